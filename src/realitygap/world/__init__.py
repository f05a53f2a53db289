"""Plain descriptions of arenas, bodies and sensors; nothing here moves."""

from ._arena import (
    MOST_ROBOTS,
    NAMED_STARTS,
    Arena,
    Pose,
    paper_arena,
)
from ._arena_file import ArenaFile
from ._calibration import Calibration, Fitted
from ._case import Case, CaseBody, CaseDevice
from ._described import INCH, in_si
from ._distribution import Distribution
from ._floor import BARE_FLOOR, Floor, FloorImage
from ._grid import Grid, VisitedCells, cells_along
from ._library import (
    arena_names,
    load_arena,
    load_calibration,
    load_robot,
    read_calibration,
    read_toml,
    robot_names,
)
from ._obstacle import Goal, Light, Obstacle, Segment, distance_to_segment
from ._part import JYRO_SCRIBBLER, MOST_CORNERS, Body, Part, RangeSensors, rounded, why_no_part
from ._pictures import (
    arena_picture,
    dimension_line,
    extent_of,
    floor_shapes,
    length_text,
    obstacle_shapes,
    robot_picture,
    things_in,
)
from ._placing import check_drawn_starts, check_start
from ._robot_model import SENSORS, RangeSensor, RobotModel
from ._robot_picture import model_picture
from ._settings import ArenaSettings
from ._walls import bounds_of, enclosing_walls, is_inside, room_of, walls_within

__all__ = [
    "BARE_FLOOR",
    "INCH",
    "JYRO_SCRIBBLER",
    "MOST_CORNERS",
    "MOST_ROBOTS",
    "NAMED_STARTS",
    "SENSORS",
    "Arena",
    "ArenaFile",
    "ArenaSettings",
    "Body",
    "Calibration",
    "Case",
    "CaseBody",
    "CaseDevice",
    "Distribution",
    "Fitted",
    "Floor",
    "FloorImage",
    "Goal",
    "Grid",
    "Light",
    "Obstacle",
    "Part",
    "Pose",
    "RangeSensor",
    "RangeSensors",
    "RobotModel",
    "Segment",
    "VisitedCells",
    "arena_names",
    "arena_picture",
    "bounds_of",
    "cells_along",
    "check_drawn_starts",
    "check_start",
    "dimension_line",
    "distance_to_segment",
    "enclosing_walls",
    "extent_of",
    "floor_shapes",
    "in_si",
    "is_inside",
    "length_text",
    "load_arena",
    "load_calibration",
    "load_robot",
    "model_picture",
    "obstacle_shapes",
    "paper_arena",
    "read_calibration",
    "read_toml",
    "robot_names",
    "robot_picture",
    "room_of",
    "rounded",
    "things_in",
    "walls_within",
    "why_no_part",
]
