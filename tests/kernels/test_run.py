"""Two roads to one answer: whole runs in one call, and the loop of asking, trying and telling."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from realitygap.evolution import NeatSettings
from realitygap.kernels.neat.block import RunRows
from realitygap.runs import Condition, replay, run_replicates, run_rows
from realitygap.runs import _runs as runs_module
from tests.kernels.genome_arrays import from_arrays, rules_of, to_arrays
from tests.reference import run as reference
from tests.reference.effort import cases
from tests.reference.neat import Neat
from tests.reference.philox import GENOME, Stream

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:overflow encountered")]

STEPS = cases(87, 15)
WILD = {
    "population": 7,
    "generations": 6,
    "add_node": 0.4,
    "add_link": 0.6,
    "structural_mutations": "independent",
    "threshold": 1.0,
}

CONDITIONS: dict[str, dict[str, Any]] = {
    "paper-coverage": {},
    "paper-novelty": {"selection": "novelty", "noise": 0.5},
    "no-noise": {"noise": 0.0},
    "ends": {"task": {"cells": "ends"}, "jyro": {"turn_per_step": 0.9}},
    "novelty-of-ends": {"selection": "novelty", "task": {"cells": "ends"}, "jyro": {"turn_per_step": 0.9}},
    "neat-python": {"neat": {"settings": "rosenzweig-remy-neat-python"}, "jyro": {"noisy_reading": "clip"}},
    "wild": {"neat": WILD},
    "wild-recurrent": {"neat": {**WILD, "recurrent": True, "node_bias": True}, "selection": "novelty"},
    "wild-constant": {"neat": {**WILD, "bias_value": 0.5}, "task": {"bias_input": "always"}},
    "novelty-without-constant": {"selection": "novelty", "task": {"bias_input": "never"}},
    "small-archive": {
        "selection": "novelty",
        "novelty": {"archive_size": 3, "enter": "above-least", "sort": "y-then-x"},
        "arena": {"start": "center"},
    },
    "nearest": {
        "selection": "novelty",
        "novelty": {"kind": "lehman-stanley", "neighbors": 3, "threshold": 30.0, "patience": 6},
    },
    "nearest-of-ends": {
        "selection": "novelty",
        "task": {"cells": "ends"},
        "novelty": {"kind": "lehman-stanley", "threshold": 0.0, "sort": "y-then-x"},
        "arena": {"start": "left"},
    },
    "moving-threshold": {"neat": {**WILD, "target_species": 3, "representative": "champion"}},
}


def condition_of(name: str, **changes: Any) -> Condition:
    values = {**CONDITIONS[name], **changes}
    neat = dict(values.pop("neat", {}))
    named = NeatSettings.named(neat.pop("settings", "rosenzweig-remy"), **neat)
    jyro = {"steps": STEPS, **values.pop("jyro", {})}
    return Condition.model_validate({"name": name, "seed": 5, **values, "neat": named, "jyro": jyro})


def genome_in(rows: RunRows, neat: Neat, *place: int) -> Any:
    """A genome of the rows, as the reference has it."""
    arrays = to_arrays(neat, [neat.first_genome(Stream(0, 0, 0, 0, 2))], 200, 60)
    n, h = int(rows.n_connections[place]), int(rows.n_hidden[place])
    arrays.n_connections[0], arrays.n_hidden[0] = n, h
    for name in ("innovation", "source", "target", "weight", "enabled"):
        getattr(arrays, name)[0, :n] = getattr(rows, name)[place][:n]
    arrays.hidden[0, :h] = rows.hidden[place][:h]
    arrays.bias[0, : 2 + h] = rows.bias[place][: 2 + h]
    return from_arrays(neat, arrays, 0)


def neat_of(condition: Condition) -> Neat:
    bias = condition.has_bias_input
    neat = Neat(condition.neat, 3 + bias, 2, 3 if bias else None)
    assert rules_of(neat) == condition.neat_rules
    return neat


@pytest.mark.parametrize("name", CONDITIONS)
def test_the_whole_run_kernel_equals_asking_trying_and_telling(name: str) -> None:
    """Bit for bit, where the loop does the same sums; the reference archive's sums differ in the last bits."""
    condition = condition_of(name)
    neat = neat_of(condition)
    n_runs = cases(4, 1)
    rows = run_rows(condition, 3, n_runs)
    for run in range(n_runs):
        plain = reference.run(condition, 3 + run)
        for g, generation in enumerate(plain.generations):
            assert rows.species[run, g].tolist() == generation.species
            assert rows.parents[run, g].tolist() == generation.parents
            assert rows.counts[run, g, :, 1].tolist() == generation.n_ends
            assert rows.counts[run, g, :, 2].tolist() == generation.n_stalls
            for k, genome in enumerate(generation.genomes):
                n_line = int(rows.counts[run, g, k, 0])
                assert rows.cells[run, g, k, :n_line].tolist() == generation.cells[k]
                assert genome_in(rows, neat, run, g, k) == from_arrays(neat, genome._genomes, genome._row)
            if condition.novelty.kind == "paper":
                assert rows.fitness[run, g].tolist() == generation.fitness
                np.testing.assert_array_equal(rows.novelty[run, g], generation.novelty)
            else:
                assert rows.novelty[run, g].tolist() == pytest.approx(generation.novelty, rel=1e-12)
                assert (rows.fitness[run, g] == rows.novelty[run, g]).all()


def test_the_conditions_are_not_all_alike() -> None:
    """Structure grows, species are many, archives take entries: or else the comparison would say little."""
    wild = run_rows(condition_of("wild", jyro={"steps": 10}), 0, 10)
    assert wild.n_hidden.max() > runs_module.FIRST_HIDDEN_ROOM
    assert wild.species.max() > 3
    assert (wild.parents[..., 1] >= 0).any()


def test_random_tries_are_first_genomes_without_parents_or_species() -> None:
    condition = condition_of("paper-coverage", selection="random")
    neat = neat_of(condition)
    rows = run_rows(condition, 2, 2)
    for run in range(2):
        for g in range(5):
            for k in range(8):
                stream = Stream(condition.key, 2 + run, g, k, GENOME)
                assert genome_in(rows, neat, run, g, k) == neat.first_genome(stream)
    assert (rows.species == 0).all()
    assert (rows.parents == -1).all()
    assert np.isnan(rows.novelty).all()
    np.testing.assert_array_equal(rows.fitness, rows.counts[..., 0] / 72)


@pytest.mark.parametrize("name", ["paper-coverage", "paper-novelty", "nearest", "wild-recurrent"])
def test_the_rows_of_a_replicate_do_not_depend_on_which_others_are_asked_for(name: str) -> None:
    condition = condition_of(name)
    together = run_rows(condition, 0, 4)
    for replicate in (0, 2, 3):
        assert_same_rows(run_rows(condition, replicate, 1), together, replicate)
    later = run_rows(condition, 2, 2)
    assert_same_rows(later, together, 2)
    assert not np.array_equal(together.fitness[0], together.fitness[1])


def assert_same_rows(rows: RunRows, together: RunRows, first: int) -> None:
    """Equal in all that is used; what lies beyond a list's end, and how much room there is, does not matter."""
    part = RunRows._make(array[first : first + rows.fitness.shape[0]] for array in together)
    for name in ("fitness", "novelty", "counts", "species", "parents", "n_connections", "n_hidden"):
        np.testing.assert_array_equal(getattr(rows, name), getattr(part, name), err_msg=name)
    for place in np.ndindex(rows.fitness.shape):
        ends = {
            "cells": rows.counts[place][0],
            "hidden": rows.n_hidden[place],
            "bias": 2 + rows.n_hidden[place],
        }
        for name in ("innovation", "source", "target", "weight", "enabled"):
            ends[name] = rows.n_connections[place]
        for name, end in ends.items():
            np.testing.assert_array_equal(getattr(rows, name)[place][:end], getattr(part, name)[place][:end])


def test_conditions_share_their_random_numbers_only_where_they_are_paired() -> None:
    first = run_rows(condition_of("paper-coverage"), 0, 1)
    named = run_rows(condition_of("paper-coverage").model_copy(update={"name": "other"}), 0, 1)
    apart = run_rows(condition_of("paper-coverage", pair=False), 0, 1)
    np.testing.assert_array_equal(first.weight, named.weight)
    assert not np.array_equal(first.weight[0, 0], apart.weight[0, 0])


@pytest.mark.parametrize("name", ["wild", "wild-recurrent"])
def test_a_run_that_outgrows_its_room_equals_one_with_much_room(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    condition = condition_of(name)
    monkeypatch.setattr(runs_module, "FIRST_ROOM", 1)
    monkeypatch.setattr(runs_module, "FIRST_HIDDEN_ROOM", 1)
    grown = run_rows(condition, 0, 3)
    assert grown.hidden.shape[3] > 1
    monkeypatch.setattr(runs_module, "FIRST_ROOM", 300)
    monkeypatch.setattr(runs_module, "FIRST_HIDDEN_ROOM", 100)
    roomy = run_rows(condition, 0, 3)
    assert roomy.hidden.shape[3] == 100
    assert_same_rows(grown, roomy, 0)


@pytest.mark.parametrize("name", CONDITIONS)
def test_every_row_can_be_shown_again(name: str) -> None:
    condition = condition_of(name)
    frame = run_replicates(condition, 1, 1)
    for row in frame.iter_rows(named=True):
        trajectory = replay(condition, row)  # says so itself where the cells differ
        assert list(trajectory.cells) == row["cells"]
        assert trajectory.coverage_line == row["coverage_line"]
        assert trajectory.coverage_ends == row["coverage_ends"]
        assert trajectory.stalled.sum() == row["stalls"]
