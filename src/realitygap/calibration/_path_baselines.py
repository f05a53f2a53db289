"""Simple predictions of the unseen part of a log, which a fitted drive has to beat."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ._simulate import Floats

NEIGHBORS = 7
"""Number of steps with the most similar commands whose mean motion is used."""
ALIGNED_M = 0.3
"""Length of the path before the split that gives the heading there [m]."""
LEAST_ALIGNED = 3
MOST_STEP_RAD = 1.0
"""Turn in one step beyond which a heading by the path is no turn [rad]."""


def look_up_motion(time_s: ArrayLike, commands: ArrayLike, poses: ArrayLike, split: int) -> Floats:
    """Return positions of the held-out part of a log, by the motion in fitted steps with similar commands.

    Args:
        time_s: (n,) ascending times [s].
        commands: (n, 2) commands of the left and right wheel.
        poses: (n, 2) x, y [m] or (n, 3) x, y, heading [rad]; nan if not seen.
        split: First row of the held-out part.

    Returns:
        (n - split, 2) positions [m].
    """
    time, asked, seen = (np.asarray(values, np.float64) for values in (time_s, commands, poses))
    lasts = np.diff(time)
    ahead, turn = _motion(asked, seen)
    # a wheel nears its command, so the one before counts as well
    told = np.concatenate([asked[:-1], np.concatenate([asked[:1], asked[:-2]])], 1)
    known = np.flatnonzero(np.isfinite(ahead[: split - 1]) & np.isfinite(turn[: split - 1]))
    if not len(known):
        return np.full((len(time) - split, 2), np.nan)
    rate = np.stack([ahead, turn], 1)[known] / lasts[known, None]
    speeds = np.empty((len(lasts), 2))
    for k, row in enumerate(told):
        near = np.argsort(((told[known] - row) ** 2).sum(1), kind="stable")[:NEIGHBORS]
        speeds[k] = rate[near].mean(0)
    return drive_on(speeds * lasts[:, None], seen, split)


def drive_on(steps: Floats, poses: Floats, split: int) -> Floats:
    """Return the positions of a body that moves by steps from the end of the fitted part, (n - split, 2) [m].

    Args:
        steps: (n - 1, 2) distance ahead [m] and turn [rad] of each step.
        poses: (n, 2) or (n, 3) poses; nan if not seen. Without headings, the heading at the split is the one that
            aligns the last part of the computed path with the observed one.
        split: First row of the held-out part.
    """
    heading = np.concatenate([[0.0], np.cumsum(steps[:, 1])])
    middle = heading[:-1] + steps[:, 1] / 2
    path = np.concatenate([[0j], np.cumsum(steps[:, 0] * np.exp(1j * middle))])
    seen = poses[:, 0] + 1j * poses[:, 1]
    known = np.flatnonzero(np.isfinite(seen[:split]))
    last = known[-1]
    if poses.shape[1] == 3 and np.isfinite(poses[last, 2]):
        angle = poses[last, 2] - heading[last]
    else:
        way = np.abs(np.diff(path))[:last][::-1].cumsum()
        first = last - min(int(np.searchsorted(way, ALIGNED_M)) + LEAST_ALIGNED, last)
        rows = known[known >= first]
        moved, told = seen[rows] - seen[rows].mean(), path[rows] - path[rows].mean()
        angle = float(np.angle(np.vdot(told, moved)))
    at = seen[last] + (path[split:] - path[last]) * np.exp(1j * angle)
    return np.stack([at.real, at.imag], 1)


def _motion(commands: Floats, poses: Floats) -> tuple[Floats, Floats]:
    """Return the way ahead [m] and turn [rad] in each step, (n - 1,) each; without headings by the path."""
    steps = np.diff(poses[:, 0] + 1j * poses[:, 1])
    if poses.shape[1] == 3 and np.isfinite(poses[:, 2]).any():
        turn = np.diff(poses[:, 2])
        return np.real(steps * np.exp(-1j * (poses[:-1, 2] + turn / 2))), turn
    way = np.abs(steps) * np.where(commands[:-1].sum(1) < 0, -1, 1)
    usual = np.nanmedian(np.abs(way[np.abs(way) > 0])) if np.any(np.abs(way) > 0) else 0.0
    clear = np.flatnonzero(np.isfinite(way) & (np.abs(way) > 0.2 * usual))
    if len(clear) < LEAST_ALIGNED:
        return way, np.zeros(len(way))
    direction = np.unwrap(np.angle(steps[clear] * np.sign(way[clear])))
    heading = np.interp(np.arange(len(poses)), clear + 0.5, direction)
    turn = np.diff(heading)
    return way, np.where(np.abs(turn) < MOST_STEP_RAD, turn, np.nan)
