"""Scores of other tasks than coverage: their table and figures on the page of a study."""

from __future__ import annotations

import json
import re

import polars as pl
import pytest

from realitygap.records import ResultsFolder
from realitygap.report import (
    _replay,
    draw_paths,
    draw_scores,
    export_individual,
    read_tally,
    summarize_tasks,
    write_report,
)
from realitygap.study import parse_study, run_study

from .test_drawing import texts

pytestmark = pytest.mark.slow

TEXT = """
[study]
name = "tasks"
replicates = 6

[neat]
population = 6
generations = 3

[platform.jyro]
steps = 20

[[condition]]
name = "avoid"
task.kind = "avoid"

[[condition]]
name = "wall"
task.kind = "wall"

[[condition]]
name = "wall-again"
task.kind = "wall"

[[condition]]
name = "cover"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("scores") / "tasks"
    run_study(parse_study(TEXT, "tasks.toml"), path)
    return path


def test_each_score_has_a_figure_with_a_panel_for_each_of_its_conditions(folder):
    drawn = [" ".join(texts(drawing.svg)) for drawing in draw_scores(folder)]
    assert len(drawn) == 2
    assert ["avoidance" in text for text in drawn] == [True, False]
    assert [text.count("SIM, n = 6") for text in drawn] == [1, 2]
    assert "wall-again" in drawn[1]
    assert not any("cover" in text for text in drawn)


def test_the_axis_holds_every_score(folder):
    for drawing in draw_scores(folder):
        axes = drawing.figure.axes[0]
        low, high = axes.get_ylim()
        values = [y for line in axes.lines for y in line.get_ydata() if y == y]
        assert low <= min(values) <= max(values) <= high
    low, high = draw_scores(folder)[0].figure.axes[0].get_ylim()
    assert 0.0 <= low < high <= 1.0, "no score of avoidance is beyond 0 to 1"


def test_the_page_has_the_table_and_the_figures_of_scores(folder, tmp_path):
    page = write_report(folder, tmp_path / "page.html").read_text("utf-8")
    section = page.split('<h3 id="scores">')[1].split("</section>")[0]
    medians = [f"{row:#.4g}" for row in summarize_tasks(folder)["median"]]
    assert re.findall(r'<td class="median">([^<]*)</td>', section) == medians
    assert section.count('<figure id="figure-scores-') == 2


def test_first_screen_plays_the_best_trial_by_the_task(folder):
    tally = read_tally(folder)
    replay = _replay.content(tally, "wall")
    run = next(each for each in replay.runs if each.name == "wall")
    best = tally.rows_of("wall", run.replicate)["task_fitness"].max()
    assert replay.still.caption.endswith(f"score of wall {best:#.4g}.")


def test_a_study_of_coverage_has_no_figure_of_scores(tiny_study):
    assert draw_scores(tiny_study) == []


def test_the_best_trial_is_the_best_by_the_task(folder, tmp_path):
    rows = ResultsFolder.open(folder).read("wall")
    best = rows.group_by("replicate").agg(pl.col("task_fitness").max()).sort("task_fitness")
    typical = best.row((best.height - 1) // 2, named=True)
    last = rows.filter((pl.col("replicate") == typical["replicate"]) & (pl.col("generation") == 2))
    export_individual(folder, tmp_path / "wall.json", condition="wall")
    origin = json.loads((tmp_path / "wall.json").read_text("utf-8"))["origin"]
    assert origin["replicate"] == typical["replicate"]
    assert origin["fitness"] == last["task_fitness"].max()
    assert "its best score" in draw_paths(folder, "wall").caption
    assert "its best coverage" in draw_paths(folder, "cover").caption
