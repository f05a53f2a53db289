"""The motors of the Scribblers, the S1's open loop, the S2's in regulated steps of speed; and the cells that feed them.

Source: scribbler_server.bs2 and ipre_s2_port.spin of Myro's repository, and what is known of s2.spin.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from realitygap.emulator import MILLISECOND, SECOND, nanoseconds

STEP_NS = 5 * MILLISECOND  # of the simulation
STEP_S = 0.005
TICK_STEPS = 4  # simulation steps in the 20 ms of the S2's regulator

FULL_VOLTS, EMPTY_VOLTS = 9.0, 6.0  # a full set; the Fluke blinks below 6.15 V
CAPACITY_AS = 2.0 * 3600  # of fresh AA cells [A s]; chosen
IDLE_A, MOTORS_A = 0.15, 0.35  # chosen
OWN_SAG = 0.015  # share of the voltage that fresh cells lose under full load; chosen
DROP_OUT_VOLTS = 5.5  # below it Bluetooth drops out; chosen

S1_SPACING = 0.1463  # of the S1's wheels, from its CAD model [m]
S1_TOP_SPEED = 0.15  # no trustworthy figure is known; the S2's is taken [m/s]

HALF_MM = 0.0005  # the S2's unit of distance [m]
COUNT = HALF_MM / 2  # the S2's encoders [m]
CIRCLE = 955  # units that each wheel of an S2 drives for a full turn on the spot
S2_SPACING = CIRCLE * HALF_MM / math.pi  # 152 mm
PATH_SPEED = 7  # until a client chooses another; Myro's default
TOP_STEP = 15
STATISTICS_NS = 100 * MILLISECOND


class S1Motors:
    """Two pulses a motor turns after; nothing is measured.

    Args:
        trim: First four bytes of its data: for fast ahead, slow ahead, slow back and fast back, 127 for none. Ahead, a
            value above 127 slows the left wheel by (trim - 127) / 127 of full speed, and one below 127 the right wheel.
            Back, the wheels are swapped.

    Source: scribbler_server.bs2 and the comment on it in Myro's robots/scribbler.py.
    """

    def __init__(self, trim: bytearray) -> None:
        self._trim = trim
        self.stop()

    def drive(self, right: int, left: int) -> None:
        """Take the two bytes of SET_MOTORS."""
        self._bytes = (left, right)
        speeds = (self._trimmed(left, side=1), self._trimmed(right, side=-1))
        self._speeds = (speeds[0] * S1_TOP_SPEED, speeds[1] * S1_TOP_SPEED)

    def _trimmed(self, byte: int, side: int) -> float:
        """Return the speed of a wheel, -1 to 1; side is 1 for the left one."""
        speed = max(-1.0, min(1.0, (byte - 100) / 100))
        ahead, fast = speed > 0, abs(speed) > 0.5
        trim = self._trim[(0 if fast else 1) if ahead else (3 if fast else 2)]
        slower = (trim - 127) / 127 * (side if ahead else -side)
        return math.copysign(max(0.0, abs(speed) - max(0.0, slower)), speed)

    def stop(self) -> None:
        """Stop immediately."""
        self._bytes = (100, 100)
        self._speeds = (0.0, 0.0)

    @property
    def turning(self) -> bool:
        """True if a wheel is meant to turn."""
        return self._bytes != (100, 100)

    def speeds(self) -> tuple[float, float]:
        """Return the speeds of the left and the right wheel [m/s]."""
        return self._speeds

    def turned(self, now: int, left: float, right: float, *, slipping: bool) -> None:
        """Nothing is counted."""

    @property
    def load(self) -> float:
        """Load of the motors, 0 to 1."""
        return max(map(abs, self._speeds)) / S1_TOP_SPEED


@dataclass
class Segment:
    """A motion of the S2 by distance.

    Attributes:
        left, right: Distance of each wheel [counts], signed.
        speed: The largest step of speed.
        rolls_on: Whether the wheels keep turning at its end.
    """

    left: float
    right: float
    speed: int
    rolls_on: bool = False


class S2Motors:
    """Speed in steps of a count in 20 ms, rising by one step in 20 ms; encoders; motions by distance."""

    def __init__(self) -> None:
        self.encoders = [0.0, 0.0]  # [counts]
        self.tripped = False  # too much current: nothing moves until a reset
        self._recent: deque[tuple[int, float, float, bool]] = deque()
        self._idler_ns = 0
        self._shares = (0.0, 0.0)
        self._step = self._target = self._phase = 0
        self._left: float | None = (
            None  # what the faster wheel of a motion by distance has still to drive [counts]
        )
        self._rolls_on = False
        self._next: Segment | None = None

    def drive(self, right: int, left: int) -> None:
        """Take the two bytes of SET_MOTORS; those above 200 reach the path speed of 15."""
        wanted = [2 * (left - 100), 2 * (right - 100)]
        fastest = max(map(abs, wanted))
        if not fastest or self.tripped:
            self.stop()
            return
        shares = (wanted[0] / fastest, wanted[1] / fastest)
        self._begin(shares, min(TOP_STEP, max(2, fastest // 16)))
        self._left = None
        self._next = None

    def _begin(self, shares: tuple[float, float], step: int) -> None:
        """Turn the wheels in this proportion. The speed stays unless a wheel changes its direction."""
        back = any(old * new < 0 for old, new in zip(self._shares, shares, strict=True))
        if back or not self._step:
            self._step, self._phase = 1, 0
        self._shares, self._target = shares, step
        self._step = min(self._step, step)

    def stop(self) -> None:
        """Stop immediately and drop all pending motions."""
        self._shares = (0.0, 0.0)
        self._target = self._step = self._phase = 0
        self._left, self._rolls_on, self._next = None, False, None

    def post(self, segment: Segment) -> bool:
        """Accept a motion, and return whether it was accepted: at most one waits during another."""
        if self.tripped:
            return True
        if self._left is not None:
            if self._next is not None:
                return False
            self._next = segment
            return True
        self._start(segment)
        return True

    def _start(self, segment: Segment) -> None:
        longest = max(abs(segment.left), abs(segment.right))
        if not longest:
            return
        self._step = 0
        self._begin((segment.left / longest, segment.right / longest), max(2, min(TOP_STEP, segment.speed)))
        self._left, self._rolls_on = longest, segment.rolls_on

    @property
    def ready(self) -> bool:
        """True if no motion by distance is active, so that the next one is accepted immediately."""
        return self._left is None

    @property
    def turning(self) -> bool:
        """True if a wheel is meant to turn."""
        return self._step > 0

    @property
    def step(self) -> int:
        """The step of speed at present, 0 to 15."""
        return self._step

    def speeds(self) -> tuple[float, float]:
        """Return the speeds of the left and the right wheel for the next step of the simulation [m/s]."""
        counts = self._step / TICK_STEPS
        if self._left is not None and not self._rolls_on:
            counts = min(counts, self._left)
        speed = counts * COUNT / STEP_S
        return self._shares[0] * speed, self._shares[1] * speed

    def turned(self, now: int, left: float, right: float, *, slipping: bool) -> None:
        """Count, and choose the next step of speed; the idler stands still while the wheels slip."""
        counts = (left / COUNT, right / COUNT)
        self.encoders[0] += counts[0]
        self.encoders[1] += counts[1]
        self._recent.append((now, *counts, slipping))
        while self._recent[0][0] <= now - STATISTICS_NS:
            self._recent.popleft()
        if not slipping:
            self._idler_ns = now
        self._go_on(max(abs(counts[0]), abs(counts[1])))

    def trip(self) -> None:
        """The current is too high: nothing moves until a reset."""
        self.stop()
        self.tripped = True

    def _go_on(self, counts: float) -> None:
        if self._left is not None:
            self._left -= counts
            if self._left < 1e-6:
                self._finish()
                return
        self._phase += 1
        if self._phase == TICK_STEPS:
            self._phase = 0
            self._step = min(self._step + 1, self._target, self._still_stoppable())

    def _still_stoppable(self) -> int:
        """Return the largest step from which the wheels can slow down to the end of a motion, a step in 20 ms."""
        if self._left is None or self._rolls_on:
            return TOP_STEP
        return max(1, int((math.sqrt(8 * self._left + 1) - 1) / 2))

    def _finish(self) -> None:
        """End a motion by distance."""
        self._left = None
        following, self._next = self._next, None
        if not self._rolls_on:
            self._shares, self._step, self._target = (0.0, 0.0), 0, 0
        if following is not None:
            self._start(following)

    def statistics(self, now: int) -> bytes:
        """Return the answer to GET_MOTOR_STATS.

        The scale of a byte is known for the first three. The idler's speed is assumed to be half the counts.
        """
        fresh = [entry for entry in self._recent if entry[0] > now - STATISTICS_NS]
        left, right = (sum(entry[wheel] for entry in fresh) for wheel in (1, 2))
        idler = min(63, int(abs(sum(entry[1] + entry[2] for entry in fresh if not entry[3])) / 4))
        since = min(255, (now - self._idler_ns) // nanoseconds(0.1))
        wheels = (max(-128, min(127, int(counts))) & 0xFF for counts in (left, right))
        moving = 3 if self.turning else 0
        return bytes((*wheels, since, idler << 2 | moving, int(self.ready)))

    @property
    def load(self) -> float:
        """Load of the motors, 0 to 1."""
        return min(1.0, self._step / 12)


Motors = S1Motors | S2Motors
"""The motors that turn the wheels."""


class Battery:
    """A battery with its remaining charge and its voltage under load.

    Args:
        sag: Share of the voltage lost under full load, of weak cells.
        own_volts: Function of a load of 0 to 1 that returns the voltage of a robot with its own battery [V].
    """

    def __init__(self, sag: float = 0.0, own_volts: Callable[[float], float] | None = None) -> None:
        self._sag = sag + (OWN_SAG if own_volts is None else 0.0)
        self._own_volts = own_volts
        self.used = 0.0  # share of the capacity

    def drain(self, load: float, duration_ns: int) -> None:
        """Use what robot and motors take in a while, with the motors at a load of 0 to 1."""
        amperes = IDLE_A + MOTORS_A * load
        self.used = min(1.0, self.used + amperes * duration_ns / SECOND / CAPACITY_AS)

    def volts(self, load: float) -> float:
        """Return the voltage with the motors at a load of 0 to 1."""
        if self._own_volts is not None:
            return self._own_volts(load) * (1 - self._sag * load)
        resting = FULL_VOLTS - (FULL_VOLTS - EMPTY_VOLTS) * self.used
        return resting * (1 - self._sag * load)
