"""Several robots of the platform `sim` in one arena: each is a separate trial, with the others as obstacles.

A step of one robot is that of `step_sim` in two parts, so that all can move before any of them looks.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import kernel
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.math.philox import FIRST

from .contact import settle
from .drive import drive, take_commands
from .lanes import start_block
from .outline import place_obstacle
from .senses import feel_motion
from .trial import _list, arrive, sense

ONE = np.int64(1)  # a literal 1 would have the kernel that it is passed to compiled once more


@kernel
def put_others(shape, room, first, poses):
    """Put obstacles from number `first` on at poses (k, 3): x, y from the origin of the table [m], heading [turns]."""
    lanes = room.lanes
    for k in range(poses.shape[0]):
        row = shape.row_obstacle[first + k]
        for part in range(3):
            for lane in range(LANES):
                lanes.p[row + part, lane] = poses[k, part]
        place_obstacle(shape, lanes, first + k)


@kernel
def begin_sim(shape, table, rules, counters, room, cells):
    """`start_sim` for one robot, but for what its sensors answer: that is `look_sim` before step 0."""
    lanes = room.lanes
    start_block(shape, rules, table, counters, FIRST, ONE, lanes)
    arrive(shape, rules, lanes)
    _list(shape, lanes, 1, cells, 0)


@kernel
def move_sim(shape, rules, key, room, cells, step, commands):
    """The first part of `step_sim`, for one robot: it moves as far as its surroundings let it."""
    lanes = room.lanes
    take_commands(commands[0], commands[1], lanes)
    drive(shape, rules, key, lanes, step)
    settle(shape, lanes, room.near)
    feel_motion(shape, rules, key, lanes, step)
    arrive(shape, rules, lanes)
    _list(shape, lanes, 1, cells, 0)


@kernel
def look_sim(shape, rules, key, room, step):
    """Write the readings before a step to `room.lanes.readings`; after a step the second part of `step_sim`."""
    sense(shape, rules, key, room.lanes, step)
