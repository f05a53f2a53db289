"""Fits of drives to logs that a plain simulation of two wheels wrote, with numbers that are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from realitygap.calibration import MotionLogFit, fit_motion_log, fit_motion_logs, motion_log
from realitygap.world import RobotModel, load_robot

STEP_S = 0.1
ROBOT = load_robot("khepera").with_numbers({"drive.lag": 0.0})
SPEED, TRACK = ROBOT.drive.speed, ROBOT.drive.track


def commands_of(rng: np.random.Generator, n: int) -> np.ndarray:
    """Straight runs, arcs and turns, each for a second."""
    kinds = np.array(
        [[1, 1], [0.6, 0.9], [0.9, 0.6], [0.5, -0.5], [-0.5, 0.5], [0.3, 0.3], [-0.8, -0.8], [0.05, 0.05]]
    )
    return np.repeat(kinds[rng.integers(len(kinds), size=n // 10 + 1)], 10, axis=0)[:n]


def drive(
    commands: np.ndarray,
    rng: np.random.Generator,
    *,
    track: float = TRACK,
    gains: tuple[float, float] = (1.0, 1.0),
    dead_band: float = 0.0,
    turn_noise: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Return poses and distances of the wheels at each time, by small arcs."""
    poses, wheels = [np.array([0.3, -0.2, 2.0])], [np.zeros(2)]
    for asked in commands[:-1]:
        share = np.sign(asked) * np.maximum(np.abs(asked) - dead_band, 0.0) / (1 - dead_band)
        left, right = share * np.array(gains) * SPEED * STEP_S
        length, turn = (left + right) / 2, (right - left) / track
        turn += turn_noise * math.sqrt((abs(left) + abs(right)) / 2) * rng.standard_normal()
        x, y, heading = poses[-1]
        for _ in range(10):
            x += length / 10 * math.cos(heading + turn / 20)
            y += length / 10 * math.sin(heading + turn / 20)
            heading += turn / 10
        poses.append(np.array([x, y, heading]))
        wheels.append(wheels[-1] + [left, right])
    return np.array(poses), np.array(wheels)


def of(fit: MotionLogFit, name: str) -> tuple[float, float, float]:
    row = {each.name: each for each in fit.fitted}[name]
    return row.estimate, row.low, row.high


@pytest.mark.slow
@pytest.mark.parametrize("seen", [2, 3])
def test_log_with_poses_corrects_a_wrong_track(seen: int) -> None:
    rng = np.random.default_rng(1)
    commands, time = commands_of(rng, 240), np.arange(240) * STEP_S
    poses, _ = drive(commands, rng, track=1.1 * TRACK, gains=(0.95, 0.97), turn_noise=0.05)
    poses = poses + rng.normal(0, [0.001, 0.001, 0.01], poses.shape)
    poses[rng.random(240) < 0.2] = np.nan
    fit = fit_motion_log(time, commands, ROBOT, poses=poses[:, :seen])
    assert fit.held_out is not None
    assert fit.recommended == "fitted"
    assert fit.held_out.fitted < 0.7 * fit.held_out.nominal
    assert of(fit, "drive.gain")[0] == pytest.approx(0.96, rel=0.02)
    assert fit.recommended_numbers["drive.track"] == pytest.approx(1.1 * TRACK, rel=0.03)


@pytest.mark.slow
def test_short_noisy_log_leaves_right_numbers_nearly_alone() -> None:
    """The robot is as its file says, and a camera errs by 5 mm: the mean fit of 3 logs is not much worse."""
    errors = []
    for seed in range(3):
        rng = np.random.default_rng([2, seed])
        commands, time = commands_of(rng, 160), np.arange(160) * STEP_S
        poses, _ = drive(commands, rng, turn_noise=0.2)
        fit = fit_motion_log(time, commands, ROBOT, poses=poses[:, :2] + rng.normal(0, 0.005, (160, 2)))
        assert fit.held_out is not None
        assert abs(of(fit, "drive.track")[0] / TRACK - 1) < 0.04
        assert fit.recommended == ("fitted" if fit.held_out.fitted < fit.held_out.nominal else "nominal")
        errors.append((fit.held_out.fitted, fit.held_out.nominal))
    fitted, nominal = np.mean(errors, axis=0)
    assert fitted < 1.5 * nominal


@pytest.mark.slow
def test_encoders_show_a_soft_dead_band_and_speeds_within_one_percent() -> None:
    rng = np.random.default_rng(3)
    commands = np.repeat(rng.permutation(np.linspace(-0.7, 0.7, 57)), 5)[:, None] * np.ones(2)
    time = np.arange(len(commands)) * STEP_S
    _, wheels = drive(commands, rng, gains=(1.03, 0.98), dead_band=0.085)
    seen = wheels + rng.normal(0, 2e-5, wheels.shape)
    fit = fit_motion_log(time, commands, ROBOT, encoders=seen)
    assert of(fit, "drive.soft_dead_band")[0] == pytest.approx(0.085, abs=0.003)
    assert fit.held_out is not None
    assert fit.held_out.more["as a share of full speed (1)"][1] < 0.01
    assert fit.held_out.fitted < 0.2 * fit.held_out.nominal
    assert "drive.track" not in {each.name for each in fit.fitted}


def test_wrong_logs_are_refused_with_one_message() -> None:
    time, commands = np.arange(40) * STEP_S, np.ones((40, 2))
    poses = np.cumsum(np.ones((40, 2)), axis=0)

    def refused(message: str, robot: RobotModel = ROBOT, **changed: object) -> None:
        given = {"time_s": time, "commands": commands, "poses": poses, **changed}
        with pytest.raises(ValueError, match=message):
            fit_motion_log(robot=robot, **given)  # type: ignore[arg-type]

    refused("at least 10 times", time_s=time[:5])
    refused("expected ascending times", time_s=np.zeros(40))
    refused(r"commands has shape \(40, 3\), expected \(40, 2\)", commands=np.ones((40, 3)))
    refused(
        "commands\\[3, 0\\] is nan",
        commands=np.where(np.arange(40)[:, None] == 3, np.nan, 1.0) * np.ones(2),
    )
    refused("All commands are 0", commands=np.zeros((40, 2)))
    refused(r"poses has shape \(39, 2\), expected \(40, 2\) or \(40, 3\)", poses=poses[:39])
    refused("were recorded at 0 times", poses=None)
    refused("hold_out is 1, expected", hold_out=1.0)
    refused("The held-out part of the log has 4 rows", hold_out=0.1)


def rough_log(seed: int, n: int = 300) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, commands, and true poses of a robot as its file has it."""
    rng = np.random.default_rng(seed)
    commands = np.repeat(rng.uniform(-0.3, 0.8, (n // 6 + 1, 2)), 6, axis=0)[:n]
    return np.arange(n) * STEP_S, commands, drive(commands, rng)[0]


def seen_beside(poses: np.ndarray, left: float, heading: float, rng: np.random.Generator) -> np.ndarray:
    """Poses of a marker to the left of the axle's middle, turned by an angle, under a camera that errs by 0.5 mm."""
    x, y, angle = poses.T
    seen = np.stack([x - left * np.sin(angle), y + left * np.cos(angle), angle + heading], axis=1)
    return seen + rng.normal(0, [0.0005, 0.0005, 0.005], seen.shape)


@pytest.mark.slow
@pytest.mark.parametrize("left", [-0.009, 0.0, 0.02])
def test_marker_beside_the_axle_is_no_asymmetry(left: float) -> None:
    """The truth is in each 90 % interval of four numbers at once in half of such logs; here within twice that."""
    time, commands, poses = rough_log(11)
    seen = seen_beside(poses, left, 0.1, np.random.default_rng(12))
    fit = fit_motion_log(time, commands, ROBOT, poses=seen, hold_out=0.0)
    truth = {
        "drive.gain": 1.0, "drive.asymmetry": 0.0, "drive.track": TRACK, "camera.left": left, "camera.heading": 0.1,
    }  # fmt: skip
    for name, value in truth.items():
        estimate, low, high = of(fit, name)
        assert 1.5 * low - 0.5 * high - 1e-4 < value < 1.5 * high - 0.5 * low + 1e-4, name
        assert low <= estimate <= high
    assert not fit.misspecified


@pytest.mark.slow
def test_late_poses_are_a_clock_and_no_lag() -> None:
    time, commands, poses = rough_log(21)
    seen = np.stack([np.interp(time - 0.37, time, column) for column in poses.T], axis=1)
    seen += np.random.default_rng(22).normal(0, [0.0005, 0.0005, 0.005], seen.shape)
    fit = fit_motion_log(time, commands, ROBOT, poses=seen)
    assert of(fit, "camera.delay")[0] == pytest.approx(0.37 - ROBOT.drive.delay, abs=0.02)
    assert of(fit, "drive.lag")[0] < 0.02
    assert fit.held_out is not None
    assert fit.held_out.fitted < 0.01


@pytest.mark.slow
def test_log_without_noise_gives_the_numbers_that_made_it() -> None:
    time, commands, poses = rough_log(31)
    fit = fit_motion_log(time, commands, ROBOT, poses=poses)
    assert of(fit, "drive.track")[0] == pytest.approx(TRACK, rel=2e-3)
    assert of(fit, "drive.gain")[0] == pytest.approx(1.0, abs=2e-3)
    assert fit.held_out is not None
    assert fit.held_out.nominal < 1e-3
    assert fit.held_out.fitted < 2e-3


@pytest.mark.slow
def test_poses_with_encoders_alone_calibrate_odometry() -> None:
    rng = np.random.default_rng(41)
    time, commands, _ = rough_log(42)
    poses, wheels = drive(commands, rng, track=1.05 * TRACK)
    encoders = wheels * [1.02, 1.01]
    fit = fit_motion_log(time, None, ROBOT, poses=seen_beside(poses, 0.004, 0.0, rng), encoders=encoders)
    assert of(fit, "encoder.gain")[0] == pytest.approx(1.015, abs=0.004)
    assert of(fit, "drive.track")[0] == pytest.approx(1.05 * TRACK, rel=0.01)
    assert "drive.gain_left" not in fit.numbers
    assert fit.recommended == "fitted"


@pytest.mark.slow
def test_cameras_of_several_logs_differ_and_the_robot_is_one() -> None:
    rng = np.random.default_rng(51)
    logs = []
    for left, heading in ((0.005, 0.05), (-0.003, -0.02)):
        time, commands, _ = rough_log(int(1000 * abs(left)), 240)
        poses = drive(commands, rng, track=1.06 * TRACK)[0]
        logs.append(motion_log(time, commands, poses=seen_beside(poses, left, heading, rng)))
    fit = fit_motion_logs(logs, ROBOT)
    assert of(fit, "drive.track")[0] == pytest.approx(1.06 * TRACK, rel=0.01)
    assert of(fit, "camera.1.left")[0] == pytest.approx(0.005, abs=0.001)
    assert of(fit, "camera.2.left")[0] == pytest.approx(-0.003, abs=0.001)
    assert of(fit, "camera.2.heading")[0] == pytest.approx(-0.02, abs=0.01)


ONE_SIDED = {
    "straight on": lambda rng, k: rng.uniform(0.2, 1, (k, 1)) * [1, 1],
    "one speed": lambda rng, k: np.full((k, 2), 0.5),
    "one circle": lambda rng, k: np.tile([0.4, 0.6], (k, 1)),
    "circles of one side": lambda rng, k: rng.uniform(0.4, 1, (k, 1)) * [0.6, 0.9],
    "turns in place": lambda rng, k: rng.choice([-0.5, 0.5], (k, 1)) * [-1, 1],
}
"""Logs that show some parameters only together."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ONE_SIDED)
def test_what_a_one_sided_log_does_not_show_stays_as_in_the_file(kind: str) -> None:
    """Predictions of other motions are at most a tenth, or 2 mm in 5 s, worse than by the robot file's numbers."""
    for seed, wrong in enumerate(({"track": 1.08 * TRACK}, {"gains": (0.97, 1.03)}, {"dead_band": 0.06}, {})):
        rng = np.random.default_rng([61, seed])
        commands = np.repeat(ONE_SIDED[kind](rng, 50), 6, axis=0)
        poses, _ = drive(commands, rng, **wrong)
        fit = fit_motion_log(
            np.arange(300) * STEP_S, commands, ROBOT, poses=seen_beside(poses, 0.003, 0.0, rng)
        )
        numbers = ROBOT.with_numbers(fit.recommended_numbers).drive
        errors = []
        for _ in range(12):
            other = np.repeat(rng.uniform(-1, 1, (9, 2)), 6, axis=0)
            true = drive(other, rng, **wrong)[0][-1, :2]
            fitted = drive(
                other, rng, track=numbers.track, gains=(numbers.gain_left, numbers.gain_right),
                dead_band=numbers.soft_dead_band,
            )[0][-1, :2]  # fmt: skip
            errors.append((math.dist(true, drive(other, rng)[0][-1, :2]), math.dist(true, fitted)))
        nominal, fitted = np.mean(errors, axis=0)
        assert fitted < 1.1 * nominal + 0.002, wrong
