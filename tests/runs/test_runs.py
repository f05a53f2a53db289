"""Runs as frames, and their trials shown again."""

import polars as pl
import pytest

from realitygap.errors import RecordError
from realitygap.records import SCHEMA
from realitygap.runs import Condition, genome_of, replay, run_replicates

CONDITIONS = [
    Condition(name="coverage", noise=0.1),
    Condition(name="novelty", selection="novelty", noise=0.5),
    Condition(name="nearest", selection="novelty", novelty={"kind": "lehman-stanley"}),
    Condition(name="random", selection="random", noise=0.8),
    Condition(name="ends", task={"cells": "ends"}),
    Condition(
        name="biases", neat=Condition(name="x").neat.model_copy(update={"node_bias": True, "add_node": 0.6})
    ),
]


@pytest.fixture(scope="module", params=CONDITIONS, ids=lambda condition: condition.name)
def run(request):
    return request.param, run_replicates(request.param, 0, 6)


def test_rows_are_complete_and_in_order(run):
    condition, rows = run
    assert rows.schema == SCHEMA
    keys = [(r, g, i) for r in range(6) for g in range(5) for i in range(8)]
    assert rows.select("replicate", "generation", "individual").rows() == keys
    assert rows["condition"].unique().to_list() == [condition.name]
    assert rows["key"].unique().to_list() == [condition.key]


def test_coverage_is_the_share_of_72_cells(run):
    _, rows = run
    assert (rows["coverage_line"] * 72 - rows["cells"].list.len()).abs().max() < 1e-9
    assert rows.select((pl.col("coverage_ends") <= pl.col("coverage_line") + 1e-12).all()).item()
    assert rows["cells"].list.n_unique().equals(rows["cells"].list.len().rename("cells"))
    assert rows["cells"].list.first().unique().to_list() == [12 * 1 + 1]
    assert rows["cells"].list.max().max() < 72


def test_fitness_is_what_selection_uses(run):
    condition, rows = run
    if condition.selection == "novelty":
        assert rows["fitness"].equals(rows["novelty"].rename("fitness"))
        assert rows["novelty"].null_count() == 0
    else:
        used = "coverage_ends" if condition.task.cells == "ends" else "coverage_line"
        assert rows["fitness"].equals(rows[used].rename("fitness"))
        assert rows["novelty"].null_count() == rows.height


def test_parents_come_from_the_generation_before(run):
    condition, rows = run
    later = rows.filter(pl.col("generation") > 0)["parents"]
    assert rows.filter(pl.col("generation") == 0)["parents"].list.len().max() == 0
    if condition.selection == "random":
        assert later.list.len().max() == 0
    else:
        assert later.list.len().min() >= 1
        assert later.list.len().max() == 2
        assert later.explode().max() < 8


def test_genomes_are_whole(run):
    condition, rows = run
    for row in rows.iter_rows(named=True):
        genome = genome_of(condition, row)
        assert len(genome.nodes) == row["nodes"]
        assert genome.n_enabled == row["connections"]
        assert len(genome.connections) >= row["connections"]
    if condition.name == "biases":
        assert rows["nodes"].max() > 5
        assert (rows["genome"].struct.field("biases").list.len() == rows["nodes"] - 3).all()


def test_trials_can_be_shown_again(run):
    condition, rows = run
    for row in rows[::7].iter_rows(named=True):
        for described in (condition, condition.settings()):
            trajectory = replay(described, row)
            assert list(trajectory.cells) == row["cells"]
            assert trajectory.coverage_ends == pytest.approx(row["coverage_ends"], abs=1e-12)
            assert trajectory.stalled.sum() == row["stalls"]
            assert trajectory.poses.shape == (88, 3)


def test_a_replicate_does_not_depend_on_the_others(run):
    condition, rows = run
    alone = run_replicates(condition, 4, 1)
    assert alone.equals(rows.filter(pl.col("replicate") == 4))


def test_a_row_of_other_settings_is_noticed():
    condition = Condition(name="a", noise=0.1)
    row = run_replicates(condition, 0, 1).row(30, named=True)
    with pytest.raises(RecordError, match="run 0, generation 3, individual 6"):
        replay(Condition(name="a", jyro={"steps": 20, "turn_per_step": 0.9}), row)
    with pytest.raises(RecordError, match=r"belongs to condition 'a', and the condition is 'b'"):
        replay(Condition(name="b", noise=0.1), row)
    with pytest.raises(RecordError, match="does not fit the settings of the condition"):
        replay(Condition(name="a", controller={"inputs": ["obstacle", "bias"]}), row)


@pytest.fixture(scope="module")
def shown():
    """A condition and a row of it with blocked steps."""
    condition = Condition(name="a", noise=0.1)
    return condition, run_replicates(condition, 0, 2).filter(pl.col("stalls") > 0).row(0, named=True)


@pytest.mark.parametrize(
    ("column", "change", "text"),
    [
        ("key", lambda value: value ^ 1, "its random numbers have the key"),
        ("stalls", lambda value: value - 1, "stalls is"),
        ("coverage_line", lambda value: value + 1 / 72, "coverage_line is"),
        ("coverage_ends", lambda value: value + 1 / 72, "coverage_ends is"),
        ("cells", lambda value: [*value[:-1], (value[-1] + 1) % 72], "first difference at place"),
        ("cells", lambda value: value[:-1], "first difference at place"),
        ("cells", lambda value: [*value, 71], "first difference at place"),
    ],
)
def test_a_row_that_was_changed_is_noticed(shown, column, change, text):
    """Only the cells were compared, and only their number was told: 'visits 9 cells, its row has 9'."""
    condition, row = shown
    replay(condition, row)
    with pytest.raises(RecordError, match=text):
        replay(condition, {**row, column: change(row[column])})


def test_a_trial_is_shown_by_its_entry_in_the_description_too(shown):
    condition, row = shown
    entry = {"name": "a", "label": "SIM", "hash": condition.hash(), "settings": condition.settings()}
    assert replay(entry, row).cells == replay(condition, row).cells
    with pytest.raises(TypeError, match=r"condition is 'a', expected a Condition, or its settings"):
        replay("a", row)


def test_a_row_of_another_seed_is_noticed(shown):
    condition, row = shown
    with pytest.raises(RecordError, match="have the key"):
        replay(condition.model_copy(update={"seed": 2}), row)


def test_a_row_without_all_columns_is_refused(shown):
    condition, row = shown
    with pytest.raises(RecordError, match="The row lacks cells, stalls"):
        replay(condition, {key: value for key, value in row.items() if key not in ("cells", "stalls")})


def test_random_networks_are_unrelated():
    rows = run_replicates(Condition(name="random", selection="random"), 0, 3)
    weights = [tuple(weights) for weights in rows["genome"].struct.field("weight").to_list()]
    assert len(set(weights)) == len(weights) == 120


@pytest.mark.slow
def test_evolution_beats_as_many_random_networks():
    """Over 60 paired runs, chance alone would fail this with probability below 1e-6 (sign test, observed 55 of 60)."""
    best = {}
    for selection in ("coverage", "random"):
        rows = run_replicates(Condition(name=selection, selection=selection), 0, 60)
        best[selection] = rows.group_by("replicate", maintain_order=True).agg(pl.col("coverage_line").max())
    wins = (best["coverage"]["coverage_line"] > best["random"]["coverage_line"]).sum()
    assert wins >= 45


@pytest.mark.parametrize(
    ("first", "n_runs", "error"),
    [
        (-1, 1, ValueError),
        (1 << 32, 1, ValueError),
        ((1 << 32) - 1, 2, ValueError),
        (0, 0, ValueError),
        (0.5, 1, TypeError),
        (0, "1", TypeError),
    ],
)
def test_replicates_that_are_none_or_would_repeat_are_refused(first, n_runs, error):
    """Replicate 2**32 was computed as replicate 0."""
    with pytest.raises(error, match="expected"):
        run_replicates(CONDITIONS[0], first, n_runs)
