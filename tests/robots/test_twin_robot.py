"""Twins in motion: what drives, what slips, what is felt and seen."""

import math
from itertools import pairwise

import numpy as np
import pytest

from realitygap.errors import RobotError
from realitygap.platforms import SimTwin, open_twin
from realitygap.robots import Command
from realitygap.robots.twin import FAMILIES, TwinModel, TwinRobot, sample_twin
from realitygap.testing import check_robot
from realitygap.world import Arena, Grid, Obstacle, Pose, load_arena, paper_arena

pytestmark = pytest.mark.slow

pytest.importorskip("mujoco")

HEALTHY = {
    "motors": {"wander": 0.0, "delay": 0.0, "delay_jitter": 0.0, "lag": 0.0, "stepped": False},
    "encoders": {"noise_per_m": 0.0, "count": 0.0},
    "battery": {"sag": 0.0, "fall_per_s": 0.0},
    "ir": {"spread": 0.0, "noise": 0.0},
}
FIELD = Arena(
    "field", ((-3, -3, 3, -3), (3, -3, 3, 3), (3, 3, -3, 3), (-3, 3, -3, -3)), Grid(-3, -3, 0.5, 12, 12),
    Pose(0.0, 0.0, 0.0),
)  # fmt: skip


def healthy(**changes):
    """A twin without noise or delay, but for what is changed of its tables."""
    values = {name: dict(table) for name, table in HEALTHY.items()}
    for name, table in changes.items():
        values[name] = values.get(name, {}) | table
    return TwinModel(**values)


def driven(commands, *, arena=FIELD, start=None, number=0, **changes):
    """A twin after commands."""
    robot = TwinRobot(healthy(**changes), arena, number=number)
    robot.reset(start)
    for command in commands:
        robot.drive(Command(*command))
    return robot


def turned(robot):
    """How far it has turned since the start [rad]."""
    headings = np.unwrap(robot.path()[:, 2])
    return headings[-1] - headings[0]


AHEAD = [(1.0, 0.0)] * 6
SPIN = [(0.0, 1.0)] * 6


# the contract


@pytest.mark.parametrize("family", ["close", "alien", "same"])
def test_a_twin_keeps_the_contract_of_a_robot(family):
    check_robot(open_twin(sample_twin(family, 1), paper_arena()))


def test_a_trial_is_a_function_of_twin_arena_and_number():
    def trial(robot, number):
        robot.number = number
        robot.reset()
        seen = []
        for k in range(12):
            seen.append(robot.observe())
            robot.drive(Command(0.8, 0.3 if k % 3 else -0.9))
        return seen, robot.path().tolist(), robot.wheels, robot.battery_v

    for family in ("worn", "same"):
        model = sample_twin(family, 7)
        robot = open_twin(model, paper_arena())
        first = trial(robot, 3)
        other = trial(robot, 4)
        assert str(trial(robot, 3)) == str(first)  # nan is the battery of sim
        assert str(trial(open_twin(model, paper_arena()), 3)) == str(first)
        assert str(other) != str(first)


@pytest.mark.parametrize("family", ["close", "same"])
def test_the_number_of_a_trial_is_checked(family):
    robot = open_twin(sample_twin(family, 1), paper_arena())
    with pytest.raises(ValueError, match="-1"):
        robot.number = -1
    with pytest.raises(ValueError, match="-2"):
        open_twin(sample_twin(family, 1), paper_arena(), number=-2)


def test_looking_changes_nothing():
    blind, looking = (TwinRobot(sample_twin("noisy-ir", 1), paper_arena()) for _ in range(2))
    for _ in range(5):
        looking.observe()
        assert looking.observe() == looking.observe()
        for robot in (blind, looking):
            robot.drive(Command(0.5, 0.1))
    assert blind.pose == looking.pose
    assert blind.observe() == looking.observe()


def test_same_has_the_trials_of_sim_with_random_numbers_of_its_own():
    from realitygap.platforms import SimRobot
    from realitygap.trials import NoiseKey

    twin = open_twin(sample_twin("same", 4), paper_arena(), number=2)
    assert isinstance(twin, SimTwin)
    sim = SimRobot(twin.platform, paper_arena(), noise_key=twin.noise_key)
    other = SimRobot(twin.platform, paper_arena(), noise_key=NoiseKey(4, replicate=2))
    for robot in (twin, sim, other):
        for _ in range(6):
            robot.drive(Command(0.9, 0.2))
    assert twin.pose == sim.pose
    assert twin.wheels == sim.encoders
    assert twin.pose != other.pose
    assert len(twin.path()) == 7


def test_a_twin_of_sim_is_no_body_of_mujoco():
    with pytest.raises(ValueError, match="open_twin"):
        TwinRobot(sample_twin("same", 1), paper_arena())


def test_time_passes_only_in_commands_and_while_somebody_waits():
    robot = driven(AHEAD[:1])
    assert robot.clock.now() == pytest.approx(0.5)
    before = robot.pose
    robot.clock.sleep(1.0)
    assert robot.clock.now() == pytest.approx(1.5)
    assert robot.pose.x - before.x == pytest.approx(0.15, rel=0.02)  # it goes on with what it was told
    robot.stop()
    robot.clock.sleep(1.0)
    stopped = robot.pose
    robot.clock.sleep(1.0)
    assert math.dist(robot.pose[:2], stopped[:2]) < 1e-4


# motion


@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_a_healthy_twin_drives_as_far_as_it_is_told(speed):
    robot = driven([(speed, 0.0)] * 10)
    assert robot.pose.x == pytest.approx(speed * 0.15 * 5, rel=0.01)
    assert robot.wheels == pytest.approx([speed * 0.15 * 5] * 2, rel=0.01)
    assert abs(robot.pose.y) < 1e-3
    assert not robot.observe().stalled


def test_a_healthy_twin_turns_as_far_as_its_wheels_say():
    robot = driven([(0.0, 1.0)] * 10)
    assert turned(robot) == pytest.approx(2 * 0.15 * 5 / 0.153, rel=0.01)
    assert math.hypot(*robot.pose[:2]) < 2e-3
    left, right = robot.wheels
    assert left == pytest.approx(-0.75, rel=0.01)
    assert right == pytest.approx(0.75, rel=0.01)


def test_commands_mix_as_those_of_an_s2_do():
    # left = .5 - .2, right = .5 + .2, in steps of 12.5 mm/s of the faster wheel: 140 // 16 = 8 of 12
    robot = driven([(0.5, 0.2)] * 8, motors={"stepped": True})
    right = 0.15 * 8 / 12
    left = right * 3 / 7
    robot.clock.sleep(0.0)
    steady = driven([(0.5, 0.2)] * 16, motors={"stepped": True})
    way = np.subtract(steady.wheels, robot.wheels)
    assert way == pytest.approx([left * 4, right * 4], rel=0.01)


def test_an_s2_takes_a_quarter_of_a_second_to_full_speed():
    slow = driven(AHEAD[:1], motors={"stepped": True})
    # 12 ticks of 20 ms rise by a step each: 11/2 * 20 ms of full speed are lost
    assert slow.pose.x == pytest.approx(0.15 * (0.5 - 0.02 * 11 / 2), rel=0.04)


def test_delay_moves_the_start_of_a_command():
    late = driven(AHEAD, motors={"delay": 0.4})
    assert driven(AHEAD).pose.x - late.pose.x == pytest.approx(0.4 * 0.15, rel=0.02)


def test_jitter_of_the_delay_differs_from_trial_to_trial():
    ways = [driven(AHEAD[:1], motors={"delay": 0.2, "delay_jitter": 0.1}, number=k).pose.x for k in range(6)]
    assert np.ptp(ways) > 0.003
    assert min(ways) >= (0.5 - 0.31) * 0.15 * 0.97
    assert max(ways) <= (0.5 - 0.09) * 0.15


def test_lag_costs_its_time_of_way():
    lagging = driven(AHEAD, motors={"lag": 0.3})
    assert driven(AHEAD).pose.x - lagging.pose.x == pytest.approx(0.3 * 0.15, rel=0.1)


def test_a_wheel_stands_in_its_dead_band():
    assert (
        abs(driven([(0.15, 0.0)] * 4, motors={"dead_band_left": 0.2, "dead_band_right": 0.2}).pose.x) < 1e-4
    )
    robot = driven([(0.15, 0.0)] * 4, motors={"dead_band_left": 0.2})
    assert turned(robot) > 0.2
    assert driven([(0.3, 0.0)] * 4, motors={"dead_band_left": 0.2}).pose.x > 0.08


def test_wheel_with_soft_dead_band_starts_from_zero_beyond_it():
    """Without steps of speed: 0.325 of full speed is (0.325 - 0.1) / 0.9, a quarter, with a dead band of 0.1."""
    plain, both = {"stepped": False}, {"soft_dead_band_left": 0.1, "soft_dead_band_right": 0.1}
    soft = driven([(0.325, 0.0)] * 4, motors={**plain, **both}).pose.x
    assert soft == pytest.approx(driven([(0.25, 0.0)] * 4, motors=plain).pose.x, rel=0.02)
    assert abs(driven([(-0.09, 0.0)] * 4, motors={**plain, **both}).pose.x) < 1e-4
    assert turned(driven([(0.2, 0.0)] * 4, motors={**plain, "soft_dead_band_left": 0.1})) > 0.1


def test_gains_bend_the_way():
    robot = driven(AHEAD, motors={"gain_left": 0.9})
    assert robot.wheels == pytest.approx([0.9 * 0.45, 0.45], rel=0.01)
    assert turned(robot) == pytest.approx(0.1 * 0.45 / 0.153, rel=0.03)


def test_drift_turns_by_so_much_in_a_meter():
    assert turned(driven(AHEAD, motors={"drift_per_m": 0.5})) == pytest.approx(0.5 * 0.45, rel=0.03)


def test_wandering_wheels_scatter_the_heading_and_not_its_mean():
    headings = [turned(driven(AHEAD, motors={"wander": 0.05}, number=k)) for k in range(24)]
    assert 0.02 < np.std(headings) < 0.15
    assert abs(np.mean(headings)) < 3 * np.std(headings) / math.sqrt(24)


def test_a_wider_track_turns_less():
    wide = turned(driven(SPIN, wheels={"track": 0.18}))
    assert wide / turned(driven(SPIN)) == pytest.approx(0.153 / 0.18, rel=0.01)


def test_an_axle_ahead_moves_the_pen_in_a_turn():
    robot = driven(SPIN, wheels={"axle": 0.02}, body={"center": 0.03})
    center = robot.path()[:, :2].mean(axis=0)
    radii = np.hypot(*(robot.path()[:, :2] - (0.02, 0.0)).T)
    assert radii == pytest.approx(np.full(len(radii), 0.02), abs=1e-3)
    assert np.hypot(*center) > 0.005


def test_the_other_end_can_be_ahead():
    robot = driven(AHEAD, motors={"ahead": -1})
    assert robot.pose.x == pytest.approx(-0.45, rel=0.01)
    assert turned(driven(SPIN, motors={"ahead": -1})) == pytest.approx(turned(driven(SPIN)), rel=1e-3)


def test_smooth_wheels_slip_at_a_turn_and_push_less():
    grip, ice = (driven([(1, 0)] * 2 + [(0, -1)] * 4, wheels={"friction": mu}) for mu in (0.8, 0.06))
    assert grip.wheels == pytest.approx(ice.wheels, abs=0.01)
    assert math.dist(grip.pose[:2], ice.pose[:2]) > 0.01


def test_an_empty_battery_slows_motors_that_are_not_regulated():
    way = {slows: driven(AHEAD, battery={"volts": 6.0, "slows": slows}).pose.x for slows in (0.0, 1.0)}
    assert way[1.0] / way[0.0] == pytest.approx(6 / 9, rel=0.01)


def test_the_battery_sags_under_load_and_falls():
    robot = driven([*AHEAD, (0.0, 0.0)], battery={"volts": 8.0, "sag": 0.5, "fall_per_s": 0.01})
    assert robot.battery_v == pytest.approx(8.0 - 0.01 * 3.0, abs=2e-3)
    assert driven(AHEAD, battery={"volts": 8.0, "sag": 0.5}).battery_v == pytest.approx(7.5, abs=1e-9)


def test_encoders_tell_what_they_count():
    robot = driven(AHEAD, encoders={"gain_left": 1.1, "count": 0.001})
    assert robot.wheels[0] == pytest.approx(1.1 * 0.45, rel=0.01)
    assert robot.wheels[0] / 0.001 == pytest.approx(round(robot.wheels[0] / 0.001), abs=1e-6)
    told = [driven(AHEAD[:2], encoders={"noise_per_m": 0.01}, number=k).wheels[0] for k in range(30)]
    assert np.std(told) == pytest.approx(0.01 * math.sqrt(0.15), rel=0.45)


# walls


@pytest.mark.parametrize("degrees", [5, 40, 60, 80, 90])
def test_no_wall_is_passed_and_pushing_at_one_is_a_stall(degrees):
    start = Pose(0.5, 0.3, math.radians(degrees))
    robot = driven([(1.0, 0.0)] * 14, arena=paper_arena(), start=start)
    path = robot.path()
    assert path[:, 1].max() < 24 * 0.0254 - 0.079  # half the width of the shell
    assert path[:, 0].max() < 42 * 0.0254 - 0.079
    assert robot.observe().stalled
    assert min(robot.wheels) > 0.4  # they slip


def test_friction_of_walls_holds_what_slides_along_them():
    start = Pose(0.4, 0.45, math.radians(25))
    ends = [
        driven([(1.0, 0.0)] * 8, arena=paper_arena(), start=start, walls={"friction": mu}).pose.x
        for mu in (0.0, 0.9)
    ]
    assert ends[0] > ends[1] + 0.02


def test_a_box_of_cardboard_is_wider_than_the_shell():
    def clearance(**body):
        start = Pose(0.5, 0.3, math.pi / 2)
        robot = driven([(1.0, 0.0)] * 6, arena=paper_arena(), start=start, body=body)
        return 24 * 0.0254 - robot.pose.y

    assert clearance() == pytest.approx(0.089, abs=1e-3)
    assert clearance(cardboard=(0.2, 0.17)) == pytest.approx(0.1, abs=1e-3)
    assert clearance(length_scale=1.1) == pytest.approx(0.079 * 1.1 + 0.01, abs=1e-3)
    assert clearance(corner_radius=0.02) == pytest.approx(0.099, abs=1e-3)


@pytest.mark.parametrize(
    ("obstacle", "gap"),
    [
        (Obstacle(0.5, 0.0, 0.0, ((0.0, 0.0),), 0.1), 0.1),
        (Obstacle(0.5, 0.0, 0.0, ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)), 0.0), 0.1),
        (Obstacle(0.5, 0.0, 0.0, ((-0.05, -0.1), (0.05, -0.1), (0.05, 0.1), (-0.05, 0.1)), 0.03), 0.08),
        (Obstacle(0.5, 0.0, math.pi / 2, ((-0.1, 0.0), (0.1, 0.0)), 0.02), 0.02),
    ],
)
def test_obstacles_of_all_shapes_hold_it_and_are_seen(obstacle, gap):
    from dataclasses import replace

    arena = replace(FIELD, obstacles=(obstacle,))
    robot = driven([(1.0, 0.0)] * 8, arena=arena)
    assert robot.pose.x == pytest.approx(0.5 - gap - 0.089, abs=2e-3)
    assert min(robot.observe().readings) == 1.0


def test_it_stays_within_every_arena_that_comes_with_realitygap():
    from realitygap.world import arena_names, is_inside

    for name in arena_names():
        arena = load_arena(name)
        robot = TwinRobot(sample_twin("close", 1), arena)
        for k in range(30):
            robot.drive(Command(1.0, 0.5 if k % 10 > 7 else 0.0))
        x, y, _ = robot.pose
        assert is_inside(arena, x, y), name
        assert all(obstacle.distance(x, y) > 0.05 for obstacle in arena.obstacles), name


# infrared


def mean_reading(distance, *, turned_by=0.0, n=12, **changes):
    """Mean reading with the Fluke so far from a wall."""
    model = healthy(**changes)
    x = 3.0 - 0.089 * math.cos(turned_by) - distance
    robot = TwinRobot(model, FIELD)
    robot.reset(Pose(x, 0.0, turned_by))
    readings = []
    for _ in range(n):
        readings += robot.observe().readings
        robot.drive(Command(0.0, 0.0))
    return float(np.mean(readings))


def test_infrared_falls_with_the_distance():
    means = [mean_reading(d) for d in (0.02, 0.08, 0.12, 0.16, 0.3)]
    assert means == sorted(means, reverse=True)
    assert means[0] > 0.99
    assert means[2] == pytest.approx(0.5, abs=0.12)
    assert means[4] < 0.1


def test_a_slanted_wall_sends_back_less():
    straight, slanted = (mean_reading(0.12, turned_by=math.radians(a), n=20) for a in (0, 40))
    assert slanted < straight - 0.1
    flat = mean_reading(0.12, turned_by=math.radians(40), n=20, ir={"incidence": 0.0, "cone": 0.0, "rays": 1})
    assert flat > slanted


def test_a_weak_battery_weakens_infrared():
    assert mean_reading(0.13, battery={"volts": 6.5}, ir={"supply": 2.0}) < mean_reading(0.13) - 0.1


def test_raw_readings_are_a_flukes():
    robot = TwinRobot(sample_twin("close", 1), paper_arena())
    seen = robot.observe()
    assert seen.raw == pytest.approx([6400 * reading for reading in seen.readings])
    assert all(value % 640 == 0 for value in seen.raw)


def readings_of(n=60, **ir):
    """(n, 3) of a twin that stands where half the pulses come back."""
    robot = TwinRobot(healthy(ir=ir), FIELD)
    robot.reset(Pose(3.0 - 0.089 - 0.12, 0.0, 0.0))
    readings = []
    for _ in range(n):
        readings.append(robot.observe().readings)
        robot.drive(Command(0.0, 0.0))
    return np.array(readings)


def test_pulses_are_binomial_or_over_dispersed():
    binomial = readings_of().std()
    assert binomial == pytest.approx(math.sqrt(0.25 / 10), rel=0.2)
    spread = readings_of(spread=0.5).std()
    assert spread == pytest.approx(math.sqrt(0.25 / 10 * (1 + 9 * 0.5)), rel=0.2)


def test_readings_are_missed_and_remember():
    assert (readings_of(missed=0.5, half=0.4) == 0).mean() == pytest.approx(0.5, abs=0.12)
    noise = {"noise": 1.0, "pulses": 1000}
    for memory, low, high in ((0.0, -0.3, 0.3), (0.9, 0.5, 1.0)):
        one = readings_of(150, memory=memory, **noise)[:, 0]
        assert low < np.corrcoef(one[1:], one[:-1])[0, 1] < high


# what sim cannot


def test_oddities_are_seen_in_what_a_twin_does():
    plain = driven(AHEAD)
    assert turned(driven(SPIN, oddities={"swapped": True})) == pytest.approx(-turned(driven(SPIN)), rel=0.01)
    faster = driven(AHEAD, oddities={"compass": 0.5, "compass_heading": 0.0})
    assert faster.pose.x == pytest.approx(1.5 * plain.pose.x, rel=0.02)
    later = driven(AHEAD, oddities={"turn_at": 1.5, "turned_left": 0.5})
    assert later.wheels[0] == pytest.approx(0.75 * 0.45, rel=0.02)
    sticky = driven(AHEAD, oddities={"patch": {"x": 0.3, "y": 0.0, "radius": 0.1, "slows": 0.5}})
    assert sticky.pose.x == pytest.approx(0.2 + 0.5 * (0.45 - 0.2), abs=0.03)
    uphill = driven(AHEAD, oddities={"slope": 0.15}, motors={"stiffness": 0.01})
    downhill = driven(AHEAD, oddities={"slope": 0.15, "uphill": math.pi}, motors={"stiffness": 0.01})
    assert uphill.pose.x < 0.9 * plain.pose.x < downhill.pose.x


def test_readings_can_latch_and_be_inverted():
    near = Pose(3.0 - 0.089 - 0.05, 0.0, 0.0)
    robot = TwinRobot(healthy(oddities={"latch": 3}), FIELD)
    robot.reset(near)
    seen = []
    for _ in range(6):
        seen.append(max(robot.observe().readings))
        robot.drive(Command(-1.0, 0.0))
    assert seen[0] == seen[3] == 1.0
    assert seen[4] < 0.5
    far = TwinRobot(healthy(oddities={"inverted": True}), FIELD)
    assert far.observe().readings == (1.0, 1.0, 1.0)


# families


@pytest.mark.parametrize("family", [family for family in FAMILIES if family != "same"])
def test_a_hundred_twins_of_a_family_drive_without_coming_apart(family):
    arena = paper_arena()
    for seed in range(100):
        robot = TwinRobot(sample_twin(family, seed), arena)
        for command in ((1.0, 0.0), (-0.5, 1.0)):
            robot.drive(Command(*command))
        x, y, _ = robot.pose
        assert 0.05 < x < 0.9
        assert 0.05 < y < 0.55
        assert 0 <= min(robot.observe().readings) <= max(robot.observe().readings) <= 1


def test_cells_are_those_along_the_line():
    robot = driven([(1.0, 0.1)] * 12, arena=paper_arena())
    grid = paper_arena().grid
    cells = []
    path = robot.path()[:, :2]
    for a, b in pairwise(path):
        for part in np.linspace(0, 1, 20):
            x, y = a + part * (b - a)
            column, row = math.floor((x - grid.x) / grid.cell), math.floor((y - grid.y) / grid.cell)
            if 0 <= column < grid.columns and 0 <= row < grid.rows:
                cells.append(row * grid.columns + column)
    assert robot.visited_cells == tuple(dict.fromkeys(cells))


def test_a_twin_that_comes_apart_says_so():
    robot = TwinRobot(healthy(), FIELD)
    robot._physics.mj_data.qvel[0] = math.nan
    with pytest.raises(RobotError, match="physics diverged"):
        robot.drive(Command(1.0, 0.0))
