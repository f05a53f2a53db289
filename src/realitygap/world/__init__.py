"""Plain descriptions of arenas, bodies and sensors; nothing here moves."""

from ._arena import (
    INCH,
    NAMED_STARTS,
    Arena,
    Grid,
    Pose,
    check_start,
    is_inside,
    paper_arena,
)
from ._case import Case
from ._pictures import arena_picture, robot_picture
from ._robot import JYRO_SCRIBBLER, Body, RangeSensors
from ._settings import ArenaSettings

__all__ = [
    "INCH",
    "JYRO_SCRIBBLER",
    "NAMED_STARTS",
    "Arena",
    "ArenaSettings",
    "Body",
    "Case",
    "Grid",
    "Pose",
    "RangeSensors",
    "arena_picture",
    "check_start",
    "is_inside",
    "paper_arena",
    "robot_picture",
]
