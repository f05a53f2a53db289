"""Readings with the responses `linear` and `table`, fitted."""

import numpy as np
import pytest

from realitygap.calibration import Placement, fit_sensor, placements_of, sensor_plans
from realitygap.calibration.infrared._mixture import NearestReadings
from realitygap.platforms import SimPlatform, SimTarget
from realitygap.world import load_robot, paper_arena

ARENA = paper_arena()


def readings_of(robot, key=3):
    """Placements of all sensors of a robot in `sim` that differs from its file."""
    with SimTarget(SimPlatform(robot=robot), ARENA, key=key) as target:
        return target.carry_out(sensor_plans(ARENA, robot), "cells")


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.7, 1.0, 1.4])
def test_reach_and_noise_of_a_linear_sensor_are_found_again(factor):
    """Hundreds of readings fix the noise within 3 % and the reach far better; both limits are seven times that."""
    assumed = load_robot("turtlebot3-burger")
    true = assumed.with_numbers({"range.2.reach": factor * 1.0, "range.2.noise_uniform": 0.03})
    placements = placements_of(readings_of(true), assumed, ARENA)[2]
    fit = fit_sensor(assumed, 2, placements, np.random.default_rng(1))
    found = {each.name: each for each in fit.fitted}
    assert list(found) == ["range.2.reach", "range.2.noise_uniform", "range.2.noise_gain"]
    assert fit.numbers["range.2.reach"] == pytest.approx(factor, rel=0.02)
    assert fit.numbers["range.2.noise_uniform"] == pytest.approx(0.03, rel=0.2)
    assert fit.numbers["range.2.noise_gain"] < 0.01
    assert all(each.identified for each in fit.fitted)
    assert fit.p > 0.01
    assert fit.misfit < 0.05
    calibrated = assumed.with_numbers(fit.numbers).range[2]
    assert calibrated.reach == pytest.approx(factor, rel=0.02)


@pytest.mark.slow
def test_distances_of_a_table_are_found_again():
    """A table of 0 and 1 tells a distance only as well as the robot's places: it lies between two of them."""
    assumed = load_robot("scribbler-s2")
    rows = [sample.distance for sample in assumed.range[0].table]
    true = assumed.with_numbers({f"range.0.table.{k}.distance": 1.2 * far for k, far in enumerate(rows)})
    trials = readings_of(true)
    fit = fit_sensor(assumed, 0, placements_of(trials, assumed, ARENA)[0], np.random.default_rng(1))
    found = {each.name: each for each in fit.fitted}
    assert list(found) == ["range.0.table_distance", "range.0.noise_uniform", "range.0.noise_gain"]
    assert found["range.0.table_distance"].low <= 1.2 <= found["range.0.table_distance"].high
    assert [fit.numbers[f"range.0.table.{k}.distance"] for k in range(len(rows))] == pytest.approx(
        [found["range.0.table_distance"].estimate * far for far in rows]
    )
    assert all(np.ndim(drawn) == 1 for drawn in fit.draws.values())
    assumed.with_numbers(fit.numbers)


def test_curve_of_a_figure_is_that_of_drawn_readings():
    """Over 20 sets of parameters, without and with noise in proportion; the figure's bins are 0.002 wide."""
    rng = np.random.default_rng(7)
    sensor = load_robot("turtlebot3-burger").range[2]
    model = NearestReadings([Placement(np.array([0.5]), np.array([0.5]))], sensor)
    reaches, widths = rng.uniform(0.8, 1.2, 20), rng.uniform(0.001, 0.1, 20)
    gains = np.where(np.arange(20) % 2, rng.uniform(0.0, 0.2, 20), 0.0)
    far = np.linspace(0.0, 1.3, 14)
    ends = np.array([0.05, 0.95])
    mean, quantiles = model.quantiles(
        np.column_stack([reaches, widths, gains]), far[:, None], np.ones((14, 1)), ends
    )
    before = np.maximum(1.0 - far[:, None, None] / reaches[:, None], 0.0)  # (14, 20, 1)
    normal, even = rng.standard_normal((20, 10_000)), rng.uniform(-1.0, 1.0, (20, 10_000))
    drawn = np.clip(before * (1.0 + gains[:, None] * normal) + widths[:, None] * even, 0.0, 1.0)
    drawn = drawn.reshape(14, -1)
    # the mean of 200,000 readings is off by 0.0003, and the quantiles, where readings are rare, by up to 0.001
    assert mean == pytest.approx(drawn.mean(axis=1), abs=0.003)
    assert quantiles == pytest.approx(np.quantile(drawn, ends, axis=1), abs=0.006)


def test_readings_that_no_linear_sensor_makes_are_reported():
    rng = np.random.default_rng(4)
    robot = load_robot("turtlebot3-burger")
    far = np.repeat(np.linspace(0.1, 0.9, 9), 3)
    right = [Placement(np.full(5, at), np.clip(1 - at + rng.uniform(-0.01, 0.01, 50), 0, 1)) for at in far]
    wrong = [Placement(each.distances, each.readings**3) for each in right]
    fits = [fit_sensor(robot, 2, placements, rng) for placements in (right, wrong)]
    assert fits[0].misfit < 0.05
    assert fits[1].misfit > 0.1
