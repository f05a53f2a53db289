"""Fits of a simulator to what was observed of a robot: arrays in, values out; no platform is run here."""

from ._abc import Effort, Posterior, fit_all, mixed
from ._all_from_commands import fit_from_commands
from ._all_from_poses import fit_from_poses
from ._contact import fit_contact
from ._evidence import LEAST_STEPS, Evidence, Vectors, evidence_of
from ._held_out import DECISIVE, is_better
from ._log_model import MotionLog
from ._log_prediction import PathErrors, Steps, look_up_motion, path_errors, summary_of
from ._marker import Marker, fit_marker
from ._motion import MotionFit, fit_motion
from ._motion_log import LogPrediction, MotionLogFit, fit_motion_log, fit_motion_logs, motion_log
from ._next_trial import information_of, next_trials
from ._path import fit_path, path_plans
from ._plans import contact_plans, excitation, motion_plans, random_controllers
from ._predict_table import look_up_readings, place_ranks, predict_range_table
from ._predictive import PREDICTED, Misfit, misfits, prediction_errors
from ._prior import (
    CONTACT,
    MOTION,
    Effect,
    Floats,
    Parameter,
    numbers_of,
    ranges_of,
    scribbler_prior,
    standard_of,
    values_of,
)
from ._range_table import BearingFrom, MeasuredFrom, bearings_from_heading, fit_range_table
from ._ruler import Moved, end_pose_of, moved_in, ruled
from ._simulate import Simulate, of_one_length, step_of
from ._table_frame import TableFrame, choose_frame
from .infrared._checks import independence
from .infrared._fit import LEAST_PLACEMENTS, SensorFit, fit_sensor
from .infrared._plans import distance_of, placements_of, sensor_plans
from .infrared._readings import Placement

__all__ = [
    "CONTACT",
    "DECISIVE",
    "LEAST_PLACEMENTS",
    "LEAST_STEPS",
    "MOTION",
    "PREDICTED",
    "BearingFrom",
    "Effect",
    "Effort",
    "Evidence",
    "Floats",
    "LogPrediction",
    "Marker",
    "MeasuredFrom",
    "Misfit",
    "MotionFit",
    "MotionLog",
    "MotionLogFit",
    "Moved",
    "Parameter",
    "PathErrors",
    "Placement",
    "Posterior",
    "SensorFit",
    "Simulate",
    "Steps",
    "TableFrame",
    "Vectors",
    "bearings_from_heading",
    "choose_frame",
    "contact_plans",
    "distance_of",
    "end_pose_of",
    "evidence_of",
    "excitation",
    "fit_all",
    "fit_contact",
    "fit_from_commands",
    "fit_from_poses",
    "fit_marker",
    "fit_motion",
    "fit_motion_log",
    "fit_motion_logs",
    "fit_path",
    "fit_range_table",
    "fit_sensor",
    "independence",
    "information_of",
    "is_better",
    "look_up_motion",
    "look_up_readings",
    "misfits",
    "mixed",
    "motion_log",
    "motion_plans",
    "moved_in",
    "next_trials",
    "numbers_of",
    "of_one_length",
    "path_errors",
    "path_plans",
    "place_ranks",
    "placements_of",
    "predict_range_table",
    "prediction_errors",
    "random_controllers",
    "ranges_of",
    "ruled",
    "scribbler_prior",
    "sensor_plans",
    "standard_of",
    "step_of",
    "summary_of",
    "values_of",
]
