"""Trials on the platform `sim`: bound to its kernels, randomized, and stepped one command at a time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.kernels.sim.shape import sim_rows
from realitygap.platforms import (
    JyroPlatform,
    SimPlatform,
    SimRobot,
    retry_genomes,
    trace_genome,
    trace_genomes,
    try_genomes,
)
from realitygap.platforms.sim._scene import sim_scene
from realitygap.robots import Command, Robot
from realitygap.testing import check_robot
from realitygap.trials import NoiseKey
from realitygap.world import (
    NAMED_STARTS,
    Distribution,
    Pose,
    load_arena,
    load_robot,
    paper_arena,
    robot_names,
)

pytestmark = pytest.mark.slow

KEY = NoiseKey(0x9E3779B97F4A7C15, replicate=3, generation=2, individual=5, repeat=1)
RANDOM: dict[str, Any] = {
    "drive.track": {"normal": [0.153, 0.002], "per": "run"},
    "drive.speed": {"uniform": [0.1, 0.15]},
    "contact.friction": {"choice": [0.1, 0.3], "per": "study"},
    "arena.start.x": {"uniform": [0.18, 0.2]},
}


def genomes(n: int, n_inputs: int = 3) -> list[Genome]:
    settings = NeatSettings.named("rosenzweig-remy", population=n, add_node=0.5, weight_step=5.0)
    population = Population(n_inputs, 2, settings, seed=11, bias=False)
    population.tell(list(range(n)))
    return population.ask()


@pytest.mark.parametrize(
    ("name", "noise"), [("paper", 0.0), ("paper", 0.5), ("paper-boxes", 0.0), ("maze-medium", 0.0)]
)
def test_the_robot_of_jyro_drives_the_trials_of_platform_jyro(name, noise):
    """Among obstacles too: what counts is where a step ends, and not where it is before it turns there."""
    arena, population = load_arena(name), genomes(70)
    jyro = try_genomes(JyroPlatform(precision="double"), arena, population, noise=noise, noise_key=KEY)
    platform = SimPlatform(robot="jyro", steps=87, precision="double")
    sim = try_genomes(platform, arena, population, noise=noise, noise_key=KEY)
    np.testing.assert_array_equal(sim.cells, jyro.cells)
    for name in ("n_line", "n_ends", "n_stalls"):
        np.testing.assert_array_equal(getattr(sim, name), getattr(jyro, name))
    assert sim.n_stalls.sum() > 100


def test_a_trial_does_not_depend_on_which_others_are_tried_with_it():
    platform, arena, population = SimPlatform(set=RANDOM, steps=40), paper_arena(), genomes(70)
    key = replace(KEY, individual=0)
    together = try_genomes(platform, arena, population, noise=0.1, noise_key=key)
    traced = trace_genomes(platform, arena, population, noise=0.1, noise_key=key)
    assert len(np.unique(together.drawn[:, 1])) == 70
    for k in (0, 63, 64, 69):
        alone = trace_genome(platform, arena, population[k], noise=0.1, noise_key=replace(key, individual=k))
        assert alone.cells == tuple(together.behavior(k).tolist())
        assert alone.drawn == tuple(together.drawn[k].tolist())
        assert alone.stalled.sum() == together.n_stalls[k]
        np.testing.assert_array_equal(alone.wheels, traced.wheels[k])
        # of a drawn start, poses are from where the arena says that trials begin
        np.testing.assert_array_equal(alone.poses, traced.poses[k])
        np.testing.assert_array_equal(alone.answers, traced.readings[k])


def test_numbers_are_drawn_per_trial_run_or_study():
    platform, arena, population = SimPlatform(set=RANDOM, steps=1), paper_arena(), genomes(8)

    def drawn(**key: int) -> dict[str, np.ndarray]:
        batch = try_genomes(platform, arena, population, noise=0.0, noise_key=replace(KEY, **key))
        assert batch.drawn_names == tuple(sorted(RANDOM, key=batch.drawn_names.index))
        return dict(zip(batch.drawn_names, batch.drawn.T, strict=True))

    here, next_generation, next_run = drawn(), drawn(generation=3), drawn(replicate=4)
    for name in ("drive.track", "contact.friction"):
        assert len(set(here[name])) == 1
        assert here[name][0] == next_generation[name][0]
    assert here["drive.track"][0] != next_run["drive.track"][0]
    assert here["contact.friction"][0] == next_run["contact.friction"][0]
    for name in ("drive.speed", "arena.start.x"):
        assert len({*here[name], *next_generation[name], *next_run[name]}) == 24
    assert drawn(repeat=2)["drive.speed"][0] != here["drive.speed"][0]
    assert drawn(repeat=2)["drive.track"][0] == here["drive.track"][0]


def test_samples_of_a_number_do_not_depend_on_the_others():
    arena, population = paper_arena(), genomes(8)
    few = SimPlatform(set={"drive.speed": RANDOM["drive.speed"]}, steps=1)
    many = SimPlatform(set=RANDOM, steps=1)
    one, other = (
        try_genomes(platform, arena, population, noise=0.0, noise_key=KEY) for platform in (few, many)
    )
    np.testing.assert_array_equal(one.drawn[:, 0], other.drawn[:, other.drawn_names.index("drive.speed")])


def test_samples_follow_their_distribution():
    """4,000 numbers: their mean is off by more than 4 standard errors once in 16,000 seeds."""
    platform = SimPlatform(set={"drive.speed": {"uniform": [0.1, 0.2]}}, steps=1)
    batch = retry_genomes(
        platform, paper_arena(), genomes(2), noise=0.0, noise_keys=[KEY] * 2, repeats=range(4000)
    )
    drawn = batch.drawn[:4000, 0]
    assert 0.1 < drawn.min() < 0.1001
    assert 0.1999 < drawn.max() < 0.2
    assert abs(drawn.mean() - 0.15) < 4 * 0.1 / np.sqrt(12 * 4000)


def test_a_drawn_number_does_what_the_same_plain_number_does():
    arena, population = paper_arena(), genomes(6)
    # Speeds that are as good as equal, so that steps have as many parts.
    values = {**RANDOM, "drive.speed": {"uniform": [0.147, 0.15]}}
    drawn = try_genomes(SimPlatform(set=values), arena, population, noise=0.0, noise_key=KEY)
    for k, genome in enumerate(population):
        plain = dict(zip(drawn.drawn_names, drawn.drawn[k].tolist(), strict=True))
        one = SimPlatform(set=plain)
        moved = replace(arena, start=Pose(plain["arena.start.x"], arena.start.y, arena.start.heading))
        key = replace(KEY, individual=KEY.individual + k)
        alone = try_genomes(one, moved, [genome], noise=0.0, noise_key=key)
        assert abs(int(alone.n_line[0]) - int(drawn.n_line[k])) <= 1  # positions round from another origin


@pytest.mark.parametrize(
    ("robot", "settings", "noise"),
    [
        ("scribbler-s2-fluke2", {"set": RANDOM}, 0.1),
        ("jyro", {"steps": 60}, 0.5),
        ("khepera", {"steps": 60, "contact": "stop"}, 0.0),
    ],
)
def test_a_controller_on_the_robot_drives_the_trial_of_the_population(robot, settings, noise):
    platform = SimPlatform(robot=robot, precision="double", **settings)
    arena, population = paper_arena(), genomes(6)
    batch = try_genomes(platform, arena, population, noise=noise, noise_key=KEY)
    for k, genome in enumerate(population):
        key = replace(KEY, individual=KEY.individual + k)
        trial = trace_genome(platform, arena, genome, noise=noise, noise_key=key)
        network = genome.network()
        with SimRobot(platform, arena, noise=noise, noise_key=key) as stepped:
            assert isinstance(stepped, Robot)
            assert tuple(stepped.drawn.values()) == trial.drawn
            for step in range(platform.steps):
                seen = stepped.observe()
                inputs = [max(seen.readings), float(seen.stalled), step / platform.steps]
                assert inputs == trial.inputs[step].tolist()
                stepped.drive(Command(*network.activate(inputs)))
                assert list(stepped.pose) == trial.poses[step + 1].tolist()
                assert list(stepped.wheels) == trial.wheels[step + 1].tolist()
            assert stepped.visited_cells == tuple(batch.behavior(k).tolist())
            assert stepped.n_blocked == batch.n_stalls[k]


def test_the_robot_meets_the_contract():
    check_robot(SimRobot(SimPlatform(steps=10)))


def test_a_trial_of_the_robot_begins_anew_or_at_another_pose():
    robot = SimRobot(SimPlatform(set=RANDOM), noise=0.3, noise_key=KEY)
    first = robot.observe(), robot.drawn, robot.pose
    robot.drive(Command(1.0, 0.5))
    robot.reset()
    assert (robot.observe(), robot.drawn, robot.pose) == first
    robot.reset(Pose(0.5, 0.3, 1.0))
    assert robot.pose == pytest.approx((0.5, 0.3, 1.0))


@pytest.mark.parametrize("name", robot_names())
def test_every_number_of_every_robot_has_its_row(name):
    platform = SimPlatform(robot=name)
    scene = sim_scene(platform, paper_arena(NAMED_STARTS["center"]), ("obstacle", "stall", "time"), 0.0)
    rows = sim_rows(scene.shape)
    assert set(load_robot(name).numbers()) <= set(rows)
    assert scene.table(scene.fixed).shape == (len(rows), 1)


def test_a_platform_without_noise_is_the_same_in_every_repeat():
    arena, population = paper_arena(), genomes(3)
    for noise, same in ((False, True), (True, False)):
        platform = SimPlatform(noise=noise)
        keys = [replace(KEY, individual=k) for k in range(3)]
        batch = retry_genomes(platform, arena, population, noise=0.0, noise_keys=keys, repeats=range(3))
        assert (len({row.tobytes() for row in batch.cells}) <= 3) == same


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"robot": "scribler"}, "SimPlatform.robot: Unknown robot 'scribler'"),
        ({"set": {"drive.trak": 0.1}}, "drive.trak: no number of this name. Did you mean 'drive.track'?"),
        ({"set": {"drive.track": -0.1}}, "drive.track: expected more than 0"),
        ({"set": {"drive.track": "wide"}}, "drive.track: expected a number, or how it is drawn"),
        (
            {"set": {"drive.track": float("nan"), "drive.lag": 0.1}},
            "drive.track: expected a finite number, got nan",
        ),
        ({"set": {"drive.track": {"normal": [0.1]}}}, "drive.track.normal"),
        ({"set": {"drive.track": {"uniform": [-1.0, 2.0]}}}, "drive.track: expected numbers more than 0"),
        ({"contact": "bounce"}, "expected 'robot', 'freeze', 'stop' or 'slide', got 'bounce'"),
        (
            {"set": {"contact.model": {"choice": [1.0]}}},
            "contact.model: the same in all trials, and no number",
        ),
        ({"set": {"body": 1.0}}, "body: the same in all trials, and no number"),
        (
            {"set": {"steps": {"uniform": [1, 2]}}},
            "steps: a setting of [platform.sim] itself, write it there",
        ),
    ],
)
def test_a_mistake_is_said(values, text):
    with pytest.raises(ValueError) as raised:  # noqa: PT011 - its text is looked at
        SimPlatform(**values)
    assert text in str(raised.value)


def test_all_mistakes_in_numbers_are_said_at_once():
    """They came in rounds: those of one number alone, then unknown names, then limits."""
    wrong = {
        "drive.track": "wide", "drive.lag": {"uniform": [2, 1]}, "drive.trak": 0.1, "contact.model": 1, "steps": 5,
        "drive.speed": -1.0, "drive.delay": {"normal": [-1.0, 0.1]}, "drive.gain_left": 1.0,
    }  # fmt: skip
    with pytest.raises(ValueError, match="set") as raised:
        SimPlatform(set=wrong)
    said = str(raised.value)
    assert [name for name in wrong if f"{name}:" not in said.replace(".uniform:", ":")] == ["drive.gain_left"]
    assert said.count("; ") == len(wrong) - 2


@pytest.mark.parametrize(
    ("inputs", "text"),
    [
        (("obstacle", "speed"), "light.0 to light.2, .*: speed is missing"),
        (("range.3",), "'scribbler-s2-fluke2' in arena .*range.0 to range.2, .*: range.3 is missing"),
        (("goal_distance",), "arena 'paper' has .*: goal_distance is missing"),
    ],
)
def test_inputs_that_are_not_there_are_refused(inputs, text):
    with pytest.raises(ValueError, match=text):
        try_genomes(
            SimPlatform(), paper_arena(), genomes(2, len(inputs)), noise=0.0, noise_key=KEY, inputs=inputs
        )


def test_a_distribution_of_an_arena_is_no_number_of_the_robot():
    platform = SimPlatform(set={"arena.start.y": Distribution(uniform=(0.18, 0.2))})
    assert platform.model == SimPlatform().model
    assert list(platform.arena_numbers) == ["arena.start.y"]
