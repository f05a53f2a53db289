"""Trials of genomes on the platform `jyro`."""

import math

import numpy as np
import pytest

from realitygap.evolution import NeatSettings, Population
from realitygap.platforms import JyroPlatform, retry_genomes, trace_genome, try_genomes
from realitygap.trials import NoiseKey
from realitygap.world import paper_arena

SETTINGS = NeatSettings.named("rosenzweig-remy")


@pytest.mark.parametrize(
    "wrong",
    [{"repeat": 4096}, {"individual": 1 << 24}, {"generation": 1 << 20}, {"replicate": -1}, {"key": -1}],
)
def test_a_key_whose_numbers_would_repeat_is_refused(wrong):
    with pytest.raises(ValueError, match="expected 0 to"):
        NoiseKey(**{"key": 1, **wrong})


def test_a_key_is_made_of_whole_numbers():
    with pytest.raises(TypeError, match=r"key is 1\.5, expected a whole number"):
        NoiseKey(1.5)
    key = NoiseKey(np.uint64(7), np.uint32(1))
    assert key == NoiseKey(7, 1)
    assert {type(key.key), type(key.replicate)} == {int}, "another type would have kernels compiled again"


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


OTHER_KINDS = [
    {"activation": "sigmoid"},
    {"activation_slope": 1.0},
    {"recurrent": True},
    {"node_bias": True},
    {"bias_value": 0.5},
]


@pytest.mark.parametrize("change", OTHER_KINDS, ids=lambda change: next(iter(change)))
def test_genomes_of_several_kinds_are_refused(change):
    """All were tried with the rules of the first one, and scored as something that they are not."""
    one, other = (
        Population(3, 2, NeatSettings.named("rosenzweig-remy", **more), seed=4).ask() for more in ({}, change)
    )
    mixed = [one[0], one[1], other[0]]
    arena, platform = paper_arena(), JyroPlatform()
    name = next(iter(change))
    with pytest.raises(
        ValueError, match=f"Genome 2 has {name} .*, genome 0 has .*: expected genomes of one kind"
    ):
        try_genomes(platform, arena, mixed, noise=0.1, noise_key=NoiseKey(1))
    keys = [NoiseKey(1)] * 3
    with pytest.raises(ValueError, match=f"Genome 2 has {name}"):
        retry_genomes(platform, arena, mixed, noise=0.1, noise_keys=keys, repeats=range(1))


def test_genomes_with_and_without_the_constant_input_are_refused():
    mixed = Population(3, 2, SETTINGS).ask()[:1] + Population(3, 2, SETTINGS, bias=False).ask()[:1]
    with pytest.raises(ValueError, match="Genome 1 has n_inputs 3, genome 0 has 4"):
        try_genomes(JyroPlatform(), paper_arena(), mixed, noise=0.1, noise_key=NoiseKey(1))


@pytest.mark.parametrize("noise", [math.nan, math.inf, -0.1])
def test_noise_that_is_no_level_is_refused(noise):
    """Not-a-number noise gave trials that looked like any other."""
    genomes = Population(3, 2, SETTINGS).ask()
    with pytest.raises(ValueError, match="expected a finite number, 0 or more"):
        try_genomes(JyroPlatform(), paper_arena(), genomes, noise=noise, noise_key=NoiseKey(1))


def test_individuals_beyond_the_last_number_are_refused():
    """The number of the individual wrapped around into that of another purpose."""
    genomes = Population(3, 2, SETTINGS).ask()
    last = (1 << 24) - len(genomes)
    try_genomes(JyroPlatform(), paper_arena(), genomes, noise=0.1, noise_key=NoiseKey(1, individual=last))
    with pytest.raises(ValueError, match="numbers would repeat"):
        try_genomes(
            JyroPlatform(), paper_arena(), genomes, noise=0.1, noise_key=NoiseKey(1, individual=last + 1)
        )
