"""Fits of a simulator to what was observed of a robot: arrays in, values out; no platform is run here."""

from ._contact import fit_contact
from ._contact_plans import contact_plans
from ._ir_checks import Independence, independence, predictive_p
from ._ir_fit import LEAST_PLACEMENTS, SensorFit, fit_sensor
from ._ir_plans import distance_of, placements_of, sensor_distances, sensor_plans
from ._ir_readings import Placement
from ._motion import MotionFit, fit_motion
from ._motion_plans import motion_plans
from ._path import PathFit, fit_path, path_plans
from ._ruler import Moved, end_pose_of, moved_in, ruled
from ._simulate import Simulate

__all__ = [
    "LEAST_PLACEMENTS",
    "Independence",
    "MotionFit",
    "Moved",
    "PathFit",
    "Placement",
    "SensorFit",
    "Simulate",
    "contact_plans",
    "distance_of",
    "end_pose_of",
    "fit_contact",
    "fit_motion",
    "fit_path",
    "fit_sensor",
    "independence",
    "motion_plans",
    "moved_in",
    "path_plans",
    "placements_of",
    "predictive_p",
    "ruled",
    "sensor_distances",
    "sensor_plans",
]
