"""Columns of a log in their units, as values in meters, radians, and shares of full speed."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from realitygap.errors import LogError

from ._log_map import Commands, Part, Poses, Readings, WheelPart, Wheels
from ._source import Floats
from ._units import ANGLES, LENGTHS, LEVEL, RATES, SHARES, SPEEDS, TICKS, unit_factor


class Convert(Protocol):
    """Turns rows of a part into values; it may remember the rows before.

    Attributes:
        width: Values in a row.
    """

    width: int

    def __call__(self, times: Floats, raw: Floats) -> Floats:
        """Return values (b, width) for times (b,) [s] and numbers (b, k) of the log, which follow all earlier ones."""


def converter(part: Part, speed: float, track: float) -> Convert:
    """Return what converts a part.

    Commands are shares of full speed. Encoders, and commands with `per = "row"`, are distances of the wheels since
    their first row [m].

    Args:
        part: Part of the mapping.
        speed: Speed of a wheel at full command [m/s].
        track: Distance between the wheels [m].

    Raises:
        LogError: A unit is unknown, or a number that it needs is missing.
    """
    if isinstance(part, Commands):
        if part.per:
            return _Increments(_to_wheels(part, _way(part, "commands"), _turn_way(part, track)))
        return _CommandConverter(part, speed, track)
    if isinstance(part, Wheels):
        if part.per:
            return _Increments(_to_wheels(part, _way(part, "wheels")))
        return _WheelConverter(part)
    if isinstance(part, Poses):
        return _PoseConverter(part)
    if isinstance(part, Readings):
        return _ReadingConverter(part)
    raise TypeError(f"{type(part).__name__} is no part of a log.")


def _in_meters(place: str, part: Commands | Wheels, known: dict[str, float]) -> float:
    """Return the length of one unit of a wheel, in meters or m/s."""
    unit = part.unit
    factor = unit_factor(f"{place}.unit", unit, known)
    if unit in TICKS:
        if not part.ticks_per_m:
            raise LogError(
                f"{place}.unit is {unit!r}: give ticks_per_m, the ticks of a wheel for each meter."
            )
        return 1 / part.ticks_per_m
    if unit in ANGLES or unit in RATES:
        if not part.wheel_diameter_mm:
            raise LogError(f"{place}.unit is {unit!r}: give wheel_diameter_mm, to turn it into meters.")
        return factor * part.wheel_diameter_mm / 2000
    return factor


def _way(part: Commands | Wheels, place: str) -> float:
    """Return the length of one unit of an increment [m]."""
    try:
        return _in_meters(place, part, LENGTHS | ANGLES | {"ticks": 1.0})
    except LogError as error:
        raise LogError(f"{error}{_SINCE_THE_ROW_BEFORE if part.unit.endswith('/s') else ''}") from None


_SINCE_THE_ROW_BEFORE = ' With per = "row", a number is a distance since the row before, and no speed.'


def _turn_way(part: Commands, track: float) -> float:
    """Return the distance of a wheel for one unit of a turn in place [m]; 0 if the part has wheels."""
    return unit_factor("commands.turn_unit", part.turn_unit, ANGLES) * track / 2 if part.turn else 0.0


def _to_wheels(part: WheelPart, first: float, turn: float = 0.0) -> Floats:
    """Return the matrix that turns a row into values of both wheels.

    Args:
        part: Part with wheels, or with forward speed and turn rate.
        first: Value of one unit of a wheel, or of the forward speed.
        turn: Value of one unit of the turn rate.
    """
    if isinstance(part, Commands) and part.forward:
        return np.array([[first, first], [-turn * part.turn_sign, turn * part.turn_sign]])
    return np.diag([first * part.left_sign, first * part.right_sign])


class _CommandConverter:
    width = 2

    def __init__(self, part: Commands, speed: float, track: float) -> None:
        turn = 0.0
        if part.forward:
            turn = unit_factor("commands.turn_unit", part.turn_unit, RATES, SHARES)
            turn *= 1.0 if part.turn_unit in SHARES else track / 2 / speed
        self._to_wheels = _to_wheels(part, self._share(part, speed), turn)

    @staticmethod
    def _share(part: Commands, speed: float) -> float:
        if part.unit in SHARES:
            return SHARES[part.unit]
        if part.unit == LEVEL:
            if not part.full:
                raise LogError("commands.unit is 'level': give full, the number that stands for full speed.")
            return 1 / part.full
        known = SPEEDS | SHARES | RATES | {LEVEL: 1.0, "ticks/s": 1.0}
        return _in_meters("commands", part, known) / speed

    def __call__(self, times: Floats, raw: Floats) -> Floats:
        return np.asarray(raw @ self._to_wheels)


class _Increments:
    """Distances of the wheels since the first row, from distances since the row before."""

    width = 2

    def __init__(self, to_wheels: Floats) -> None:
        self._to_wheels = to_wheels
        self._way: Floats | None = None

    def __call__(self, times: Floats, raw: Floats) -> Floats:
        if not len(raw):
            return raw
        steps = raw @ self._to_wheels
        if self._way is None:  # the increment of the first row is from before the log
            steps[0] = 0.0
            self._way = np.zeros(2)
        ways = self._way + np.cumsum(steps, axis=0)
        self._way = ways[-1]
        return np.asarray(ways)


class _WheelConverter:
    width = 2

    def __init__(self, part: Wheels) -> None:
        known = LENGTHS | SPEEDS | ANGLES | RATES | dict.fromkeys(TICKS, 1.0)
        self._factors = _in_meters("wheels", part, known) * np.array([part.left_sign, part.right_sign])
        self._is_speed = part.unit.endswith("/s") or part.unit == "rpm"
        self._wraps_at = part.wraps_at
        self._last: tuple[float, Floats, Floats] | None = None

    def __call__(self, times: Floats, raw: Floats) -> Floats:
        if not len(raw):
            return raw
        way = np.zeros(2) if self._last is None else self._last[2]
        before = raw[:1] if self._last is None else self._last[1][None]
        rows = np.concatenate([before, raw])
        if self._is_speed:
            at = np.concatenate([times[:1] if self._last is None else [self._last[0]], times])
            steps = (rows[1:] + rows[:-1]) / 2 * np.diff(at)[:, None]
        else:
            steps = np.diff(rows, axis=0)
            if self._wraps_at:
                half = self._wraps_at / 2
                steps = (steps + half) % self._wraps_at - half
        ways = way + np.cumsum(steps * self._factors, axis=0)
        self._last = float(times[-1]), raw[-1], ways[-1]
        return np.asarray(ways)


class _PoseConverter:
    """x, y, heading without jumps, and the heading as the log has it, which shows mistakes."""

    width = 4

    def __init__(self, part: Poses) -> None:
        self._part = part
        self._meters = unit_factor("poses.unit", part.unit, LENGTHS)
        self._radians = unit_factor("poses.heading_unit", part.heading_unit, ANGLES)
        self._last = math.nan

    def __call__(self, times: Floats, raw: Floats) -> Floats:
        part = self._part
        x, y = raw[:, 0] * self._meters, raw[:, 1] * self._meters
        if raw.shape[1] == 2:
            heading = np.full(len(raw), np.nan)
        elif raw.shape[1] == 3:
            heading = raw[:, 2] * self._radians
        else:
            qx, qy, qz, qw = raw[:, 2:].T
            heading = np.arctan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy**2 + qz**2))
        if part.clockwise != part.y_down:
            heading = -heading
        if part.y_down:
            y = -y
        heading = heading + math.radians(part.heading_offset_deg)
        with_jumps = heading
        if len(heading) and np.isfinite(heading).all():
            first = heading[0] if math.isnan(self._last) else self._last
            heading = np.unwrap(np.concatenate([[first], heading]))[1:]
            self._last = float(heading[-1])
        ahead, left = part.marker_x_mm / 1000, part.marker_y_mm / 1000
        if ahead or left:
            x = x - ahead * np.cos(heading) + left * np.sin(heading)
            y = y - ahead * np.sin(heading) - left * np.cos(heading)
        return np.stack([x, y, heading, with_jumps], 1)


class _ReadingConverter:
    def __init__(self, part: Readings) -> None:
        self.width = len(part.sensors)
        self._full, self._is_inverted = part.full, part.inverted

    def __call__(self, times: Floats, raw: Floats) -> Floats:
        shares = raw / self._full
        return np.asarray(1 - shares if self._is_inverted else shares)
