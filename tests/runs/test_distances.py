"""Novelty with any distance in whole runs, against archives that are told the behaviors of the rows."""

from __future__ import annotations

import polars as pl
import pytest

from realitygap.evolution import DISTANCES, NoveltyArchive
from realitygap.runs import Condition, Evolution, replay, run_replicates

pytestmark = pytest.mark.slow

START = {"paper": 20.0, "ordered": 20.0, "jaccard": 0.5, "hamming": 8.0, "edit": 8.0, "alignment": 0.5}


def novel(name: str, kind: str = "paper", **more: object) -> Condition:
    settings = {"kind": kind, "distance": name, "neighbors": 5, "threshold": START.get(name, 0.1)}
    return Condition(name="a", selection="novelty", noise=0.5, novelty=settings, **more)


@pytest.mark.parametrize("kind", ["paper", "lehman-stanley"])
@pytest.mark.parametrize("name", DISTANCES)
def test_novelty_of_whole_runs_is_that_of_an_archive_told_their_rows(name: str, kind: str) -> None:
    condition = novel(name, kind)
    rows = run_replicates(condition, 0, 3)
    for run in range(3):
        archive = NoveltyArchive(condition.novelty)
        for generation in range(condition.neat.generations):
            of_it = rows.filter(pl.col("replicate") == run, pl.col("generation") == generation)
            behaviors = of_it["cells"].to_list()
            if DISTANCES[name].compares == "position":
                behaviors = [replay(condition, row).poses[-1, :2] for row in of_it.iter_rows(named=True)]
            # runs are in single precision, and so is where trials end
            within = 1e-12 if DISTANCES[name].compares == "cells" else 1e-5
            assert of_it["novelty"].to_list() == pytest.approx(archive.update(behaviors).tolist(), rel=within)
        assert len(archive) > 0


def test_another_distance_is_another_evolution() -> None:
    found = [run_replicates(novel(name), 0, 4)["coverage_line"].to_list() for name in DISTANCES]
    assert len(set(map(tuple, found))) == len(DISTANCES)


@pytest.mark.parametrize("name", ["paper", "jaccard", "alignment"])
def test_asking_and_telling_gives_the_rows_of_a_whole_run(name: str) -> None:
    condition = novel(name, "lehman-stanley")
    rows = run_replicates(condition, 2, 1)
    evolution = Evolution(condition, 2)
    for generation in range(condition.neat.generations):
        of_it = rows.filter(pl.col("generation") == generation)
        assert [asked.record for asked in evolution.ask()] == of_it["genome"].to_list()
        scores = of_it["coverage_line"].to_list()
        assert list(evolution.tell(scores, of_it["cells"].to_list()).novelty) == of_it["novelty"].to_list()


def test_a_distance_other_than_the_papers_is_another_condition() -> None:
    assert novel("jaccard").hash() != novel("hamming").hash()
    settings = novel("jaccard").settings()
    assert settings["novelty"]["distance"] == "jaccard"
    assert Condition.from_settings("a", settings) == novel("jaccard")


@pytest.mark.parametrize("name", DISTANCES)
def test_a_drawing_tells_which_squares_and_not_their_order(name: str) -> None:
    distance = DISTANCES[name]
    if not distance.needs_order and distance.compares == "cells":
        assert Condition(name="a", platform="scribbler", selection="novelty", novelty={"distance": name})
        return
    with pytest.raises(ValueError, match="an operator enters the visited squares, and not"):
        Condition(name="a", platform="scribbler", selection="novelty", novelty={"distance": name})


def test_cells_at_the_ends_of_steps_have_no_order() -> None:
    with pytest.raises(ValueError, match=r"expected task\.cells 'line'"):
        novel("edit", task={"cells": "ends"})
    assert novel("jaccard", task={"cells": "ends"})
