"""What the environments ask of a platform's robots, all at the same step of their trials."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.trials import NoiseKey
from realitygap.world import Arena

Array = NDArray[np.float64]


class Fleet(Protocol):
    """n robots of one platform in one arena.

    Attributes:
        arena: Where.
        n_steps: Of a trial.
        cells: (n, c) uint8; the first of a row are the cells along the line in order of first visit.
    """

    arena: Arena
    n_steps: int
    cells: NDArray[np.uint8]

    @property
    def counts(self) -> NDArray[np.int32]:
        """(n, 2 or more) cells visited so far: along the line, at the ends of steps."""
        ...

    def bounds(self) -> NDArray[Any]:
        """(2,) the least and the most that a reading can be."""
        ...

    def start(self, key: NoiseKey) -> None:
        """Put all robots at the start; robot k draws the numbers of individual `key.individual` + k."""
        ...

    def step(self, commands: Array) -> None:
        """Carry out one command of each robot, (n, 2) move and turn."""
        ...

    def observe(self) -> Array:
        """(n, 3) obstacle, stall, time before the next step."""
        ...

    def facts(self) -> dict[str, Array]:
        """`pose` (n, 3) and `readings` (n, s): distances without noise [m]."""
        ...
