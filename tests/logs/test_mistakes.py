"""The usual mistakes in logs are named, and good logs have none."""

import numpy as np
import pytest

from realitygap.logs import Log, diagnose
from realitygap.logs._clock_offset import clock_offset
from tests.logs.made import SPEED, STEP_S, TRACK, drive

NOTHING = np.empty((0, 2))


def kinds(commands, poses, *, raw=None, track=TRACK):
    log = Log("", 0.0, STEP_S, commands, poses, NOTHING, NOTHING, poses[:, 2] if raw is None else raw)
    return [mistake.kind for mistake in diagnose(log, SPEED, track).mistakes]


@pytest.mark.slow
def test_mistakes_are_named_one_by_one():
    commands, poses = drive(400)
    degrees = np.degrees(poses[:, 2])
    wrapped = (degrees + 180) % 360 - 180
    late, seen_late = drive(400, late=12)
    cases = {
        "": (commands, poses),
        "swapped": (commands[:, ::-1], poses),
        "reversed": (-commands, poses),
        "left reversed": (commands * [-1, 1], poses),
        "right reversed": (commands * [1, -1], poses),
        "swapped, left reversed": (commands[:, ::-1] * [-1, 1], poses),
        "swapped and reversed": (-commands[:, ::-1], poses),
        "millimeters": (commands, poses * [1000, 1000, 1]),
        "centimeters": (commands * 100, poses),
        "inches": (commands, poses * [1 / 0.0254, 1 / 0.0254, 1]),
        "unit": (commands * 5432, poses),
        "clockwise": (commands, poses * [1, 1, -1]),
        "heading offset": (commands, poses + np.array([0, 0, np.pi / 2])),
        "clock": (late, seen_late),
    }
    for kind, (told, seen) in cases.items():
        assert kinds(told, seen) == ([kind] if kind else []), kind
    assert kinds(commands, poses, track=TRACK / 2) == ["half track"]
    assert kinds(commands, poses, track=2 * TRACK) == ["double track"]
    assert kinds(commands, np.column_stack([poses[:, :2], np.unwrap(wrapped)]), raw=wrapped) == ["degrees"]


def test_logs_without_headings_show_as_much_as_a_path_can():
    commands, poses = drive(400)
    path = poses * [1, 1, np.nan]
    assert kinds(commands, path) == []
    assert kinds(commands[:, ::-1], path) == ["swapped or reversed"]
    assert kinds(-commands, path) == ["swapped or reversed"]
    assert kinds(commands, path, track=TRACK / 2) == ["half track"]
    assert kinds(commands, path * 1000) == ["millimeters"]


@pytest.mark.slow
def test_good_logs_have_no_mistakes_whatever_their_seed():
    """60 logs with noise of 1 to 5 mm; none may be blamed."""
    for seed in range(60):
        commands, poses = drive(300, seed=seed, noise=0.001 * (1 + seed % 5), late=seed % 4)
        assert kinds(commands, poses) == [], seed


@pytest.mark.filterwarnings("error")
def test_motion_without_variety_shows_nothing_and_divides_by_nothing():
    """A heading that never changes made a division by zero. Each column stands still here, in turn and together."""
    n = 100
    straight = np.column_stack([0.01 * np.arange(n + 1), np.zeros(n + 1), np.zeros(n + 1)])
    arc = drive(n, held=n, noise=0)[1]
    told = {
        "straight": np.full((n, 2), 0.3),
        "arc": np.tile([0.2, 0.4], (n, 1)),
        "in place": np.tile([-0.3, 0.3], (n, 1)),
        "one wheel": np.tile([0.0, 0.3], (n, 1)),
        "still": np.zeros((n, 2)),
        "driven": drive(n)[0],
    }
    seen = {
        "straight": straight,
        "still": 0 * straight,
        "arc": arc,
        "no heading": arc * [1, 1, 0],
        "turning": arc * [0, 0, 1],
        "one axis": arc * [0, 1, 1],
    }
    for commands in told.values():
        for poses in seen.values():
            for rows in (n, 24, 9, 2):
                diagnose(
                    Log(
                        "",
                        0.0,
                        STEP_S,
                        commands[:rows],
                        poses[: rows + 1],
                        NOTHING,
                        NOTHING,
                        poses[: rows + 1, 2],
                    ),
                    SPEED,
                    TRACK,
                )


def test_heading_that_never_changes_is_a_mistake_if_the_path_turns():
    commands, poses = drive(400)
    assert kinds(commands, poses * [1, 1, 0]) == ["constant heading"]
    slight, arc = np.tile([0.15, 0.2], (24, 1)), drive(24, held=24, noise=0)[1] * [1, 0.02, 0]
    assert kinds(slight, arc) == ["constant heading"]
    for noise in (0, 0.001, 0.01):  # one of 100 by chance is no reason to blame it
        blamed = 0
        for seed in range(20):
            straight = np.zeros((401, 3))
            straight[:, 0] = 0.01 * np.arange(401)
            straight[:, :2] += np.random.default_rng(seed).normal(0, noise, (401, 2))
            blamed += kinds(np.full((400, 2), 0.1 / SPEED), straight) != []
        assert blamed <= 1, noise


def test_increments_that_are_read_as_counters_are_a_mistake():
    commands, poses = drive(200)
    steps = np.concatenate([np.zeros((1, 2)), commands * SPEED * STEP_S])
    for wheels, expected in ((steps, ["increments"]), (np.cumsum(steps, 0), [])):
        log = Log("", 0.0, STEP_S, commands, poses, wheels, NOTHING, poses[:, 2])
        assert [mistake.kind for mistake in diagnose(log, SPEED, TRACK).mistakes] == expected


def test_a_robot_that_stands_shows_nothing():
    commands, poses = drive(100)
    assert kinds(0 * commands, poses) == []
    assert kinds(commands, np.empty((0, 3)), raw=np.empty(0)) == []


@pytest.mark.slow
def test_intervals_of_clock_offsets_hold_the_true_one():
    """90 % intervals in 40 logs: fewer than 29 hold the truth by chance once in 1000 times."""
    held = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        told = np.repeat(rng.normal(0, 1, (60, 2)), 8, 0)
        at = np.arange(480) - 3.4
        seen = np.stack([np.interp(at, np.arange(480), told[:, k]) for k in range(2)], 1)
        offset = clock_offset(told, seen + rng.normal(0, 1.0, seen.shape), 0.1, seed=seed)
        assert offset is not None
        assert offset.seconds == pytest.approx(0.34, abs=0.05)
        held += offset.low <= 0.34 <= offset.high
    assert held >= 29


def test_signals_that_have_nothing_in_common_have_no_offset():
    rng = np.random.default_rng(0)
    assert clock_offset(rng.normal(0, 1, (400, 2)), rng.normal(0, 1, (400, 2)), 0.1) is None
    assert clock_offset(np.zeros((400, 2)), np.zeros((400, 2)), 0.1) is None
