"""Trials to show, of robots that drive on lines of our own."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np

from realitygap.platforms import JyroPlatform
from realitygap.playback import MovingTrial, in_motion
from realitygap.world import paper_arena


def straight(
    n_steps: int = 10, *, step_s: float = 0.1, step_m: float = 0.05, title: str = "a"
) -> MovingTrial:
    """A robot that drives to the right from the paper's start, seeing nothing on the left and more on the right."""
    start = paper_arena().start
    poses = np.array([[start.x + step_m * k, start.y, start.heading] for k in range(n_steps + 1)])
    readings = np.column_stack([np.full(n_steps + 1, reading) for reading in (0.2, 0.1, 0.0)])
    stalled = np.zeros(n_steps + 1, np.bool_)
    driven = SimpleNamespace(step_s=step_s, poses=poses, readings=readings, stalled=stalled)
    return in_motion(driven, paper_arena(), JyroPlatform(), title=title)


def turning(n_steps: int = 8, *, step_s: float = 0.5) -> MovingTrial:
    """A robot that turns on the spot over the direction in which headings begin anew, blocked in its last step."""
    poses = np.array([[0.5, 0.3, (math.tau - 0.4 + 0.2 * k) % math.tau] for k in range(n_steps + 1)])
    stalled = np.arange(n_steps + 1) == n_steps
    driven = SimpleNamespace(
        step_s=step_s, poses=poses, readings=np.full((n_steps + 1, 3), 0.2), stalled=stalled
    )
    return in_motion(driven, paper_arena(), JyroPlatform(), title="turning")
