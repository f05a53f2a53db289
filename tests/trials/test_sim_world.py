"""Several robots of the platform `sim` in one arena: they collide and see each other."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from realitygap.errors import RobotError
from realitygap.evolution import NeatSettings, Population
from realitygap.platforms import SimPlatform, SimWorld, trace_genomes
from realitygap.robots import Robot
from realitygap.testing import check_robot
from realitygap.trials import NoiseKey
from realitygap.world import Distribution, Obstacle, Pose, paper_arena

pytestmark = pytest.mark.slow

SCRIBBLER = "scribbler-s2-fluke2"
WALL = 1e-6  # how far a body may come into another by rounding, in single precision [m]


def gap(one: object, other: object) -> float:
    """Between two robots [m], from the corners of each to the other; negative where one is in the other."""

    def parts(robot) -> list[Obstacle]:  # type: ignore[no-untyped-def]
        return [Obstacle(*robot.pose, part.corners, part.radius) for part in robot.model.body]

    distances = [
        a.distance(x, y) - b.radius
        for first, second in ((one, other), (other, one))
        for a in parts(first)
        for b in parts(second)
        for x, y in b.placed
    ]
    return min(distances)


def test_one_robot_alone_drives_the_trial_that_a_network_drove() -> None:
    """The same key and commands give the same poses and readings, noise, delay and drawn numbers included."""
    platform = SimPlatform(
        steps=40,
        set={"drive.track": Distribution(normal=(0.153, 0.004)), "drive.lag": 0.1},
    )
    arena = paper_arena()
    genome = Population(3, 2, NeatSettings.named("rosenzweig-remy"), seed=4, bias=False).ask()[0]
    key = NoiseKey(77, individual=5)
    trial = trace_genomes(platform, arena, [genome], noise=0.1, noise_key=key)
    world = SimWorld(arena)
    robot = world.add(platform, noise=0.1, noise_key=key)
    poses, readings = [robot.pose], [list(robot.readings.values())]
    for command in trial.commands[0]:
        robot.move(*command)
        world.step()
        poses.append(robot.pose)
        readings.append(list(robot.readings.values()))
    np.testing.assert_allclose(np.array(poses)[:, :2], trial.poses[0, :, :2], rtol=0, atol=1e-15)
    turned = np.remainder(np.array(poses)[:, 2] - trial.poses[0, :, 2] + math.pi, math.tau) - math.pi
    assert abs(turned).max() < 1e-14
    assert np.array_equal(np.array(readings), trial.readings[0])


def test_a_robot_that_stands_is_an_obstacle_of_its_outline() -> None:
    """What a second robot does beside it is what one alone does beside an obstacle of that outline."""
    arena = paper_arena()
    start, other = Pose(0.3, 0.3, 0.1), Pose(0.62, 0.33, 2.0)
    world = SimWorld(arena)
    robot, standing = world.add(SCRIBBLER, start), world.add(SCRIBBLER, other)
    parts = tuple(Obstacle(*other, part.corners, part.radius) for part in standing.model.body)
    alone = SimWorld(replace(arena, obstacles=parts))
    lone = alone.add(SCRIBBLER, start)
    for _ in range(25):
        robot.move(0.9, 0.1)
        lone.move(0.9, 0.1)
        world.step()
        alone.step()
        assert robot.pose == lone.pose
        assert robot.readings == lone.readings
    assert robot.pose.x < 0.62  # it did meet it


def test_robots_that_drive_at_each_other_stop_there() -> None:
    world = SimWorld(paper_arena(), step_s=0.1)
    one, other = world.add("jyro", Pose(0.3, 0.3, 0.0)), world.add("jyro", Pose(0.7, 0.3, math.pi))
    one.move(1.0, 0.0)
    other.move(1.0, 0.0)
    world.step(5)
    assert one.stalled
    assert other.stalled
    assert (one.pose.x, other.pose.x) == pytest.approx((0.4, 0.6))
    assert one.distances == pytest.approx([0.6 - 0.09 - 0.49] * 3)
    assert one.readings["range.1"] == pytest.approx(1 - 0.02 / 0.2)


def test_a_later_robot_meets_an_earlier_one_where_it_is_now() -> None:
    for first, stalls in ((0, [False, True]), (1, [True, False])):
        world = SimWorld(paper_arena(), step_s=0.1)
        starts = [Pose(0.25, 0.3, 0.0), Pose(0.25 + 0.3, 0.3, math.pi)]
        robots = [world.add("jyro", starts[k]) for k in ((0, 1) if first == 0 else (1, 0))]
        for robot in robots:
            robot.move(1.0, 0.0)
        world.step()
        by_place = sorted(robots, key=lambda robot: robot.start.x)
        assert [robot.stalled for robot in by_place] == stalls


def toward(other) -> object:  # type: ignore[no-untyped-def]
    """A brain that drives at another robot."""

    def brain(robot) -> None:  # type: ignore[no-untyped-def]
        x, y, heading = robot.pose
        bearing = math.atan2(other.pose.y - y, other.pose.x - x) - heading
        robot.move(0.8, max(-0.5, min(0.5, math.remainder(bearing, math.tau))))

    return brain


@pytest.mark.parametrize("contact", ["slide", "stop", "freeze"])
def test_robots_that_chase_each_other_never_come_into_each_other(contact: str) -> None:
    world = SimWorld(paper_arena(), seed=1, step_s=0.3)
    starts = [Pose(0.2, 0.2, 0.3), Pose(0.6, 0.35, 2.0), Pose(0.85, 0.25, 4.0)]
    robots = [
        world.add(SimPlatform(robot=kind, contact=contact), start)
        for kind, start in zip((SCRIBBLER, "e-puck", "khepera"), starts, strict=True)
    ]
    for k, robot in enumerate(robots):
        robot.brain = toward(robots[(k + 1) % 3])
    smallest = math.inf
    for _ in range(60):
        world.step()
        pairs = [(one, other) for one in robots for other in robots if one is not other]
        smallest = min(smallest, *(gap(*pair) for pair in pairs))
    assert -WALL <= smallest < 0.02


def test_a_brain_is_asked_when_its_turn_has_come() -> None:
    world = SimWorld(paper_arena(), step_s=0.1)
    seen: list[float] = []
    leader = world.add("jyro", Pose(0.5, 0.3, 0.0), brain=lambda robot: robot.move(1.0, 0.0))
    world.add("jyro", Pose(0.2, 0.3, 0.0), brain=lambda robot: seen.append(leader.pose.x))
    world.step(2)
    world.step(1, brains=False)
    assert seen == pytest.approx([0.6, 0.7])
    assert world.time == pytest.approx(0.3)


def test_a_reset_begins_the_same_again() -> None:
    world = SimWorld(paper_arena(), seed=3)
    robots = [world.add(SCRIBBLER, Pose(0.3, 0.3, 0.0)), world.add(SCRIBBLER, Pose(0.7, 0.3, 1.0))]

    def drive() -> list[object]:
        for robot in robots:
            robot.move(0.6, 0.2)
        world.step(8)
        return [(robot.pose, robot.readings, robot.wheels) for robot in robots]

    first = drive()
    world.reset()
    assert world.n_steps == 0
    assert robots[0].pose == pytest.approx((0.3, 0.3, 0.0))
    assert drive() == first
    assert first[0] != first[1]


def test_a_robot_of_it_keeps_the_contract() -> None:
    world = SimWorld(paper_arena())
    robot = world.add("jyro", Pose(0.3, 0.3, 0.0))
    world.add("jyro", Pose(0.7, 0.3, 0.0))
    assert isinstance(robot, Robot)
    check_robot(robot)


def test_the_picture_shows_all_robots() -> None:
    world = SimWorld(paper_arena())
    world.add(SCRIBBLER, Pose(0.3, 0.3, 0.0), color="orchid").move(0.5, 0.1)
    world.add("e-puck", Pose(0.7, 0.3, 0.0), color="seagreen")
    world.step(3)
    svg = world._repr_svg_()
    assert "#da70d6" in svg
    assert "#2e8b57" in svg
    assert "with 2 robots after 3 steps" in svg


def box(x: float, y: float, heading: float = 0.0, radius: float = 0.0) -> Obstacle:
    return Obstacle(x, y, heading, ((0.1, 0.05), (-0.1, 0.05), (-0.1, -0.05), (0.1, -0.05)), radius)


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (box(0, 0), box(0.05, 0), True),  # sides on sides, no corner inside
        (box(0, 0), box(0, 0, math.pi / 2), True),  # a cross
        (box(0, 0), box(0.2, 0), False),  # side to side
        (box(0, 0), box(0.19, 0.09, 0.1), True),
        (box(0, 0), box(0.21, 0, radius=0.02), True),
        (box(0, 0), box(0.21, 0, radius=0.009), False),
        (box(0, 0), Obstacle(0.0, 0.0, radius=0.01), True),
        (box(0, 0), Obstacle(0.12, 0.07, radius=0.028), False),
        (box(0, 0), Obstacle(0.12, 0.07, radius=0.029), True),
        (Obstacle(0.0, 0.0, radius=0.1), Obstacle(0.15, 0.0, radius=0.04), False),
        (Obstacle(0.0, 0.0, radius=0.1), Obstacle(0.15, 0.0, radius=0.06), True),
        (box(0, 0), Obstacle(0.0, 0.0, 0.0, ((-1.0, 0.0), (1.0, 0.01))), True),  # a wall through it
        (box(0, 0), Obstacle(0.0, 0.0, 0.0, ((-1.0, 0.06), (1.0, 0.07))), False),
    ],
)
def test_outlines_overlap_or_not(one: Obstacle, other: Obstacle, expected: bool) -> None:
    assert one.overlaps(other) is expected
    assert other.overlaps(one) is expected


def test_mistakes_are_named() -> None:
    world = SimWorld(paper_arena())
    world.add("jyro", Pose(0.3, 0.3, 0.0), name="ada")
    with pytest.raises(RobotError, match="There is a robot named 'ada' already"):
        world.add("jyro", Pose(0.7, 0.3, 0.0), name="ada")
    with pytest.raises(RobotError, match="jyro-1 starts in a wall, an obstacle or another robot"):
        world.add("jyro", Pose(0.35, 0.3, 0.0))
    with pytest.raises(RobotError, match="jyro-1 starts in a wall"):
        world.add("jyro", Pose(0.05, 0.3, 0.0))
    with pytest.raises(ValueError, match="scribler"):
        world.add("scribler-s2")
    with pytest.raises(KeyError, match="No robot 'eve'; there are: ada"):
        world["eve"]
    with pytest.raises(ValueError, match="move is 2"):
        world["ada"].move(2.0, 0.0)
    world.step()
    with pytest.raises(RobotError, match="The world has begun"):
        world.add("jyro", Pose(0.7, 0.3, 0.0))
    with pytest.raises(ValueError, match="step_s is -1"):
        SimWorld(step_s=-1)
