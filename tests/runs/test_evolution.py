"""A run by asking and telling gives the rows of the whole-run kernel."""

import polars as pl
import pytest

from realitygap.platforms import try_genomes
from realitygap.runs import Condition, Evolution, run_replicates
from realitygap.trials import NoiseKey


def rows_by_asking(condition: Condition, replicate: int) -> list[dict]:
    evolution = Evolution(condition, replicate)
    rows = []
    for generation in range(condition.neat.generations):
        asked = evolution.ask()
        batch = try_genomes(
            condition.on,
            condition.arena.arena(),
            [each.genome for each in asked],
            noise=condition.noise,
            noise_key=NoiseKey(condition.key, replicate, generation),
        )
        cells = [batch.behavior(k).tolist() for k in range(len(asked))]
        told = evolution.tell(batch.coverage_line.tolist(), cells)
        rows += [
            {
                "species": each.species,
                "parents": list(each.parents),
                "fitness": told.fitness[k],
                "novelty": told.novelty[k],
                "cells": cells[k],
                "genome": each.record,
            }
            for k, each in enumerate(asked)
        ]
    return rows


@pytest.mark.parametrize(
    "changes",
    [
        {"selection": "coverage"},
        {"selection": "random"},
        {"selection": "novelty"},
        {"selection": "novelty", "novelty": {"kind": "lehman-stanley", "threshold": 2.0, "neighbors": 3}},
        {"selection": "coverage", "neat": {"settings": "default", "population": 12, "generations": 6}},
    ],
    ids=["coverage", "random", "novelty", "nearest", "default"],
)
def test_asking_and_telling_gives_the_rows_of_whole_runs(changes):
    condition = Condition(name="a", noise=0.5, **changes)
    frame = run_replicates(condition, 3, 2)
    for replicate in (3, 4):
        wanted = frame.filter(pl.col("replicate") == replicate)
        rows = rows_by_asking(condition, replicate)
        for name in rows[0]:
            assert [row[name] for row in rows] == wanted[name].to_list(), name


def test_the_order_of_cells_within_a_trial_does_not_matter():
    condition = Condition(name="a", selection="novelty", platform="scribbler")
    one, other = Evolution(condition, 0), Evolution(condition, 0)
    cells = [[k, k + 12, 2 * k + 24] for k in range(8)]
    scores = [0.1] * 8
    assert one.tell(scores, cells) == other.tell(scores, [each[::-1] for each in cells])
    assert [each.record for each in one.ask()] == [each.record for each in other.ask()]


def test_scores_and_cells_of_too_few_individuals_are_refused():
    evolution = Evolution(Condition(name="a", platform="scribbler"), 0)
    with pytest.raises(ValueError, match="cells of 1 individuals, expected 8"):
        evolution.tell([0.5] * 8, [[1]])
    with pytest.raises(ValueError, match="scores of 1 individuals, expected 8"):
        evolution.tell([0.5], [[1]] * 8)
