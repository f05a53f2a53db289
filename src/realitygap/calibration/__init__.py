"""Fits of a simulator to what was observed of a robot: arrays in, values out; no platform is run here."""

from ._motion import MotionFit, fit_motion
from ._simulate import Simulate

__all__ = [
    "MotionFit",
    "Simulate",
    "fit_motion",
]
