"""Trials in motion: movies, a player in notebooks, and how two of them diverge.

A `MovingTrial` is what a trial looks like whatever platform it was on; `in_motion` makes one of a trajectory.
"""

from . import _card  # noqa: F401  # what notebooks show
from ._divergence import Divergence, measure_divergence, own_divergence
from ._live import WatchedRobot
from ._movie import WIDTH, save_movie
from ._moving import MovingTrial, RobotShape, first_visits, in_motion, placed, ray_ends
from ._player import (
    PackedScene,
    PackedTrial,
    pack_pen,
    pack_scene,
    pack_shape,
    pack_trials,
    play,
    widget_class,
)
from ._twin import TwinDrive, save_twin_trial, wander

__all__ = [
    "WIDTH",
    "Divergence",
    "MovingTrial",
    "PackedScene",
    "PackedTrial",
    "RobotShape",
    "TwinDrive",
    "WatchedRobot",
    "first_visits",
    "in_motion",
    "measure_divergence",
    "own_divergence",
    "pack_pen",
    "pack_scene",
    "pack_shape",
    "pack_trials",
    "placed",
    "play",
    "ray_ends",
    "save_movie",
    "save_twin_trial",
    "wander",
    "widget_class",
]
