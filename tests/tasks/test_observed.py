"""Observed trials are worth to a task what the same trials are worth step by step."""

from dataclasses import replace

import numpy as np
import pytest

from realitygap.errors import TaskError
from realitygap.evolution import NeatSettings, Population
from realitygap.platforms import SimPlatform, SimTarget, trace_genomes
from realitygap.tasks import AvoidTask, CoverageTask, GoalTask, LightTask, WallTask, score_observed
from realitygap.trials import NoiseKey, TrialPlan
from realitygap.world import load_arena

N = 6
TASKS = {
    "paper": (CoverageTask(), CoverageTask(cells="ends"), AvoidTask(), WallTask()),
    "light": (LightTask(),),
    "goal": (GoalTask(),),
}


def genomes():
    return Population(3, 2, NeatSettings.named("rosenzweig-remy"), seed=5, bias=False).ask()[:N]


def observed(arena, observe="track"):
    plans = [TrialPlan(genome=each, number=k, sees_end=True) for k, each in enumerate(genomes())]
    return SimTarget(SimPlatform(precision="double"), arena, key=3).carry_out(plans, observe)


@pytest.mark.parametrize(
    ("name", "task"), [(name, task) for name, tasks in TASKS.items() for task in tasks], ids=str
)
def test_the_score_is_that_of_an_evolution(name, task):
    arena = load_arena(name)
    traced = trace_genomes(
        SimPlatform(precision="double"), arena, genomes(), noise=0.0, noise_key=NoiseKey(3)
    )
    found = score_observed(task, observed(arena), arena)
    assert found == pytest.approx(task.fitness(traced, arena), abs=1e-12)
    assert len(set(found)) > 2, "the trials are told apart"


def test_an_observer_of_less_is_refused_in_words():
    arena = load_arena("light")
    with pytest.raises(
        TaskError, match=r"Trial 0 has no poses, which task 'light' needs.*let track be observed"
    ):
        score_observed(LightTask(), observed(arena, "cells"), arena)
    blind = [replace(each, last_readings=np.empty(0)) for each in observed(arena, "readings")]
    with pytest.raises(TaskError, match="has no look at its end, which task 'avoid' needs"):
        score_observed(AvoidTask(), blind, arena)
    with pytest.raises(TaskError, match="has no cells, which task 'coverage' needs"):
        score_observed(CoverageTask(), observed(arena, "readings"), arena)


def test_readings_are_enough_for_avoidance():
    arena = load_arena("paper")
    seen = observed(arena, "readings")
    assert all(len(each.poses) == len(each.wheels) == len(each.cells) == 0 for each in seen)
    whole = score_observed(AvoidTask(), observed(arena), arena)
    assert score_observed(AvoidTask(), seen, arena).tolist() == whole.tolist()


def test_score_observed_refuses_arenas_that_are_sampled_for_each_trial():
    from realitygap.world import Distribution

    arena = load_arena("light")
    drawn = replace(arena, vary={"arena.light.0.x": Distribution(uniform=(0.4, 0.6))})
    with pytest.raises(TaskError, match=r"arena\.light\.0\.x .* is sampled for each trial"):
        score_observed(LightTask(), observed(arena), drawn)


def test_an_observed_trial_has_no_inputs_of_networks_and_says_so():
    from realitygap.tasks._observed import observed_trajectories

    arena = load_arena("paper")
    seen = observed_trajectories(observed(arena), arena)
    assert seen.network_inputs == ()
    assert seen.poses.shape == (N, 101, 3)
    with pytest.raises(ValueError, match="no sensors of kind 'light'"):
        _ = seen.light
