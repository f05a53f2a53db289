"""Several robots of one twin, each given one command a step from outside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.trials import NoiseKey, counters_of
from realitygap.world import Arena

from .._stepwise import TakenRobots, trial_number
from ._pool import TwinPool


class TwinRobots(TakenRobots):
    """n robots of a twin in a separate process, each alone in its arena.

    Commands from outside drive the trials that `try_genomes` gives networks with these commands and the same key.

    Args:
        file: File of the twin.
        arena: Arena of the robots.
        n: Number of robots.

    Attributes:
        step_s: Duration of a command [s].
        readings: (n, s) readings of the range sensors, 0..1.
        stalled: (n,) True if the last step was blocked.
        poses: (n, 3) x [m], y [m], heading [rad].
        cells: The cells along each line, in order of first visit.
        channels: Names of the sensors that each has besides range sensors.
        values: Readings of the selected sensors.

    Raises:
        DescriptionError: There is no such file, or it cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The process does not come up.
    """

    def __init__(self, file: str, arena: Arena, n: int) -> None:
        self._pool = TwinPool(file, arena, 1)
        self._arena, self._n = arena, n
        self.step_s, self.n_sensors = self._pool.step_s, self._pool.n_sensors
        self.channels = self._pool.channels
        self._selected: tuple[str, ...] = ()

    def select(self, names: Sequence[str]) -> None:
        """Choose the sensors to read besides range sensors, from the next `begin` on."""
        self._selected = tuple(names)

    def begin(self, key: NoiseKey) -> None:
        """Put all robots at the start; robot k draws the numbers of individual `key.individual` + k.

        A closed twin is opened again, because some checkers of environments close one and continue to use it.
        """
        if self._pool.is_closed:
            self._pool = TwinPool(self._pool.file, self._arena, 1)
        numbers = [trial_number(key.key, counter) for counter in counters_of(key, self._n)]
        self._take(self._ask({"do": "begin", "numbers": numbers, "channels": self._selected}))

    def drive(self, commands: NDArray[np.float64]) -> None:
        """Drive each robot by one command, (n, 2) each -1..1.

        Raises:
            RobotError: No trial is under way.
        """
        self._take(self._ask({"do": "drive", "commands": commands.tolist()}))

    def close(self) -> None:
        """End the process; safe to call twice."""
        self._pool.close()

    def _ask(self, request: dict[str, Any]) -> Sequence[dict[str, Any]]:
        answer: Sequence[dict[str, Any]] = next(self._pool.ask_all([request]))
        return answer
