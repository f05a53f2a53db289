"""Stops a robot whose program has fallen silent: it would drive on for ever."""

from __future__ import annotations

import threading
import time
import weakref

from realitygap.errors import RecordError, RobotError
from realitygap.robots._clock import Clock, SystemClock

from ._link import Link

LOOK_S = 0.02
"""How often the thread looks [s]."""


class Watchdog:
    """Stops the motors when nobody has spoken to a robot for a while.

    Where time passes by itself a thread of its own looks. Elsewhere it passes only where somebody lets it, so that
    `WatchedClock` looks there, and results do not depend on threads.

    Args:
        link: To the robot.
        silence_s: How long nobody may speak while motors may be running [s].
    """

    def __init__(self, link: Link, silence_s: float) -> None:
        if not silence_s > 0:
            raise ValueError(f"watchdog_s is {silence_s}, expected more than 0.")
        self._link = link
        self.silence_s = silence_s
        self._excused_until = link.clock.now()
        self._is_stopping = False
        self._ended = threading.Event()
        self._unsaid: RecordError | None = None
        link.watch = self._before_command
        if _passes_by_itself(link.clock):
            threading.Thread(target=_keep_looking, args=(weakref.ref(self), self._ended), daemon=True).start()

    def excuse(self, seconds: float) -> None:
        """Nobody need speak for so long from now on [s]: a command lasts."""
        self._excused_until = self._link.clock.now() + seconds

    @property
    def due_s(self) -> float:
        """When the motors will be stopped, if nobody speaks before [s]."""
        return max(self._link.spoken_s, self._excused_until) + self.silence_s

    def look(self) -> None:
        """Stop the motors if they may be running and it is time to."""
        link = self._link
        if link.motors_off or link.clock.now() <= self.due_s:
            return
        with link.lock:
            if self._is_stopping or link.motors_off or not link.is_open or link.clock.now() <= self.due_s:
                return
            self._is_stopping = True
            link.faults.watchdog_stops += 1
            try:
                link.stop_motors()
            except RobotError:
                pass  # whoever speaks next will meet it too
            except RecordError as error:
                self._unsaid = error
            finally:
                self._is_stopping = False

    def _before_command(self) -> None:
        """Look, and say that the recording failed while only the watchdog spoke."""
        if self._is_stopping:
            return
        self.look()
        unsaid, self._unsaid = self._unsaid, None
        if unsaid is not None:
            raise unsaid

    def end(self) -> None:
        """Look no more."""
        self._ended.set()


class WatchedClock:
    """A clock under whose sleep a silent robot is stopped in time."""

    def __init__(self, clock: Clock, watchdog: Watchdog) -> None:
        self._clock = clock
        self._watchdog = watchdog

    def now(self) -> float:
        """The time [s]."""
        return self._clock.now()

    def sleep(self, seconds: float) -> None:
        """Let so much time pass [s]."""
        until = self._clock.now() + seconds
        due = self._watchdog.due_s
        if due < until:
            self._clock.sleep(max(due - self._clock.now(), 0.0))
            self._clock.sleep(min(1e-6, max(until - self._clock.now(), 0.0)))  # beyond, not at
            self._watchdog.look()
        self._clock.sleep(max(until - self._clock.now(), 0.0))


def _passes_by_itself(clock: Clock) -> bool:
    """Whether time passes on a clock while nobody lets it."""
    if isinstance(clock, SystemClock):
        return True
    before = clock.now()
    time.sleep(0.002)
    return clock.now() > before


def _keep_looking(watched: weakref.ref[Watchdog], ended: threading.Event) -> None:
    while not ended.wait(LOOK_S):
        watchdog = watched()
        if watchdog is None:
            return
        watchdog.look()
        del watchdog
