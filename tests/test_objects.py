"""The verbs of studies, results, gaps, calibrations, and figures."""

from __future__ import annotations

import subprocess
import sys
import typing
from pathlib import Path
from types import ModuleType

import polars as pl
import pytest

import realitygap as rg
from realitygap.errors import MissingExtraError
from realitygap.report import Drawing
from realitygap.study import parse_study
from realitygap.world import Calibration, load_calibration

ROOT = Path(__file__).parent.parent

STUDY = """
[study]
name = "tiny"
replicates = 3

[neat]
population = 4
generations = 2

[platform.jyro]
steps = 10

[[condition]]
name = "coverage"
selection = "coverage"
noise = 0.1

[[condition]]
name = "novelty"
selection = "novelty"
noise = 0.1
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return parse_study(STUDY, "tiny.toml").run(tmp_path_factory.mktemp("objects") / "tiny")


@pytest.mark.slow
def test_twenty_lines_run_unchanged(tmp_path):
    script = ROOT / "examples" / "twenty_lines.py"
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=True)
    names = ("coverage.svg", "paths.svg", "run-6.gif", "gap.svg", "results/twin-worn-all-track.toml")
    assert all((tmp_path / name).stat().st_size > 0 for name in names)
    assert done.stdout.count("RMS gap") == 2
    assert len([line for line in script.read_text().split('"""')[2].splitlines() if line]) <= 25


def test_study_runs_with_its_own_replicates_or_others(results, tmp_path):
    assert results.count_runs() == (6, 6)
    fewer = parse_study(STUDY, "tiny.toml").run(tmp_path / "fewer", replicates=2, threads=1)
    assert fewer.count_runs() == (4, 4)


def test_best_has_the_highest_score_of_each_condition(results):
    best, rows = results.best(), results.to_polars()
    assert best["score"].to_list() == sorted(best["score"], reverse=True)
    for row in best.iter_rows(named=True):
        of_condition = rows.filter(condition=row["condition"])
        assert row["score"] == of_condition["coverage_line"].max()
        numbers = {"replicate": row["run"], "generation": row["generation"], "individual": row["individual"]}
        assert of_condition.filter(**numbers)["coverage_line"].item() == row["score"]


def test_figures_are_shown_in_short_and_saved(results, tmp_path):
    for drawing in (results.plot(), results.paths("novelty", run=1)):
        assert len(repr(drawing)) < 120
        assert drawing.save(tmp_path / "figure.svg").read_text("utf-8").lstrip().startswith("<")


def test_figure_of_other_tasks_shows_their_score(tmp_path):
    task = '[task]\nkind = "avoid"\n'
    other = parse_study(
        STUDY.replace("[neat]", task + "[neat]").replace('"coverage"\nnoise', '"fitness"\nnoise'),
        "other.toml",
    ).run(tmp_path / "other")
    assert "coverage" not in other.plot().alt.lower()


def test_replay_shows_the_named_run_or_names_those_that_exist(results):
    trial = results.replay("novelty", run=2)
    assert trial.title.startswith("novelty, run 2")
    with pytest.raises(ValueError, match=r"Unknown condition 'nvelty'\. Did you mean 'novelty'"):
        results.replay("nvelty")
    with pytest.raises(ValueError, match=r"has no run 9 .* its runs are 0 to 2"):
        results.replay("novelty", run=9)


@pytest.mark.parametrize("missing", ["pandas", "pyarrow"])
def test_pandas_is_named_if_it_is_missing(missing, results, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", ModuleType("pandas"))
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(MissingExtraError, match=f"needs {missing}.*pip install pandas pyarrow"):
        results.to_pandas()


def test_pandas_gets_all_rows_from_polars(results, monkeypatch):
    """The development environment has no pandas. So its modules are empty, and polars passes its frame on."""
    for module in ("pandas", "pyarrow"):
        monkeypatch.setitem(sys.modules, module, ModuleType(module))
    monkeypatch.setattr(pl.DataFrame, "to_pandas", lambda frame: ("pandas", frame))
    name, frame = results.to_pandas()
    assert name == "pandas"
    assert frame.equals(results.to_polars())
    assert frame.height == results.to_polars().height > 0


def test_completion_offers_the_verbs_and_no_internals(results):
    offered = dir(results)
    assert len(offered) <= 15
    assert {"best", "plot", "paths", "replay", "report", "to_polars", "to_pandas"} <= set(offered)
    assert all(hasattr(type(results), name) for name in offered)


def test_verbs_declare_what_they_return():
    """Editors complete the result of each verb."""
    expected = {
        rg.Study.run: rg.ResultsFolder,
        rg.ResultsFolder.best: pl.DataFrame,
        rg.ResultsFolder.plot: Drawing,
        rg.ResultsFolder.paths: Drawing,
        rg.ResultsFolder.replay: rg.playback.MovingTrial,
        rg.ResultsFolder.report: Path,
        rg.ResultsFolder.to_polars: pl.DataFrame,
        rg.study.GapBetween.plot: Drawing,
        rg.study.GapBetween.report: Path,
        Calibration.simulator: str,
    }
    for verb, returned in expected.items():
        assert typing.get_type_hints(verb)["return"] is returned, verb


def test_front_door_measures_a_gap_and_shows_its_measures(results):
    gap = rg.measure_gap("sim", "jyro", controllers=results, n_controllers=4, trials=2)
    assert isinstance(gap, rg.study.GapBetween)
    assert float(gap.rms) == gap.rms.value
    assert gap.verdict in gap.study.result.verdict
    assert len(repr(gap.plot())) < 120


def test_calibration_gives_the_simulator_in_its_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fit = rg.calibrate("path", robot="sim")
    assert fit.simulator() == "sim:results/sim-path.toml"
    assert load_calibration("results/sim-path.toml").simulator() == fit.simulator()
    assert fit.simulator("other.toml") == "sim:other.toml"
    unsaved = Calibration(**fit.model_dump())
    assert unsaved == fit
    with pytest.raises(ValueError, match="no file yet"):
        unsaved.simulator()


def test_observation_level_stands_for_a_calibration_of_all_parts():
    order = rg.orders.CalibrateOrder(what="track", robot="sim")
    assert (order.what, order.observe) == ("all", "track")
