"""Checks of a fit to logs: whether the rest that it leaves depends on the speed, the turn, or the time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ._log_model import MotionLog, Numbers, body_steps, pose_likelihood, read_late, wheel_ways
from ._simulate import Bools, Floats

THIRDS = {
    "speed": ("slowest", "middle", "fastest"),
    "turn": ("straightest", "middle", "sharpest"),
    "time": ("first", "middle", "last"),
}
CLEAR, LARGE = 4.0, 0.03
"""Standard errors, and share of the motion, beyond which a rest contradicts the fit."""
LEAST_SHARE = 0.05
"""Share of the whole motion that a third must have."""


@dataclass(frozen=True)
class Contradictions:
    """Thirds of logs that contradict a fit.

    Attributes:
        lines: The third that contradicts it most, by speed, by turn, and by time, in words.
        drives: Largest share by which the robot drives more or less.
        turns: Largest share by which it turns more or less.
    """

    lines: tuple[str, ...] = ()
    drives: float = 0.0
    turns: float = 0.0


def contradictions(logs: Sequence[MotionLog], numbers: Sequence[Numbers]) -> Contradictions:
    """Return what thirds of logs, by speed, by turn, and by time, say against a fit.

    Args:
        logs: Logs with poses.
        numbers: Fitted numbers for each log, as arrays of one value.
    """
    rows = [_rests(log, values) for log, values in zip(logs, numbers, strict=True) if log.sees_poses]
    if not rows:
        return Contradictions()
    length, turn, lasts, along, about = (np.concatenate(columns) for columns in zip(*rows, strict=True))
    lines, largest = [], {"drives": 0.0, "turns": 0.0}
    for name, order in (
        ("speed", np.abs(length) / lasts),
        ("turn", np.abs(turn) / lasts),
        ("time", np.arange(len(length), dtype=np.float64)),
    ):
        third = np.searchsorted(np.quantile(order, (1 / 3, 2 / 3)), order)
        worst, line = 0.0, ""
        for k, which in enumerate(THIRDS[name]):
            for verb, rest, motion in (("drives", along, length), ("turns", about, turn)):
                share = _share(rest, motion, third == k)
                largest[verb] = max(largest[verb], abs(share))
                if abs(share) > abs(worst):
                    more = "more" if share > 0 else "less"
                    where = f"In the {which} third of the log by {name}"
                    worst, line = share, f"{where}, the robot {verb} {abs(share):.0%} {more} than the fit."
        lines += [line] if line else []
    return Contradictions(tuple(lines), **largest)


def _rests(log: MotionLog, values: Numbers) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return the predicted distance and turn of each seen row, its time, and the rest of its pose."""
    ways = wheel_ways(log, values)
    off = pose_likelihood(log, ways, values)[1][0, 1:]
    length, turn = body_steps(read_late(log, ways, values["camera.delay"]), values)
    seen = np.isfinite(off[:, 0]) & np.isfinite(log.poses[:-1, 0])
    return length[0, seen], turn[0, seen], np.diff(log.time_s)[seen], off[seen, 0], off[seen, 2]


def _share(rest: Floats, motion: Floats, part: Bools) -> float:
    """Return the share of the motion in a part by which the fit is clearly off there; 0 if it is not."""
    part = part & np.isfinite(rest)
    size = float(np.abs(motion[part]).sum())
    if size < LEAST_SHARE * float(np.abs(motion).sum()) or size == 0.0:
        return 0.0
    share = float((rest[part] * np.sign(motion[part])).sum()) / size
    error = float(np.sqrt((rest[part] ** 2).sum())) / size
    return share if abs(share) > max(LARGE, CLEAR * error) else 0.0
