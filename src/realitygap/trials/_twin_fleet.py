"""Several robots of one twin, each given one command a step from outside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.robots import TwinPlatform
from realitygap.world import Arena

from ._batch import NoiseKey, counters_of
from ._twin_pool import TwinPool
from ._twin_trials import twin_number


class TwinRobots:
    """n robots of a twin in a separate process, each alone in its arena.

    Commands from outside drive the trials that `try_genomes` gives networks with these commands and the same key.

    Args:
        platform: The twin, by its file.
        arena: Where.
        n: Number of robots.

    Attributes:
        step_s: Duration of a command [s].
        readings: (n, s) what the range sensors answer, 0..1.
        stalled: (n,) whether the last step was blocked.
        poses: (n, 3) x [m], y [m], heading [rad].
        cells: The cells along each line, in order of first visit.

    Raises:
        DescriptionError: There is no such file, or it cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The process does not come up.
    """

    def __init__(self, platform: TwinPlatform, arena: Arena, n: int) -> None:
        self._pool = TwinPool(platform.file, arena, 1)
        self._arena, self._n = arena, n
        self.step_s, self.n_sensors = self._pool.step_s, self._pool.n_sensors

    def begin(self, key: NoiseKey) -> None:
        """Put all robots at the start; robot k draws the numbers of individual `key.individual` + k.

        A twin that was closed is opened again: some checkers of environments close one and go on with it.
        """
        if self._pool.is_closed:
            self._pool = TwinPool(self._pool.file, self._arena, 1)
        numbers = [twin_number(key.key, counter) for counter in counters_of(key, self._n)]
        self._take(self._ask({"do": "begin", "numbers": numbers}))

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

    def _take(self, seen: Sequence[dict[str, Any]]) -> None:
        self.readings = np.array([robot["readings"] for robot in seen], np.float64)
        self.stalled = np.array([robot["stalled"] for robot in seen], np.bool_)
        self.poses = np.array([robot["pose"] for robot in seen], np.float64)
        self.cells = [tuple(robot["cells"]) for robot in seen]
