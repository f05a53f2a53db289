"""The scene kernel against the plain reference: random scenes and hand-made corners."""

from __future__ import annotations

import math
import random
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from realitygap.kernels.jyro import scene
from realitygap.trials._scene import SceneTrack, simulate_case
from realitygap.world._case import Case
from realitygap.world.jyro_stock import DEVICES, INPUTS, LIGHT_MODES, ROBOT_BODIES
from tests.reference import scene as reference
from tests.reference.trial import touch

# Kernel and reference do the same operations in the same order; sine and tanh may differ in the last bit.
LAST_BITS = 1e-13

EAST, WEST, NORTH = -math.pi / 2, math.pi / 2, 0.0
BOX = [0.0, 0.0, 2.0, 1.0]
AHEAD = {"kind": "range", "geometry": [[0.09, 0.0, 0.0]], "max_range": 0.5}


def one_robot(x: float, y: float, heading: float, **more: Any) -> dict[str, Any]:
    return {"start": {"x": x, "y": y, "heading": heading}, "commands": [[0.0, 0.0]] * 9} | more


def run(*robots: dict[str, Any], steps: int = 1, **world: Any) -> SceneTrack:
    return simulate_case(Case.from_dict({"steps": steps, "world": world, "robots": list(robots)}))


def assert_equals_reference(case: Case) -> None:
    track = simulate_case(case)
    for row in reference.run(case):
        at = (row.step, row.robot)
        assert track.stalls[at] == row.stall, at
        assert track.energies[at] == row.energy, at
        assert track.times[row.step] == row.time, at
        pose = [row.x, row.y, row.heading]
        np.testing.assert_allclose(track.poses[at], pose, rtol=0, atol=LAST_BITS, err_msg=str(at))
        command = [row.speed, row.turn_rate]
        np.testing.assert_allclose(track.commands[at], command, rtol=0, atol=LAST_BITS, err_msg=str(at))
        readings = track.readings[row.robot][row.step]
        np.testing.assert_allclose(readings, row.readings, rtol=0, atol=LAST_BITS, err_msg=str(at))


# random scenes


def random_case(seed: int) -> Case:
    """A scene with anything that the format knows; every other one on a grid of 0.1 m, where things touch."""
    rng = random.Random(seed)

    def place(low: float, high: float) -> float:
        value = rng.uniform(low, high)
        return round(value, 1) if seed % 2 else value

    width, height = rng.choice([1.0, 1.0668, 3.0]), rng.choice([0.6096, 1.0, 2.5])
    boxes = [[0, 0, width, height]]
    boxes += [[place(0, width), place(0, height), place(0, width), place(0, height)] for _ in range(seed % 3)]
    walls = [[place(0, width), place(0, height), place(0, width), place(0, height)] for _ in range(seed % 4)]
    lights = [[place(0, width), place(0, height), rng.uniform(0.1, 2)] for _ in range(rng.randrange(4))]
    steps = 25
    robots = []
    for i in range(rng.randint(1, 4)):
        devices: list[dict[str, Any]] = []
        for _ in range(rng.randrange(4)):
            kind = rng.choice(sorted(DEVICES))
            device: dict[str, Any] = {"kind": kind, "max_range": rng.choice([0.1, 0.5, 3.0])}
            device["mode"] = rng.choice(LIGHT_MODES)
            if "geometry" not in DEVICES[kind]:
                device["geometry"] = [[place(-0.2, 0.2), place(-0.2, 0.2), rng.uniform(-4, 4)]]
                if DEVICES[kind].get("type") != "light":
                    device["type"] = rng.choice(["ir", "sonar", "bumper"])
            devices.append(device)
        robot: dict[str, Any] = {
            "name": rng.choice([f"robot{i}", f"robot{i}", "a twin", "a_twin"]),
            "class": rng.choice(["Scribbler", *sorted(ROBOT_BODIES)]),
            "start": {"x": place(0.1, width), "y": place(0.1, height), "heading": rng.uniform(-7, 14)},
            "devices": devices,
        }
        if robot["class"] == "Robot":
            robot["bounding_box"] = {"x": [0.1, -0.1, -0.1], "y": [0.0, 0.1, -0.1]}
        if rng.random() < 0.6:
            speed, turn_rate = rng.uniform(-1, 1), rng.uniform(-1, 1)
            robot["commands"] = [rng.choice([[speed, turn_rate], [1, 0], [0, turn_rate], [0, 0]])] * steps
        else:
            robot["controller"] = random_controller(rng, devices)
        robots.append(robot)
    world = {"boxes": boxes, "walls": walls, "lights": lights}
    return Case.from_dict({"steps": steps, "dt": rng.choice([0.1, 0.05]), "world": world, "robots": robots})


def random_controller(rng: random.Random, devices: list[dict[str, Any]]) -> dict[str, Any]:
    n_sensors = sum(len((DEVICES[device["kind"]] | device)["geometry"]) for device in devices)
    inputs = ["time", *rng.sample(INPUTS, 2)] if n_sensors else ["stall", "time"]
    sizes = [
        sum(n_sensors if name == "all_inverted" else 1 for name in inputs),
        *rng.choice([[], [3], [4, 2]]),
        2,
    ]
    layers = [
        {
            "weights": [[rng.gauss(0, 1.5) for _ in range(n_in)] for _ in range(n_out)],
            "bias": [rng.gauss(0, 0.5) for _ in range(n_out)],
        }
        for n_in, n_out in pairwise(sizes)
    ]
    return {"inputs": inputs, "layers": layers, "output_scale": [1.0, 2.0], "sensor_max_range": 0.5}


@pytest.mark.parametrize("seed", range(60))
def test_a_random_scene_equals_the_reference(seed: int) -> None:
    assert_equals_reference(random_case(seed))


def test_random_scenes_hold_what_they_should_hold() -> None:
    cases = [random_case(seed) for seed in range(60)]
    kinds = {device.kind for case in cases for robot in case.robots for device in robot.devices}
    assert kinds == set(DEVICES)
    assert {robot.robot_class for case in cases for robot in case.robots} == set(ROBOT_BODIES)
    stalls = [simulate_case(case).stalls[1:].mean() for case in cases]
    assert 0.1 < np.mean(stalls) < 0.9


# rounding and lines


def test_round7_is_pythons_round() -> None:
    rng = random.Random(7)
    values = [rng.uniform(-1, 1) * 10.0 ** rng.randint(-9, 12) for _ in range(20_000)]
    halves = [(rng.randint(-(10**9), 10**9) + 0.5) / 1e7 for _ in range(20_000)]  # on or beside a half
    exact_halves = [k / 2.0**8 for k in range(-2000, 2000)]  # among them halves that no rounding blurs
    for value in [*values, *halves, *exact_halves, 0.0, -0.0, -1e-9, 2.0**29, math.nextafter(2.0**29, 0)]:
        assert scene.round7(value) == round(value, 7), value
    assert scene.round7(math.inf) == math.inf
    assert math.isnan(scene.round7(math.nan))


def test_lines_agree_with_exact_geometry_away_from_touching() -> None:
    """The reference does not round."""
    rng = random.Random(3)
    near = 1e-5  # how far apart the two may be, and how close to touching a case is passed over
    for _ in range(5000):
        a, b, c, d = ((rng.uniform(0, 1), rng.uniform(0, 1)) for _ in range(4))
        turn = (b[0] - a[0]) * (d[1] - c[1]) - (b[1] - a[1]) * (d[0] - c[0])
        if abs(turn) < 0.05:
            continue
        one, other = np.empty(6), np.empty(6)
        scene.set_line(one, *a, *b)
        scene.set_line(other, *c, *d)
        crossed, x, y = scene.crossing(one, other)
        along = ((c[0] - a[0]) * (d[1] - c[1]) - (c[1] - a[1]) * (d[0] - c[0])) / turn
        meet = touch(a, b, c, d)
        if crossed and meet:
            assert math.hypot(a[0] + along * (b[0] - a[0]) - x, a[1] + along * (b[1] - a[1]) - y) < near
        elif crossed != meet:
            ends = (np.hypot(x - px, y - py) for px, py in (a, b, c, d))
            assert min(ends) < near


def test_a_line_on_top_of_another_does_not_cross_it() -> None:
    for ends in [(0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)]:
        line = np.empty(6)
        scene.set_line(line, *ends)
        assert not scene.crossing(line, line)[0]


# moving


def test_forward_is_plus_y_at_heading_0_and_turns_are_counter_clockwise() -> None:
    track = run(one_robot(1.0, 0.5, NORTH, commands=[[1.0, 0.5]]), boxes=[BOX])
    assert track.poses[1, 0].tolist() == [1.0, 0.6, 0.05]


def test_the_heading_is_as_given_until_the_robot_moves() -> None:
    blocked = one_robot(1.9, 0.5, EAST, commands=[[1.0, 0.0]] * 2 + [[-1.0, 0.0]])
    track = run(blocked, boxes=[BOX], steps=3)
    assert track.stalls[:, 0].tolist() == [0, 1, 1, 0]
    assert track.poses[:, 0, 2].tolist() == [EAST, EAST, EAST, EAST + 2 * math.pi]


def test_a_blocked_robot_does_not_turn_either() -> None:
    track = run(one_robot(1.9, 0.5, EAST, commands=[[1.0, 1.0]] * 9), boxes=[BOX], steps=9)
    assert track.stalls[1:, 0].all()
    assert (track.poses == track.poses[0]).all()
    assert track.energies[:, 0].tolist() == [10000.0 - k for k in range(10)]


def test_touching_blocks_and_a_gap_of_a_tenth_of_a_micrometer_does_not() -> None:
    for gap, stall in [(0.0, 1), (4e-8, 1), (1e-7, 0)]:
        track = run(one_robot(2.0 - 0.09 - gap, 0.5, EAST), boxes=[BOX])
        assert track.stalls[1, 0] == stall, gap


def test_zero_motion_costs_nothing_and_leaves_a_free_robot_alone() -> None:
    track = run(one_robot(1.0, 0.5, 0.3), boxes=[BOX], steps=9)
    assert (track.poses == track.poses[0]).all()
    assert (track.stalls == 0).all()
    assert (track.energies == 10000.0).all()


def test_zero_command_while_overlapping_a_wall_sets_stall() -> None:
    track = run(one_robot(2.0, 0.5, EAST), boxes=[BOX])
    assert track.stalls[1, 0] == 1
    assert track.energies[1, 0] == 10000.0


def test_a_robot_wholly_past_a_wall_is_not_blocked() -> None:
    track = run(one_robot(5.0, 0.5, EAST), boxes=[BOX])
    assert track.stalls[1, 0] == 0


def test_a_step_longer_than_the_body_jumps_over_a_wall() -> None:
    track = run(one_robot(1.8, 0.5, EAST, commands=[[9.0, 0.0]]), boxes=[BOX])
    assert track.stalls[1, 0] == 0
    assert track.poses[1, 0, 0] == pytest.approx(2.7)


def test_body_edges_parallel_to_a_wall_are_caught_by_their_neighbors_only() -> None:
    """A wall that covers the front edge and ends within it touches no other edge."""
    on_the_edge = [1.09, 0.45, 1.09, 0.55]
    assert run(one_robot(1.0, 0.5, EAST), walls=[on_the_edge]).stalls[1, 0] == 0
    past_the_corner = [1.09, 0.45, 1.09, 0.60]
    assert run(one_robot(1.0, 0.5, EAST), walls=[past_the_corner]).stalls[1, 0] == 1


def test_a_body_inside_a_big_closed_shape_is_free() -> None:
    assert run(one_robot(1.0, 0.5, 0.7), boxes=[BOX]).stalls[1, 0] == 0


# several robots


def test_the_first_robot_moves_first() -> None:
    """Two robots want the same gap: the first takes it, the second meets it there."""
    left = one_robot(0.80, 0.5, EAST, commands=[[1.0, 0.0]])
    right = one_robot(1.15, 0.5, WEST, commands=[[1.0, 0.0]])
    assert run(left, right).stalls[1].tolist() == [0, 1]
    assert run(right, left).stalls[1].tolist() == [0, 1]


def test_a_robot_follows_one_that_drives_away() -> None:
    ahead = one_robot(1.19, 0.5, EAST, commands=[[1.0, 0.0]])
    behind = one_robot(1.0, 0.5, EAST, commands=[[1.0, 0.0]])
    assert run(ahead, behind).stalls[1].tolist() == [0, 0]
    assert run(behind, ahead).stalls[1].tolist() == [1, 0]


def test_robots_see_each_other_at_the_start_whatever_their_order() -> None:
    one = one_robot(0.5, 0.5, EAST, devices=[AHEAD])
    other = one_robot(1.0, 0.5, WEST, devices=[AHEAD])
    track = run(one, other)
    assert [readings[0, 0] for readings in track.readings] == pytest.approx([0.32, 0.32], abs=1e-7)


def test_robots_of_one_name_neither_touch_nor_see_each_other() -> None:
    one = one_robot(0.5, 0.5, EAST, devices=[AHEAD], name="my robot", commands=[[1.0, 0.0]] * 6)
    other = one_robot(0.8, 0.5, WEST, devices=[AHEAD], name="my_robot")
    track = run(one, other, steps=6)
    assert (track.stalls == 0).all()
    assert (track.readings[0] == 0.5).all()
    assert track.poses[6, 0, 0] == pytest.approx(1.1)


def test_a_blimp_collides_with_nothing_and_is_seen_by_nobody() -> None:
    blimp = one_robot(1.8, 0.5, EAST, commands=[[1.0, 0.0]] * 9) | {"class": "Blimp"}
    watcher = one_robot(1.6, 0.5, EAST, devices=[AHEAD])
    track = run(blimp, watcher, boxes=[BOX], steps=9)
    assert (track.stalls[:, 0] == 0).all()
    assert track.poses[9, 0, 0] == pytest.approx(2.7)
    np.testing.assert_allclose(track.readings[1], 0.31, atol=1e-7)


# sensors


def test_a_ray_reads_the_distance_from_its_mount() -> None:
    track = run(one_robot(1.6, 0.5, EAST, devices=[AHEAD]), boxes=[BOX])
    assert track.readings[0][0, 0] == pytest.approx(0.31, abs=1e-7)


def test_a_ray_along_a_wall_reads_full_range() -> None:
    on_the_ray = [1.2, 0.5, 1.4, 0.5]
    track = run(one_robot(1.0, 0.5, EAST, devices=[AHEAD]), walls=[on_the_ray])
    assert track.readings[0][0, 0] == 0.5


def test_a_mount_beyond_a_wall_reads_from_there() -> None:
    track = run(one_robot(1.95, 0.5, EAST, devices=[AHEAD]), boxes=[BOX])
    assert track.readings[0][0, 0] == 0.5


def test_a_bumper_reads_1_when_something_is_within_its_range() -> None:
    bumper = AHEAD | {"type": "bumper"}
    readings = [
        run(one_robot(x, 0.5, EAST, devices=[bumper]), boxes=[BOX]).readings[0][0, 0] for x in (1.3, 1.5)
    ]
    assert readings == [0.0, 1.0]


@pytest.mark.parametrize(("mode", "expected"), [("linear", 1 - 1 / 3), ("ambient", 0.2), ("direct", 0.04)])
def test_light_falls_off_by_its_mode_and_halves_in_a_shadow(mode: str, expected: float) -> None:
    eye = {"kind": "light", "geometry": [[0.0, 0.0, 0.0]], "max_range": 3.0, "mode": mode}
    light = [[2.0, 0.5, 1.0]]

    def reading(*others: dict[str, Any], **world: Any) -> float:
        robot = one_robot(1.0, 0.5, EAST, devices=[eye])
        return float(run(robot, *others, lights=light, **world).readings[0][0, 0])

    between = [1.5, 0.0, 1.5, 1.0]
    just_before_the_sensor = [1.05, 0.0, 1.05, 1.0]  # within the 0.1 m where no ray looks
    assert reading() == pytest.approx(expected, abs=1e-6)
    assert reading(walls=[between]) == pytest.approx(expected / 2, abs=1e-6)
    assert reading(one_robot(1.5, 0.5, 0.0)) == pytest.approx(expected / 2, abs=1e-6)
    assert reading(walls=[just_before_the_sensor]) == pytest.approx(expected, abs=1e-6)


def test_a_light_nearer_than_a_tenth_of_a_meter_is_never_in_a_shadow() -> None:
    eye = {"kind": "light", "geometry": [[0.0, 0.0, 0.0]], "max_range": 2.0}
    robot = one_robot(1.0, 0.5, EAST, devices=[eye])
    track = run(robot, lights=[[1.05, 0.5, 1.0]], walls=[[1.02, 0.0, 1.02, 1.0], [1.07, 0.0, 1.07, 1.0]])
    assert track.readings[0][0, 0] == pytest.approx(1 - 0.05 / 2.0)


CORNERS = [
    {"boxes": [BOX], "walls": [[1.09, 0.45, 1.09, 0.55]]},  # along the front edge
    {"boxes": [BOX], "walls": [[1.0, 0.5, 1.0, 0.5]]},  # a wall that is a point
    {"boxes": [BOX], "walls": [[1.3, 0.2, 1.3000001, 0.8], [1.2, 0.2, 1.2 + 1e-9, 0.8]]},  # hardly slanted
    {"boxes": [BOX], "lights": [[1.0, 0.5, 1.0], [1.05, 0.5, 1.0], [2.0, 0.5, 0.5]]},  # at the sensor
    {},  # nothing at all
]


@pytest.mark.parametrize("world", CORNERS)
@pytest.mark.parametrize("heading", [EAST, NORTH, 0.1, math.pi, -1e-17])
def test_hand_made_corners_equal_the_reference(world: dict[str, Any], heading: float) -> None:
    eye = {
        "kind": "light",
        "geometry": [[0.0, 0.0, 0.0], [0.09, 0.0, 0.0]],
        "max_range": 2.0,
        "mode": "direct",
    }
    commands = [[0.0, 0.0], [0.3, 0.0], [0.0, 0.3], [0.0, -0.3], [-1.0, 0.2], [1.0, 0.0]]
    robot = one_robot(1.0, 0.5, heading, devices=[AHEAD, eye, {"kind": "MyroIR"}], commands=commands)
    assert_equals_reference(Case.from_dict({"steps": 6, "world": world, "robots": [robot]}))
