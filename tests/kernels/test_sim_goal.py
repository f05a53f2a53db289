"""Where the goal is as a robot sees it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import goal as goal_kernels
from tests.kernels.sim_rows import PRECISIONS, poses, row


def sectors(goal_x, goal_y, x, y, heading, real=np.float64):
    """(4, LANES) of all quarters."""
    seen = np.empty((4, LANES), real)
    for sector in range(4):
        goal_kernels.see_goal_sector(
            row(goal_x, real), row(goal_y, real), np.int64(sector), poses(x, y, heading, real), seen[sector]
        )
    return seen


@pytest.mark.parametrize("real", PRECISIONS)
def test_the_goal_is_in_the_quarter_that_its_bearing_says(real):
    rng = np.random.default_rng(1)
    goal, place = rng.uniform(-1, 1, (2, 2, LANES))
    heading = rng.uniform(-math.pi, math.pi, LANES)
    seen = sectors(*goal, *place, heading, real)
    bearing = np.arctan2(goal[1] - place[1], goal[0] - place[0]) - heading
    wanted = np.round(bearing / (math.pi / 2)).astype(int) % 4  # ahead, left, behind, right
    assert (seen.argmax(axis=0) == wanted).all()
    assert (seen.sum(axis=0) == 1).all()


def test_exactly_one_quarter_sees_the_goal_on_a_border_and_at_the_goal():
    for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1), (0, 0)):
        seen = sectors(x, y, 0.0, 0.0, 0.0)
        assert (seen.sum(axis=0) == 1).all()
    assert sectors(1, 1, 0.0, 0.0, 0.0)[0, 0] == 1


def test_the_distance_is_a_part_of_that_from_the_start():
    value = row(7.0, np.float64)
    x = np.linspace(0.0, 3.0, LANES)
    real = np.float64
    goal_kernels.see_goal_distance(
        row(2.0, real), row(0.0, real), row(0.5, real), row(0.0, real), poses(x, 0.0, 0.0, real), value
    )
    assert value == pytest.approx(np.minimum(abs(2.0 - x) / 1.5, 1.0))
    goal_kernels.see_goal_distance(
        row(2.0, real), row(0.0, real), row(2.0, real), row(0.0, real), poses(x, 0.0, 0.0, real), value
    )
    assert (value == 1.0).all()
