"""The simulators as targets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.platforms import JyroPlatform, JyroRobot, SimPlatform, SimRobot, SimTarget, try_genomes
from realitygap.records import TrialRecord
from realitygap.trials import NoiseKey, RobotObserver, TrialPlan, carry_out_on_robot
from realitygap.world import Pose, paper_arena

pytestmark = pytest.mark.slow

KEY = 7
STEPS = 30
ARENA = paper_arena()
PLATFORMS = {"sim": SimPlatform(precision="double"), "jyro": JyroPlatform(precision="double")}


@pytest.fixture(scope="module")
def genomes() -> list[Genome]:
    settings = NeatSettings.named("rosenzweig-remy", population=8, add_node=0.5, weight_step=5.0)
    population = Population(3, 2, settings, seed=11, bias=False)
    population.tell(list(range(8)))
    return list(population.ask())


def one_by_one(name: str, plan: TrialPlan) -> TrialRecord:
    made = SimRobot if name == "sim" else JyroRobot
    robot = made(PLATFORMS[name], ARENA, noise=0.1, noise_key=NoiseKey(KEY, individual=plan.number))
    trial = carry_out_on_robot(robot, plan, "track", RobotObserver(robot), plan.start or ARENA.start)
    assert not trial.problem
    return trial


def assert_same(one: TrialRecord, other: TrialRecord) -> None:
    for name, value in vars(one).items():
        there = getattr(other, name)
        if isinstance(value, np.ndarray):
            np.testing.assert_allclose(value, there, rtol=0, atol=1e-9, err_msg=name)
        elif name != "battery_v":
            assert value == there, name


@pytest.mark.parametrize("name", PLATFORMS)
def test_controller_in_one_call_drives_what_it_drives_on_the_robot(name: str, genomes: list[Genome]) -> None:
    plans = [TrialPlan(genome=genome, steps=STEPS, number=3 * k) for k, genome in enumerate(genomes)]
    plans[1] = replace(plans[1], start=Pose(0.5, 0.3, 1.0))
    trials = SimTarget(PLATFORMS[name], ARENA, 0.1, key=KEY).carry_out(plans, "track")
    for plan, trial in zip(plans, trials, strict=True):
        assert_same(trial, one_by_one(name, plan))
    assert len({trial.cells for trial in trials}) > 1


@pytest.mark.parametrize("name", PLATFORMS)
def test_cells_are_those_of_try_genomes(name: str, genomes: list[Genome]) -> None:
    platform = PLATFORMS[name].model_copy(update={"steps": STEPS, "precision": "single"})
    plans = [TrialPlan(genome=genome, steps=STEPS, number=k) for k, genome in enumerate(genomes)]
    trials = SimTarget(platform, ARENA, 0.1, key=KEY).carry_out(plans, "cells")
    batch = try_genomes(platform, ARENA, genomes, noise=0.1, noise_key=NoiseKey(KEY))
    assert [trial.cells for trial in trials] == [
        tuple(sorted(batch.behavior(k).tolist())) for k in range(len(genomes))
    ]
