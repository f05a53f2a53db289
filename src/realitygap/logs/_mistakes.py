"""The usual mistakes in logs, found by what cannot be: wheels and poses have to tell of one motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ._clock_offset import ClockOffset, clock_offset, correlation
from ._log import Log
from ._source import Floats

WINDOW_S = 1.0
"""Time over which motion is compared: long against lags, short against turns."""
SAME = 1.35
"""Factor within which a ratio is taken for a known one, such as 1000 for millimeters."""
GAINS = 3.0
"""Factor within which a ratio is a gain, and no unit."""
SURE = 4.0
"""Standard errors that a coefficient has to be away from 0 for its sign to count."""
CLEAR = 0.75
"""Concentration of angles around one direction, 0 to 1, beyond which they are one direction."""
FEWEST_WINDOWS = 8
MOST_STEPS = 20_000
"""Maximum number of steps of a log that are compared."""
MOST_LATE_S = 0.5
"""A robot's own lag and delay: what follows later is a clock."""
SCALES = {1000.0: ("millimeters", "mm"), 100.0: ("centimeters", "cm"), 1 / 0.0254: ("inches", "in")}
LEAST_WAY = 1e-9
FEWEST_INCREMENTS = 50
"""Minimum number of steps that show whether encoders count on."""
ALIKE = 0.7
"""Correlation with the motion of the poses at which encoders are that motion, if the other reading has less."""
INCREMENTS = (
    "The encoders do not count on, but follow the speed of the poses: they are increments since the row before. "
    'Set wheels.per = "row".'
)
LEAST_BEND = 0.1
"""Change of direction below which a path counts as straight [rad]."""
CLEAR_BEND = 5.0
"""Factor by which a change of direction has to exceed the noise of one."""
STANDS = 1e-6
"""Range of headings that do not change [rad or deg]."""


@dataclass(frozen=True)
class Mistake:
    """Something in a log that cannot be as its mapping says.

    Attributes:
        kind: swapped, reversed, left reversed, right reversed, degrees, millimeters, centimeters, inches, unit,
            half track, double track, clockwise, constant heading, heading offset,
            clock, or increments.
        message: Observation, and the next step.
    """

    kind: str
    message: str


@dataclass(frozen=True)
class Diagnosis:
    """A comparison of the wheels and the poses of a log.

    Attributes:
        mistakes: List of mistakes.
        offset: Delay of poses after commands; None if the log does not show it.
        track: Distance between the wheels, by the poses [m]; nan if unknown.
        gain: Distance by the poses divided by the distance by the wheels; nan if unknown.
    """

    mistakes: tuple[Mistake, ...] = ()
    offset: ClockOffset | None = None
    track: float = math.nan
    gain: float = math.nan


def diagnose(log: Log, speed: float, track: float) -> Diagnosis:
    """Compare what a log says of the wheels with what it says of the poses, and name the usual mistakes.

    Args:
        log: A trial.
        speed: Speed of a wheel at full command [m/s].
        track: Distance between the wheels in the robot's file [m].
    """
    log = _begin(log)
    if _are_increments(log):
        return Diagnosis((Mistake("increments", INCREMENTS),))
    ways = log.commands * speed * log.step_s
    if not len(log.poses) or not np.abs(ways).max(initial=0.0) > LEAST_WAY:
        return Diagnosis()
    xy, raw = log.poses[:, :2], log.raw_headings
    mistakes: list[Mistake] = []
    headings = log.poses[:, 2]
    if log.has_heading:
        headings, mistakes = _checked_headings(xy, raw, headings, ways)
    mean, half = ways.sum(1) / 2, np.diff(ways, axis=1)[:, 0] / 2
    observed = np.stack([np.hypot(*np.diff(xy, axis=0).T), _turns(xy, headings)], 1)
    offset = clock_offset(np.stack([np.abs(mean), half], 1), observed, log.step_s)
    if offset is None:  # with one wheel reversed, its speed is in the difference
        offset = clock_offset(np.stack([np.abs(half), mean], 1), observed, log.step_s)
    shift = 0 if offset is None else round(offset.seconds / log.step_s)
    of_wheels, gain, measured = _compare_wheels(xy, headings, _shifted(ways, shift), log.step_s, track)
    mistakes += of_wheels
    if offset is not None and (offset.high < -log.step_s / 4 or offset.low > MOST_LATE_S):
        mistakes.append(_clock(offset, log.wheel_part))
    return Diagnosis(tuple(mistakes), offset, measured, gain)


def _are_increments(log: Log) -> bool:
    """Return whether the encoders do not count on, but follow the speed of the poses."""
    if not len(log.wheels) or not len(log.poses) or len(log.commands) < FEWEST_INCREMENTS:
        return False
    moved = np.hypot(*np.diff(log.poses[:, :2], axis=0).T)
    way = log.wheels.mean(1)
    as_counter, as_increment = (correlation(moved, distance) for distance in (np.abs(np.diff(way)), way[1:]))
    return as_increment > ALIKE and as_counter < ALIKE * as_increment


def _begin(log: Log) -> Log:
    """Return the first part of a log, which shows its mistakes as well as all of it."""
    n = MOST_STEPS
    if len(log.commands) <= n:
        return log
    return replace(
        log,
        commands=log.commands[:n],
        poses=log.poses[: n + 1],
        wheels=log.wheels[: n + 1],
        readings=log.readings[: n + 1],
        raw_headings=log.raw_headings[: n + 1],
    )


def _clock(offset: ClockOffset, wheels: str) -> Mistake:
    when = "before" if offset.seconds < 0 else "after"
    return Mistake(
        "clock",
        f"Poses come {abs(offset.seconds):.2f} s ({abs(offset.low):.2f} to {abs(offset.high):.2f}) {when} the {wheels} "
        f"that they follow: the clocks differ. Set poses.offset_s = {-offset.seconds:.2f}.",
    )


def _shifted(ways: Floats, shift: int) -> Floats:
    """Return the distances of the wheels, `shift` steps later."""
    if not shift:
        return ways
    moved = np.zeros_like(ways)
    if shift > 0:
        moved[shift:] = ways[:-shift]
    else:
        moved[:shift] = ways[-shift:]
    return moved


def _turns(xy: Floats, headings: Floats) -> Floats:
    """Return the turn in each step, (n,) [rad], from headings or the path; nan if the robot hardly moves."""
    if np.isfinite(headings).any():
        return np.diff(headings)
    steps = np.diff(xy, axis=0)
    way = np.hypot(*steps.T)
    direction = np.where(way > 0.2 * np.nanmedian(way[way > 0]) if (way > 0).any() else False,
                         np.arctan2(steps[:, 1], steps[:, 0]), np.nan)  # fmt: skip
    turn = np.full(len(steps), np.nan)
    turn[1:] = _wrapped(np.diff(direction), math.pi)  # ahead and back are one direction
    return turn


def _wrapped(angle: Floats, period: float = 2 * math.pi) -> Floats:
    return np.asarray((angle + period / 2) % period - period / 2)


def _checked_headings(
    xy: Floats, raw: Floats, headings: Floats, ways: Floats
) -> tuple[Floats, list[Mistake]]:
    """Return the headings as they are meant, which are along the path, and the mistakes in them."""
    steps = np.diff(xy, axis=0) * np.sign(ways.sum(1, keepdims=True))
    way = np.hypot(*steps.T)
    moves = np.isfinite(way) & (way > 0.3 * np.nanmax(way, initial=0.0)) & np.isfinite(raw[:-1])
    if moves.sum() < FEWEST_WINDOWS:
        return headings, []
    path = np.arctan2(steps[moves, 1], steps[moves, 0])
    if np.ptp(raw[:-1][moves]) < STANDS and _bends(steps[moves]):
        return headings * math.nan, [
            Mistake(
                "constant heading",
                "Headings never change, but the path turns: the column is no heading. Leave poses.heading out of the "
                "mapping, or name another column.",
            )
        ]
    if np.abs(np.exp(1j * path).mean()) > CLEAR:
        return headings, []  # one direction all along: any heading that stays agrees
    fits = {}
    for unit, factor in (("rad", 1.0), ("deg", math.pi / 180)):
        for sign in (1, -1):
            fits[unit, sign] = np.exp(1j * (path - sign * factor * raw[:-1][moves])).mean()
    best = max(fits, key=lambda key: abs(fits[key]))
    if abs(fits["rad", 1]) > CLEAR * abs(fits[best]):
        best = ("rad", 1)
    elif abs(fits[best]) < CLEAR:
        return headings, []
    mistakes = []
    unit, sign = best
    if unit == "deg":
        headings = np.unwrap(raw * math.pi / 180)
        mistakes.append(
            Mistake(
                "degrees",
                'Headings are in degrees: read so, they follow the path. Set poses.heading_unit = "deg".',
            )
        )
    if sign < 0:
        headings = -headings
        mistakes.append(
            Mistake(
                "clockwise",
                "Headings grow clockwise, against the path. Set poses.clockwise = true, or y_down.",
            )
        )
    angle = math.degrees(float(np.angle(fits[best])))
    if 25 < abs(angle) < 155 and abs(fits[best]) > CLEAR:
        headings = headings + math.radians(angle)
        mistakes.append(
            Mistake(
                "heading offset",
                f"Headings are {-angle:.0f} degrees from the direction of the path. Set poses.heading_offset_deg = "
                f"{angle:.0f}.",
            )
        )
    return headings, mistakes


def _bends(steps: Floats) -> bool:
    """Return whether the direction of a path changes by more than its noise, in `FEWEST_WINDOWS` parts of it."""
    chords = np.stack([part.sum(0) for part in np.array_split(steps, FEWEST_WINDOWS)])
    direction = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))
    # the noise of a position is in two steps, with opposite signs
    noise = float(np.median(np.hypot(*np.diff(steps, axis=0).T))) / float(
        np.median(np.hypot(*chords.T)) or 1.0
    )
    return float(np.ptp(direction)) > max(LEAST_BEND, CLEAR_BEND * noise)


def _compare_wheels(
    xy: Floats, headings: Floats, ways: Floats, step_s: float, track: float
) -> tuple[list[Mistake], float, float]:
    """Return mistakes in signs and units of the wheels, the gain, and the track [m]."""
    width = max(1, min(round(WINDOW_S / step_s), len(ways) // FEWEST_WINDOWS))
    at = np.arange(0, len(ways) + 1 - width, width)
    sums = np.concatenate([np.zeros((1, 2)), np.cumsum(ways, 0)])
    wheels = sums[at + width] - sums[at]
    chord = xy[at + width] - xy[at]
    has_heading = bool(np.isfinite(headings).any())
    if has_heading:
        turn = headings[at + width] - headings[at]
        middle = headings[at] + turn / 2
        ahead = chord[:, 0] * np.cos(middle) + chord[:, 1] * np.sin(middle)
        turning = wheels
    else:
        direction = np.arctan2(chord[:, 1], chord[:, 0])
        length = np.hypot(*chord.T)
        direction[length < 0.2 * np.nanmax(length, initial=0.0)] = np.nan
        turn = np.concatenate([[np.nan], _wrapped(np.diff(direction), math.pi)])
        turning = np.concatenate([wheels[:1], (wheels[1:] + wheels[:-1]) / 2])
        ahead = length * np.where(wheels.sum(1) < 0, -1, 1)
        turn[np.abs(turn) > 1.2] = np.nan  # near half of the period it may be on either side
    with np.errstate(invalid="ignore", divide="ignore"):
        bend = np.where(np.abs(turn) > 1e-6, np.sin(turn / 2) / (turn / 2), 1.0)
    arc = ahead / np.where(np.isfinite(bend) & (np.abs(bend) > 0.3), bend, np.nan if has_heading else 1.0)
    forward, sure_forward = _slopes(wheels, arc)
    round_, sure_round = _slopes(turning, turn)
    if forward is None or round_ is None:
        return [], math.nan, math.nan
    mistakes = []
    if sure_forward and sure_round:
        kind = _signs(np.sign(forward), np.sign(round_), has_heading=has_heading)
        mistakes += [kind] if kind is not None else []
    gain = float(np.abs(forward).sum())
    spin = float(np.abs(round_).sum() / 2)
    measured = math.nan if spin == 0 else (1 if gain > GAINS else gain) / spin
    if sure_forward:
        mistakes += _scale(gain)
    if (
        sure_round
        and sure_forward
        and not any(mistake.kind in ("left reversed", "right reversed") for mistake in mistakes)
    ):
        mistakes += _track(measured, track)
    return mistakes, gain, measured


def _slopes(wheels: Floats, values: Floats) -> tuple[Floats | None, bool]:
    """Return the least-squares slopes of values over both wheels, (2,), and whether the signs of both are certain."""
    known = np.isfinite(values) & np.isfinite(wheels).all(1)
    x, y = wheels[known], values[known]
    if len(y) < FEWEST_WINDOWS or np.linalg.matrix_rank(x) < 2:
        return None, False
    slopes = np.linalg.lstsq(x, y, rcond=None)[0]
    off = y - x @ slopes
    # slips and lost poses count little
    weight = 1 / np.maximum(1, np.abs(off) / (3 * np.median(np.abs(off)) + 1e-12))
    slopes = np.linalg.lstsq(x * weight[:, None], y * weight, rcond=None)[0]
    off = (y - x @ slopes) * weight
    errors = np.linalg.norm(np.linalg.pinv(x), axis=1) * math.sqrt(off @ off / max(len(y) - 2, 1))
    return slopes, bool((np.abs(slopes) > SURE * errors).all())


_PATTERNS: dict[tuple[int, int, int, int], tuple[str, str]] = {
    (1, 1, 1, -1): (
        "swapped",
        "The robot turns against its wheels: left and right are swapped, or the poses are mirrored. Swap left and "
        "right in the mapping, or set poses.y_down = true.",
    ),
    (-1, -1, 1, -1): (
        "reversed",
        "Both wheels are reversed: the robot goes ahead when they go back. Set left_sign = -1 and right_sign = -1.",
    ),
    (-1, -1, -1, 1): (
        "swapped and reversed",
        "The robot goes back when its wheels go ahead, and turns as they say: its other end is ahead. Set "
        "poses.heading_offset_deg = 180, or swap left and right and set both signs to -1.",
    ),
    (-1, 1, 1, 1): ("left reversed", "The left wheel is reversed. Set left_sign = -1."),
    (1, -1, -1, -1): ("right reversed", "The right wheel is reversed. Set right_sign = -1."),
    (-1, 1, -1, -1): (
        "swapped, left reversed",
        "Left and right are swapped, and the column of the left one is reversed. Swap them and set right_sign = -1.",
    ),
    (1, -1, 1, 1): (
        "swapped, right reversed",
        "Left and right are swapped, and the column of the right one is reversed. Swap them and set left_sign = -1.",
    ),
}
"""Patterns of the signs of the slopes: distance over left and right wheel, turn over left and right wheel."""


def _signs(forward: Floats, round_: Floats, *, has_heading: bool) -> Mistake | None:
    pattern = (int(forward[0]), int(forward[1]), int(round_[0]), int(round_[1]))
    if pattern not in _PATTERNS:
        return None
    kind, message = _PATTERNS[pattern]
    if not has_heading and kind == "swapped":
        message = (
            "The robot turns against its wheels: left and right are swapped, or both are reversed. A log without "
            "headings does not tell which. Set left_sign = -1 and right_sign = -1, or swap left and right."
        )
        kind = "swapped or reversed"
    return Mistake(kind, message)


def _is_about(ratio: float, known: float) -> bool:
    return known / SAME < ratio < known * SAME


def _scale(gain: float) -> list[Mistake]:
    if 1 / GAINS < gain < GAINS or not math.isfinite(gain) or gain <= 0:
        return []
    for factor, (name, unit) in SCALES.items():
        if _is_about(gain, factor):
            message = (
                f"Poses are {gain:.0f} times the ways of the wheels: they are in {name}. "
                f'Set poses.unit = "{unit}".'
            )
            return [Mistake(name, message)]
        if _is_about(1 / gain, factor):
            message = (
                f"The ways of the wheels are {1 / gain:.0f} times the poses: they are in {name}. "
                f'Set unit = "{unit}/s".'
            )
            return [Mistake(name, message)]
    message = (
        f"A meter by the wheels is {gain:.3g} m by the poses: wheels are in ticks or in another unit. If in ticks, "
        f'set unit = "ticks/s" and ticks_per_m = {1 / gain:.4g}. Otherwise check unit and speed.'
    )
    return [Mistake("unit", message)]


def _track(measured: float, track: float) -> list[Mistake]:
    by_poses = f"By the poses there are about {measured:.2g} m between the wheels"
    if _is_about(measured / track, 2.0):
        message = (
            f"{by_poses}, twice the track of {track:.4g} m: is half the track given for the track? Set track = "
            f"{2 * track:.4g}."
        )
        return [Mistake("half track", message)]
    if _is_about(measured / track, 0.5):
        message = (
            f"{by_poses}, half the track of {track:.4g} m: is twice the track given for the track? Set track = "
            f"{track / 2:.4g}."
        )
        return [Mistake("double track", message)]
    return []
