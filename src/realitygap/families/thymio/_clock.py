"""Time by the ticks that the program on board counts; a simulated robot's may pass faster than ours."""

from __future__ import annotations

import time
from collections.abc import Callable

from realitygap.errors import RobotError
from realitygap.robots import HEAR_S

from ._program import TICK_S

CLOCK_STANDS_S = 2.0
"""Time after which a clock on board that does not advance counts as stopped [s]."""
UNREAD_S = 0.25
"""Robot time for which the clock advances without a reading while a program waits [s]."""
PAUSE_S = 1.0
"""Time without a reading after which the clock's origin may move, so that it can advance [s]."""
SHORTEST_S = 1e-6
"""Time that is too short to wait for: rounding may hide that it passed [s]."""
RATE_S = 2.0
"""Time over which the rate is measured [s]."""


class BoardClock:
    """The robot's time [s], read with its sensors. Between readings it runs on at the rate of before.

    Args:
        read: Reads the ticks, and gives them to `note`.

    Attributes:
        rate: Seconds of the robot in one of real time.
    """

    def __init__(self, read: Callable[[], object]) -> None:
        self._read = read
        self.rate = 1.0
        self._ticks: int | None = None
        self._board = self._shown = self._at = self._moved_at = 0.0
        self._anchor: tuple[float, float] | None = None

    def note(self, ticks: int) -> None:
        """Process a reading of the 16-bit counter.

        Raises:
            RobotError: The counter stands still.
        """
        host = time.monotonic()
        if self._ticks is None:
            self._at = self._moved_at = host
            self._anchor = (0.0, host)
        passed = 0 if self._ticks is None else (ticks - self._ticks) & 0xFFFF
        if host - self._at > PAUSE_S:
            self._board = self.now()  # what passed meanwhile is not known better than by our own clock
            self._anchor = (self._board, host)
            self._moved_at = host
        else:
            self._board += passed * TICK_S
        if passed:
            self._moved_at = host
        elif host - self._moved_at > CLOCK_STANDS_S:
            raise RobotError("The clock on board of the Thymio does not advance: its program does not run.")
        self._ticks, self._at = ticks, host
        self._measure_rate(host)

    def _measure_rate(self, host: float) -> None:
        board, since = self._anchor or (self._board, host)
        if host - since >= RATE_S / 20:
            self.rate = min(max((self._board - board) / (host - since), 0.05), 20.0)
        if host - since >= RATE_S:
            self._anchor = (self._board, host)

    @property
    def unread_s(self) -> float:
        """Time since the last reading, by the robot's clock [s]."""
        return (time.monotonic() - self._at) * self.rate

    def now(self) -> float:
        """Return the time since the robot was opened [s]."""
        if self._ticks is not None:
            self._shown = max(self._shown, self._board + self.unread_s)
        return self._shown

    def sleep(self, seconds: float) -> None:
        """Let so much time pass [s].

        Raises:
            RobotError: The robot does not answer, or its clock stands still.
        """
        until = self.now() + seconds
        while (left := until - self.now()) > SHORTEST_S:
            unheard = UNREAD_S - self.unread_s  # once: time passes between two looks at the clock
            if unheard <= SHORTEST_S:
                self._read()
                continue
            time.sleep(min(left / self.rate, unheard / self.rate, HEAR_S))
