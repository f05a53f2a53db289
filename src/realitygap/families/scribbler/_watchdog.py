"""A watchdog that stops a robot whose program is silent. Otherwise the robot would drive on forever."""

from __future__ import annotations

import threading
import time
import weakref

from realitygap.errors import RecordError, RobotError
from realitygap.robots import Clock, SystemClock

from ._link import Link

LOOK_S = 0.02
"""Time between two checks of the thread [s]."""


class Watchdog:
    """Stops the motors if no command was sent to a robot for a while.

    If the clock advances automatically, a separate thread checks it. Otherwise time advances only in `sleep`, so
    `WatchedClock` checks it there, and results do not depend on threads.

    Args:
        link: The link to the robot.
        silence_s: Maximum time without a command while motors may be running [s].
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
        """Allow silence for some seconds from now on, because a command lasts."""
        self._excused_until = self._link.clock.now() + seconds

    @property
    def due_s(self) -> float:
        """Time at which the motors will be stopped unless a command is sent before [s]."""
        return max(self._link.spoken_s, self._excused_until) + self.silence_s

    def look(self) -> None:
        """Stop the motors if they may be running and the time is up."""
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
                pass  # the next command raises it, too
            except RecordError as error:
                self._unsaid = error
            finally:
                self._is_stopping = False

    def _before_command(self) -> None:
        """Check the time, and raise an error if a recording by the watchdog failed."""
        if self._is_stopping:
            return
        self.look()
        unsaid, self._unsaid = self._unsaid, None
        if unsaid is not None:
            raise unsaid

    def end(self) -> None:
        """End the checks."""
        self._ended.set()


class WatchedClock:
    """A clock whose `sleep` also runs the watchdog."""

    def __init__(self, clock: Clock, watchdog: Watchdog) -> None:
        self._clock = clock
        self._watchdog = watchdog

    def now(self) -> float:
        """Return the time [s]."""
        return self._clock.now()

    def sleep(self, seconds: float) -> None:
        """Wait for some seconds."""
        until = self._clock.now() + seconds
        due = self._watchdog.due_s
        if due < until:
            self._clock.sleep(max(due - self._clock.now(), 0.0))
            self._clock.sleep(min(1e-6, max(until - self._clock.now(), 0.0)))  # beyond, not at
            self._watchdog.look()
        self._clock.sleep(max(until - self._clock.now(), 0.0))


def _passes_by_itself(clock: Clock) -> bool:
    """Return whether a clock advances without calls of `sleep`."""
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
