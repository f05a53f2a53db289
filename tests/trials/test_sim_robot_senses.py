"""Sensors in the loop: what a robot of `sim` senses where it is, step by step."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from realitygap.errors import RobotError
from realitygap.platforms import SimPlatform, SimRobot
from realitygap.robots import Command
from realitygap.world import Arena, Floor, Light, Obstacle, Pose, RobotModel, load_robot, paper_arena
from tests.reference import senses as reference

pytestmark = pytest.mark.slow

MIDDLE = Pose(0.5, 0.3, 0.3)


def scribbler(**changed: Any) -> RobotModel:
    return RobotModel.from_dict({**load_robot("scribbler-s2-fluke2").to_dict(), **changed})


def quiet(arena: Arena, robot: Any = "scribbler-s2-fluke2", **numbers: float) -> SimRobot:
    """A robot without noise, with some of its numbers changed ("drive_slip" for drive.slip)."""
    given = {name.replace("_", ".", 1): value for name, value in numbers.items()}
    return SimRobot(SimPlatform(robot=robot, noise=False, precision="double", set=given), arena)


def curve(robot: SimRobot) -> None:
    for move, turn in ((0.5, 0.0), (0.5, 0.1), (0.3, -0.1), (-0.5, 0.2), (0.4, -0.2)):
        robot.drive(Command(move, turn))


def test_odometry_without_errors_stays_with_the_robot():
    robot = quiet(paper_arena(MIDDLE))
    curve(robot)
    assert robot.n_blocked == 0
    assert math.dist(robot.pose[:2], MIDDLE[:2]) > 0.03
    assert robot.odometry == pytest.approx(robot.pose, abs=2e-3)
    assert robot.encoders == pytest.approx(robot.wheels)


def test_gains_and_drift_of_encoders_lead_odometry_astray():
    robot = quiet(paper_arena(MIDDLE), encoder_gain_left=1.1, encoder_gain_right=0.9)
    curve(robot)
    left, right = robot.wheels
    assert robot.encoders == pytest.approx((1.1 * left, 0.9 * right))
    drifting = quiet(paper_arena(MIDDLE), encoder_drift_per_m=0.5)
    for _ in range(4):
        drifting.drive(Command(0.5, 0.0))
    way = sum(drifting.wheels) / 2
    assert drifting.odometry.heading == pytest.approx(MIDDLE.heading + 0.5 * abs(way))
    assert drifting.pose.heading == pytest.approx(MIDDLE.heading)


def test_a_robot_without_encoders_says_so():
    robot = quiet(paper_arena(MIDDLE), "jyro")
    with pytest.raises(RobotError, match="Robot 'jyro' has no encoders"):
        _ = robot.odometry
    with pytest.raises(RobotError, match="no encoders"):
        _ = robot.encoders


def lit(robot: SimRobot, lamps: list[reference.Lamp]) -> list[float]:
    """What each light sensor should answer where the robot is."""
    model = robot.platform.model
    received = [
        reference.light(robot.pose, (sensor.x, sensor.y), sensor.direction, sensor.width, lamps)
        for sensor in model.light
    ]
    return [
        reference.limited(sensor.gain * light) for sensor, light in zip(model.light, received, strict=True)
    ]


def lights_of(robot: SimRobot) -> list[float]:
    return [
        float(value) for name, value in zip(robot.sensors, robot.readings, strict=True) if name[:5] == "light"
    ]


@pytest.mark.parametrize(("shadows", "part"), [("none", 1.0), ("half", 0.5), ("dark", 0.0)])
def test_light_falls_off_and_an_obstacle_throws_a_shadow(shadows, part):
    lights = (Light(0.1, 0.5, 0.02), Light(0.9, 0.1, 0.05))
    box = Obstacle(0.22, 0.45, 0.7, ((-0.03, -0.03), (0.03, -0.03), (0.03, 0.03), (-0.03, 0.03)))
    clear = replace(paper_arena(MIDDLE), lights=lights)
    robot = quiet(clear, scribbler(shadows=shadows))
    lamps = [reference.Lamp(light.x, light.y, light.strength) for light in lights]
    assert lights_of(robot) == pytest.approx(lit(robot, lamps))
    assert max(lights_of(robot)) > 0.01
    robot.drive(Command(0.5, 0.3))
    assert lights_of(robot) == pytest.approx(lit(robot, lamps))
    behind = quiet(replace(clear, obstacles=(box,)), scribbler(shadows=shadows))
    shaded = [replace(lamps[0], lit=part), lamps[1]]
    assert lights_of(behind) == pytest.approx(lit(behind, shaded))


def test_line_sensors_see_tape_as_they_cross_it():
    arena = replace(
        paper_arena(Pose(0.4, 0.3, 0.0)), floor=Floor(tape=((0.55, 0.0, 0.55, 0.6),), tape_width=0.04)
    )
    robot = quiet(arena)
    seen = []
    for _ in range(12):
        for k, sensor in enumerate(robot.platform.model.line):
            x = (
                robot.pose.x
                + sensor.x * math.cos(robot.pose.heading)
                - sensor.y * math.sin(robot.pose.heading)
            )
            answer = robot.readings[robot.sensors.index(f"line.{k}")]
            assert answer == float(abs(x - 0.55) <= 0.02)
            seen.append(answer)
        robot.drive(Command(0.4, 0.0))
    assert {0.0, 1.0} == set(seen)


def test_a_bump_sensor_feels_the_wall_that_it_is_near():
    ahead, aside = {"x": 0.089, "y": 0.0, "reach": 0.02}, {"x": 0.0, "y": 0.08, "reach": 0.02}
    robot = quiet(paper_arena(Pose(0.85, 0.3, 0.0)), scribbler(bump=[ahead, aside]))
    wall = 42 * 0.0254
    for _ in range(3):
        gap = wall - robot.pose.x - 0.089 * math.cos(robot.pose.heading)
        assert robot.readings[-2] == float(gap <= 0.02)
        assert robot.readings[-1] == 0.0
        robot.drive(Command(0.8, 0.0))
    assert robot.readings[-2] == 1.0


def test_an_s2_stalls_in_front_of_a_wall_and_never_turning_on_the_spot():
    robot = quiet(paper_arena(Pose(0.9, 0.3, 0.0)))
    stalled = []
    for _ in range(14):
        robot.drive(Command(1.0, 0.0))
        stalled.append(robot.observe().stalled)
    assert not stalled[0]
    assert stalled[-1]
    assert robot.n_blocked == sum(stalled)
    turning = quiet(paper_arena(MIDDLE))
    for _ in range(8):
        turning.drive(Command(0.0, 0.5))
        assert not turning.observe().stalled


def test_readings_without_noise_are_those_of_the_distances():
    robot = quiet(paper_arena(Pose(0.75, 0.3, 0.2)), "scribbler-s2-fluke1")
    model = robot.platform.model
    for _ in range(3):
        first = 0
        for k, sensor in enumerate(model.range):
            rays = robot.distances[first : first + sensor.rays].tolist()
            first += sensor.rays
            wanted = reference.limited(reference.infrared(rays, sensor.reach, sensor.amplitude, sensor.decay))
            assert robot.readings[k] == pytest.approx(wanted)
        robot.drive(Command(0.3, 0.1))
    assert np.ptp(robot.readings[:3]) > 0
