"""One simulated robot under the contract drives the trials of the batch."""

from __future__ import annotations

import pytest

from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.platforms import JyroPlatform, JyroRobot, trace_genome, try_genomes
from realitygap.robots import Command, Robot
from realitygap.trials import NoiseKey
from realitygap.world import INCH, NAMED_STARTS, Pose, load_arena, paper_arena

KEY = NoiseKey(0x9E3779B97F4A7C15, replicate=3, generation=2, individual=5, repeat=1)


def genomes(n: int) -> list[Genome]:
    settings = NeatSettings.named("rosenzweig-remy", population=n, add_node=0.5, weight_step=5.0)
    population = Population(3, 2, settings, seed=11, bias=False)
    population.tell(list(range(n)))
    return population.ask()


@pytest.mark.parametrize(
    ("noise", "settings", "start"),
    [
        (0.5, {}, "corner"),
        (0.0, {"turn_per_step": 0.9}, "center"),
        (0.8, {"noisy_reading": "clip", "steps": 150}, "left"),
    ],
)
def test_a_controller_on_the_robot_drives_the_trial_of_the_batch(noise, settings, start):
    platform = JyroPlatform(precision="double", **settings)
    arena = paper_arena(NAMED_STARTS[start])
    population = genomes(8)
    batch = try_genomes(platform, arena, population, noise=noise, noise_key=KEY)
    n_stalls = 0
    for k, genome in enumerate(population):
        key = NoiseKey(KEY.key, KEY.replicate, KEY.generation, KEY.individual + k, KEY.repeat)
        trial = trace_genome(platform, arena, genome, noise=noise, noise_key=key)
        network = genome.network()
        with JyroRobot(platform, arena, noise=noise, noise_key=key) as robot:
            assert isinstance(robot, Robot)
            robot.reset()
            for step in range(platform.steps):
                seen = robot.observe()
                inputs = [max(seen.readings), float(seen.stalled), step / platform.steps]
                assert inputs == trial.inputs[step].tolist()
                assert list(seen.raw) == trial.readings[step].tolist()
                robot.drive(Command(*network.activate(inputs)))
                assert list(robot.pose) == trial.poses[step + 1].tolist()
            assert robot.visited_cells == tuple(batch.behavior(k).tolist())
            assert robot.coverage == (batch.coverage_line[k], batch.coverage_ends[k])
            assert robot.n_blocked == batch.n_stalls[k]
            n_stalls += robot.n_blocked
    assert n_stalls > 0


def test_a_trial_begins_anew_with_the_same_random_numbers_or_at_another_pose():
    robot = JyroRobot(noise=0.3, noise_key=KEY)
    first = robot.observe()
    robot.drive(Command(1.0, 0.5))
    assert robot.observe() != first
    robot.reset()
    assert robot.observe() == first
    robot.reset(Pose(0.5, 0.3, 1.0))
    assert robot.pose == pytest.approx((0.5, 0.3, 1.0))
    assert robot.n_blocked == 0


def test_boxes_in_the_arena_are_seen_and_stop_the_robot():
    start = Pose(8 * INCH, 15.5 * INCH, 0.0)  # faces the first box, whose near side is at 14.5 in
    reached = {}
    for name in ("paper", "paper-boxes"):
        with JyroRobot(arena=load_arena(name)) as robot:
            robot.reset(start)
            gap = 14.5 * INCH - start.x - 0.09
            seen = pytest.approx([gap] * 3, abs=1e-6) if name == "paper-boxes" else [0.2] * 3
            assert list(robot.observe().raw) == seen
            for _ in range(5):
                robot.drive(Command(1.0, 0.0))
            reached[name] = robot.observe().stalled
    assert reached == {"paper": False, "paper-boxes": True}
