"""Encoders, the pose reckoned from them, and the stall of an S2, against plain references."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from realitygap.kernels.math.elementary import normal
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import encoders, stall
from tests.kernels.sim_rows import poses, random_words, row, rows
from tests.reference import senses as reference
from tests.reference.effort import cases


class Driven:
    """Wheels in lanes that are driven step by step, with encoders and reckoning."""

    def __init__(
        self, real: Any, *, gain: Any = (1.0, 1.0), noise: Any = 0.0, drift: Any = 0.0, axle: Any = 0.0
    ):
        self.real = real
        self.gain = rows(gain, real)
        self.noise, self.track, self.axle = row(noise, real), row(0.15, real), row(axle, real)
        self.drift = row(np.asarray(drift) / math.tau, real)
        self.wheels, self.before = rows([0.0, 0.0], real), rows([0.0, 0.0], real)
        self.counted, self.step_said = rows([0.0, 0.0], real), rows([0.0, 0.0], real)
        self.reckoned = rows([0.0, 0.0, 0.0], real)

    def drive(self, left: Any, right: Any, words: np.ndarray) -> None:
        self.wheels += rows([left, right], self.real)
        for k in range(2):
            encoders.read_encoder(
                self.wheels[k],
                self.before[k],
                self.gain[k],
                self.noise,
                words[k],
                self.counted[k],
                self.step_said[k],
            )
        encoders.reckon(
            self.step_said[0], self.step_said[1], self.track, self.axle, self.drift, self.reckoned
        )


@pytest.mark.parametrize(("real", "bound"), [(np.float64, 1e-12), (np.float32, 3e-5)])
def test_encoders_and_reckoning_equal_the_reference_with_other_numbers_in_each_lane(
    real: Any, bound: float
) -> None:
    rng = np.random.default_rng(1)
    gain = rng.uniform(0.9, 1.1, (2, LANES))
    noise, drift, axle = (
        rng.uniform(0, 0.02, LANES),
        rng.uniform(-0.2, 0.2, LANES),
        rng.uniform(-0.05, 0.05, LANES),
    )
    driven = Driven(real, gain=gain, noise=noise, drift=drift, axle=axle)
    lanes = [0, 5, LANES - 1]
    drawn: dict[int, list[float]] = {lane: [] for lane in lanes}
    plain = {
        lane: reference.Encoders(
            (gain[0, lane], gain[1, lane]),
            noise[lane],
            drift[lane],
            0.15,
            axle[lane],
            lambda lane=lane: drawn[lane].pop(0),
        )
        for lane in lanes
    }
    for _ in range(cases(60, 10)):
        left, right = rng.uniform(-0.1, 0.1, (2, LANES))
        words = random_words(rng, 2)
        driven.drive(left, right, words)
        for lane in lanes:
            drawn[lane] += [float(normal(words[k, lane], 0.0)) for k in range(2)]
            plain[lane].step(left[lane], right[lane])
    for lane in lanes:
        assert driven.counted[:, lane] == pytest.approx(plain[lane].counted, abs=bound)
        assert driven.reckoned[:2, lane] == pytest.approx(plain[lane].pose[:2], abs=bound)
        turn = driven.reckoned[2, lane] - plain[lane].pose[2] / math.tau
        assert turn - round(turn) == pytest.approx(0.0, abs=bound)


def test_encoder_noise_grows_with_the_way_and_not_with_the_number_of_steps() -> None:
    """2 m in 4, 20 or 200 steps, forth and back: variance noise^2 * way within four standard errors, 1 in 8,000
    by chance for each."""
    rng = np.random.default_rng(2)
    for n_steps in (4, 20, cases(200, 40)):
        repeats = cases(40, 4)
        said = []
        for _ in range(repeats):
            driven = Driven(np.float64, noise=0.01)
            for step in range(n_steps):
                way = 2.0 / n_steps * (1 if step % 2 == 0 else -1)
                driven.drive(way, way, random_words(rng, 2))
            said.append(driven.counted.copy())
        errors = np.concatenate(said, axis=None)
        variance = 0.01**2 * 2.0
        assert errors.mean() == pytest.approx(0.0, abs=4 * math.sqrt(variance / errors.size))
        assert errors.var() == pytest.approx(variance, abs=4 * variance * math.sqrt(2 / errors.size))


def test_drift_turns_the_reckoned_heading_by_the_meter_at_any_step() -> None:
    for n_steps in (1, 10, 100):
        driven = Driven(np.float64, drift=0.3)
        for _ in range(n_steps):
            driven.drive(1.5 / n_steps, 1.5 / n_steps, np.zeros((2, LANES), np.uint32))
        assert driven.reckoned[2, 0] * math.tau == pytest.approx(0.45)


def test_a_turn_on_the_spot_without_errors_goes_around_the_axle() -> None:
    driven = Driven(np.float64, axle=0.05)
    quarter = 0.15 * math.pi / 4  # of each wheel
    for _ in range(10):
        driven.drive(-quarter / 10, quarter / 10, np.zeros((2, LANES), np.uint32))
    assert driven.reckoned[:, 0] == pytest.approx([0.05, -0.05, 0.25])


def test_full_speed_is_one_as_an_input() -> None:
    value = row(0.0, np.float64)
    said = row(np.linspace(-0.2, 0.2, LANES), np.float64)
    encoders.as_input(said, row(0.15, np.float64), 0.5, value)
    assert value == pytest.approx(np.clip(said / 0.075, -1, 1))


class Stalling:
    """An S2's stall in lanes: poses and wheels are told step by step."""

    def __init__(self, *, idler: float = -0.08, share: float = 0.5, window: float = 1.6, step_s: float = 0.5):
        real = np.float64
        self.was, self.before = rows([0.0, 1.0, 0.0, 0.0], real), rows([0.0, 0.0], real)
        self.wheels, self.idled = rows([0.0, 0.0], real), rows([0.0, 0.0, 0.0], real)
        self.idler, self.share = row(idler, real), row(share, real)
        stall.prepare_stall(row(window, real), step_s, self.idled[2])
        self.plain = reference.Idler(idler, share, window, step_s, (0.0, 0.0, 0.0))

    def step(self, pose: tuple[float, float, float], left: float, right: float) -> bool:
        self.wheels += rows([left, right], np.float64)
        stalled = row(7.0, np.float64)
        stall.idler_stall(
            self.was, poses(*pose, np.float64), self.wheels, self.before, self.idler, self.share, self.idled[2],
            self.idled[0], self.idled[1], stalled,
        )  # fmt: skip
        assert set(stalled) == {float(self.plain.step(pose, left, right))}
        return bool(stalled[0])


def test_stall_equals_the_reference_on_random_drives() -> None:
    rng = np.random.default_rng(3)
    seen = set()
    for window in (0.0, 1.6):
        robot = Stalling(window=window)
        x, y, heading = 0.0, 0.0, 0.0
        for _ in range(cases(60, 15)):
            left, right = rng.choice([0.0, 0.05, 0.075, -0.075], 2)
            blocked = rng.random() < 0.6
            if not blocked:
                heading += (right - left) / 0.15
                x += (left + right) / 2 * math.cos(heading)
                y += (left + right) / 2 * math.sin(heading)
            seen.add(robot.step((x, y, heading), left, right))
    assert seen == {True, False}


def test_a_robot_stalls_in_front_of_a_wall_but_never_turning_on_the_spot_nor_standing() -> None:
    robot = Stalling()
    for step in range(1, 5):
        assert not robot.step((0.075 * step, 0.0, 0.0), 0.075, 0.075)
    slipping = [robot.step((0.3, 0.0, 0.0), 0.075, 0.075) for _ in range(6)]
    assert not slipping[0]  # the firmware looks at the last 1.6 s
    assert slipping[-1]
    assert not robot.step((0.3, 0.0, 0.0), 0.0, 0.0)
    turning = Stalling()
    assert not any(turning.step((0.0, 0.0, 0.5 * step), -0.04, 0.04) for step in range(1, 8))
    assert not any(turning.step((0.0, 0.0, 3.5), -0.04, 0.04) for step in range(8))  # not even when held
