"""Runs with selection map-elites: the same archives as by ask and tell, whatever they are computed with."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
import polars as pl
import pytest

from realitygap.evolution import MapElites
from realitygap.platforms import trace_genome
from realitygap.records import has_far_parents
from realitygap.runs import (
    Condition,
    Evolution,
    archive_progress,
    corrected_archive,
    elites_of,
    replay,
    retry_elites,
    run_replicates,
    to_ribs,
)
from realitygap.trials import NoiseKey
from realitygap.world import paper_arena

pytestmark = pytest.mark.slow

NEAT = {"population": 40, "generations": 6, "add_node": 0.3, "add_link": 0.3}
ONCE = {"retry": 0.0, "depth": 1}
VARIANTS: list[dict[str, Any]] = [
    {"platform": "sim", "archive": {"descriptor": ["mean_turn", "mean_move"], "cells": [6, 5], **ONCE}},
    {"platform": "sim", "archive": {"descriptor": ["end", "stall_share"], "cells": [7, 4, 3], "repeats": 3}},
    {"archive": {"descriptor": ["stall_share", "region_share"], "kind": "cvt", "cells": [50]}},
    {"platform": "sim", "archive": {"descriptor": ["turn_spread", "stall_share"], "cells": [6, 5]}},
    {"archive": {"descriptor": ["mean_move", "path"], "kind": "cvt", "cells": [40]}},
    {"archive": {"descriptor": ["end"], "cells": [9, 9], "retry": 0.3, "depth": 2, "repeats": 2}},
    {"archive": {"descriptor": ["end"], "cells": [5, 5], "retry": 0.2, "competition": "dominated-novelty"}},
    {
        "archive": {
            "descriptor": ["end"],
            "cells": [5, 5],
            "retry": 0.2,
            "competition": "local",
            "neighbors": 5,
        }
    },
    {
        "archive": {"crossover": 1.0, "descriptor": ["end"], "cells": [9, 9], **ONCE},
        "task": {"cells": "ends"},
    },
]


def condition_of(variant: dict[str, Any]) -> Condition:
    return Condition.model_validate({"name": "c", "selection": "map-elites", "neat": NEAT, **variant})


def described(condition: Condition, trace: Any) -> list[float]:
    """Descriptors of a trial as their definitions say, from its path alone."""
    arena = condition.arena.arena()
    columns = [cell % arena.grid.columns for cell in trace.cells]
    rows = [cell // arena.grid.columns for cell in trace.cells]
    found: list[float] = []
    for name in condition.archive.descriptor:
        if name == "mean_turn":
            found.append(float(np.mean(trace.commands[:, 1])))
        elif name == "mean_move":
            found.append(float(np.mean(np.abs(trace.commands[:, 0]))))
        elif name == "stall_share":
            found.append(sum(trace.stalled[1:]) / (len(trace.stalled) - 1))
        elif name == "turn_spread":
            turns = trace.commands[:, 1]
            found.append(float(np.sqrt(np.mean((turns - turns.mean()) ** 2))))
        elif name == "path":
            steps = len(trace.commands)
            for at in (steps // 3, 2 * steps // 3, steps):
                found += trace.poses[at, :2].tolist()
        elif name == "end":
            found += trace.poses[-1, :2].tolist()
        else:
            for row in range(2):
                for column in range(3):
                    inside = [
                        3 * x // arena.grid.columns == column and 2 * y // arena.grid.rows == row
                        for x, y in zip(columns, rows, strict=True)
                    ]
                    found.append(sum(inside) / len(inside))
    return found


@pytest.mark.parametrize("variant", VARIANTS, ids=str)
def test_a_run_is_that_of_ask_and_tell(variant: dict[str, Any]) -> None:
    condition = condition_of(variant)
    archive, replicate = condition.archive, 5
    bias, has_cells = condition.has_bias_input, archive.competition == "cells"
    told = MapElites(
        len(condition.network_inputs) - bias,
        2,
        archive.cells if archive.kind == "grid" and has_cells else archive.n_cells,
        archive.ranges(condition.arena.arena()),
        condition.neat,
        crossover=archive.crossover,
        retry=archive.retry,
        depth=archive.depth if has_cells else 1,
        neighbors=0 if has_cells else archive.neighbors,
        local=archive.competition == "local",
        replicate=replicate,
        bias=bias,
        key=condition.key,
    )
    told._space = told._cells = archive.cells_in(condition.arena.arena(), condition.key)
    rows = run_replicates(condition, replicate, 1)
    for batch in range(condition.neat.generations):
        genomes, fitness, descriptors = told.ask(), [], []
        for repeat in range(archive.repeats):
            each = [
                trace_genome(
                    condition.on,
                    condition.arena.arena(),
                    genome,
                    noise=condition.noise,
                    noise_key=NoiseKey(condition.key, replicate, batch, k, repeat),
                    inputs=condition.network_inputs,
                )
                for k, genome in enumerate(genomes)
            ]
            fitness.append([getattr(one, f"coverage_{condition.counted_cells}") for one in each])
            descriptors.append([described(condition, one) for one in each])
        own = rows.filter(generation=batch)
        np.testing.assert_allclose(own["fitness"], np.mean(fitness, axis=0), rtol=1e-12)
        np.testing.assert_allclose(own["descriptor"].to_list(), np.mean(descriptors, axis=0), atol=1e-6)
        told.tell(own["fitness"].to_numpy(), np.array(own["descriptor"].to_list()))
    elites = elites_of(condition, rows)
    expected = sorted(told.elites())
    if not has_cells:
        best: dict[int, Any] = {}
        for one in sorted(expected, key=lambda one: one.fitness):
            best[int(told.cells_of([one.descriptor])[0])] = one
        expected = [best[cell]._replace(cell=cell) for cell in sorted(best)]
    assert elites["cell"].to_list() == [one.cell for one in expected]
    assert elites["fitness"].to_list() == [one.fitness for one in expected]
    progress = archive_progress(condition, rows)
    if has_cells:
        assert elites["generation"].to_list() == [one.batch for one in expected]
        assert progress["filled"][-1] == pytest.approx(told.coverage)
        assert progress["qd_score"][-1] == pytest.approx(told.qd_score() / told.n_cells)
    if not archive.retry:
        assert progress["qd_score"].is_sorted()
    assert progress["trials"][-1] == 240 * archive.repeats


def test_rows_do_not_depend_on_the_block(monkeypatch: pytest.MonkeyPatch) -> None:
    condition = condition_of(VARIANTS[1])
    whole = run_replicates(condition, 0, 9)
    monkeypatch.setattr("realitygap.runs._staged.MOST_ELITES", 2 * condition.archive.n_cells)
    assert run_replicates(condition, 0, 9).equals(whole)
    monkeypatch.setattr("realitygap.runs._staged.BLOCK_TRIALS", 8)
    assert run_replicates(condition, 0, 9).equals(whole)
    alone = run_replicates(condition, 7, 1)
    assert alone.equals(whole.filter(whole["replicate"] == 7))


def test_parents_are_elites_of_before_their_batch() -> None:
    condition = condition_of(VARIANTS[0])
    rows = run_replicates(condition, 0, 1)
    assert has_far_parents(rows)
    assert rows.filter(generation=0)["parents"].list.len().max() == 0
    n = condition.neat.population
    for batch in range(1, condition.neat.generations):
        before = elites_of(condition, rows.filter(pl.col("generation") < batch))
        known = set((before["generation"] * n + before["individual"]).to_list())
        parents = set(rows.filter(generation=batch)["parents"].explode().to_list())
        assert parents <= known


def test_centroids_of_shares_are_shares() -> None:
    settings = condition_of(VARIANTS[2]).archive
    centroids = settings.cells_in(paper_arena(), 3).centroids
    assert centroids.shape == (50, 7)
    np.testing.assert_allclose(centroids[:, 1:].sum(axis=1), 1.0)
    assert centroids[:, 0].min() < 0.2
    assert centroids[:, 0].max() > 0.8


def test_rows_are_repeated_trial_by_trial() -> None:
    condition = condition_of(VARIANTS[1])
    rows = run_replicates(condition, 0, 1)
    for number in (0, 100, 239):
        replay(condition, rows.row(number, named=True))


def test_fresh_trials_correct_an_archive() -> None:
    """Elites are the lucky ones of 240: it takes no luck that the mean of their fresh trials is lower."""
    condition = condition_of({"platform": "sim", "archive": {"descriptor": ["end"], "cells": [12, 8]}})
    elites = elites_of(condition, run_replicates(condition, 0, 2))
    again = retry_elites(condition, elites, trials=16)
    assert again.drop("again_fitness", "again_deviation", "again_descriptor", "again_cell").equals(elites)
    assert again["again_fitness"].mean() < elites["fitness"].mean()
    corrected = corrected_archive(again)
    assert corrected.height < elites.height
    assert corrected.select("replicate", "again_cell").is_unique().all()
    best = again.group_by("replicate", "again_cell").agg(pl.col("again_fitness").max())
    assert corrected["again_fitness"].sum() == pytest.approx(best["again_fitness"].sum())
    assert retry_elites(condition, elites.tail(3), trials=16).height == 3
    with pytest.raises(ValueError, match="trials is 0"):
        retry_elites(condition, elites, trials=0)


@pytest.mark.parametrize("variant", VARIANTS, ids=str)
def test_archives_of_pyribs_have_the_same_elites_in_the_same_cells(variant: dict[str, Any]) -> None:
    pytest.importorskip("ribs.archives", reason="needs ribs: uv sync --extra qd")
    condition = condition_of(variant)
    elites = elites_of(condition, run_replicates(condition, 0, 1))
    for frame, cell, fitness in (
        (elites, "cell", "fitness"),
        (corrected_archive(retry_elites(condition, elites, 3)), "again_cell", "again_fitness"),
    ):
        theirs = to_ribs(condition, frame).data(return_type="pandas").sort_values("index")
        assert theirs["index"].tolist() == frame.sort(cell)[cell].to_list()
        assert theirs["objective"].tolist() == frame.sort(cell)[fitness].to_list()
    assert theirs["solution"].iloc[0].network().activate([0.0] * len(condition.network_inputs)).shape == (2,)
    two = elites.vstack(elites.with_columns(replicate=pl.lit(1, pl.UInt32)))
    with pytest.raises(ValueError, match="rows of 2 runs"):
        to_ribs(condition, two)


def test_rows_that_do_not_tell_all_trials_of_elites_are_refused() -> None:
    condition = condition_of({"platform": "sim", "archive": {"descriptor": ["end"], "cells": [6, 5]}})
    rows = run_replicates(condition, 0, 2)
    assert rows["tries"].max() > 1
    for wrong, says in (
        (rows.drop("tries"), "have no column tries"),
        (rows.drop("tries", "parents"), "no column parents and no column tries"),
        (rows.filter(pl.col("generation") > 1), "Rows of run 0 .* are not all rows from its first batch on"),
        (rows.filter(pl.col("individual") > 0), "are not all rows"),
        (rows.filter((pl.col("replicate") == 0) | (pl.col("fitness") > 0.05)), "Rows of run 1"),
    ):
        for read in (elites_of, archive_progress):
            with pytest.raises(ValueError, match=says):
                read(condition, wrong)
    assert elites_of(condition, rows.filter(pl.col("generation") < 3)).height


@pytest.mark.parametrize("competition", ["cells", "dominated-novelty", "local"])
def test_rows_of_others_cannot_write_beside_an_archive(competition: str) -> None:
    """Means of huge numbers are no numbers, and had cells that are not there: reading such rows ended the process."""
    archive = {"descriptor": ["end"], "cells": [4, 4], "retry": 0.5, "competition": competition}
    condition = condition_of({"archive": archive})
    rows = run_replicates(condition, 0, 1)
    signs = np.where(np.arange(rows.height) % 2, 1.7e308, -1.7e308)
    hostile = rows.with_columns(descriptor=pl.Series(np.column_stack([signs, -signs])).arr.to_list())
    with contextlib.suppress(ValueError):  # rows that the archive of this condition cannot have
        assert archive_progress(condition, hostile)["filled"].max() <= 1


def test_means_of_elites_are_those_of_their_rows() -> None:
    condition = condition_of(VARIANTS[3])
    rows = run_replicates(condition, 0, 1)
    by_number = dict(enumerate(rows.iter_rows(named=True)))
    elites = elites_of(condition, rows)
    assert elites["tries"].max() > 2
    for elite in elites.iter_rows(named=True):
        row = by_number[elite["generation"] * condition.neat.population + elite["individual"]]
        trials = [row]
        while trials[-1]["tries"] > 1:
            trials.append(by_number[trials[-1]["parents"][0]])
            assert trials[-1]["genome"] == row["genome"]
        assert len(trials) == elite["tries"]
        assert elite["fitness"] == pytest.approx(np.mean([each["fitness"] for each in trials]))
        np.testing.assert_allclose(
            elite["descriptor"], np.mean([one["descriptor"] for one in trials], axis=0)
        )


def test_other_selections_have_no_archive() -> None:
    condition = Condition(name="c", neat={"population": 4, "generations": 2})
    with pytest.raises(ValueError, match="expected 'map-elites'"):
        elites_of(condition, run_replicates(condition, 0, 1).with_columns(descriptor=pl.lit([0.0])))


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"archive": {"cells": [20, 10]}}, "cells has 2 numbers, expected 3 with kind 'grid'"),
        ({"archive": {"kind": "cvt"}}, "cells has 3 numbers, expected 1 with kind 'cvt'"),
        ({"archive": {"cells": [2000, 2000, 5]}}, "20,000,000"),
        ({"archive": {"cells": [0, 10, 5]}}, "expected 1 to"),
        ({"archive": {"descriptor": ["end", "end"], "cells": [1, 1, 1, 1]}}, "twice"),
        ({"archive": {"descriptor": ["speed"]}}, "mean_turn"),
        ({"archive": {"repeats": 0}}, "greater than or equal to 1"),
        ({"archive": {"retry": 1.0}}, "less than 1"),
        ({"archive": {"cells": [100, 100, 100]}}, "1,000,000 cells of depth 4 hold 4,000,000 genomes"),
        (
            {"archive": {"cells": [100, 100, 100], "depth": 1, "competition": "dominated-novelty"}},
            "1,000,000 in all, expected at most 10,000 with competition 'dominated-novelty'",
        ),
        ({"platform": "sim", "arena": {"robots": 2, "other_starts": [[0.5, 0.3, 0.0]]}}, "several robots"),
        ({"platform": "scribbler"}, "thousands of trials"),
    ],
)
def test_mistakes_are_refused(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        condition_of(settings)


def test_there_is_no_population_to_ask() -> None:
    condition = condition_of(VARIANTS[0])
    with pytest.raises(ValueError, match="use MapElites"):
        Evolution(condition, 0)


def test_conditions_without_an_archive_keep_their_settings() -> None:
    assert "archive" not in Condition(name="c").settings()
    condition = condition_of(VARIANTS[1])
    assert condition.settings()["archive"]["repeats"] == 3
    assert Condition.from_settings("c", condition.settings()).hash() == condition.hash()
