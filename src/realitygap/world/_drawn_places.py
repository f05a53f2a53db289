"""Checks that the robot fits at the start of trials in an arena whose numbers are drawn."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from ._arena import Arena
from ._placing import check_start
from ._robot import Body
from ._robot_model import RobotModel

START = "arena.start."
PLACES = (START, "arena.obstacle.", "arena.wall.")
"""First parts of the names of numbers that can put a robot's start into a solid object."""

N_DRAWN = 64
"""Number of draws to check in addition to the ends. A fault in one trial of twenty is missed in 1 of 25 arenas."""

TOP = 1.0 - 2.0**-32
"""The largest of the random numbers that draws are made of."""


def check_drawn_starts(arena: Arena, robot: Body | RobotModel) -> None:
    """Refuse an arena in which the robot would not fit at the start for some of what is drawn.

    It checks the ends of the distributions of the start, and some draws of all numbers that move the start, obstacles,
    or walls.

    Raises:
        ValueError: As `check_start`, with what was drawn.
    """
    places = {name: drawn for name, drawn in arena.vary.items() if name.startswith(PLACES)}
    if not places:
        check_start(arena, robot)
        return
    words = {name: drawn.together or name for name, drawn in places.items()}
    for row in _rows(words):
        values = {name: float(drawn.of(np.array(row[words[name]]))) for name, drawn in places.items()}
        try:
            check_start(arena.with_numbers(values), robot)
        except ValueError as error:
            said = ", ".join(f"{name} = {value:.4g}" for name, value in values.items())
            raise ValueError(f"{str(error).removeprefix('ArenaFile: ')} Drawn: {said}") from None


def _rows(words: dict[str, str]) -> Iterator[dict[str, float]]:
    """Yield uniform random numbers by the word that numbers are drawn by: the ends of the start, then draws of all."""
    every = list(dict.fromkeys(words.values()))
    ends = list(dict.fromkeys(word for name, word in words.items() if name.startswith(START)))
    for corner in itertools.product((0.0, TOP), repeat=len(ends)):
        yield dict.fromkeys(every, 0.5) | dict(zip(ends, corner, strict=True))
    for row in np.random.default_rng(1).random((N_DRAWN, len(every))):
        yield dict(zip(every, row.tolist(), strict=True))
