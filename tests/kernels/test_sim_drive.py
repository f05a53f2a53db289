"""The drive of `sim`: arcs, lag, delay, and noise that does not depend on the size of steps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from realitygap.robots.twin._motors import NOMINAL, TICK_S, SpeedSteps
from tests.kernels.sim_cases import OUTLINE, SCRIBBLER, drive_robots, outline, room

pytestmark = pytest.mark.slow

FIELD: dict[str, Any] = {
    **SCRIBBLER,
    **outline(OUTLINE),
    **room(40.0, 40.0),
    "arena.start.x": 20.0,
    "arena.start.y": 20.0,
}
SPEED, TRACK = 0.15, 0.153


def test_a_constant_command_drives_the_arc_of_its_wheels() -> None:
    driven = drive_robots(FIELD, np.tile([0.5, 0.2], (9, 1)))
    left, right = 0.3 * SPEED, 0.7 * SPEED
    time = np.arange(10) * 0.5
    turn = (right - left) / TRACK
    reach = (left + right) / 2 / turn
    np.testing.assert_allclose(driven.poses[:, 0, 0] - 20, reach * np.sin(turn * time), atol=1e-12)
    np.testing.assert_allclose(driven.poses[:, 0, 1] - 20, reach * (1 - np.cos(turn * time)), atol=1e-12)
    np.testing.assert_allclose(driven.wheels[:, 0], np.stack([left * time, right * time], 1), atol=1e-12)


def test_a_turn_on_the_spot_moves_a_body_around_its_axle() -> None:
    driven = drive_robots({**FIELD, "drive.axle": 0.05}, np.array([[0.0, 0.3]]))
    x, y, heading = driven.poses[1, 0]
    assert heading == pytest.approx(2 * 0.3 * SPEED * 0.5 / TRACK)
    assert (x, y) == pytest.approx((20.05 - 0.05 * math.cos(heading), 20 - 0.05 * math.sin(heading)))


@pytest.mark.parametrize("step_s", [0.5, 0.25, 0.0625])
def test_wheels_near_their_speed_exponentially_at_any_step(step_s: float) -> None:
    n = round(2 / step_s)
    driven = drive_robots({**FIELD, "drive.lag": 0.3}, np.tile([1.0, 0.0], (n, 1)), step_s=step_s)
    assert driven.poses[-1, 0, 0] - 20 == pytest.approx(
        SPEED * (2 - 0.3 * (1 - math.exp(-2 / 0.3))), abs=1e-12
    )


@pytest.mark.parametrize("lag", [0.0, 0.05])
def test_a_robot_that_stands_is_not_shaken(lag: float) -> None:
    """The tail of a lag never ends, but a second after a command to stop nothing moves any more."""
    numbers = {**FIELD, "drive.lag": lag, "drive.heading_noise_per_s": 0.1, "drive.travel_noise_per_s": 0.02}
    driven = drive_robots(numbers, np.array([[0.5, 0.1]] * 3 + [[0.0, 0.0]] * 6), noisy=True)
    headings = driven.poses[:, 0, 2]
    assert np.ptp(headings[:4]) > 0.1
    assert np.ptp(headings[5:]) < 1e-4


@pytest.mark.parametrize(("step_s", "delay_steps"), [(0.5, 0), (0.25, 1), (0.0625, 4)])
def test_an_old_command_goes_on_until_the_new_one_arrives(step_s: float, delay_steps: int) -> None:
    """One second ahead, one second back, each 0.3 s late."""
    n = round(1 / step_s)
    commands = np.array([[1.0, 0.0]] * n + [[-1.0, 0.0]] * n)
    driven = drive_robots(
        {**FIELD, "drive.delay": 0.3}, commands, step_s=step_s, late=True, delay_steps=delay_steps
    )
    assert driven.poses[n, 0, 0] - 20 == pytest.approx(SPEED * 0.7, abs=1e-9)
    assert driven.poses[-1, 0, 0] - 20 == pytest.approx(SPEED * (0.7 + 0.3 - 0.7), abs=1e-9)


def risen(commands: np.ndarray, step_s: float, rise: float, delay: float, lag: float) -> np.ndarray:
    """(t + 1, 2) way of both wheels [m], a tenth of a millisecond at a time."""
    tick, level, asked, speed = 1e-4, 0.0, (0.0, 0.0), np.zeros(2)
    keeps = math.exp(-tick / lag) if lag else 0.0
    ways, way = [(0.0, 0.0)], np.zeros(2)
    n, late = round(step_s / tick), round(delay / tick)
    heard = {step * n + late: (move - turn, move + turn) for step, (move, turn) in enumerate(commands)}
    for k in range(len(commands) * n):
        if k in heard:
            if any(new * old < 0 for new, old in zip(heard[k], asked, strict=True)):
                level = 0.0
            asked = heard[k]
        faster = max(map(abs, asked))
        before = min(level, faster)
        level = min(before + (tick / rise if rise else math.inf), faster)
        target = SPEED * np.array(asked) * ((before + level) / 2 / faster if faster else 0.0)
        way += tick * target - lag * (1 - keeps) * (target - speed)
        speed = target + keeps * (speed - target)
        if (k + 1) % n == 0:
            ways.append((way[0], way[1]))
    return np.array(ways)


@pytest.mark.parametrize(
    ("rise", "delay", "lag"),
    [
        (0.24, 0.0, 0.0),
        (0.24, 0.1, 0.0),
        (0.9, 0.0, 0.0),
        (0.9, 0.3, 0.0),
        (0.24, 0.1, 0.06),
        (0.5, 0.3, 0.4),
        (0.02, 0.5, 0.2),
    ],
)
@pytest.mark.parametrize("step_s", [0.5, 0.25])
def test_speeds_rise_evenly_and_begin_anew_where_a_wheel_turns_the_other_way(
    rise: float, delay: float, lag: float, step_s: float
) -> None:
    commands = np.array(
        [
            [1.0, 0.0],
            [1.0, 0.0],
            [0.4, 0.1],
            [0.9, -0.1],
            [0.2, 0.5],
            [-0.5, 0.0],
            [0.0, 0.0],
            [0.6, 0.3],
            [0.6, 0.3],
        ]
    )
    late: dict[str, Any] = {"late": True, "delay_steps": 2} if delay else {}
    numbers = {**FIELD, "drive.rise": rise, "drive.delay": delay, "drive.lag": lag}
    driven = drive_robots(numbers, commands, step_s=step_s, **late)
    np.testing.assert_allclose(driven.wheels[:, 0], risen(commands, step_s, rise, delay, lag), atol=2e-6)


def test_a_command_of_the_other_way_begins_anew_however_late_each_comes() -> None:
    """To and fro, each command 0.45 to 0.55 s late: none lasts more than 0.55 s of a step, as its speed rises."""
    numbers = {**FIELD, "drive.rise": 0.9, "drive.delay": 0.5, "drive.delay_jitter": 0.05}
    commands = np.array([[1.0, 0.0], [-1.0, 0.0]] * 20)
    driven = drive_robots(numbers, commands, late=True, delay_steps=2, noisy=True, n=64)
    ways = np.abs(np.diff(driven.wheels, axis=0))
    assert ways.max() <= SPEED * 0.55**2 / (2 * 0.9)
    assert ways[2:].min() > 0.0


def test_an_s2_of_speeds_that_rise_goes_as_far_as_its_firmware_has_it() -> None:
    """Commands at random, each by itself: a step of the firmware's speed is 12.5 mm/s, one more each 20 ms."""
    rng = np.random.default_rng(1)
    speeds = rng.choice([-1.0, -0.5, 0.5, 1.0], (200, 2))
    commands = np.stack([speeds.mean(axis=1), (speeds[:, 1] - speeds[:, 0]) / 2], axis=1)
    regulator, ways = SpeedSteps(), []
    for left, right in speeds:
        regulator.drive(left, right)
        ways.append(sum(np.array(regulator.tick()) * NOMINAL * TICK_S for _ in range(25)))
    driven = drive_robots({**FIELD, "drive.rise": 12 * TICK_S}, commands, levels=12, lowest_level=2)
    off = np.diff(driven.wheels[:, 0], axis=0) - np.array(ways)
    at_once = np.diff(
        drive_robots(FIELD, commands, levels=12, lowest_level=2).wheels[:, 0], axis=0
    ) - np.array(ways)
    assert np.abs(off).max() < 0.0025
    assert np.abs(at_once).max() > 0.015


def test_gain_and_dead_band_act_on_each_wheel() -> None:
    one = drive_robots(
        {**FIELD, "drive.gain_left": 0.9, "drive.bias_right": 0.01}, np.array([[1.0, 0.0], [0.0, 0.0]])
    )
    np.testing.assert_allclose(one.wheels[1:, 0], [[0.0675, 0.08]] * 2, atol=1e-12)
    dead = drive_robots({**FIELD, "drive.dead_band": 0.3}, np.array([[0.2, 0.0], [0.4, 0.0]]))
    np.testing.assert_allclose(dead.wheels[1:, 0, 0], [0.0, 0.03], atol=1e-12)
    back = drive_robots(FIELD, np.array([[1.0, 0.0], [0.0, 0.2]]), ahead=-1)
    assert back.poses[1, 0, 0] == pytest.approx(20 - 0.075)
    assert back.poses[2, 0, 2] > 0
    slow = drive_robots({**FIELD, "drive.battery_sag": 0.1, "drive.slip": 0.2}, np.tile([1.0, 0.0], (3, 1)))
    np.testing.assert_allclose(np.diff(slow.wheels[:, 0, 0]), [0.075, 0.075 * 0.95, 0.075 * 0.9], atol=1e-12)
    np.testing.assert_allclose(slow.poses[:, 0, 0] - 20, 0.8 * slow.wheels[:, 0, 0], atol=1e-12)


def test_wheel_stands_in_soft_dead_band_and_starts_from_zero_beyond_it() -> None:
    commands = np.array([[share, 0.0] for share in (0.05, 0.1, 0.11, 0.55, 1.0, -0.55, -0.1, 0.0)])
    wheels = drive_robots({**FIELD, "drive.soft_dead_band": 0.1}, commands).wheels[:, 0]
    shares = np.diff(wheels, axis=0) / 0.5 / SPEED
    np.testing.assert_allclose(shares, np.array([[0, 0, 0.01 / 0.9, 0.5, 1, -0.5, 0, 0]] * 2).T, atol=1e-8)
    whole = drive_robots({**FIELD, "drive.soft_dead_band": 1.0}, commands).wheels
    assert np.abs(whole).max() == 0


def test_robot_without_soft_dead_band_drives_the_same_to_the_bit_among_others_with_it() -> None:
    commands = np.random.default_rng(3).uniform(-1, 1, (20, 2))
    soft = np.where(np.arange(8) % 2, 0.1, 0.0)
    some = drive_robots({**FIELD, "drive.soft_dead_band": soft}, commands, n=8).poses
    none = drive_robots(FIELD, commands, n=8).poses
    assert (some[:, ::2] == none[:, ::2]).all()
    assert (some[-1, 1::2] != none[-1, 1::2]).any()


def test_only_speeds_that_exist_are_driven_the_slower_wheel_in_proportion() -> None:
    """Twelve of them, from the second on."""
    commands = np.array([[0.03, 0.0], [0.05, 0.0], [0.55, 0.0], [1.0, 0.0], [0.4, 0.14]])
    driven = drive_robots(FIELD, commands, levels=12, lowest_level=2)
    speeds = np.diff(driven.wheels[:, 0], axis=0) / 0.5 / SPEED
    np.testing.assert_allclose(speeds[:4, 0], [0, 2 / 12, 7 / 12, 1], atol=1e-12)
    np.testing.assert_allclose(speeds[4], [6 / 12 * 0.26 / 0.54, 6 / 12], atol=1e-12)


@pytest.mark.parametrize("step_s", [0.5, 0.25, 0.125])
@pytest.mark.parametrize("unit", ["m", "s"])
def test_noise_has_its_stated_variance_at_any_step(unit: str, step_s: float) -> None:
    """Of 640 robots over 2 s; the limits are four standard errors: one test in 4,000 would fail by chance."""
    n, seconds = 64, 2.0
    spread = {f"drive.travel_noise_per_{unit}": 0.02, f"drive.heading_noise_per_{unit}": 0.05}
    amount = seconds * SPEED * 0.8 if unit == "m" else seconds
    length, turned = [], []
    for first in range(0, 640, n):
        driven = drive_robots(
            {**FIELD, **spread}, np.tile([0.8, 0.0], (round(seconds / step_s), 1)), step_s=step_s,
            noisy=True, first=first, n=n, key=7,
        )  # fmt: skip
        steps = np.diff(driven.poses[:, :, :2], axis=0)
        length.append(np.hypot(steps[..., 0], steps[..., 1]).sum(0))
        turned.append(driven.poses[-1, :, 2])
    n = 640
    for values, mean, sd in (
        (np.concatenate(length), seconds * SPEED * 0.8, 0.02 * math.sqrt(amount)),
        (np.concatenate(turned), 0.0, 0.05 * math.sqrt(amount)),
    ):
        assert abs(values.mean() - mean) < 4 * sd / math.sqrt(n)
        assert abs(values.std() / sd - 1) < 4 / math.sqrt(2 * n)


def test_a_late_command_comes_after_a_delay_that_is_drawn_evenly() -> None:
    numbers = {**FIELD, "drive.delay": 0.2, "drive.delay_jitter": 0.1}
    driven = drive_robots(numbers, np.array([[1.0, 0.0]]), late=True, noisy=True, n=64)
    late = 0.5 - driven.wheels[1, :, 0] / SPEED
    assert 0.1 <= late.min() < 0.13
    assert 0.27 < late.max() <= 0.3
    assert late.mean() == pytest.approx(0.2, abs=4 * 0.2 / math.sqrt(12 * 64))
