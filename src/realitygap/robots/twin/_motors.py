"""The motors of a twin, from commands to speeds: an S2's steps, delay, lag, gains, and oddities."""

from __future__ import annotations

import math

from realitygap.world import Pose

from ._model import WHEELS, TwinModel, numbers_for

TICK_S = 0.020  # of the S2's regulator
STEPS = 12  # of speed at full command
LOWEST = 2
NOMINAL = 0.15  # speed of an S2 at full command [m/s]
STEADY = 0.002  # a lag that has no more to do than this is over [m/s]
STANDING = (0.0, 0.0)


class SpeedSteps:
    """An S2's regulator: a speed in steps of 12.5 mm/s, rising by one of them each 20 ms.

    Source: ipre_s2_port.spin and s2.spin as in the emulator of the paper's robot.
    """

    def __init__(self) -> None:
        self._shares = STANDING
        self._step = self._target = 0

    def drive(self, left: float, right: float) -> None:
        """Take a command of the wheels, each -1 to 1, as the bytes of SET_MOTORS have it."""
        wanted = [2 * round(100 * wheel) for wheel in (left, right)]
        fastest = max(map(abs, wanted))
        if not fastest:
            self._shares, self._step, self._target = STANDING, 0, 0
            return
        shares = wanted[0] / fastest, wanted[1] / fastest
        turns_back = any(old * new < 0 for old, new in zip(self._shares, shares, strict=True))
        if turns_back or not self._step:
            self._step = 1
        self._shares, self._target = shares, max(LOWEST, fastest // 16)
        self._step = min(self._step, self._target)

    @property
    def is_steady(self) -> bool:
        """True if the speed is constant."""
        return self._step == self._target

    def tick(self) -> tuple[float, float]:
        """Return speeds for the next 20 ms, left and right, as shares of full speed."""
        step = self._step / STEPS
        self._step = min(self._step + 1, self._target)
        return self._shares[0] * step, self._shares[1] * step


class PlainSpeeds:
    """A regulator that passes on commanded speeds immediately."""

    is_steady = True

    def __init__(self) -> None:
        self._shares = STANDING

    def drive(self, left: float, right: float) -> None:
        """Take a command of the wheels, each -1 to 1."""
        self._shares = left, right

    def tick(self) -> tuple[float, float]:
        """Return the commanded speeds."""
        return self._shares


def _softened(share: float, dead_band: float) -> float:
    """Return the share of full speed that a wheel with a soft dead band turns at."""
    if not dead_band:
        return share
    past = abs(share) - dead_band
    return math.copysign(past / (1 - dead_band), share) if past > 0 else 0.0


class Servo:
    """A model of the motors that turns wanted speeds into the speeds that the wheels get.

    Attributes:
        volts: Battery voltage now [V].
        time: Time since the trial began [s].
        is_steady: True if the lag had ended when speeds were last computed.
    """

    def __init__(self, model: TwinModel, number: int) -> None:
        self._motors, self._battery, self._odd = model.motors, model.battery, model.oddities
        self._track, self._axle = model.wheels.track, model.wheels.axle
        self._random = numbers_for(model.seed, number, WHEELS)
        self._drawn: list[float] = []
        wander = self._random.standard_normal(2) * self._motors.wander
        self._wander = [float(each) for each in wander]
        self._left = self._right = 0.0
        self._used = 0.0
        self.is_steady = True
        self.time = 0.0
        self.volts = self._battery.volts

    def follow(self, left: float, right: float, pose: Pose, seconds: float) -> tuple[float, float]:
        """Return speeds for the motors in a short time, left and right [m/s].

        Args:
            left, right: Target speeds of the regulator, in shares of full speed.
            pose: Pose of the robot.
            seconds: Duration [s].
        """
        motors, odd = self._motors, self._odd
        if motors.ahead < 0:
            left, right = -right, -left
        if odd.swapped:
            left, right = right, left
        work = (abs(left) + abs(right)) / 2
        left = 0.0 if abs(left) < motors.dead_band_left else left
        right = 0.0 if abs(right) < motors.dead_band_right else right
        left = _softened(left, motors.soft_dead_band_left)
        right = _softened(right, motors.soft_dead_band_right)
        left *= motors.gain_left
        right *= motors.gain_right
        turn = motors.drift_per_m * self._track / 2 * (left + right) / 2
        left, right = left - turn, right + turn
        if motors.wander:
            self._stray(seconds)
            left *= 1 + self._wander[0]
            right *= 1 + self._wander[1]
        top = motors.speed * self._supply(work, seconds)
        left, right = left * top, right * top
        if odd.compass:
            share = 1 + odd.compass * math.cos(pose.heading - odd.compass_heading)
            left, right = left * share, right * share
        if odd.turn_at and self.time >= odd.turn_at:
            left, right = left * odd.turned_left, right * odd.turned_right
        if odd.patch is not None:
            left *= self._on_patch(pose, 1)
            right *= self._on_patch(pose, -1)
        keep = math.exp(-seconds / motors.lag) if motors.lag else 0.0
        self.is_steady = abs(self._left - left) + abs(self._right - right) < STEADY
        self._left = left + (self._left - left) * keep
        self._right = right + (self._right - right) * keep
        self.time += seconds
        return self._left, self._right

    def _supply(self, work: float, seconds: float) -> float:
        """Return the share of the speed that the battery leaves."""
        battery = self._battery
        self._used += battery.fall_per_s * work * seconds
        self.volts = self.volts_at(work)
        return max(0.0, 1 - battery.slows * (1 - self.volts / battery.full))

    def volts_at(self, load: float) -> float:
        """Return the battery's voltage [V] with the motors at a load of 0 to 1."""
        return self._battery.volts - self._used - self._battery.sag * load

    def _stray(self, seconds: float) -> None:
        """Let the wheels' speeds wander on."""
        if len(self._drawn) < 2:
            self._drawn = self._random.standard_normal(512).tolist()
        keep = math.exp(-seconds / self._motors.wander_s)
        new = self._motors.wander * math.sqrt(1 - keep * keep)
        for wheel in (0, 1):
            self._wander[wheel] = keep * self._wander[wheel] + new * self._drawn.pop()

    def _on_patch(self, pose: Pose, side: int) -> float:
        """Return the share of its speed that a wheel has at its place."""
        patch = self._odd.patch
        if patch is None:
            return 1.0
        x, y = pose.point(self._axle, side * self._track / 2)
        inside = (x - patch.x) ** 2 + (y - patch.y) ** 2 < patch.radius**2
        return 1 - patch.slows if inside else 1.0
