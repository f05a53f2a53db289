"""Fits of range sensors to tables that a simulated robot read along a wall."""

from __future__ import annotations

import math

import numpy as np
import pytest

from realitygap.calibration import fit_range_table
from realitygap.calibration._range_table import wall_reading
from realitygap.platforms import SimPlatform, SimRobot
from realitygap.world import Pose, RobotModel, load_robot, paper_arena

ROBOT = load_robot("khepera")
DISTANCES = np.arange(0.005, 0.045, 0.004)
BEARINGS = np.radians(np.arange(0, 360, 6))


def table_of(
    robot: RobotModel, sensors: tuple[int, ...], off: np.ndarray | float = 0.0
) -> dict[str, np.ndarray]:
    """Return a table of readings without noise, at distances that are off by some [m]."""
    sensor, i, j = (
        each.ravel()
        for each in np.meshgrid(sensors, np.arange(len(DISTANCES)), np.arange(len(BEARINGS)), indexing="ij")
    )
    readings = np.empty(len(sensor))
    true = DISTANCES + off
    for k in sensors:
        one, at = robot.range[k], sensor == k
        bearing = BEARINGS[j[at]]
        gap = true[i[at]] + robot.radius - one.x * np.cos(bearing) - one.y * np.sin(bearing)
        numbers = {
            name: float(getattr(one, name))
            for name in ("direction", "cone", "amplitude", "decay", "incidence", "compression")
        }
        readings[at] = wall_reading(gap, bearing, numbers, one.reach, one.rays)
    return {"sensor": sensor, "distance_m": DISTANCES[i], "bearing_rad": BEARINGS[j], "readings": readings}


@pytest.mark.slow
def test_readings_along_a_wall_are_those_of_the_simulated_robot() -> None:
    arena = paper_arena()
    right = max(x for wall in arena.walls for x in wall[::2])
    rng = np.random.default_rng(1)
    with SimRobot(SimPlatform(robot=ROBOT, noise=False, precision="double"), arena) as simulated:
        for _ in range(20):
            distance, heading = rng.uniform(0.005, 0.03), rng.uniform(-math.pi, math.pi)
            simulated.reset(Pose(right - ROBOT.radius - distance, 0.3, heading))
            for k, one in enumerate(ROBOT.range):
                gap = distance + ROBOT.radius - one.x * math.cos(heading) + one.y * math.sin(heading)
                numbers = {
                    name: float(getattr(one, name))
                    for name in ("direction", "cone", "amplitude", "decay", "incidence", "compression")
                }
                expected = wall_reading(np.array([gap]), np.array([-heading]), numbers, one.reach, one.rays)[
                    0
                ]
                assert simulated.readings[k] == pytest.approx(expected, abs=1e-6), (k, heading)


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
    table = table_of(truth, (1, 4), rng.normal(0, 0.0005, len(DISTANCES)))
    table["readings"] = np.clip(table["readings"] + rng.normal(0, 0.02, len(table["readings"])), 0, 1)
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
    refused("distance_m has no number in row 0", distance_m=np.full(n, np.nan))
    refused("has the response 'lorentz', expected 'ir'", robot="thymio")
    refused("measured_from is 'rim'", measured_from="rim")
    refused("shared has 'gain', expected some of", shared=("gain",))
    refused("distance_sd_m is -1, expected", distance_sd_m=-1.0)
    refused("The fit sees 5 readings", **{name: values[:10] for name, values in table.items()})
