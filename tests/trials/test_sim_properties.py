"""What holds for any robot of `sim` in any arena, as the platform sets its kernels up."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from realitygap.evolution import NeatSettings
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim.lanes import SimRules, make_sim_room
from realitygap.kernels.sim.trial import start_sim, step_sim
from realitygap.platforms import SimPlatform
from realitygap.platforms.sim._scene import sim_scene
from realitygap.world import Arena, Obstacle, RobotModel, load_robot, paper_arena
from tests.reference import contact as reference
from tests.reference.effort import cases

pytestmark = pytest.mark.slow

Pose = tuple[float, float, float]
MODELS = ["freeze", "stop", "slide"]
NEAT = NeatSettings.named("rosenzweig-remy").rules(3, 2, bias_input=-1)
BOX = ((-0.06, -0.05), (0.06, -0.05), (0.06, 0.05), (-0.06, 0.05))
TRIANGLE = ((-0.05, -0.04), (0.07, 0.0), (-0.04, 0.05))
# The outlines of bodies: corners and radius of each part.
BODIES: dict[str, Sequence[tuple[Sequence[tuple[float, float]], float]]] = {
    "disc": [(((0.0, 0.0),), 0.06)],
    "bar with round ends": [(((0.0, -0.05), (0.0, 0.05)), 0.02)],
    "box": [(((-0.08, -0.07), (0.08, -0.07), (0.08, 0.07), (-0.08, 0.07)), 0.0)],
    "rounded triangle": [(TRIANGLE, 0.015)],
    "box with a disc and a bar ahead": [
        (((-0.05, -0.06), (0.05, -0.06), (0.05, 0.06), (-0.05, 0.06)), 0.005),
        (((-0.06, 0.0),), 0.04),
        (((0.07, -0.04), (0.07, 0.04)), 0.02),
    ],
}
HALF = 0.5334  # of the paper's arena [m]
INSIDE = 2e-6  # what `TILT` lets faces of 0.2 m that are nearly parallel go into each other [m]


def body_of(name: str, **drive: Any) -> RobotModel:
    """A Scribbler's wheels and sensors under another body."""
    model = load_robot("scribbler-s2-fluke2").to_dict()
    model["body"] = [
        {"corner": [{"x": x, "y": y} for x, y in corners], "radius": radius}
        for corners, radius in BODIES[name]
    ]
    model["drive"] |= drive
    return RobotModel.from_dict(model)


def furnished(*, divided: bool) -> Arena:
    """The paper's arena with two boxes, a rounded triangle and a disc; or one with a thin wall across it too."""
    arena = paper_arena()
    obstacles = (
        Obstacle(0.3, 0.3, 0.4, BOX),
        Obstacle(0.75, 0.45, 1.0, TRIANGLE, 0.015),
        Obstacle(0.85, 0.15, 0.0, ((0.0, 0.0),), 0.05),
        Obstacle(0.05, 0.58, -0.3, BOX),
    )
    walls = arena.walls + (((HALF, 0.0, HALF, 1.0),) if divided else ())
    return replace(arena, obstacles=obstacles, walls=walls)


def parts_of(robot: RobotModel) -> list[reference.Body]:
    return [reference.Body(list(part.corners), part.radius) for part in robot.body]


def world_of(arena: Arena) -> reference.World:
    polygons = [reference.Polygon(list(o.placed), o.radius) for o in arena.obstacles]
    return reference.World([], polygons + [reference.Polygon([(a, b), (c, d)]) for a, b, c, d in arena.walls])


def gap(parts: Sequence[reference.Body], pose: Pose, world: reference.World) -> float:
    """How far a body is from everything [m]; negative where it is in something."""
    return min(reference.deepest(part, pose, world).gap for part in parts)


def starts_in(arena: Arena, robot: RobotModel, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """(n, 3) free poses of the body in the paper's arena."""
    starts: list[Pose] = []
    parts, world = parts_of(robot), world_of(arena)
    while len(starts) < n:
        pose = (rng.uniform(0.05, 1.02), rng.uniform(0.05, 0.56), rng.uniform(-math.pi, math.pi))
        if gap(parts, pose, world) > 1e-3:
            starts.append(pose)
    return np.array(starts)


def driven(
    platform: SimPlatform,
    arena: Arena,
    starts: NDArray[np.float64],
    commands: NDArray[np.float64],
    key: int = 1,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Poses (t + 1, n, 3) [m, rad], readings (t + 1, n, s) and stalls (t + 1, n) of n robots, by commands (t, 2, n)."""
    scene = sim_scene(platform, arena, ("obstacle", "stall", "time"), 0.0)
    n = len(starts)
    place = dict(zip(("arena.start.x", "arena.start.y", "arena.start.heading"), starts.T, strict=True))
    table = scene.table({**scene.fixed, **place})
    real = table.dtype.type
    rules = SimRules(len(commands), platform.command_s, True, 1.0, np.array([0.0, 0.0, 1.0, 1e-9], real))
    room = make_sim_room(scene.shape, NEAT, 0, real)
    counters = np.zeros((n, 3), np.uint32)
    counters[:, 0] = np.arange(n) << 8 | 1
    cells = np.zeros((n, 1), np.uint8)
    lanes = room.lanes
    seen: list[list[NDArray[Any]]] = [[], [], []]

    def keep() -> None:
        pose = lanes.pose
        turned = pose.heading * real(math.tau)
        seen[0].append(np.stack([pose.x, pose.y, turned], 1)[:n] + np.array([*scene.origin, 0.0]))
        seen[1].append(lanes.readings.T[:n].astype(np.float64))
        seen[2].append(lanes.stalled[:n] > 0)

    start_sim(scene.shape, table, rules, np.uint64(key), counters, n, room, cells)
    keep()
    for step, command in enumerate(commands):
        given_ = np.zeros((2, LANES), real)
        given_[:, :n] = command
        step_sim(scene.shape, rules, np.uint64(key), n, room, cells, step, given_)
        keep()
    return np.array(seen[0]), np.array(seen[1]), np.array(seen[2])


@given(
    st.sampled_from(MODELS), st.sampled_from(sorted(BODIES)), st.floats(0.05, 2.0), st.floats(0.0, 1.5),
    st.floats(0.0, 0.7), st.sampled_from([0.1, 0.5]), st.booleans(), st.integers(0, 2**32 - 1),
)  # fmt: skip
@example("slide", "disc", 2.0, 0.3, 0.0, 0.5, True, 1)
@example("slide", "box with a disc and a bar ahead", 2.0, 0.3, 0.45, 0.5, True, 2)
@example("stop", "bar with round ends", 2.0, 0.3, 0.45, 0.5, True, 3)
@settings(max_examples=cases(24, 2))
def test_no_robot_ends_inside_anything_nor_gets_through_a_thin_wall(
    model: str,
    name: str,
    speed: float,
    friction: float,
    delay: float,
    step_s: float,
    divided: bool,
    seed: int,
) -> None:
    """Up to 1 m a step, at once or late, wheels unlike, noise and all; by the reference's distances."""
    rng = np.random.default_rng(seed)
    robot = body_of(
        name, delay=delay, delay_jitter=0.05, gain_left=1.2, travel_noise_per_s=0.02, heading_noise_per_s=0.1
    )
    platform = SimPlatform(
        robot=robot.to_dict(), contact=model, step_s=step_s, precision="double",
        set={"drive.speed": speed, "contact.friction": friction},
    )  # fmt: skip
    arena = furnished(divided=divided)
    starts = starts_in(arena, robot, 16, rng)
    commands = rng.uniform(-1, 1, (15, 2, 16))
    commands[:, 0, ::2] = 1.0
    commands[:, 1, ::2] *= 0.2
    poses, _, _ = driven(platform, arena, starts, commands)
    parts, world = parts_of(robot), world_of(arena)
    for k in range(16):
        side = np.sign(starts[k, 0] - HALF)
        for step in range(1, 16):
            x, y, heading = poses[step, k].tolist()
            assert 0 < x < 2 * HALF, (k, step, "left the room")
            assert 0 < y < 0.6096, (k, step, "left the room")
            assert not divided or np.sign(x - HALF) == side, (k, step, "went through")
            assert gap(parts, (x, y, heading), world) > -INSIDE, (k, step)


def quiet(name: str, model: str, **set_: float) -> SimPlatform:
    robot = body_of(name)
    return SimPlatform(robot=robot.to_dict(), contact=model, noise=False, precision="double", set=set_)


@given(
    st.sampled_from(MODELS), st.sampled_from(sorted(BODIES)), st.permutations(range(4)), st.integers(0, 2**32 - 1)
)  # fmt: skip
@settings(max_examples=cases(12, 2))
def test_the_order_of_obstacles_changes_no_bit(model: str, name: str, order: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    arena, platform = furnished(divided=False), quiet(name, model)
    other = replace(arena, obstacles=tuple(arena.obstacles[k] for k in order))
    starts = starts_in(arena, platform.model, 24, rng)
    commands = np.stack([rng.uniform(-0.2, 1, (12, 24)), rng.uniform(-0.3, 0.3, (12, 24))], 1)
    for one, two in zip(
        driven(platform, arena, starts, commands), driven(platform, other, starts, commands), strict=True
    ):
        np.testing.assert_array_equal(one, two)


def test_a_robot_goes_the_same_way_alone_and_in_a_team() -> None:
    """A push beside a box took the box into account only if some robot of the block was near the box."""
    rng = np.random.default_rng(6)
    n, steps = cases(LANES, 8), cases(40, 6)
    for model, divided in itertools.product(MODELS, (False, True)):
        arena, platform = furnished(divided=divided), quiet("box", model)
        starts = starts_in(arena, platform.model, n, rng)
        commands = np.stack([rng.uniform(-0.6, 1, (steps, n)), rng.uniform(-0.8, 0.8, (steps, n))], 1)
        team = driven(platform, arena, starts, commands)
        for k in range(0, n, 4):
            alone = driven(platform, arena, starts[k : k + 1], commands[:, :, k : k + 1])
            for here, there in zip(team, alone, strict=True):
                np.testing.assert_array_equal(
                    here[:, k], there[:, 0], f"{model}, divided: {divided}, robot {k}"
                )


@pytest.mark.parametrize("model", MODELS)
def test_two_obstacles_that_are_met_at_once_are_met_in_no_order(model: str) -> None:
    """A box heads straight between two posts, which are as near as each other to the last bit."""
    posts = [Obstacle(0.6, 0.3 + side * 0.0625, 0.0, ((0.0, 0.0),), 0.03) for side in (-1, 1)]
    starts = np.array([[0.25 + 0.01 * k, 0.3, 0.0] for k in range(20)])
    commands = np.tile([[1.0], [0.0]], (8, 1, 20))
    platform = quiet("box", model)
    paths = [
        driven(platform, replace(paper_arena(), obstacles=tuple(each)), starts, commands)
        for each in (posts, posts[::-1])
    ]
    assert paths[0][2][-1].all()
    for one, two in zip(*paths, strict=True):
        np.testing.assert_array_equal(one, two)


def mirrored_robot(robot: RobotModel) -> RobotModel:
    """Left is right."""
    model = robot.to_dict()
    for part in model["body"]:
        part["corner"] = [{"x": c["x"], "y": -c["y"]} for c in reversed(part["corner"])]
    for sensor in model["range"]:
        sensor["y"] = -sensor.get("y", 0.0)
        sensor["direction"] = -sensor.get("direction", 0.0)
    drive = model["drive"]
    for name in ("gain", "bias"):
        left, right = drive.get(f"{name}_left"), drive.get(f"{name}_right")
        for side, value in (("left", right), ("right", left)):
            drive.pop(f"{name}_{side}", None)
            if value is not None:
                drive[f"{name}_{side}"] = value
    drive["drift_per_m"] = -drive.get("drift_per_m", 0.0)
    return RobotModel.from_dict(model)


def mirrored_arena(arena: Arena, depth: float) -> Arena:
    return replace(
        arena,
        walls=tuple((x1, depth - y1, x2, depth - y2) for x1, y1, x2, y2 in arena.walls),
        obstacles=tuple(
            Obstacle(o.x, depth - o.y, -o.heading, tuple((x, -y) for x, y in reversed(o.corners)), o.radius)
            for o in arena.obstacles
        ),
    )


@given(
    st.sampled_from(MODELS), st.sampled_from(sorted(BODIES)), st.booleans(), st.integers(0, 2**32 - 1)
)  # fmt: skip
@settings(max_examples=cases(12, 2))
def test_a_mirrored_robot_in_a_mirrored_arena_goes_a_mirrored_way(
    model: str, name: str, divided: bool, seed: int
) -> None:
    """Readings are the same. Three steps: what rounding decides where two contacts are as deep grows in more."""
    rng = np.random.default_rng(seed)
    depth = paper_arena().walls[1][3]
    arena = furnished(divided=divided)
    robot = body_of(name, gain_left=0.9, bias_right=0.004, drift_per_m=0.2, axle=0.01)
    platforms = [
        SimPlatform(robot=each.to_dict(), contact=model, noise=False, precision="double")
        for each in (robot, mirrored_robot(robot))
    ]
    starts = starts_in(arena, robot, 32, rng)
    commands = np.stack([rng.uniform(-0.2, 1, (3, 32)), rng.uniform(-0.3, 0.3, (3, 32))], 1)
    poses, readings, stalled = driven(platforms[0], arena, starts, commands)
    others = driven(
        platforms[1],
        mirrored_arena(arena, depth),
        starts * [1, -1, -1] + [0, depth, 0],
        commands * [[1], [-1]],
    )
    off = np.abs(others[0] * [1, -1, -1] + [0, depth, 0] - poses)
    off[..., 2] = np.abs(np.remainder(off[..., 2] + math.pi, math.tau) - math.pi)
    same = off.max((0, 2)) < 1e-9
    assert same.mean() > 0.9
    np.testing.assert_allclose(readings[:, same], others[1][:, same], atol=1e-6)
    np.testing.assert_array_equal(stalled[:, same], others[2][:, same])
