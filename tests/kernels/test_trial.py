"""Trials against the plain reference, against Jyro's scene, by symmetry, by frequency and by hand."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from realitygap import evolution
from realitygap.kernels.jyro import trial as trial_kernels
from realitygap.kernels.jyro import walls as walls_kernels
from realitygap.kernels.math.lanes import LANES, Poses, Seen
from realitygap.platforms import JyroPlatform, jyro_scene, trace_genome, try_genomes
from realitygap.trials import NoiseKey, Trajectory, simulate_case
from realitygap.world import Arena, Pose, paper_arena
from realitygap.world._case import Case
from tests.kernels.genome_arrays import grown, rules_of, settings, to_arrays
from tests.kernels.noisy import largest_noisy
from tests.reference import trial as reference
from tests.reference.effort import COMPILED, cases
from tests.reference.neat import Gene, Genome, Neat, Recurrent, feed_forward
from tests.reference.philox import NOISE, Stream

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered", "ignore:invalid value encountered")

WIDTH, DEPTH = 42 * 0.0254, 24 * 0.0254
QUIET: Any = {"noise": 0.0, "noise_key": NoiseKey(1)}


def as_genome(neat: Neat, genome: Genome, bias_value: float = 1.0) -> evolution.Genome:
    return evolution.Genome(to_arrays(neat, [genome]), 0, rules_of(neat), bias_value)


def constant(move: float, turn: float) -> evolution.Genome:
    """A network that always answers the same."""
    neat = Neat(settings(activation="identity", node_bias=True), 3, 2)
    return as_genome(neat, Genome({}, {3: move, 4: turn}))


def drive(move: float, turn: float, start: tuple[float, float, float], **platform: Any) -> Trajectory:
    return trace_genome(
        JyroPlatform(precision="double", **platform), paper_arena(Pose(*start)), constant(move, turn), **QUIET
    )


def controller(neat: Neat, genome: Genome) -> Callable[[Sequence[float]], list[float]]:
    if neat.settings.recurrent:
        return Recurrent(neat, genome).step
    return lambda inputs: feed_forward(neat, genome, inputs)


# random trials


def random_arena(rng: random.Random) -> Arena:
    """The paper's, half of the time with more walls in it; the start where a body fits."""
    arena = paper_arena()
    walls = list(arena.walls)
    for _ in range(rng.choice([0, 0, 1, 3])):
        walls.append(tuple(rng.uniform(0, 1) * side for side in (WIDTH, DEPTH, WIDTH, DEPTH)))
    while True:
        start = Pose(rng.uniform(0, WIDTH), rng.uniform(0, DEPTH), rng.uniform(-6.28, 6.28))
        found = Arena("random", tuple(walls), arena.grid, start)
        if reference.Robot(JyroPlatform(precision="double"), found).move(0.0, 0.0):
            return found


def random_platform(rng: random.Random) -> JyroPlatform:
    return JyroPlatform(
        steps=rng.choice([1, 40, 87]),
        turn_per_step=rng.choice([0.1, 0.9, 3.0]),
        sensor_offset=rng.choice([0.0, 0.05, 0.2]),
        sensor_range=rng.choice([0.2, 0.05, 2.0]),
        noisy_reading=rng.choice(["leave", "clip"]),
        precision="double",
    )


def random_neat(rng: random.Random, *, bias: bool) -> Neat:
    kind = rng.choice(["tanh", "tanh", "sigmoid", "identity"])
    recurrent = kind != "identity" and rng.random() < 0.4
    chosen = settings(
        recurrent=recurrent,
        node_bias=rng.random() < 0.3,
        activation=kind,
        activation_slope=1.0 if recurrent else 2.45,  # so that no bit grows into another network
        initial_weight=1.0 if recurrent else 2.0,
    )
    return Neat(chosen, 3 + bias, 2, 3 if bias else None)


def apart(poses: Any, others: Any) -> float:
    """The largest difference of two paths, of headings as directions [m, rad]."""
    difference = np.array(poses) - np.array(others)
    difference[:, 2] = np.remainder(difference[:, 2] + math.pi, math.tau) - math.pi
    return float(np.abs(difference).max())


def limited(values: Sequence[float]) -> list[float]:
    return [min(max(value, -1.0), 1.0) for value in values]


@pytest.mark.slow
def test_random_trials_equal_the_reference() -> None:
    """The reference robot is given the commands that the kernel's network gave, and senses for itself.

    So no last bit is fed back, which some networks would blow up; the network's answers to the inputs are
    compared beside it.
    """
    stalls = moves = cells = 0
    for seed in range(cases(250, 12)):
        rng = random.Random(seed)
        arena, platform, bias = random_arena(rng), random_platform(rng), rng.random() < 0.5
        neat = random_neat(rng, bias=bias)
        genome = grown(neat, seed, rng.choice([0, 3, 10]))
        noise = rng.choice([0.0, 0.1, 0.8])
        key = NoiseKey(rng.getrandbits(64), rng.randrange(99), rng.randrange(99), rng.randrange(99), seed % 3)
        found = trace_genome(platform, arena, as_genome(neat, genome, 0.5), noise=noise, noise_key=key)

        answer = controller(neat, genome)
        for inputs, command in zip(found.inputs.tolist(), found.commands.tolist(), strict=True):
            assert command == pytest.approx(limited(answer(inputs)), rel=0, abs=1e-9)
        commands = iter(found.commands.tolist())
        expected = reference.run(
            platform,
            arena,
            lambda _, commands=commands: next(commands),
            noise=noise,
            stream=Stream(key.key, key.replicate, key.generation, key.individual, NOISE, key.repeat),
            bias_value=0.5 if bias else None,
        )
        assert found.stalled.tolist() == expected.stalled, seed
        assert apart(found.poses, expected.poses) < 1e-11
        np.testing.assert_allclose(found.readings, expected.readings, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.inputs, expected.inputs, rtol=0, atol=1e-8)
        line, ends = reference.visited(expected, arena)
        assert list(found.cells) == line, seed
        assert found.coverage_line == len(line) / 72
        assert found.coverage_ends == len(ends) / 72
        stalls += sum(expected.stalled)
        moves += platform.steps - sum(expected.stalled)
        cells += len(line)
    assert min(stalls, moves, cells) > cases(1_000, 60)


def test_whole_trials_equal_the_reference_with_its_own_network() -> None:
    for seed in range(cases(60, 6)):
        rng = random.Random(1_000 + seed)
        neat = Neat(settings(activation="tanh", activation_slope=1.0), 3, 2)
        genome = grown(neat, seed, rng.choice([0, 3, 10]))
        arena = random_arena(rng)
        found = trace_genome(JyroPlatform(precision="double"), arena, as_genome(neat, genome), **QUIET)
        expected = reference.run(JyroPlatform(precision="double"), arena, controller(neat, genome))
        assert found.stalled.tolist() == expected.stalled
        assert apart(found.poses, expected.poses) < 1e-9


# Jyro's scene


def jyro_case(platform: JyroPlatform, start: Pose, **driven_by: Any) -> Case:
    """The same trial as Jyro's rounding has it; its heading is 0 towards +y."""
    mounts = [list(mount) for mount in platform.sensors.mounts]
    robot = {
        "start": {"x": start.x, "y": start.y, "heading": start.heading - math.pi / 2},
        "devices": [{"kind": "range", "geometry": mounts, "max_range": platform.sensor_range}],
        **driven_by,
    }
    world = {"boxes": [[0.0, 0.0, WIDTH, DEPTH]]}
    return Case.from_dict({"steps": platform.steps, "world": world, "robots": [robot]})


def layered(rng: random.Random, n_hidden: int) -> tuple[Neat, Genome, dict[str, Any]]:
    """One network twice: as a genome, and as the controller of a case."""
    neat = Neat(settings(activation="tanh", activation_slope=1.0, node_bias=True), 3, 2)
    genome = Genome({}, {3: 0.0, 4: 0.0})
    hidden = list(range(5, 5 + n_hidden))
    layers = []
    for sources, targets in [([0, 1, 2], hidden), (hidden, [3, 4])] if hidden else [([0, 1, 2], [3, 4])]:
        weights = [[rng.uniform(-1.5, 1.5) for _ in sources] for _ in targets]
        bias = [rng.uniform(-1, 1) for _ in targets]
        layers.append({"weights": weights, "bias": bias})
        for target, row, own in zip(targets, weights, bias, strict=True):
            genome.biases[target] = own
            for source, weight in zip(sources, row, strict=True):
                genome.genes[len(genome.genes)] = Gene(source, target, weight)
    return neat, genome, {"inputs": ["max_inverted", "stall", "time"], "layers": layers}


def jyro_pairs(n: int) -> Any:
    """Trials of random networks, with the case's controller."""
    for seed in range(n):
        rng = random.Random(seed)
        neat, genome, network = layered(rng, rng.choice([0, 3]))
        start = Pose(rng.uniform(0.15, 0.9), rng.uniform(0.15, 0.45), rng.uniform(-3, 3))
        platform = JyroPlatform(precision="double", turn_per_step=rng.choice([0.1, 0.9]))
        yield (
            platform,
            start,
            trace_genome(platform, paper_arena(start), as_genome(neat, genome), **QUIET),
            network,
        )


def test_a_robot_with_the_same_commands_moves_senses_and_is_blocked_as_jyros() -> None:
    """Readings within Jyro's rounding; no trial here has a contact that near to a wall."""
    stalls = 0
    for platform, start, found, _ in jyro_pairs(cases(100, 6)):
        scale = np.array([platform.speed, platform.turn_rate])
        track = simulate_case(jyro_case(platform, start, commands=(found.commands * scale).tolist()))
        assert found.stalled.tolist() == (track.stalls[:, 0] == 1).tolist()
        np.testing.assert_allclose(found.poses[:, :2], track.poses[:, 0, :2], rtol=0, atol=1e-9)
        apart = found.poses[:, 2] - (track.poses[:, 0, 2] + math.pi / 2)
        assert np.abs(np.remainder(apart + math.pi, 2 * math.pi) - math.pi).max() < 1e-9
        np.testing.assert_allclose(found.readings, track.readings[0], rtol=0, atol=1e-6)
        stalls += int(found.stalled.sum())
    assert stalls > 50


def test_most_paths_of_the_same_network_stay_on_jyros() -> None:
    """Jyro rounds readings; some networks make that grow, so that a few paths leave the others for good."""
    apart = []
    for platform, start, found, network in jyro_pairs(cases(100, 10)):
        network["output_scale"] = [platform.speed, platform.turn_rate]
        track = simulate_case(jyro_case(platform, start, controller=network))
        apart.append(np.abs(found.poses[:, :2] - track.poses[:, 0, :2]).max())
    assert np.median(apart) < 1e-7
    assert np.quantile(apart, 0.9) < 1e-5


# symmetry, repetition


def test_a_mirrored_arena_gives_the_mirrored_path() -> None:
    for seed in range(cases(60, 6)):
        rng = random.Random(seed)
        neat = Neat(settings(activation="tanh", activation_slope=1.0), 3, 2)
        genome = grown(neat, seed, 8)
        mirrored = Genome({n: Gene(**vars(gene)) for n, gene in genome.genes.items()}, dict(genome.biases))
        for gene in mirrored.genes.values():
            gene.weight *= -1 if gene.target == 4 else 1  # tanh is odd: the turn changes its sign
        arena = random_arena(rng)
        x, y, heading = arena.start
        walls = tuple((x1, DEPTH - y1, x2, DEPTH - y2) for x1, y1, x2, y2 in arena.walls)
        other = Arena("mirrored", walls, arena.grid, Pose(x, DEPTH - y, -heading))
        one = trace_genome(JyroPlatform(precision="double"), arena, as_genome(neat, genome), **QUIET)
        two = trace_genome(JyroPlatform(precision="double"), other, as_genome(neat, mirrored), **QUIET)
        assert one.stalled.tolist() == two.stalled.tolist()
        np.testing.assert_allclose(one.poses[:, 0], two.poses[:, 0], rtol=0, atol=1e-9)
        np.testing.assert_allclose(one.poses[:, 1], DEPTH - two.poses[:, 1], rtol=0, atol=1e-9)
        np.testing.assert_allclose(np.sin(one.poses[:, 2]), -np.sin(two.poses[:, 2]), rtol=0, atol=1e-9)


def test_a_trial_is_the_same_alone_among_others_and_with_its_steps_kept() -> None:
    neat = Neat(settings(activation="tanh", recurrent=True), 3, 2)
    genomes = [as_genome(neat, grown(neat, seed, seed)) for seed in range(10)]
    platform, arena = JyroPlatform(precision="double"), paper_arena()
    batch = try_genomes(platform, arena, genomes, noise=0.5, noise_key=NoiseKey(9, 8, 7, 3))
    for k, genome in enumerate(genomes):
        key = NoiseKey(9, 8, 7, 3 + k)
        kept = trace_genome(platform, arena, genome, noise=0.5, noise_key=key)
        alone = try_genomes(platform, arena, [genome], noise=0.5, noise_key=key)
        assert batch.behavior(k).tolist() == list(kept.cells) == alone.behavior(0).tolist()
        assert batch.n_stalls[k] == kept.stalled.sum() == alone.n_stalls[0]
        assert batch.coverage_ends[k] == kept.coverage_ends == alone.coverage_ends[0]
    assert len({tuple(batch.behavior(k)) for k in range(10)}) > 2


# roads and precisions


def random_room(rng: random.Random) -> Arena:
    """A convex room with three to seven walls, in any order and direction, around the paper's start."""
    n = rng.randint(3, 7)
    around = sorted(rng.uniform(0, math.tau) for _ in range(n))
    corners = [(0.5 + 0.9 * math.cos(angle), 0.3 + 0.9 * math.sin(angle)) for angle in around]
    walls = [(*a, *b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    walls = [wall if rng.random() < 0.5 else (*wall[2:], *wall[:2]) for wall in walls]
    rng.shuffle(walls)
    return Arena("room", tuple(walls), paper_arena().grid, Pose(0.5, 0.3, rng.uniform(-3, 3)))


def test_planes_and_segments_give_one_path_where_walls_enclose_the_robot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    enclosed = stalls = 0
    differences = []
    for seed in range(cases(300, 12)):
        rng = random.Random(seed)
        arena = rng.choice([paper_arena(), random_room(rng)])
        neat = Neat(settings(activation="tanh", activation_slope=1.0, initial_weight=1.0), 3, 2)
        genome = as_genome(neat, grown(neat, seed, rng.choice([0, 4])))
        platform = JyroPlatform(precision="double", turn_per_step=rng.choice([0.1, 0.9, 3.0]))
        if not jyro_scene(platform, arena).is_enclosed:
            continue
        enclosed += 1
        trial = {"noise": 0.3, "noise_key": NoiseKey(seed)}
        planes = trace_genome(platform, arena, genome, **trial)
        with monkeypatch.context() as patch:
            patch.setattr("realitygap.platforms.jyro._trials.is_enclosed", lambda *_: False)
            segments = trace_genome(platform, arena, genome, **trial)
        assert planes.stalled.tolist() == segments.stalled.tolist(), seed
        differences.append(apart(planes.poses, segments.poses))
        assert planes.cells == segments.cells
        stalls += int(planes.stalled.sum())
    assert np.quantile(differences, 0.9) < 1e-9
    assert max(differences) < 1e-3  # some networks make the last bits grow
    assert enclosed > cases(150, 5)
    assert stalls > 100


def test_only_a_closed_convex_scene_with_nothing_inside_is_enclosed() -> None:
    paper = paper_arena()
    assert jyro_scene(JyroPlatform(precision="double"), paper).is_enclosed
    assert jyro_scene(
        JyroPlatform(precision="double", turn_per_step=3.0), paper
    ).is_enclosed  # turning moves no center

    def changed(walls: Sequence[tuple[float, float, float, float]], **platform: Any) -> bool:
        arena = Arena("changed", tuple(walls), paper.grid, paper.start)
        return bool(jyro_scene(JyroPlatform(precision="double", **platform), arena).is_enclosed)

    assert changed([(c, d, a, b) for a, b, c, d in paper.walls])
    assert not changed(paper.walls[:3])  # open
    assert not changed([*paper.walls, (0.5, 0.3, 0.6, 0.3)])  # something inside
    assert not changed(paper.walls, sensor_offset=0.2)  # sensors beside the body
    notch = [(0, 0), (WIDTH, 0), (WIDTH, DEPTH), (0.6, DEPTH), (0.6, 0.4), (0, 0.4)]
    assert not changed([(*notch[k], *notch[(k + 1) % 6]) for k in range(6)])  # not convex
    far = Arena("beyond", paper.walls, paper.grid, Pose(-1.0, 0.3, 0.0))
    assert not jyro_scene(JyroPlatform(precision="double"), far).is_enclosed


def test_single_precision_seldom_changes_what_a_trial_visits() -> None:
    """Rounding decides only where it decides a contact or is fed back by the network, and grows.

    Of 4,000 trials of these steep networks 1.05 % differed; if that is the rate, more than 2 % of 2,000 would
    differ by chance once in 10,000 choices of seeds.
    """
    neat = Neat(settings(activation="tanh"), 3, 2)
    genomes = [as_genome(neat, grown(neat, seed, seed % 3)) for seed in range(cases(2_000, 64))]
    trial = {"noise": 0.5, "noise_key": NoiseKey(11)}
    single = try_genomes(JyroPlatform(), paper_arena(), genomes, **trial)
    double = try_genomes(JyroPlatform(precision="double"), paper_arena(), genomes, **trial)
    assert (single.n_line != double.n_line).mean() < (0.02 if COMPILED else 0.1)


def test_each_trial_of_a_call_may_have_its_own_physics() -> None:
    """Speed, turn, noise and range of trial k are those that it has alone."""
    arena, n = paper_arena(), 70
    neat = Neat(settings(activation="tanh"), 3, 2)
    genome = as_genome(neat, grown(neat, 5, 2))
    ranges = [0.1 + 0.01 * k for k in range(n)]
    scene = jyro_scene(JyroPlatform(precision="double"), arena)
    rules = trial_kernels.TrialRules(
        n_steps=87,
        clip=False,
        bias_input=False,
        bias_value=1.0,
        step_length=np.full(1, 0.1),
        step_turn=np.array([(0.1 + 0.02 * k) / math.tau for k in range(n)]),
        noise=np.array([0.01 * k for k in range(n)]),
        sensor_range=np.array(ranges),
    )
    cells, counts = np.zeros((n, 72), np.uint8), np.zeros((n, 3), np.int32)
    counters = np.zeros((n, 3), np.uint32)
    counters[:, 0] = np.arange(n) * 256 + 1
    networks = evolution.decode_all([genome])
    lanes, wiring = trial_kernels.make_block(scene, genome.rules, networks.place.shape[1])
    trace = trial_kernels.make_trace(scene.heading, 3, 3, -1, 1)
    rows = np.zeros(n, np.int32)
    trial_kernels.run_trials(
        scene,
        rules,
        genome.rules,
        networks,
        rows,
        np.uint64(4),
        counters,
        lanes,
        wiring,
        cells,
        np.zeros((0, 72), np.uint8),
        np.zeros((n, 2)),
        counts,
        trace,
    )
    for k in range(n):
        platform = JyroPlatform(precision="double", turn_per_step=0.1 + 0.02 * k, sensor_range=ranges[k])
        key = NoiseKey(4, individual=k)
        alone = trace_genome(platform, arena, genome, noise=0.01 * k, noise_key=key)
        assert cells[k, : counts[k, 0]].tolist() == list(alone.cells)
        assert counts[k, 2] == alone.stalled.sum()
    assert len({row.tobytes() for row in cells}) > 30


# noise


@pytest.mark.parametrize(
    ("n_sensors", "mean", "variance"),
    [
        (1, 0.0, 1 / 3),
        (3, 1 / 2, 3 / 20),  # the largest of three U(-1, 1)
        (6, 5 / 7, 24 / 7**2 / 8),  # two groups of random numbers a step
    ],
)
def test_noise_moves_the_largest_reading_as_said(n_sensors: int, mean: float, variance: float) -> None:
    """In units of the level. Mean: four standard errors; variance: 5 %. 1 in 10,000 by chance at most."""
    n, level = cases(40_000, 4_000), 0.5
    moved = (largest_noisy([0.5] * n_sensors, level, n) - 0.5) / level
    assert np.abs(moved).max() < 1.0
    assert abs(moved.mean() - mean) < 4 * math.sqrt(variance / n)
    assert abs(moved.var() / variance - 1) < (0.05 if n > 10_000 else 0.15)


def test_no_number_is_drawn_for_two_sensors_or_two_steps() -> None:
    """With one sensor far nearer than the others its noise can be read off: all values differ."""
    seen: set[float] = set()
    for sensor in range(5):
        fractions = [1e6] * 5
        fractions[sensor] = 0.0
        seen.update(largest_noisy(fractions, 0.5, 50))
    assert len(seen) == 250


def test_a_reading_is_inverted_before_noise_and_clipped_after_it_where_that_is_said() -> None:
    assert largest_noisy([1.0, 0.75, 1.0], 0.0, 200) == pytest.approx([0.25] * 200)
    assert set(largest_noisy([1.0], 0.0, 200)) == {0.0}
    free = largest_noisy([0.0] * 3, 0.5, 200)
    assert max(free) > 1.3
    assert largest_noisy([0.0] * 3, 0.5, 200, clip=True).tolist() == [min(value, 1.0) for value in free]
    low = largest_noisy([1.0], 0.5, 200)
    assert min(low) < -0.3
    assert largest_noisy([1.0], 0.5, 200, clip=True).tolist() == [max(value, 0.0) for value in low]


# hand-made


def test_full_speed_is_a_tenth_of_a_meter_a_step_until_the_wall_is_nearer() -> None:
    """From x = 0.1905 the front, 0.09 ahead, fits seven times before the wall at 1.0668."""
    path = drive(1.0, 0.0, (0.1905, 0.1905, 0.0))
    assert path.poses[:8, 0] == pytest.approx([0.1905 + 0.1 * k for k in range(8)])
    assert (path.poses[8:] == path.poses[7]).all()
    assert path.stalled.tolist() == [False] * 8 + [True] * 80
    assert path.readings[7, 1] == pytest.approx(1.0668 - 0.8905 - 0.09)
    assert (path.poses[:, 1] == 0.1905).all()
    assert path.inputs[:, 1].tolist() == [0.0] * 8 + [1.0] * 79


def test_the_time_input_is_the_part_of_the_steps_that_is_done() -> None:
    path = drive(0.0, 0.0, (0.3, 0.3, 0.0), steps=40)
    assert path.inputs[:, 2].tolist() == [step / 40 for step in range(40)]


def test_a_step_moves_along_the_old_heading_and_turns_then() -> None:
    path = drive(0.5, 1.0, (0.5, 0.3, 0.0), turn_per_step=0.9)
    assert path.poses[1] == pytest.approx([0.55, 0.3, 0.9])
    assert path.poses[2] == pytest.approx([0.55 + 0.05 * math.cos(0.9), 0.3 + 0.05 * math.sin(0.9), 1.8])


def test_a_blocked_robot_does_not_turn_either() -> None:
    path = drive(1.0, 0.1, (1.0668 - 0.1, 0.3, 0.0))
    assert path.stalled[1:].all()
    assert (path.poses == path.poses[0]).all()


def test_a_robot_beside_a_wall_can_back_out() -> None:
    assert not drive(-0.5, 0.0, (1.0668 - 0.095, 0.3, 0.0)).stalled[1]


def test_a_turn_in_place_is_blocked_where_the_corners_do_not_fit() -> None:
    path = drive(0.0, 1.0, (0.095, 0.3, 0.0))
    assert path.stalled[1:].all()
    assert not drive(0.0, 1.0, (0.13, 0.3, 0.0)).stalled.any()


def lanes_at(x: float, y: float, heading: float = 0.0) -> tuple[Poses, Seen]:
    sine, cosine = math.sin(heading), math.cos(heading)
    pose = Poses(*(np.full(LANES, value) for value in (x, y, 0.0, sine, cosine)))
    return pose, Seen(*np.empty((7, LANES)))


def test_touching_counts_and_the_next_number_does_not() -> None:
    square = np.array([[0.25, 0.25], [0.25, -0.25], [-0.25, -0.25], [-0.25, 0.25]])
    wall = np.array([[1.0, 0.0, 1.0, 2.0]])
    plane = np.array([[-1.0, 0.0, -1.0]])

    def touches(x: float, y: float) -> bool:
        low = np.empty(LANES)
        walls_kernels.touch_segments(wall, square, *lanes_at(x, y), low)
        assert (low == low[0]).all()
        return bool(low[0] <= 0)

    def beyond(x: float, y: float) -> bool:
        low = np.empty(LANES)
        walls_kernels.gap_to_planes(plane, square, *lanes_at(x, y), low)
        return bool(low[0] <= 0)

    assert touches(0.75, 1.0)
    assert beyond(0.75, 1.0)
    assert not touches(0.75 - 1e-15, 1.0)
    assert not beyond(0.75 - 1e-15, 1.0)
    assert touches(0.75, 2.25)  # a corner on the wall's end
    assert not touches(0.75, 2.25 + 1e-15)
    assert beyond(0.75, 2.25 + 1e-15)
    assert not touches(1.5, 1.0)  # only a plane has a side that is inside
    assert beyond(1.5, 1.0)


def test_a_ray_reads_from_its_mount_and_not_past_its_range() -> None:
    arena = Arena("one wall", ((1.0, -5.0, 1.0, 5.0),), paper_arena().grid, Pose(0.0, 0.0, 0.0))
    scene = jyro_scene(JyroPlatform(precision="double"), arena)
    assert not scene.is_enclosed
    reach, fractions, rates = np.full(LANES, 0.2), np.empty((3, LANES)), np.empty((3, LANES))

    def readings(x: float, heading: float = 0.0) -> list[float]:
        walls_kernels.sense_segments(
            scene.walls, scene.sensors, reach, *lanes_at(x, 0.0, heading), fractions, rates
        )
        return (fractions[:, 0] * 0.2).tolist()

    for x, expected in [
        (0.8, 0.11),
        (0.9099999999999999, 0.0),
        (0.71, 0.2),
        (0.5, 0.2),
        (0.95, 0.2),
        (1.5, 0.2),
    ]:
        assert readings(x) == pytest.approx([expected] * 3, abs=1e-15)
    left, middle, right = readings(0.8, 0.3)
    assert middle == pytest.approx((0.2 - 0.09 * math.cos(0.3)) / math.cos(0.3))
    assert right < middle < left  # turned to the left, the right one is nearest


@pytest.mark.parametrize(
    ("output", "command"),
    [
        (0.3, 0.3),
        (-1.0, -1.0),
        (1.5, 1.0),
        (-1e300, -1.0),
        (math.inf, 1.0),
        (-math.inf, -1.0),
    ],
)
def test_outputs_are_limited_to_commands(output: float, command: float) -> None:
    assert trial_kernels.as_command(output) == command


def test_a_recurrent_network_that_grows_without_limit_still_ends_its_trial() -> None:
    """Its steps grew as well, until the line of one of them crossed more cells than can be counted."""
    neat = Neat(settings(activation="identity", recurrent=True, node_bias=True), 3, 2)
    genes = {0: Gene(3, 3, 8.0), 1: Gene(4, 4, -8.0), 2: Gene(3, 4, 8.0), 3: Gene(4, 3, 8.0)}
    genome = as_genome(neat, Genome(genes, {3: 0.1, 4: 0.1}))
    path = trace_genome(JyroPlatform(precision="double", steps=2_000), paper_arena(), genome, **QUIET)
    assert np.isfinite(path.poses).all()
    assert np.abs(path.commands).max() == 1.0
