from __future__ import annotations

import numpy as np
import pytest

from realitygap.platforms import trace_genome
from realitygap.report._champions import FRESH_TRIALS, retry_champions
from realitygap.runs import Condition, genome_of, replay
from realitygap.trials import NoiseKey
from tests.report.results import describe, random_runs, settings, write_results


def test_champions_are_the_best_of_each_run_and_tried_anew(tiny_study):
    found = {each.condition: each for each in retry_champions(tiny_study)}
    assert list(found) == ["coverage", "novelty", "turn", "ends"]
    novelty = found["novelty"]
    assert novelty.problem == ""
    assert novelty.label == "SIM"
    assert novelty.fresh.shape == (7, FRESH_TRIALS)
    rows = tiny_study.read("novelty")
    bests = rows.group_by("replicate", maintain_order=True).agg(best=rows["coverage_line"].max())
    assert len(bests) == 7
    for run in range(7):
        part = tiny_study.read("novelty", [run])
        assert novelty.reported[run] == part["coverage_line"].max()
    row = tiny_study.read("novelty", [4])
    best = row.row(int(np.argmax(row["coverage_line"].to_numpy())), named=True)
    condition = Condition.from_settings("novelty", tiny_study.description["conditions"][1]["settings"])
    assert replay(condition, best).coverage_line == novelty.reported[4]
    for repeat in (1, 20):
        fresh = trace_genome(
            condition.on,
            condition.arena.arena(),
            genome_of(condition, best),
            noise=condition.noise,
            noise_key=NoiseKey(best["key"], 4, best["generation"], best["individual"], repeat),
        )
        assert fresh.coverage_line == novelty.fresh[4, repeat - 1]


def test_luck_is_what_is_lost_and_few_champions_have_no_interval(tiny_study):
    found = retry_champions(tiny_study)[0]
    assert found.luck.value == pytest.approx(found.reported.mean() - found.fresh.mean())
    assert found.luck.ends is None
    assert found.expected_mean.ends is None


def test_rows_of_another_key_are_not_tried(out):
    folder = write_results(out, [describe("c")], {"c": random_runs(3)})
    (found,) = retry_champions(folder)
    assert found.n == 0
    assert "key of its settings" in found.problem


def test_settings_of_another_version_are_said_so(out):
    folder = write_results(out, [describe("c", settings=settings(flux=3))], {"c": random_runs(3)})
    (found,) = retry_champions(folder)
    assert "another version" in found.problem


def test_trials_that_come_out_otherwise_are_not_shown(tiny_study, monkeypatch):
    from realitygap.report import _champions

    rows = _champions._champion_rows

    def changed(tally, condition):
        return rows(tally, condition).with_columns(coverage_line=0.5)

    monkeypatch.setattr(_champions, "_champion_rows", changed)
    assert {"another version computed them" in each.problem for each in retry_champions(tiny_study)} == {True}
