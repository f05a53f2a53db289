"""Fits of range sensors to tables that a simulated robot read along a wall."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from realitygap.calibration import TableFrame, choose_frame, fit_range_table, predict_range_table
from realitygap.calibration._range_table import JUMPS
from realitygap.platforms import SimPlatform, SimRobot
from realitygap.world import Pose, RobotModel, load_robot, paper_arena, robot_names

ROBOT = load_robot("khepera")
DISTANCES = np.arange(0.005, 0.045, 0.004)
BEARINGS = np.radians(np.arange(0, 360, 6))
ROBOTS = [name for name in robot_names() if "cardboard" not in name and load_robot(name).range]
"""The cardboard changes the body alone."""


def table_of(
    robot: RobotModel, sensors: tuple[int, ...], off: np.ndarray | float = 0.0
) -> dict[str, np.ndarray]:
    """Return a table of readings without noise, at distances that are off by some [m]."""
    return places_of(robot, sensors, DISTANCES, BEARINGS, off)


def places_of(
    robot: RobotModel,
    sensors: tuple[int, ...],
    distances: np.ndarray,
    bearings: np.ndarray,
    off: np.ndarray | float = 0.0,
    **frame: str,
) -> dict[str, np.ndarray]:
    sensor, i, j = (
        each.ravel()
        for each in np.meshgrid(sensors, np.arange(len(distances)), np.arange(len(bearings)), indexing="ij")
    )
    true = (distances + off)[i]
    readings = predict_range_table(sensor, true, bearings[j], robot, **frame)  # type: ignore[arg-type]
    return {"sensor": sensor, "distance_m": distances[i], "bearing_rad": bearings[j], "readings": readings}


def noisy(table: dict[str, np.ndarray], noise: float, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return table | {
        "readings": np.clip(table["readings"] + rng.normal(0, noise, len(table["readings"])), 0, 1)
    }


@pytest.mark.slow
def test_readings_along_a_wall_are_those_of_each_simulated_robot() -> None:
    walls = tuple(tuple(20.0 * np.sign(part - 0.1) for part in wall) for wall in paper_arena().walls)
    arena = replace(paper_arena(), walls=walls)
    rng = np.random.default_rng(1)
    for name in ROBOTS:
        robot = load_robot(name)
        always = {
            f"range.{k}.{kind}_most": 0.0 for k in range(len(robot.range)) for kind in ("drop", "outlier")
        }
        robot = robot.with_numbers(always)
        pulses = robot.range[0].response == "pulses"
        with SimRobot(SimPlatform(robot=robot, noise=False, precision="double"), arena) as simulated:
            for _ in range(8):
                distance = rng.uniform(0.1, 0.5) * robot.range[0].reach
                heading = rng.uniform(-math.pi, math.pi)
                simulated.reset(Pose(20.0 - robot.radius - distance, 0.3, heading))
                n = len(robot.range)
                expected = predict_range_table(
                    np.arange(n), np.full(n, distance + robot.radius), np.full(n, -heading), robot,
                    measured_from="origin",
                )  # fmt: skip
                assert simulated.readings[:n] == pytest.approx(expected, abs=0.051 if pulses else 1e-5), (
                    name,
                    heading,
                )


@pytest.mark.slow
def test_each_shipped_robot_is_recovered_from_its_own_readings() -> None:
    """The true sensor looks elsewhere and answers differently than the robot file says; readings have noise."""
    changes = {
        "ir": {"amplitude": 1.3, "decay": 1.2},
        "pulses": {"amplitude": 1.3, "decay": 0.8, "drop_at": 1.2},
        "lorentz": {"amplitude": 0.8, "half_width": 1.2},
        "linear": {"reach": 0.7},
        "table": {f"table.{j}.distance": 0.8 for j in range(3)},
    }
    checked = set()
    for name in ROBOTS:
        robot = load_robot(name)
        own = robot.range[0]
        key = own.model_dump_json(exclude={"x", "y", "direction"})
        if key in checked:  # the same sensors as another robot's
            continue
        checked.add(key)
        numbers = robot.centers()
        factors = {f"range.0.{each}": factor for each, factor in changes[own.response].items()}
        true = {each: factor * numbers[each] for each, factor in factors.items()}
        true["range.0.direction"] = numbers["range.0.direction"] + 0.15
        bearings = own.direction + np.radians(np.arange(-80, 81, 8))
        distances = own.reach * np.linspace(0.03, 0.7, 14)
        table = noisy(places_of(robot.with_numbers(true), (0,), distances, bearings), 0.01)
        fit = fit_range_table(**table, robot=robot, distance_sd_m=0.0)
        assert fit.held_out is not None
        most = 0.1 if own.response in JUMPS else 0.02  # of 147 places, one on the wrong side of a jump
        assert fit.held_out.fitted < most < fit.held_out.nominal, (name, fit.held_out)
        assert fit.held_out.fitted < (fit.held_out.floor or 1.0), name
        assert fit.numbers["range.0.direction"] == pytest.approx(true["range.0.direction"], abs=0.05), name
        assert robot.with_numbers(fit.numbers).range[0].response == own.response
    assert len(checked) >= 9


@pytest.mark.slow
def test_bearings_from_each_sensor_are_detected_and_fitted() -> None:
    """The numbers are far from the robot file's. A fit with bearings from the heading ends 1 rad off."""
    own = {"amplitude": 2.5, "decay": 0.011, "incidence": 1.0, "compression": 0.0, "cone": 0.1}
    robot = ROBOT.with_numbers({f"range.{k}.{name}": value for k in range(3) for name, value in own.items()})
    bearings = np.radians(np.arange(-75, 76, 15))
    for point in ("sensor", "body"):
        table = noisy(
            places_of(
                robot,
                (0, 1, 2),
                np.arange(0.004, 0.045, 0.004),
                bearings,
                measured_from=point,
                bearing_from="sensor",
            ),
            0.01,
        )
        columns = [table[name] for name in ("sensor", "distance_m", "bearing_rad", "readings")]
        frames = [
            TableFrame(origin, axis, clockwise)
            for origin, axis in (("body", "body"), ("sensor", "sensor"), ("body", "sensor"))
            for clockwise in (True, False)
        ]
        frame, errors = choose_frame(*columns, ROBOT, frames)
        assert (frame.measured_from, frame.bearing_from) == (point, "sensor"), errors
        assert errors[frame] < 0.02 < errors[TableFrame("body", "body", False)]
        fit = fit_range_table(**table, robot=ROBOT, measured_from=point, bearing_from="sensor")
        assert fit.held_out is not None
        assert fit.held_out.fitted < 0.015 < fit.held_out.nominal
        for k in range(3):
            assert fit.numbers[f"range.{k}.direction"] == pytest.approx(ROBOT.range[k].direction, abs=0.05)
            assert fit.numbers[f"range.{k}.decay"] == pytest.approx(0.011, rel=0.25)


def test_bearings_from_the_heading_stay_and_their_sense_is_found() -> None:
    table = noisy(table_of(ROBOT.with_numbers({"range.1.decay": 0.004}), (0, 1, 5)), 0.02)
    columns = [table[name] for name in ("sensor", "distance_m", "bearing_rad", "readings")]
    frames = [
        TableFrame(origin, axis, clockwise)
        for origin, axis in (("body", "body"), ("sensor", "sensor"))
        for clockwise in (True, False)
    ]
    assert choose_frame(*columns, ROBOT, frames)[0] == TableFrame("body", "body", clockwise=False)


@pytest.mark.slow
def test_table_corrects_sensors_that_differ() -> None:
    """Noise of 0.02 on readings; numbers are far from the file's, and distances are off by 0.5 mm."""
    rng = np.random.default_rng(2)
    truth = ROBOT.with_numbers(
        {
            "range.1.amplitude": 400.0,
            "range.1.decay": 0.005,
            "range.1.direction": 0.9,
            "range.4.decay": 0.0045,
        }
    )
    table = noisy(table_of(truth, (1, 4), rng.normal(0, 0.0005, len(DISTANCES))), 0.02)
    fit = fit_range_table(**table, robot=ROBOT)
    assert fit.held_out is not None
    assert fit.recommended == "fitted"
    assert fit.held_out.nominal > 0.1
    assert fit.held_out.more["with corrected distances"][1] < 0.025
    assert fit.held_out.floor is not None
    numbers = fit.recommended_numbers
    assert numbers["range.1.direction"] == pytest.approx(0.9, abs=0.03)
    assert numbers["range.1.decay"] == pytest.approx(0.005, rel=0.1)
    assert numbers["range.4.decay"] == pytest.approx(0.0045, rel=0.1)
    assert set(numbers) == set(fit.draws)
    assert ROBOT.with_numbers(numbers).range[1].direction == numbers["range.1.direction"]


def test_right_numbers_stay_and_all_frames_are_the_same() -> None:
    table = table_of(ROBOT, (2,))
    one = ROBOT.range[2]
    fit = fit_range_table(**table, robot=ROBOT)
    assert fit.held_out is not None
    assert fit.held_out.nominal < 1e-9
    assert fit.recommended == "nominal"
    assert fit.recommended_numbers == {}
    gap = table["distance_m"] + ROBOT.radius
    from_origin = fit_range_table(**{**table, "distance_m": gap}, robot=ROBOT, measured_from="origin")
    gap = gap - one.x * np.cos(table["bearing_rad"]) - one.y * np.sin(table["bearing_rad"])
    at_sensor = {**table, "distance_m": gap, "bearing_rad": table["bearing_rad"] - one.direction}
    from_sensor = fit_range_table(**at_sensor, robot=ROBOT, measured_from="sensor", distance_sd_m=0)
    for other in (from_origin, from_sensor):
        assert other.held_out is not None
        assert other.held_out.nominal < 1e-9


def test_wrong_tables_are_refused_with_one_message() -> None:
    table = table_of(ROBOT, (0,))

    def refused(message: str, robot: str = "khepera", **changed: object) -> None:
        with pytest.raises(ValueError, match=message):
            fit_range_table(**{**table, **changed}, robot=load_robot(robot))  # type: ignore[arg-type]

    n = len(table["sensor"])
    refused(r"readings has shape \(3,\), expected", readings=np.zeros(3))
    refused("expected whole numbers from 0 to 7", sensor=np.full(n, 8))
    refused("A reading is 1023, expected 0 .* Divide by the full scale", readings=np.full(n, 1023.0))
    refused("A distance is -0.1 m", distance_m=np.full(n, -0.1))
    refused("distance_m\\[0\\] is nan", distance_m=np.full(n, np.nan))
    refused("measured_from is 'rim'", measured_from="rim")
    refused("bearing_from is 'north', expected 'body' or 'sensor'", bearing_from="north")
    refused("shared has 'gain', expected some of", shared=("gain",))
    refused("distance_sd_m is -1, expected", distance_sd_m=-1.0)
    refused("The fit sees 5 readings", **{name: values[:10] for name, values in table.items()})
