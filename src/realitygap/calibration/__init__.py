"""Fits of a simulator to what was observed of a robot: arrays in, values out; no platform is run here."""

from ._all_from_commands import fit_from_commands
from ._all_from_poses import fit_from_poses
from ._all_from_simulation import Effort, Posterior, fit_all, mixed
from ._contact import fit_contact
from ._evidence import LEAST_STEPS, Evidence, Vectors, evidence_of
from ._fit import DECISIVE, Fit, is_better
from ._log_model import MotionLog
from ._log_prediction import PathErrors, Steps, look_up_motion, path_errors, summary_of
from ._marker import Marker, fit_marker
from ._motion import fit_motion
from ._motion_log import LogPrediction, MotionLogFit, fit_motion_log, fit_motion_logs, motion_log
from ._path import fit_path, path_plans
from ._plans import contact_plans, excitation, motion_plans, next_trials, random_controllers
from ._predictive import PREDICTED, TOLERATED, Misfit, misfits, prediction_errors
from ._prior import (
    CONTACT,
    MOTION,
    Effect,
    Floats,
    Parameter,
    is_identified,
    numbers_of,
    ranges_of,
    scribbler_prior,
    values_of,
)
from ._range_table import choose_frame, fit_range_table
from ._residual_patterns import Pattern, residual_patterns
from ._ruler import Moved, end_pose_of, moved_in, ruled
from ._score import information_of
from ._simulate import Simulate, of_one_length, step_of
from ._wall_table import (
    BearingFrom,
    MeasuredFrom,
    TableFrame,
    look_up_readings,
    place_ranks,
    predict_range_table,
)
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
    "TOLERATED",
    "BearingFrom",
    "Effect",
    "Effort",
    "Evidence",
    "Fit",
    "Floats",
    "LogPrediction",
    "Marker",
    "MeasuredFrom",
    "Misfit",
    "MotionLog",
    "MotionLogFit",
    "Moved",
    "Parameter",
    "PathErrors",
    "Pattern",
    "Placement",
    "Posterior",
    "SensorFit",
    "Simulate",
    "Steps",
    "TableFrame",
    "Vectors",
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
    "is_identified",
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
    "residual_patterns",
    "ruled",
    "scribbler_prior",
    "sensor_plans",
    "step_of",
    "summary_of",
    "values_of",
]
