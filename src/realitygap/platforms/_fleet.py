"""The interface between environments and a platform's robots, all at the same step of their trials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.trials import NoiseKey
from realitygap.world import SENSORS, Arena, Body, RangeSensors, RobotModel

Array = NDArray[np.float64]
Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Outline:
    """The outline of a robot in pictures, ahead and to the left of its origin [m].

    Attributes:
        parts: Corners of each part of the body.
        mounts: Place and direction [rad] of each range sensor.
    """

    parts: tuple[Points, ...]
    mounts: tuple[tuple[float, float, float], ...]

    @classmethod
    def of_body(cls, body: Body, sensors: RangeSensors) -> Outline:
        """Return the outline of a body of one part."""
        return cls((body.corners,), sensors.mounts)

    @classmethod
    def of_model(cls, model: RobotModel) -> Outline:
        """Return the outline of a robot from a file."""
        return cls(tuple(part.outline() for part in model.body), model.mounts)


class Fleet(Protocol):
    """n robots of one platform in one arena.

    Attributes:
        arena: Arena of the robots.
        n_steps: Number of steps of a trial.
        step_s: Duration of a command [s].
        outline: Outline of a robot.
        cells: (n, c) uint8; the first of a row are the cells along the line in order of first visit.
    """

    arena: Arena
    n_steps: int
    step_s: float
    outline: Outline
    cells: NDArray[np.uint8]

    @property
    def counts(self) -> NDArray[np.int32]:
        """Numbers of visited cells, (n, 2 or more): along the line, at the ends of steps."""
        ...

    @property
    def stalled(self) -> NDArray[np.bool_]:
        """True if the last step was blocked, (n,)."""
        ...

    @property
    def ranges(self) -> Array:
        """Readings of the range sensors in the form for tasks, 0..1, (n, s); 1 is near."""
        ...

    def number(self, name: str, value: float) -> Array:
        """Return a number of each trial, (n,): the drawn number, or the value if it is not drawn."""
        ...

    def bounds(self) -> NDArray[Any]:
        """Return the minimum and the maximum of each input, (2, i)."""
        ...

    def start(self, key: NoiseKey) -> None:
        """Put all robots at the start; robot k draws the numbers of individual `key.individual` + k."""
        ...

    def step(self, commands: Array) -> None:
        """Drive each robot by one command, (n, 2) finite numbers; those beyond -1..1 are limited."""
        ...

    def observe(self) -> Array:
        """Return the inputs before the next step, (n, i)."""
        ...

    def facts(self) -> dict[str, Array]:
        """Return `pose` (n, 3) and `readings` (n, s): distances without noise [m]."""
        ...

    def close(self) -> None:
        """Let go of the robots; safe to call twice."""
        ...


def is_signed(name: str) -> bool:
    """Return whether an input is within -1..1, and not within 0..1."""
    kind = name.partition(".")[0]
    return SENSORS[kind].is_signed if kind in SENSORS else kind in ("encoder", "last_move", "last_turn")
