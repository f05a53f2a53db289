"""The picture of a trial: the driven path, as plain shapes."""

from __future__ import annotations

import math

import numpy as np

from realitygap.drawing import Disc, Ink, Line, Picture, Shape, Text, picture_of

from ._batch import Trajectory

_MARGIN = 0.06  # around the path [m]
_LEAST = 0.5  # shown from left to right, so that a robot that hardly moves looks so [m]
_SCALE = 0.1  # length of the scale [m]


@picture_of.register(Trajectory)
def path_picture(trajectory: Trajectory) -> Picture:
    """Return a drawing of the robot's path, with the places where it was blocked and a scale of 0.1 m."""
    xs, ys = trajectory.poses[:, 0], trajectory.poses[:, 1]
    across = max(_LEAST, float(np.ptp(xs)), 1.4 * float(np.ptp(ys))) + 2 * _MARGIN
    up = max(0.5 * _LEAST, float(np.ptp(ys))) + 2 * _MARGIN
    left = (float(xs.min()) + float(xs.max()) - across) / 2
    bottom = (float(ys.min()) + float(ys.max()) - up) / 2 - 0.03
    right, top = left + across, bottom + up
    points = tuple((float(x), float(y)) for x, y in zip(xs, ys, strict=True))
    shapes: list[Shape] = [Line(points, Ink.OURS, 1.4)]
    blocked = sorted({point for point, stall in zip(points, trajectory.stalled, strict=True) if stall})
    for x, y in blocked:
        for way in (0.006, -0.006):
            shapes.append(Line(((x - 0.006, y - way), (x + 0.006, y + way)), Ink.REACH, 1.1))
    x, y, heading = (float(value) for value in trajectory.poses[0])
    nose = (x + 0.03 * math.cos(heading), y + 0.03 * math.sin(heading))
    shapes += [Line(((x, y), nose), Ink.TEXT, 1.2), Disc(x, y, 2.6, fill=Ink.TEXT)]
    shapes.append(Disc(*points[-1], 3.2, Ink.OURS, Ink.GROUND, 1.3))
    low = bottom + 0.02
    ends = (left + 0.02, left + 0.02 + _SCALE)
    shapes += [Line(((ends[0], low), (ends[1], low)), Ink.MUTED, 1.2)]
    shapes.append(Text(ends[1] + 0.01, low, f"{_SCALE:g} m", 7.0, "start", color=Ink.MUTED))
    n_steps, n_stalls = len(trajectory.commands), int(trajectory.stalled.sum())
    return Picture(
        "Path of a trial",
        f"Path of {n_steps} steps of {trajectory.step_s:g} s, {n_stalls} of them blocked; coverage "
        f"{trajectory.coverage_line:.3f} along the line, {trajectory.coverage_ends:.3f} at the ends of steps.",
        left,
        bottom,
        right,
        top,
        tuple(shapes),
    )
