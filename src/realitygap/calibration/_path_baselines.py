"""Simple predictions of the unseen part of a log, which a fitted drive has to beat."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ._log_prediction import Steps
from ._simulate import Floats

NEIGHBORS = 7
"""Number of steps with the most similar commands whose mean motion is used."""
MOST_STEP_RAD = 1.0
"""Turn in one step beyond which a heading by the path is no turn [rad]."""


FEWEST_CLEAR = 3
"""Steps with a clear direction from which headings by the path are made."""


def look_up_motion(time_s: ArrayLike, commands: ArrayLike, poses: ArrayLike, split: int) -> Steps | None:
    """Return the motion of each step of a log, by that in fitted steps with similar commands.

    Args:
        time_s: (n,) ascending times [s].
        commands: (n, 2) commands of the left and right wheel.
        poses: (n, 2) x, y [m] or (n, 3) x, y, heading [rad]; nan if not seen.
        split: First row of the held-out part.

    Returns:
        The motion of what the camera sees; None if no motion was seen in the fitted part.
    """
    time, asked, seen = (np.asarray(values, np.float64) for values in (time_s, commands, poses))
    lasts = np.diff(time)
    ahead, turn = _motion(asked, seen)
    # a wheel nears its command, so the one before counts as well
    told = np.concatenate([asked[:-1], np.concatenate([asked[:1], asked[:-2]])], 1)
    known = np.flatnonzero(np.isfinite(ahead[: split - 1]) & np.isfinite(turn[: split - 1]))
    if not len(known):
        return None
    rate = np.stack([ahead, turn], 1)[known] / lasts[known, None]
    speeds = np.empty((len(lasts), 2))
    for k, row in enumerate(told):
        near = np.argsort(((told[known] - row) ** 2).sum(1), kind="stable")[:NEIGHBORS]
        speeds[k] = rate[near].mean(0)
    return Steps(speeds[:, 0] * lasts, speeds[:, 1] * lasts)


def _motion(commands: Floats, poses: Floats) -> tuple[Floats, Floats]:
    """Return the way ahead [m] and turn [rad] in each step, (n - 1,) each; without headings by the path."""
    steps = np.diff(poses[:, 0] + 1j * poses[:, 1])
    if poses.shape[1] == 3 and np.isfinite(poses[:, 2]).any():
        turn = np.diff(poses[:, 2])
        return np.real(steps * np.exp(-1j * (poses[:-1, 2] + turn / 2))), turn
    way = np.abs(steps) * np.where(commands[:-1].sum(1) < 0, -1, 1)
    usual = np.nanmedian(np.abs(way[np.abs(way) > 0])) if np.any(np.abs(way) > 0) else 0.0
    clear = np.flatnonzero(np.isfinite(way) & (np.abs(way) > 0.2 * usual))
    if len(clear) < FEWEST_CLEAR:
        return way, np.zeros(len(way))
    direction = np.unwrap(np.angle(steps[clear] * np.sign(way[clear])))
    heading = np.interp(np.arange(len(poses)), clear + 0.5, direction)
    turn = np.diff(heading)
    return way, np.where(np.abs(turn) < MOST_STEP_RAD, turn, np.nan)
