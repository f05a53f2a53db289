"""Wheels of recorded commands and the filter of poses, against plain references."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.kernels.sim import odometry as kernels
from tests.reference import odometry as reference

BODY = (
    "track", "axle", "left", "zero", "drift", "slip", "travel", "heading_per_m", "heading_per_s", "place", "angle",
    "first",
)  # fmt: skip


@pytest.mark.parametrize("lag", [0.0, 0.03, 0.4])
def test_wheels_drive_as_by_small_steps(lag):
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.uniform(0.05, 0.3, 30))
    commands = np.repeat(rng.uniform(-1.2, 1.2, (10, 2)), 3, axis=0)
    numbers = np.array([[0.3, 0.25, 0.01, -0.01, 0.2, 0.1, lag], [0.1, 0.1, 0.0, 0.0, 0.0, 0.0, lag]])
    ways = np.empty((2, 30, 2))
    kernels.roll_wheels(times, commands, numbers, ways)
    for robot, wheel in np.ndindex(2, 2):
        row = numbers[robot]
        expected = reference.ways_of(
            times, commands[:, wheel], speed=row[wheel], bias=row[2 + wheel], dead_band=row[4], soft=row[5], lag=lag
        )  # fmt: skip
        assert ways[robot, :, wheel] == pytest.approx(expected, abs=1e-5)


def test_short_lag_joins_smoothly_with_none():
    """A search may try a lag below 0: the distance is a smooth function there."""
    times, commands = np.arange(5.0), np.array([[1.0, 1.0], [1.0, 1.0], [-0.5, 0.2], [0.0, 0.0], [0.0, 0.0]])
    lags = np.array([-2e-3, -1e-3, 0.0, 1e-3, 2e-3])
    numbers = np.zeros((5, kernels.N_WHEELS))
    numbers[:, :2], numbers[:, kernels.LAG] = 0.3, lags
    ways = np.empty((5, 5, 2))
    kernels.roll_wheels(times, commands, numbers, ways)
    assert np.diff(ways, n=2, axis=0) == pytest.approx(0.0, abs=1e-12)


def test_late_distances_lie_between_those_of_rows_and_go_on_at_the_end():
    times = np.array([0.0, 1.0, 2.0, 4.0])
    ways = np.array([[[0.0, 0.0], [1.0, 2.0], [3.0, 2.0], [7.0, 4.0]]]).repeat(3, axis=0)
    seen = np.empty_like(ways)
    kernels.read_late(times, ways, np.array([0.0, 0.5, -1.0]), seen)
    assert seen[0] == pytest.approx(ways[0])
    assert seen[1, :, 0] == pytest.approx([0.0, 0.5, 2.0, 6.0])
    assert seen[2, :, 1] == pytest.approx([2.0, 2.0, 3.0, 5.0])


@pytest.mark.parametrize("has_heading", [True, False])
def test_filter_gives_the_likelihood_of_the_reference(has_heading):
    rng = np.random.default_rng(4)
    n = 60
    times = np.cumsum(rng.uniform(0.05, 0.2, n))
    ways = np.cumsum(rng.uniform(-0.01, 0.03, (2, n, 2)), axis=1)
    bodies = np.abs(rng.normal(0, 0.02, (2, len(BODY)))) + 1e-3
    bodies[:, BODY.index("track")] = 0.1, 0.16
    poses = np.cumsum(rng.normal(0, 0.01, (n, 3)), axis=0)
    poses[rng.random(n) < 0.2] = np.nan
    poses[:2] = np.nan
    poses[30, 2] += 2 * np.pi
    if not has_heading:
        poses[:, 2] = np.nan
    logs, off = np.empty((2, n)), np.empty((2, n, 3))
    kernels.filter_poses(times, poses, ways, bodies, np.empty((4, 3)), logs, off)
    for robot in range(2):
        body = dict(zip(BODY, bodies[robot], strict=True))
        assert logs[robot] == pytest.approx(
            reference.log_likelihoods(times, poses, ways[robot], body), rel=1e-9
        )
    assert np.array_equal(np.isfinite(off[0, 3:, 0]), np.isfinite(poses[3:, 0]))
