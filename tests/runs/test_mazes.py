"""The disc in Lehman & Stanley's mazes: against a plain one, hand-made corners, and what must hold of any maze."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.runs import MAZE_REWARDS, MazeTrials, run_maze
from realitygap.runs._published import _EndsArchive
from realitygap.tasks import MAZE_TASKS, MazeAgent, MazeTask
from realitygap.tasks._published import UNIT
from realitygap.world import Arena, Goal, Grid, Pose, load_arena
from tests.reference import maze as reference
from tests.reference.effort import COMPILED, cases
from tests.reference.novelty import NearestArchive

pytestmark = pytest.mark.slow

FAR_EXIT = (1000.0, 0.0)
BIAS = 10  # number of the constant input


def arena(
    walls: Sequence[reference.Wall], start: Sequence[float], exit_: reference.Point = FAR_EXIT
) -> Arena:
    """A maze in units, its start with a heading in degrees."""
    x, y, heading = start
    return Arena(
        "test",
        tuple(tuple(value * UNIT for value in wall) for wall in walls),
        Grid(0.0, 0.0, 1.0, 1, 1),
        Pose(x * UNIT, y * UNIT, math.radians(heading)),
        goal=Goal(exit_[0] * UNIT, exit_[1] * UNIT, 5 * UNIT),
    )


def networks(n: int, seed: int, n_generations: int = 0) -> list[Genome]:
    """Networks, some with hidden nodes where generations have passed."""
    population = Population(10, 2, NeatSettings(population=n, add_node=0.3), seed=seed)
    rng = np.random.default_rng(seed)
    for _ in range(n_generations):
        population.tell(rng.random(n))
    return population.ask()


def constant(turn: float, push: float) -> Genome:
    """A network that always gives these outputs, each above 0 and below 1."""
    genome = networks(2, 1)[0]
    arrays, row = genome._genomes, 0
    for gene in range(arrays.n_connections[row]):
        output = (turn, push)[arrays.target[row, gene] - genome.rules.n_inputs]
        weight = math.log(output / (1 - output)) / genome.rules.activation_slope
        arrays.weight[row, gene] = weight if arrays.source[row, gene] == BIAS else 0.0
    return genome


def driven(place: Arena, genome: Genome, steps: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Poses (units, degrees) and inputs."""
    path = MazeTrials(place, MazeAgent(steps=steps), precision="double").path(genome)
    return path.poses / [UNIT, UNIT, math.radians(1)], path.inputs


def in_units(place: Arena) -> reference.Disc:
    walls = [tuple(value / UNIT for value in wall) for wall in place.walls]
    goal = place.goal
    assert goal is not None
    start = (place.start.x / UNIT, place.start.y / UNIT)
    return reference.Disc(
        walls,
        (goal.x / UNIT, goal.y / UNIT),
        start,
        math.degrees(place.start.heading),
        arrival=goal.radius / UNIT,
    )


@pytest.mark.parametrize("name", MAZE_TASKS)
def test_trials_equal_those_of_the_plain_disc_step_by_step(name: str) -> None:
    """Each step from where the kernel's disc stands, since the smallest difference grows in a closed loop."""
    place = load_arena(name)
    steps = cases(400, 30)
    for genome in networks(cases(10, 2), seed=3, n_generations=3):
        network, disc = genome.network(), in_units(place)
        poses, inputs = driven(place, genome, steps)
        for step, seen in enumerate(inputs):
            disc.place, disc.heading = (poses[step, 0], poses[step, 1]), poses[step, 2]
            assert seen == pytest.approx(np.array(disc.sees()), abs=1e-9)
            turn, push = network.activate(seen[:-1])
            disc.step(turn, push)
            assert poses[step + 1, :2] == pytest.approx(np.array(disc.place), abs=1e-9)
            assert abs((poses[step + 1, 2] - disc.heading + 180) % 360 - 180) < 1e-9
        assert disc.is_there() == (len(inputs) < steps)


def test_a_whole_trial_equals_the_plain_discs() -> None:
    place = load_arena("maze-medium")
    for genome in networks(4, seed=4):
        network = genome.network()
        poses, _ = reference.drive(
            in_units(place), lambda seen, of=network: tuple(of.activate(seen[:-1])), 100
        )
        found, _ = driven(place, genome, 100)
        assert found[:, :2] == pytest.approx(np.array(poses)[:, :2], abs=1e-6)


def test_single_precision_tells_the_same_but_for_what_rounding_grows_to() -> None:
    place = load_arena("maze-hard")
    genomes = networks(cases(64, 4), seed=5)
    single = MazeTrials(place, MazeAgent(steps=100)).try_all(genomes).ends
    double = MazeTrials(place, MazeAgent(steps=100), precision="double").try_all(genomes).ends
    apart = np.hypot(*(single - double).T)
    assert np.median(apart) < 1e-5
    assert (apart < 0.01).mean() > 0.9


def test_a_disc_sees_the_walls_at_the_start_of_the_hard_maze() -> None:
    """The trap of one re-implementation: the pie slices must not overwrite the sixth range finder."""
    _, inputs = driven(load_arena("maze-hard"), constant(0.5, 0.5), 1)
    right, ahead_right, ahead, ahead_left, left, behind = inputs[0, :6]
    assert behind == pytest.approx((36 - 5) / 100)
    assert left == pytest.approx((200 - 184) / 100)
    # (77, 200) to (108, 164) is met at y = 184
    assert ahead == pytest.approx((77 + 31 * 16 / 36 - 36) / 100)
    assert ahead_left == pytest.approx(16 * math.sqrt(2) / 100)
    assert 0 < ahead_right <= 1
    # (5, 80) to (33, 121) ends left of x = 36, so that (5, 49) to (57, 53) is met, which is out of reach
    assert right == 1.0
    assert inputs[0, 6:].tolist() == [0.0, 0.0, 0.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("exit_", "expected"),
    [
        ((50, 10), 0), ((10, 50), 1), ((-50, 10), 2), ((10, -50), 3), ((50, -10), 0), ((-50, -10), 2),
        ((50, 50), 1), ((-50, 50), 2), ((-50, -50), 3), ((50, -50), 0),
    ],
)  # fmt: skip
@pytest.mark.parametrize("heading", [0, 90, 180, 270])
def test_the_slice_that_holds_the_exit_is_one_whatever_stands_between(
    exit_: reference.Point, expected: int, heading: int
) -> None:
    """A border belongs to the slice left of it."""
    turned = {0: exit_, 90: (-exit_[1], exit_[0]), 180: (-exit_[0], -exit_[1]), 270: (exit_[1], -exit_[0])}[
        heading
    ]
    place = arena([(20, -20, 20, 20)], (0, 0, heading), turned)
    _, inputs = driven(place, constant(0.5, 0.5), 1)
    assert inputs[0, 6:10].tolist() == [float(k == expected) for k in range(4)]


def test_a_disc_gathers_speed_up_to_the_limit_and_moves_along_the_heading_from_before() -> None:
    poses, _ = driven(arena([(500, -9, 500, 9)], (0, 0, 0)), constant(0.9, 0.9), 40)
    assert poses[1] == pytest.approx([0.4, 0.0, 0.4])
    assert poses[2, :2] == pytest.approx(
        [0.4 + 0.8 * math.cos(math.radians(0.4)), 0.8 * math.sin(math.radians(0.4))]
    )
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    assert steps == pytest.approx([min(0.4 * (k + 1), 3.0) for k in range(40)])
    turns = (np.diff(poses[:, 2]) + 180) % 360 - 180
    assert turns == pytest.approx([min(0.4 * (k + 1), 3.0) for k in range(40)])


def test_a_move_that_would_end_nearer_than_the_radius_is_refused_but_its_turn_is_not() -> None:
    # By 0.25, 0.5, 0.75 and 1 to 2.5, which is 8 from a wall at 10.5.
    poses, _ = driven(arena([(10.501, -50, 10.501, 50)], (0, 0, 0)), constant(0.5, 0.75), 4)
    assert poses[:, 0] == pytest.approx([0, 0.25, 0.75, 1.5, 2.5], abs=1e-9)
    poses, _ = driven(arena([(10.499, -50, 10.499, 50)], (0, 0, 0)), constant(0.75, 0.75), 4)
    assert poses[4, 0] == poses[3, 0]
    assert poses[4, 2] == pytest.approx(0.25 + 0.5 + 0.75 + 1.0)


def test_the_end_of_a_wall_is_round_for_a_disc() -> None:
    """It passes a wall's end at 8.01 to its side and is held by one at 7.5, which no step of 3 skips."""
    for side, passes in ((8.01, True), (7.5, False)):
        poses, _ = driven(arena([(30, side, 30, side + 40)], (0, 0, 0)), constant(0.5, 0.9), 30)
        assert (poses[-1, 0] > 40) == passes


def test_a_wall_of_no_length_is_a_point() -> None:
    poses, inputs = driven(arena([(30, 0, 30, 0)], (0, 0, 0)), constant(0.5, 0.9), 60)
    assert 30 - 8 - 3 < poses[-1, 0] <= 22 + 1e-9
    assert inputs[0, :6].tolist() == [1.0] * 6


def test_a_ray_sees_a_walls_end_and_no_wall_that_lies_along_it() -> None:
    _, inputs = driven(
        arena([(20, 0, 60, 0), (0, 30, 40, 70), (-25, 0, -25, 9)], (0, 0, 0)), constant(0.5, 0.5), 1
    )
    assert inputs[0, :6] == pytest.approx([1.0, 1.0, 1.0, 1.0, 0.3, 0.25])


def test_a_trial_ends_nearer_than_five_units_to_the_exit() -> None:
    place = arena([(500, -9, 500, 9)], (0, 0, 0), (50, 0))
    trials = MazeTrials(place, precision="double")
    path = trials.path(constant(0.5, 0.9))
    distance = np.hypot(*(path.poses[:, :2] / UNIT - [50, 0]).T)
    assert distance[-1] < 5 <= distance[-2]
    assert len(path.inputs) == len(path.poses) - 1
    tried = trials.try_all([constant(0.5, 0.1), constant(0.5, 0.9)])
    assert tried.solver == 1
    assert tried.ends[1] == pytest.approx(path.poses[-1, :2])
    assert trials.distances_to_exit(tried.ends)[1] == pytest.approx(distance[-1] * UNIT)


def test_networks_after_the_block_of_the_first_solver_are_not_tried() -> None:
    trials = MazeTrials(arena([(500, -9, 500, 9)], (0, 0, 0), (50, 0)))
    genomes = [constant(0.5, 0.1)] * 70 + [constant(0.5, 0.9)] + [constant(0.5, 0.1)] * 100
    tried = trials.try_all(genomes)
    assert tried.solver == 70
    assert len(tried.ends) == 128


def test_a_maze_without_an_exit_is_refused() -> None:
    place = arena([(500, -9, 500, 9)], (0, 0, 0))
    with pytest.raises(ValueError, match="has no goal"):
        MazeTrials(Arena(place.name, place.walls, place.grid, place.start))


wall = st.tuples(*[st.floats(-150, 150)] * 4).map(lambda w: (w[0], w[1], w[2], w[3]))
mazes = st.lists(wall, min_size=1, max_size=8).map(
    lambda walls: (
        [one for one in walls if reference.distance_to_wall((0, 0), one) > 8.5]
        + [(-200, -200, 200, -200), (200, -200, 200, 200), (200, 200, -200, 200), (-200, 200, -200, -200)]
    )
)


@settings(max_examples=cases(40, 3))
@given(mazes, st.floats(0, 360), st.integers(0, 1000), st.randoms(use_true_random=False))
def test_no_order_of_walls_or_networks_changes_a_trial(walls, heading, seed, random) -> None:
    genomes = networks(20, seed, n_generations=2)
    agent = MazeAgent(steps=cases(200, 10))
    ends = MazeTrials(arena(walls, (0, 0, heading)), agent).try_all(genomes).ends
    order = list(range(20))
    random.shuffle(order)
    random.shuffle(walls)
    again = MazeTrials(arena(walls, (0, 0, heading)), agent).try_all([genomes[k] for k in order]).ends
    assert (again == ends[order]).all()


@settings(max_examples=cases(40, 3))
@given(mazes, st.floats(0, 360), st.integers(0, 1000))
def test_a_disc_never_comes_nearer_to_a_wall_than_its_radius(walls, heading, seed) -> None:
    for genome in networks(4, seed):
        poses, inputs = driven(arena(walls, (0, 0, heading)), genome, cases(200, 10))
        for x, y, _ in poses:
            assert min(reference.distance_to_wall((x, y), one) for one in walls) >= 8 - 1e-9
        assert (np.hypot(*np.diff(poses[:, :2], axis=0).T) <= 3 + 1e-9).all()
        assert ((inputs >= 0) & (inputs <= 1)).all()
        assert (inputs[:, 6:10].sum(axis=1) == 1).all()


MIRRORED_INPUT = [4, 3, 2, 1, 0, 5, 6, 9, 8, 7, 10]


def mirrored(genome: Genome) -> Genome:
    """The network that does in a mirrored maze what this one does: no hidden nodes, right and left changed."""
    values = genome.to_dict()
    weights = {(gene["source"], gene["target"]): gene["weight"] for gene in values["connections"]}
    turn = genome.rules.n_inputs
    for gene in values["connections"]:
        weight = weights[MIRRORED_INPUT[gene["source"]], gene["target"]]
        gene["weight"] = -weight if gene["target"] == turn else weight
    return Genome.from_dict(values)


@settings(max_examples=cases(40, 3))
@given(mazes, st.integers(0, 1000))
def test_a_mirrored_maze_gives_a_mirrored_path(walls, seed) -> None:
    for genome in networks(2, seed):
        steps = cases(60, 10)
        poses, _ = driven(arena(walls, (0, 0, 0), (100, 31)), genome, steps)
        other_walls = [(x1, -y1, x2, -y2) for x1, y1, x2, y2 in walls]
        others, _ = driven(arena(other_walls, (0, 0, 0), (100, -31)), mirrored(genome), steps)
        assert others[:, :2] == pytest.approx(poses[:, :2] * [1, -1], abs=1e-6)


def test_novelty_of_ends_is_lehman_and_stanleys() -> None:
    task = MazeTask("test", {}, {}, neighbors=4, threshold=0.3, patience=20)
    archive = _EndsArchive(task)
    plain = NearestArchive(lambda a, b: float(np.hypot(*(a - b))), 4, 0.3, 20)
    rng = np.random.default_rng(1)
    for _ in range(30):
        ends = rng.normal(size=(12, 2))
        assert archive.update(ends) == pytest.approx(plain.update(list(ends)))
        assert len(archive) == len(plain.behaviors)
    assert 0 < len(archive) < 360


def test_the_archive_grows_beyond_its_first_room() -> None:
    archive = _EndsArchive(MazeTask("test", {}, {}, threshold=1e-12))
    rng = np.random.default_rng(2)
    for k in range(6):
        archive.update(rng.random((250, 2)) * 1e6**k)
    assert len(archive) > 1024
    ends = rng.random((3, 2)) * 1e6**5
    others = np.array([*ends, *archive._places[:, : len(archive)].T])
    apart = np.sort(np.hypot(*(ends[:, None] - others).T), axis=0)[1:16]
    assert archive.update(ends) == pytest.approx(apart.mean(axis=0))


@pytest.mark.parametrize("reward", MAZE_REWARDS)
def test_a_run_counts_evaluations_up_to_the_first_solver_and_can_be_followed(reward) -> None:
    place = arena([(-200, -200, 200, -200), (200, -200, 200, 200), (200, 200, -200, 200), (-200, 200, -200, -200)],
                  (0, 0, 0), (0, 60))  # fmt: skip
    task = MAZE_TASKS["maze-medium"]
    trials = MazeTrials(place)
    neat = NeatSettings(population=cases(100, 10), generations=cases(20, 2))
    run = run_maze(task, trials, reward, neat, 1, 0, keep_ends=True)
    assert len(run.ends) == run.evaluations
    assert run.solved or not COMPILED
    if run.solved:
        assert run.solver is not None
        path = trials.path(run.solver)
        assert path.poses[-1, :2] == pytest.approx(run.ends[-1])
        assert trials.distances_to_exit(run.ends)[-1] < 5 * UNIT
        assert (trials.distances_to_exit(run.ends)[:-1] >= 5 * UNIT).all()
    assert run == run_maze(task, trials, reward, neat, 1, 0)


def test_a_run_that_may_not_go_on_ends_unsolved() -> None:
    calls = iter([True, True, False])
    trials = MazeTrials(load_arena("maze-hard"), MazeAgent(steps=5))
    neat = NeatSettings(population=10)
    run = run_maze(MAZE_TASKS["maze-hard"], trials, "novelty", neat, 1, 0, go_on=lambda: next(calls))
    assert (run.solved, run.evaluations, run.solver) == (False, 20, None)
