"""Trials of several robots of `sim` in one arena, many in one call."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from realitygap.evolution import Genome, NeatSettings, Population, decode_all
from realitygap.platforms import (
    JyroPlatform,
    SimPlatform,
    SimTrials,
    SimWorld,
    open_trials,
    trace_genome,
    trace_genomes,
    try_genomes,
)
from realitygap.platforms.sim._team import SimTeam
from realitygap.tasks import AvoidTask
from realitygap.trials import MOST_TEAMS, NoiseKey, Tried, counters_of, counters_of_robot
from realitygap.world import Arena, Distribution, Pose, paper_arena
from tests.reference.coverage import cells_on_line, first_visits

pytestmark = pytest.mark.slow

OTHERS = (Pose(0.5, 0.3, 2.0), Pose(0.8, 0.4, 3.5))
ARENA = replace(paper_arena(), others=OTHERS)
TRACK = {"drive.track": Distribution(normal=(0.153, 0.004))}
KEY = 77


def population(n: int, seed: int = 4) -> list[Genome]:
    neat = NeatSettings.named("rosenzweig-remy", population=max(n, 2))
    return Population(3, 2, neat, seed=seed, bias=False).ask()[:n]


def tried(
    genomes: Sequence[Genome],
    which: Any = None,
    *,
    arena: Arena = ARENA,
    individuals: Sequence[int] | None = None,
    quiet: bool = False,
    **settings: Any,
) -> Tried:
    """Trials of a team with every step kept."""
    noise = 0.0 if quiet else 0.1
    platform = SimPlatform(**{"steps": 40, "set": TRACK, "noise": not quiet, **settings})
    trials = open_trials(platform, arena, genomes[0].rules, noise=noise, bias_value=genomes[0].bias_value)
    which = np.arange(len(genomes), dtype=np.int32) if which is None else np.asarray(which, np.int32)
    counters = counters_of(NoiseKey(KEY), 1 + max(individuals or [len(which)]))
    counters = counters[list(individuals)] if individuals is not None else counters[: len(which)]
    return trials.carry_out(decode_all(genomes), which, KEY, counters, ends=True, trace=True)


def same(first: Tried, second: Tried, trials: Sequence[int], n_robots: int) -> bool:
    """Whether trial k of the second is trial `trials[k]` of the first, bit for bit."""
    columns = [n_robots * k + robot for k in trials for robot in range(n_robots)]
    rows = [
        (first.batch.cells, second.batch.cells),
        (first.batch.n_line, second.batch.n_line),
        (first.batch.n_ends, second.batch.n_ends),
        (first.batch.n_stalls, second.batch.n_stalls),
        (first.batch.drawn, second.batch.drawn),
        (first.ends, second.ends),
        (first.ended, second.ended),
    ]
    traces = [*zip(first.trace, second.trace, strict=True), (first.distances, second.distances)]
    return all(np.array_equal(one[list(trials)], other) for one, other in rows) and all(
        np.array_equal(one[..., columns], other) for one, other in traces
    )


@pytest.mark.parametrize("precision", ["single", "double"])
def test_team_equals_the_world_with_the_same_commands_and_random_numbers(precision: Any) -> None:
    """Bit for bit: readings, stalls, cells; noise and numbers drawn for each robot included."""
    n, n_robots = 6, 3
    team = tried(population(n), precision=precision)
    platform = SimPlatform(steps=40, set=TRACK, precision=precision)
    met = 0
    for k in range(n):
        world = SimWorld(ARENA.alone)
        robots = [
            world.add(platform, start, noise=0.1, noise_key=NoiseKey(KEY, individual=k + robot * MOST_TEAMS))
            for robot, start in enumerate((ARENA.start, *OTHERS))
        ]
        visited = []
        for step in range(41):
            for robot, body in enumerate(robots):
                column = n_robots * k + robot
                readings = np.array(list(body.readings.values()))
                assert np.array_equal(readings, team.trace.readings[step, :, column])
                assert body.stalled == team.trace.stalled[step, column]
                visited += [
                    cell for cell in body._cells[0, : body._room.lanes.n_line[0]] if cell not in visited
                ]
                if step < 40:
                    body.move(*team.trace.commands[step, :, column].astype(float))
            met += sum(body.stalled for body in robots)
            if step < 40:
                world.step()
        assert team.batch.behavior(k).tolist() == visited
    assert met > 20  # robots and walls were met


def test_team_of_one_robot_equals_trials_of_one_robot() -> None:
    genomes, arena = population(70), paper_arena()
    platform = SimPlatform(steps=40, set=TRACK)
    ready: dict[str, Any] = {
        "inputs": ("obstacle", "stall", "time"), "noise": 0.1, "bias_value": genomes[0].bias_value
    }  # fmt: skip
    which, counters = np.arange(70, dtype=np.int32), counters_of(NoiseKey(KEY), 70)
    alone, team = (
        trials(platform, arena, genomes[0].rules, **ready).carry_out(
            decode_all(genomes), which, KEY, counters, ends=True, trace=True
        )
        for trials in (SimTrials, SimTeam)
    )
    assert same(alone, team, range(70), 1)


def test_trial_does_not_depend_on_its_neighbors_in_a_block() -> None:
    """130 trials fill two blocks of lanes and begin a third; networks differ in size."""
    genomes = population(130)
    together = tried(genomes)
    backward = list(reversed(range(130)))
    assert same(together, tried(genomes, backward, individuals=backward), backward, 3)
    for k in (0, 63, 64, 129):
        assert same(together, tried([genomes[k]], individuals=[k]), [k], 3)


def test_robots_in_another_order_do_the_same_if_they_do_not_touch() -> None:
    """Without noise; robots see each other all the same."""
    genomes = population(24)
    arena = replace(paper_arena(Pose(0.2, 0.3, 1.0)), others=(Pose(0.85, 0.3, 2.5),))
    swapped = replace(paper_arena(arena.others[0]), others=(arena.start,))
    first, second = (tried(genomes, arena=each, quiet=True, set={}, steps=3) for each in (arena, swapped))
    seen = first.distances[:, :, 0].min()
    assert seen < 0.3
    compared = 0
    for k in range(24):
        if first.batch.n_stalls[k] == second.batch.n_stalls[k] == 0:
            compared += 1
            for robot in range(2):
                a, b = 2 * k + robot, 2 * k + 1 - robot
                assert np.array_equal(first.trace.readings[..., a], second.trace.readings[..., b])
                assert np.array_equal(first.trace.commands[..., a], second.trace.commands[..., b])
            assert set(first.batch.behavior(k)) == set(second.batch.behavior(k))
    assert compared > 10


def test_each_robot_follows_its_own_network() -> None:
    """A robot that drives the network of another draws its own noise, and starts elsewhere."""
    genomes = population(5)
    teams = np.array([[0, 1, 2], [3, 3, 4], [2, 2, 2]], np.int32)
    mixed, clones = tried(genomes, teams), tried(genomes, [2, 2, 2])
    assert same(clones, tried(genomes, [2, 2, 2]), range(3), 3)
    columns = [6, 7, 8]
    assert np.array_equal(mixed.trace.commands[..., columns], clones.trace.commands[..., columns])
    assert not np.array_equal(mixed.trace.commands[..., :3], clones.trace.commands[..., :3])


def test_coverage_is_that_of_all_robots() -> None:
    """Against the plain reference: cells on the lines between the poses of every robot."""
    genomes = population(12)
    team = tried(genomes, precision="double")
    grid = ARENA.grid
    trajectories = trace_genomes(
        SimPlatform(steps=40, set=TRACK, precision="double"),
        ARENA,
        genomes,
        noise=0.1,
        noise_key=NoiseKey(KEY),
    )
    assert np.array_equal(trajectories.arrays.poses, team.trace.poses)
    for k in range(12):
        cells: set[int] = set()
        for robot in range(3):
            poses: NDArray[np.float64] = trajectories.poses[3 * k + robot]
            path = ((poses[:, :2] - [grid.x, grid.y]) / grid.cell).tolist()
            lines = [cells_on_line(*a, *b) for a, b in itertools.pairwise(path)]
            cells |= set(first_visits([cell for line in lines for cell in line], grid.columns, grid.rows))
        assert set(team.batch.behavior(k).tolist()) == cells
        assert trajectories.coverage_line[3 * k] == trajectories.coverage_line[3 * k + 2] == len(cells) / 72
    starts = np.round(trajectories.poses[:3, 0], 6)
    assert starts == pytest.approx(np.array([ARENA.start, *OTHERS]), abs=1e-6)


def test_traced_genome_has_all_robots() -> None:
    genomes = population(3)
    key = NoiseKey(KEY, individual=2)
    platform = SimPlatform(steps=40)
    alike = trace_genome(platform, ARENA, genomes[0], noise=0.1, noise_key=key)
    batch = try_genomes(platform, ARENA, [genomes[0]], noise=0.1, noise_key=key)
    assert alike.cells == tuple(batch.behavior(0))
    assert alike.n_stalls == batch.n_stalls[0]
    assert len(alike.robots) == 3
    assert alike.robots[2].poses[0] == pytest.approx(OTHERS[1], abs=1e-6)
    team = trace_genome(platform, ARENA, genomes[0], noise=0.1, noise_key=key, partners=[genomes[0]] * 2)
    assert team.cells == alike.cells
    other = trace_genome(platform, ARENA, genomes[0], noise=0.1, noise_key=key, partners=genomes[1:])
    assert not np.array_equal(other.robots[1].commands, alike.robots[1].commands)


def test_avoidance_scores_each_robot_among_the_others() -> None:
    """Two robots that face each other: each is scored by what it sees of the other one."""
    facing = replace(paper_arena(Pose(0.35, 0.3, 0.0)), others=(Pose(0.6, 0.3, np.pi),))
    inputs = ("range.0", "range.1", "bias")
    neat = NeatSettings.named("rosenzweig-remy", population=2)
    genomes = Population(2, 2, neat, seed=4, bias=True).ask()
    platform, key = SimPlatform(steps=5), NoiseKey(KEY)
    two, one = (
        trace_genomes(platform, arena, genomes, noise=0.0, noise_key=key, inputs=inputs)
        for arena in (facing, facing.alone)
    )
    assert two.readings_of("range")[0, 0].max() > one.readings_of("range")[0, 0].max() + 0.1
    assert (two.readings_of("range")[:2, 0].max(axis=1) > 0.3).all()
    scores = AvoidTask(inputs=inputs).fitness(two, facing)
    assert scores.shape == (4,)
    assert AvoidTask(inputs=inputs).fitness(one, facing)[0] > scores[0]


def test_random_numbers_of_robots_do_not_repeat() -> None:
    counters = counters_of(NoiseKey(1, replicate=3, generation=5), 4)
    words = [counters_of_robot(counters, robot) for robot in range(16)]
    assert np.array_equal(words[0], counters)
    assert len({tuple(row) for word in words for row in word.tolist()}) == 64
    assert {int(word) & 0xFF for word in np.concatenate(words)[:, 0]} == {1}
    with pytest.raises(ValueError, match="more than 1,048,576 individuals"):
        counters_of_robot(counters_of(NoiseKey(1, individual=MOST_TEAMS)), 1)


@pytest.mark.parametrize(
    ("platform", "arena", "message"),
    [
        (JyroPlatform(), ARENA, "arena.robots is 3, expected 1 with platform 'jyro'.*such as sim"),
        (SimPlatform(), replace(ARENA, others=(Pose(0.21, 0.2, 0.0),)), "robots 0 and 1 overlap at their starts"),
        (SimPlatform(), replace(ARENA, others=(Pose(0.5, 0.05, 0.0),)), "robot 1: the robot does not fit"),
        (SimPlatform(), replace(ARENA, others=OTHERS * 8), "There are 17 robots, expected at most 16"),
        (
            SimPlatform(set={"arena.start.x": {"uniform": [0.19, 0.2]}}),
            ARENA,
            "arena.start.x: drawn, expected plain numbers with several robots",
        ),
    ],
)  # fmt: skip
def test_teams_that_cannot_be_are_refused(platform: Any, arena: Arena, message: str) -> None:
    genomes = population(1)
    with pytest.raises(ValueError, match=message):
        open_trials(platform, arena, genomes[0].rules, noise=0.0, bias_value=1.0)
