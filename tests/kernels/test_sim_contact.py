"""Contact of `sim`: against the plain reference, an oracle, mirrors, and finer steps."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.kernels.sim_cases import (
    DEPTH,
    OUTLINE,
    SCRIBBLER,
    WIDTH,
    Driven,
    drive_robots,
    obstacle,
    outline,
    room,
    walls,
)
from tests.reference import contact as reference
from tests.reference.effort import cases

pytestmark = pytest.mark.slow

MODELS = ["freeze", "stop", "slide"]
TRACK = 0.153
BOX = [(-0.06, -0.05), (0.06, -0.05), (0.06, 0.05), (-0.06, 0.05)]
TRIANGLE = [(-0.05, -0.04), (0.07, 0.0), (-0.04, 0.05)]
DISC = [(0.0, 0.0)]


def planes() -> list[tuple[reference.Point, float]]:
    return [((0.0, 1.0), 0.0), ((-1.0, 0.0), -WIDTH), ((0.0, -1.0), -DEPTH), ((1.0, 0.0), 0.0)]


def put(
    corners: list[tuple[float, float]], x: float, y: float, heading: float, radius: float
) -> reference.Polygon:
    c, s = math.cos(heading), math.sin(heading)
    return reference.Polygon([(x + c * a - s * b, y + s * a + c * b) for a, b in corners], radius)


def body(
    model: str = "slide",
    friction: float = 0.3,
    corners: Any = OUTLINE,
    radius: float = 0.01,
    slip: float = math.inf,
    give: tuple[float, float, float] = (1.0, 1.0, 171.0),
) -> reference.Body:
    return reference.Body(list(corners), radius, friction, give, model, slip)


def free_starts(
    rng: np.random.Generator, n: int, like: reference.Body, world: reference.World
) -> list[reference.Pose]:
    starts: list[reference.Pose] = []
    while len(starts) < n:
        pose = (rng.uniform(0, WIDTH), rng.uniform(0, DEPTH), rng.uniform(-math.pi, math.pi))
        if reference.deepest(like, pose, world).gap > 1e-4:
            starts.append(pose)
    return starts


def numbers_of(starts: list[reference.Pose], **more: Any) -> dict[str, Any]:
    at = np.array(starts)
    place = {"arena.start.x": at[:, 0], "arena.start.y": at[:, 1], "arena.start.heading": at[:, 2]}
    return {**SCRIBBLER, **outline(OUTLINE), **place, **more}


def compare(
    driven: Driven, starts: list[reference.Pose], commands: Any, like: reference.Body, world: reference.World
) -> int:
    """Each step from where the kernel was before it, so that no last bit grows; returns steps in contact."""
    met = 0
    for step, (move, turn) in enumerate(commands):
        left, right = (min(max(move + side * turn, -1.0), 1.0) * 0.15 * 0.5 for side in (-1, 1))
        for k in range(len(starts)):
            x, y, heading = driven.poses[step, k].tolist()
            expected = reference.step(
                like, (x, y, heading), world, (left + right) / 2, (right - left) / TRACK
            )
            found = driven.poses[step + 1, k]
            free = reference.arc((x, y, heading), (left + right) / 2, (right - left) / TRACK)
            met += math.dist(expected[:2], free[:2]) > 1e-9
            assert math.dist(found[:2], expected[:2]) < 1e-6, (step, k)
            assert abs(math.remainder(found[2] - expected[2], math.tau)) < 1e-5, (step, k)
    return met


@pytest.mark.parametrize("model", MODELS)
def test_steps_in_a_room_equal_the_reference(model: str) -> None:
    rng = np.random.default_rng(1)
    like, world = body(model), reference.World(planes())
    starts = free_starts(rng, cases(40, 6), like, world)
    commands = np.column_stack([rng.uniform(-0.2, 1, 12), rng.uniform(-0.4, 0.4, 12)])
    driven = drive_robots({**numbers_of(starts), **room()}, commands, contact=model)
    assert compare(driven, starts, commands, like, world) > cases(40, 4)


@pytest.mark.parametrize("model", MODELS)
def test_steps_among_obstacles_equal_the_reference(model: str) -> None:
    """A box, a triangle with rounded corners and a disc; and a straight wall that nothing encloses."""
    rng = np.random.default_rng(2)
    places = [(0.5, 0.15, 0.4, BOX, 0.0), (0.25, 0.45, 1.0, TRIANGLE, 0.015), (0.75, 0.4, 0.0, DISC, 0.05)]
    polygons = [put(corners, x, y, heading, radius) for x, y, heading, corners, radius in places]
    numbers: dict[str, Any] = {}
    for k, (x, y, heading, corners, radius) in enumerate(places):
        numbers |= obstacle(k, x, y, heading, corners if k < 2 else [], radius)
    numbers |= room()
    numbers |= {
        "arena.wall.4.x1": 0.4,
        "arena.wall.4.y1": 0.6,
        "arena.wall.4.x2": 0.5,
        "arena.wall.4.y2": 0.35,
    }
    ends = [(0.0, 0.0), (WIDTH, 0.0), (WIDTH, DEPTH), (0.0, DEPTH), (0.0, 0.0)]
    polygons += [reference.Polygon([a, b]) for a, b in itertools.pairwise(ends)]
    polygons.append(reference.Polygon([(0.4, 0.6), (0.5, 0.35)]))
    like, world = body(model), reference.World([], polygons)
    inside = reference.World(planes(), polygons)
    starts = free_starts(rng, cases(30, 5), like, inside)
    commands = np.column_stack([rng.uniform(-0.2, 1, 12), rng.uniform(-0.4, 0.4, 12)])
    structure: dict[str, Any] = {
        "obstacles": [4, 3, 0],
        "obstacle_round": [False, True, True],
        "n_walls": 5,
        "enclosed": False,
    }
    driven = drive_robots({**numbers_of(starts), **numbers}, commands, contact=model, **structure)
    assert compare(driven, starts, commands, like, world) > cases(40, 4)


GIVES = [(1.0, 1.0, 171.0), (1.0, 0.3, 171.0), (3.0, 1.0, 300.0)]


@pytest.mark.parametrize(("saturation", "give"), list(itertools.product([10.0, 200.0], GIVES)))
def test_steps_of_wheels_whose_grip_gives_out_equal_the_reference(
    saturation: float, give: tuple[float, float, float]
) -> None:
    rng = np.random.default_rng(8)
    like = body(slip=0.5 / reference.SUBSTEPS / saturation, give=give)
    world = reference.World(planes())
    starts = free_starts(rng, cases(40, 6), like, world)
    commands = np.column_stack([rng.uniform(-0.2, 1, 12), rng.uniform(-0.9, 0.9, 12)])
    long, lat, ang = give
    grip = {"contact.saturation": saturation, "contact.long": long, "contact.lat": lat, "contact.ang": ang}
    driven = drive_robots({**numbers_of(starts), **room(), **grip}, commands)
    assert compare(driven, starts, commands, like, world) > cases(40, 4)


def test_only_ratios_of_what_a_body_gives_count() -> None:
    """Also where its wheels' grip gives out."""
    starts = free_starts(np.random.default_rng(9), cases(40, 6), body(), reference.World(planes()))
    driven = [
        drive_robots(
            {
                **numbers_of(starts),
                **room(),
                "contact.saturation": 30.0,
                "contact.long": times,
                "contact.lat": 0.5 * times,
                "contact.ang": 171.0 * times,
            },
            np.array([[0.8, 0.3], [0.9, -0.2], [1.0, 0.1]]),
        )
        for times in (1.0, 4.0)
    ]
    assert driven[0].stalled.any()
    np.testing.assert_allclose(driven[0].poses, driven[1].poses, atol=1e-9)


def test_grip_that_gives_out_depends_on_no_other_robot_and_hardly_on_precision() -> None:
    """Commands that are late, so that motions in two parts are met; half of the robots have no such wheels."""
    starts = free_starts(np.random.default_rng(10), 12, body(), reference.World(planes()))
    numbers = {**room(), "drive.delay": 0.2, "drive.lag": 0.1, "drive.rise": 0.2}
    commands = np.array([[0.8, 0.3], [0.9, -0.2], [1.0, 0.1], [-0.6, 0.5]])
    late: dict[str, Any] = {"late": True, "delay_steps": 1, "late_substeps": 4}
    saturation = np.tile([0.0, 40.0], 6)
    alone = [
        drive_robots(
            {**numbers_of(starts[k::2]), **numbers, "contact.saturation": saturation[k]}, commands, **late
        )
        for k in (0, 1)
    ]
    mixed = {**numbers_of(starts), **numbers, "contact.saturation": saturation}
    together = drive_robots(mixed, commands, **late)
    single = drive_robots(mixed, commands, dtype=np.float32, **late)
    assert together.stalled[:, 0::2].any()
    assert together.stalled[:, 1::2].any()
    for k in (0, 1):
        np.testing.assert_array_equal(together.poses[:, k::2], alone[k].poses)
    # Of twelve, a push of one or two may flip by rounding.
    off = np.abs(single.poses - together.poses).max(axis=(0, 2))
    assert (off < 1e-4).sum() >= 10


NOSE = (0.08, 0.05)


@given(st.floats(0.15, 1.45), st.floats(0.0, 1.2), st.sampled_from([-1, 1]))
@settings(max_examples=cases(60, 8), deadline=None)
def test_a_nose_aligns_with_a_wall_or_stalls_as_the_oracle_says(
    angle: float, friction: float, side: int
) -> None:
    """It aligns when a + atan(mu) < atan(c_x / |c_y|).

    a: between heading and wall; c: the point of contact from the axle.
    """
    border = math.atan2(NOSE[0], NOSE[1]) - angle - math.atan(friction)
    if abs(border) < 0.05:
        return
    nose = (NOSE[0], side * NOSE[1])
    numbers = {
        **SCRIBBLER, **outline([nose]), "body.0.radius": 0.0, "contact.friction": friction,
        "arena.start.x": 1.0, "arena.start.y": 1.0 if side < 0 else -1.0, "arena.start.heading": side * angle,
        **walls([(-9, -1.5), (9, -1.5), (9, 1.5), (-9, 1.5)]),
    }  # fmt: skip
    numbers["arena.start.y"] = side * (1.49 - NOSE[0] * math.sin(angle) - NOSE[1] * math.cos(angle))
    driven = drive_robots(numbers, np.tile([1.0, 0.0], (30, 1)), step_s=0.05, parts=[1])
    turned = side * (driven.poses[10, 0, 2] - driven.poses[0, 0, 2])
    assert (turned < 0) == (border > 0), (math.degrees(angle), friction, math.degrees(turned))


def lowest(
    driven: Driven, corners: Any = OUTLINE, radius: float = 0.01, width: float = WIDTH, depth: float = DEPTH
) -> float:
    """The least distance of any body from the walls of the room [m]."""
    x, y, heading = np.moveaxis(driven.poses, 2, 0)
    c, s = np.cos(heading), np.sin(heading)
    least = math.inf
    for ahead, left in corners:
        u, v = x + c * ahead - s * left, y + s * ahead + c * left
        least = min(least, u.min(), (width - u).min(), v.min(), (depth - v).min())
    return least - radius


@given(
    st.sampled_from(MODELS), st.floats(0.05, 2.0), st.floats(0, 1.5), st.sampled_from([0.02, 0.1, 0.5, 1.0]),
    st.sampled_from([np.float32, np.float64]), st.integers(0, 2**32 - 1),
)  # fmt: skip
@settings(max_examples=cases(40, 6), deadline=None)
def test_no_robot_ends_inside_a_wall(
    model: str, speed: float, friction: float, step_s: float, dtype: Any, seed: int
) -> None:
    """Speeds up to 2 m a step: beyond the room."""
    rng = np.random.default_rng(seed)
    starts = free_starts(rng, 16, body(), reference.World(planes()))
    numbers = {**numbers_of(starts), **room(), "drive.speed": speed, "contact.friction": friction}
    commands = rng.uniform(-1, 1, (20, 2, 16))
    driven = drive_robots(numbers, commands, step_s=step_s, dtype=dtype, contact=model)
    assert lowest(driven) > (-1e-6 if dtype == np.float32 else -1e-12)


def test_no_robot_passes_through_a_thin_wall_at_any_speed() -> None:
    """A wall across an open field, driven at by steps from a tenth to three times the length of the body."""
    n = 24
    speeds = np.linspace(0.03, 1.0, n)
    heading = np.linspace(-0.5, 0.5, n)
    numbers = {
        **SCRIBBLER, **outline(OUTLINE), "arena.start.x": -0.3, "arena.start.y": 0.0, "arena.start.heading": heading,
        "drive.speed": speeds, "arena.wall.0.x1": 0.0, "arena.wall.0.y1": -50.0,
        "arena.wall.0.x2": 0.0, "arena.wall.0.y2": 50.0,
    }  # fmt: skip
    for model in MODELS:
        driven = drive_robots(
            numbers, np.tile([1.0, 0.0], (40, 1)), contact=model, n_walls=1, enclosed=False, substeps=8
        )
        assert driven.poses[:, :, 0].max() < 0.0


def test_a_mirrored_room_gives_mirrored_paths() -> None:
    rng = np.random.default_rng(3)
    starts = free_starts(rng, 30, body(), reference.World(planes()))
    mirrored = [(x, DEPTH - y, -heading) for x, y, heading in starts]
    commands = np.column_stack([rng.uniform(0, 1, 20), rng.uniform(-0.3, 0.3, 20)])
    for model in MODELS:
        one = drive_robots({**numbers_of(starts), **room()}, commands, contact=model)
        two = drive_robots({**numbers_of(mirrored), **room()}, commands * [1, -1], contact=model)
        back = two.poses * [1, -1, -1] + [0, DEPTH, 0]
        difference = one.poses - back
        difference[..., 2] = np.remainder(difference[..., 2] + math.pi, math.tau) - math.pi
        # Chaotic: a last bit grows at each meeting of a corner.
        assert np.median(np.abs(difference[-1])) < 1e-9
        assert np.quantile(np.abs(difference[5]), 0.95) < 1e-7


def test_the_order_of_obstacles_does_not_matter() -> None:
    rng = np.random.default_rng(4)
    places = [(0.5, 0.15, 0.4, BOX), (0.25, 0.45, 1.0, BOX), (0.75, 0.4, 0.0, BOX)]
    world = reference.World(planes(), [put(corners, x, y, heading, 0.0) for x, y, heading, corners in places])
    starts = free_starts(rng, 20, body(), world)
    commands = np.column_stack([rng.uniform(0, 1, 15), rng.uniform(-0.3, 0.3, 15)])

    def paths(order: tuple[int, ...]) -> Driven:
        numbers: dict[str, Any] = {**numbers_of(starts), **room()}
        for k, which in enumerate(order):
            numbers |= obstacle(k, *places[which])
        return drive_robots(
            numbers, commands, obstacles=[4, 4, 4], range_response=["linear"],
        )  # fmt: skip

    one, two = paths((0, 1, 2)), paths((2, 0, 1))
    np.testing.assert_array_equal(one.poses, two.poses)
    np.testing.assert_array_equal(one.stalled, two.stalled)


def test_a_robot_goes_the_same_way_in_any_lane_and_team() -> None:
    rng = np.random.default_rng(5)
    world = reference.World(planes(), [put(BOX, 0.5, 0.3, 0.4, 0.0)])
    starts = free_starts(rng, 60, body(), world)
    commands = np.column_stack([rng.uniform(0.3, 1, 25), rng.uniform(-0.3, 0.3, 25)])
    fixed = {**room(), **obstacle(0, 0.5, 0.3, 0.4, BOX)}
    for dtype in (np.float32, np.float64):
        every = drive_robots({**numbers_of(starts), **fixed}, commands, obstacles=[4], dtype=dtype)
        some = drive_robots({**numbers_of(starts[7:12]), **fixed}, commands, obstacles=[4], dtype=dtype)
        np.testing.assert_array_equal(every.poses[:, 7:12], some.poses)
        np.testing.assert_array_equal(every.stalled[:, 7:12], some.stalled)


def test_finer_steps_lead_to_one_path() -> None:
    """The same motion in steps of 0.5 s down to 1/32 of it: the error falls about in proportion, to below 1 mm.

    Stated: within 5 mm and 0.04 rad after 0.7 m along a wall in steps of 0.5 s.
    """
    heading = np.radians([15.0, 30, 45, 60])
    numbers = {
        **SCRIBBLER, **outline(OUTLINE), "arena.start.x": 0.2, "arena.start.y": 0.45, "arena.start.heading": heading,
        **room(3.0, DEPTH),
    }  # fmt: skip

    def end(parts: int) -> Any:
        commands = np.tile([0.8, 0.05], (12 * parts, 1))
        return drive_robots(numbers, commands, step_s=0.5 / parts).poses[-1]

    finest = end(128)
    errors = np.array([np.abs(end(parts) - finest).max(0) for parts in (1, 4, 16, 32)])
    assert (errors[0] < [0.005, 0.005, 0.04]).all()
    assert (errors[-1] < [0.001, 0.001, 0.004]).all()
    order = np.log2(errors[0] / errors[-1]) / 5
    assert order[1:].min() > 0.7, (errors, order)


@pytest.mark.parametrize(("boxes", "saturation"), [(False, 0.0), (True, 0.0), (False, 30.0)])
def test_finer_parts_lead_to_one_place_for_robots_that_are_pressed(boxes: bool, saturation: float) -> None:
    """Eight steps of 0.5 s by robots that a wall, or two boxes, hold up: the error falls about in proportion.

    Stated: nine of ten robots within 10 mm and 0.15 rad of the finest.
    """
    rng = np.random.default_rng(6)
    n = cases(64, 16)
    numbers: dict[str, Any] = {**SCRIBBLER, **outline(OUTLINE), **room()}
    polygons = []
    if boxes:
        places = [(0.4, 0.4, 0.0, BOX), (0.7, 0.2, 0.5, BOX)]
        polygons = [put(corners, x, y, heading, 0.0) for x, y, heading, corners in places]
        for k, place in enumerate(places):
            numbers |= obstacle(k, *place)
        starts = free_starts(rng, n, body(), reference.World(planes(), polygons))
    else:
        starts = [(WIDTH - 0.11, 0.3 + rng.uniform(-0.1, 0.1), rng.uniform(-1.3, 1.3)) for _ in range(n)]
    numbers = {**numbers_of(starts), **numbers, "contact.saturation": saturation}
    commands = np.stack([rng.uniform(0.3, 1, n), rng.uniform(-0.6, 0.6, n)])[None].repeat(8, 0)
    structure: dict[str, Any] = {"obstacles": [4, 4]} if boxes else {}

    def end(parts: int) -> Any:
        return drive_robots(numbers, commands, substeps=parts, **structure).poses[-1]

    finest = end(128)
    sizes = []
    for parts in (4, 8, 32):
        difference = end(parts) - finest
        turned = np.abs(np.remainder(difference[:, 2] + math.pi, math.tau) - math.pi)
        away = np.hypot(difference[:, 0], difference[:, 1])
        sizes.append([np.quantile(away, 0.9), np.quantile(turned, 0.9), away.mean()])
    assert (np.array(sizes[0][:2]) < [0.01, 0.15]).all(), sizes
    assert sizes[2][2] < sizes[0][2] / 3, sizes


def test_a_disc_turns_against_a_wall_and_a_box_with_stop_does_not_turn_into_it() -> None:
    disc = {**SCRIBBLER, **outline([(0.0, 0.0)]), "body.0.radius": 0.08, **room()}
    at = {"arena.start.x": 0.9, "arena.start.y": 0.3, "arena.start.heading": 0.0}
    commands = np.array([[1.0, 0.0]] * 4 + [[0.3, 0.5]] * 4)
    driven = drive_robots({**disc, **at}, commands, parts=[1], contact="stop")
    assert driven.stalled[-5, 0]
    assert driven.poses[-1, 0, 2] - driven.poses[4, 0, 2] > 1.0
    box = {**SCRIBBLER, **outline(OUTLINE), "body.0.radius": 0.0, **room(), **at, "arena.start.x": 0.92}
    driven = drive_robots(box, np.array([[1.0, 0.0]] * 4 + [[0.0, 0.2]] * 4), contact="stop")
    assert lowest(driven, radius=0.0) > 0
