"""One simulated robot under the contract drives the trials of the batch."""

from __future__ import annotations

import pytest

from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.robots import Command, JyroPlatform, Robot
from realitygap.trials import JyroRobot, NoiseKey, trace_genome, try_genomes
from realitygap.world import NAMED_STARTS, Pose, paper_arena

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
