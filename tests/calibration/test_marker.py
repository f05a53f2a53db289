"""The marker that a camera sees, from trials whose poses are those of a plain simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realitygap.calibration import fit_marker
from realitygap.records import TrialRecord
from realitygap.study._calibrate.marker import is_under_camera
from realitygap.world import Arena, Grid, Pose, load_robot

ROBOT = load_robot("khepera").with_numbers({"drive.lag": 0.0})
PLANE = Arena(
    "open",
    ((-9, -9, 9, -9), (9, -9, 9, 9), (9, 9, -9, 9), (-9, 9, -9, -9)),
    Grid(-9, -9, 18, 1, 1),
    Pose(0, 0, 0),
)
STEP_S = 0.25


def trial(seed: int, left: float, heading: float) -> TrialRecord:
    rng = np.random.default_rng(seed)
    commands = np.repeat(rng.uniform([-0.2, -0.4], [0.7, 0.4], (20, 2)), 3, axis=0)
    poses = [np.array([0.1, 0.2, 0.5])]
    for move, turn in commands:
        length = move * ROBOT.drive.speed * STEP_S
        angle = 2 * turn * ROBOT.drive.speed * STEP_S / ROBOT.drive.track
        x, y, at = poses[-1]
        for _ in range(10):
            x, y = x + length / 10 * np.cos(at + angle / 20), y + length / 10 * np.sin(at + angle / 20)
            at += angle / 10
        poses.append(np.array([x, y, at]))
    body = np.array(poses)
    seen = body + np.stack(
        [-left * np.sin(body[:, 2]), left * np.cos(body[:, 2]), np.full(61, heading)], axis=1
    )
    return TrialRecord(
        start=(0.1, 0.2, 0.5), step_s=STEP_S, commands=commands, readings=np.empty((60, 0)),
        stalled=np.zeros(60, np.bool_), cells=(), wheels=np.empty((0, 2)),
        poses=seen + rng.normal(0, [0.0005, 0.0005, 0.005], seen.shape), genome="", number=seed, purpose="motion",
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("left", "heading"), [(0.008, -0.06), (0.0, 0.0)])
def test_marker_is_found_and_taken_from_the_poses(left: float, heading: float) -> None:
    trials = [trial(seed, left, heading) for seed in (1, 2)]
    marker = fit_marker(trials, ROBOT, PLANE)
    assert marker is not None
    assert marker.left == pytest.approx(left, abs=5e-4)
    assert marker.heading == pytest.approx(heading, abs=4e-3)
    body, plain = marker.taken_from(trials[0]), trial(1, 0.0, 0.0)
    assert body.poses == pytest.approx(plain.poses, abs=4e-3)
    assert bool(marker.note) == bool(left)


def test_marker_is_unknown_without_free_motion() -> None:
    standing = trial(3, 0.0, 0.0)
    assert fit_marker([replace(standing, poses=np.empty((0, 3)))], ROBOT, PLANE) is None
    box = replace(PLANE, walls=((0.1, 0.17, 0.2, 0.17), (0.1, 0.23, 0.2, 0.23)))
    pressed = replace(standing, poses=np.tile([0.15, 0.2, 0.0], (61, 1)))
    assert fit_marker([pressed], ROBOT, box) is None


def test_poses_of_our_simulators_have_no_marker() -> None:
    assert is_under_camera("scribbler:/dev/rfcomm0", "REAL", "track")
    assert is_under_camera("logs/run.csv", "SIM", "track")
    assert not is_under_camera("twin:worn.toml", "TWIN", "track")
    assert not is_under_camera("sim", "SIM", "track")
    assert not is_under_camera("scribbler:/dev/rfcomm0", "REAL", "encoders")
