"""Trials of genomes on the platform `jyro`."""

import pytest

from realitygap.evolution import NeatSettings, Population
from realitygap.robots import JyroPlatform
from realitygap.trials import NoiseKey, trace_genome, try_genomes
from realitygap.world import paper_arena

SETTINGS = NeatSettings.named("rosenzweig-remy")


@pytest.mark.parametrize(
    "wrong",
    [{"repeat": 4096}, {"individual": 1 << 24}, {"generation": 1 << 20}, {"replicate": -1}, {"key": -1}],
)
def test_a_key_whose_numbers_would_repeat_is_refused(wrong):
    with pytest.raises(ValueError, match="expected 0 to"):
        NoiseKey(**{"key": 1, **wrong})


def test_one_trial_kept_step_by_step_is_that_of_the_batch():
    genomes = Population(3, 2, SETTINGS, seed=4, bias=False).ask()
    batch = try_genomes(JyroPlatform(), paper_arena(), genomes, noise=0.5, noise_key=NoiseKey(9, replicate=2))
    for k, genome in enumerate(genomes):
        key = NoiseKey(9, replicate=2, individual=k)
        trajectory = trace_genome(JyroPlatform(), paper_arena(), genome, noise=0.5, noise_key=key)
        assert list(trajectory.cells) == batch.behavior(k).tolist()
        assert trajectory.coverage_line == batch.coverage_line[k]
        assert trajectory.coverage_ends == batch.coverage_ends[k]
        assert trajectory.stalled.sum() == batch.n_stalls[k]


def test_another_repeat_draws_other_noise():
    genome = Population(3, 2, SETTINGS, seed=4, bias=False).ask()[0]
    inputs = [
        trace_genome(
            JyroPlatform(), paper_arena(), genome, noise=0.5, noise_key=NoiseKey(9, repeat=repeat)
        ).inputs[0, 0]
        for repeat in range(5)
    ]
    assert len(set(inputs)) == 5


def test_genomes_for_another_task_are_refused():
    with pytest.raises(ValueError, match="A genome has 2 inputs and 1 outputs, expected 3"):
        try_genomes(
            JyroPlatform(), paper_arena(), Population(2, 1, SETTINGS).ask(), noise=0.0, noise_key=NoiseKey(1)
        )
    with pytest.raises(ValueError, match="No genome"):
        try_genomes(JyroPlatform(), paper_arena(), [], noise=0.0, noise_key=NoiseKey(1))
