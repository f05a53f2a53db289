from __future__ import annotations

import numpy as np
import pytest

from realitygap.platforms import retry_genomes, try_genomes
from realitygap.runs import Condition, genome_of, run_replicates
from realitygap.trials import NoiseKey


@pytest.fixture(scope="module")
def rows():
    condition = Condition(name="c", selection="coverage", noise=0.5)
    return condition, run_replicates(condition, 3, 2).to_dicts()


def _retry(condition, rows, repeats):
    keys = [NoiseKey(row["key"], row["replicate"], row["generation"], row["individual"]) for row in rows]
    genomes = [genome_of(condition, row) for row in rows]
    return retry_genomes(
        condition.on,
        condition.arena.arena(),
        genomes,
        noise=condition.noise,
        noise_keys=keys,
        repeats=repeats,
    )


def test_repeat_0_is_the_trial_of_the_record(rows):
    condition, all_rows = rows
    batch = _retry(condition, all_rows, range(1))
    assert batch.coverage_line.tolist() == [row["coverage_line"] for row in all_rows]
    assert batch.coverage_ends.tolist() == [row["coverage_ends"] for row in all_rows]
    assert [batch.behavior(k).tolist() for k in range(len(all_rows))] == [row["cells"] for row in all_rows]


def test_each_repeat_is_what_try_genomes_gives(rows):
    condition, all_rows = rows
    chosen = all_rows[5::20]
    batch = _retry(condition, chosen, range(2, 5))
    expected = [
        try_genomes(
            condition.on,
            condition.arena.arena(),
            [genome_of(condition, row)],
            noise=condition.noise,
            noise_key=NoiseKey(row["key"], row["replicate"], row["generation"], row["individual"], repeat),
        ).coverage_line[0]
        for row in chosen
        for repeat in range(2, 5)
    ]
    assert batch.coverage_line.tolist() == expected


def test_fresh_noise_is_fresh_and_without_noise_all_repeats_are_equal(rows):
    condition, all_rows = rows
    tried = _retry(condition, all_rows[:40], range(21)).coverage_line.reshape(40, 21)
    assert len(np.unique(tried, axis=1).T) > 1
    assert (tried != tried[:, :1]).any(axis=1).mean() > 0.5
    still = _retry(condition.model_copy(update={"noise": 0.0}), all_rows[:40], range(3))
    assert (np.ptp(still.coverage_line.reshape(40, 3), axis=1) == 0).all()


def test_wrong_arguments_are_named(rows):
    condition, all_rows = rows
    genome = genome_of(condition, all_rows[0])
    arena = condition.arena.arena()
    with pytest.raises(ValueError, match="0 noise keys, expected 1"):
        retry_genomes(condition.on, arena, [genome], noise=0.1, noise_keys=[], repeats=range(1))
    with pytest.raises(ValueError, match="from 0 to 4095"):
        retry_genomes(
            condition.on, arena, [genome], noise=0.1, noise_keys=[NoiseKey(1)], repeats=range(-1, 2)
        )
    with pytest.raises(ValueError, match="No genome"):
        retry_genomes(condition.on, arena, [], noise=0.1, noise_keys=[], repeats=range(1))
