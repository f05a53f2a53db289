from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import matplotlib as mpl
import numpy as np
import pytest

from realitygap.drawing import Ink
from realitygap.report import NARROW, compare_choices, draw_choices, draw_coverage, draw_paths
from realitygap.report._tally import read_tally
from realitygap.report.charts.house import inline
from tests.report.results import describe, random_runs, settings, write_results


def texts(svg: str) -> list[str]:
    return ["".join(each.itertext()) for each in ET.fromstring(svg).iter() if each.tag.endswith("text")]


def test_every_figure_says_label_and_number_of_runs(tiny_study):
    for drawing in (draw_coverage(tiny_study), draw_paths(tiny_study), draw_choices(tiny_study)):
        assert any("SIM" in text for text in texts(drawing.svg))
        assert "SIM" in drawing.caption
        assert "n = " in drawing.caption or any("n = 7" in text for text in texts(drawing.svg))
        assert f'aria-label="{drawing.alt}"' in drawing.svg


@pytest.mark.parametrize("draw", [draw_coverage, draw_paths, draw_choices])
def test_drawing_twice_gives_the_same_bytes(tiny_study, draw):
    assert draw(tiny_study).svg == draw(tiny_study).svg
    assert draw(tiny_study).in_width(NARROW).svg != draw(tiny_study).svg


def test_user_settings_of_matplotlib_neither_matter_nor_change(tiny_study):
    before = draw_coverage(tiny_study).svg
    with mpl.rc_context({"font.size": 30, "axes.grid": True, "svg.fonttype": "path"}):
        assert draw_coverage(tiny_study).svg == before
        assert mpl.rcParams["font.size"] == 30


def test_a_drawing_fetches_nothing_and_has_no_style_for_others(tiny_study):
    svg = draw_coverage(tiny_study).svg
    assert not re.findall(r"<(?:style|metadata|image|script)\b", svg)
    assert set(re.findall(r'href="(.)', svg)) == {"#"}
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", svg))


def test_inlined_colors_are_all_variables(tiny_study):
    for drawing in (draw_coverage(tiny_study), draw_paths(tiny_study), draw_choices(tiny_study)):
        page = inline(drawing.svg)
        assert not re.findall(r"(?:fill|stroke): #\w+", page)
        assert set(re.findall(r"var\(--ink-(\w+)\)", page)) <= set(Ink.names())
        assert "xmlns" not in page


def test_every_condition_has_a_panel(tiny_study):
    drawn = " ".join(texts(draw_coverage(tiny_study).svg))
    assert all(name in drawn for name in ("coverage", "novelty", "turn", "ends"))


def test_points_follow_the_study_or_the_caller(out):
    runs = [[[0.4, 0.1], [0.2, 0.1], [0.3, 0.2]]] * 2
    folder = write_results(out, [describe("c")], {"c": runs}, report={"points": "best-so-far"})
    assert draw_coverage(folder).caption.startswith("Best coverage so far")
    assert draw_coverage(folder, points="best-of-generation").caption.startswith(
        "Best coverage by generation"
    )
    assert draw_coverage(folder).svg != draw_coverage(folder, points="best-of-generation").svg


def test_few_runs_have_no_interval_and_the_caption_says_so(out):
    folder = write_results(out, [describe("c")], {"c": random_runs(5)})
    drawing = draw_coverage(folder)
    assert "a 95 % interval needs 6 runs" in drawing.caption
    assert "95 % interval of the median" not in texts(drawing.svg)


def test_too_many_lines_are_thinned_and_the_caption_says_how(out):
    runs = np.random.default_rng(5).integers(0, 73, (40, 200, 1)) / 72
    folder = write_results(out, [describe("c")], {"c": runs})
    drawing = draw_coverage(folder)
    assert "the first runs" in drawing.caption
    assert re.search(r"\((\d+) of 40 in c\)", drawing.caption)
    assert len(drawing.svg) < 300_000


@pytest.mark.slow
def test_a_thousand_runs_draw_as_small_as_they_are_distinct(out):
    folder = write_results(out, [describe("c")], {"c": random_runs(1000, 5, 8)})
    drawing = draw_coverage(folder)
    assert "every run" in drawing.caption
    assert len(drawing.svg) < 200_000


def test_one_generation_and_one_run_draw(out):
    folder = write_results(out, [describe("c")], {"c": random_runs(1, 1, 1)})
    assert "c" in texts(draw_coverage(folder).svg)


def test_the_typical_run_is_the_lower_median_one(tiny_study):
    bests = read_tally(tiny_study).run_bests("novelty", "line")
    drawing = draw_paths(tiny_study, "novelty")
    run = int(re.search(r"run (\d+),", drawing.caption)[1])
    assert bests[run] == np.sort(bests)[3]
    assert list(bests).index(bests[run]) == run
    assert f"the run with the median best coverage (its best coverage: {bests[run]:.3f})" in drawing.caption


def test_paths_show_each_generation_with_its_coverage(tiny_study):
    drawing = draw_paths(tiny_study, "coverage", 2)
    rows = tiny_study.read("coverage", [2])
    for generation in range(3):
        best = rows.filter(rows["generation"] == generation)["coverage_line"].max()
        assert any(f"{best:.3f} ({round(best * 72)} of 72)" in text for text in texts(drawing.svg))
        assert f"generation {generation}" in texts(drawing.svg)
    assert "median" not in drawing.caption
    assert "Recomputed from the records" in drawing.caption


def test_paths_that_cannot_be_recomputed_are_left_out_and_said_to_be(tiny_study, no_replay):
    drawing = draw_paths(tiny_study, "coverage")
    assert "Some paths are missing" in drawing.caption
    assert "path of its center" not in texts(drawing.svg)


def test_unknown_condition_or_run_is_a_clear_error(tiny_study):
    with pytest.raises(ValueError, match="Did you mean 'novelty'"):
        draw_paths(tiny_study, "noveltyy")
    with pytest.raises(ValueError, match="has no run 99"):
        draw_paths(tiny_study, "novelty", 99)


def test_choices_are_sorted_by_their_effect(out):
    def runs(best: float) -> list:
        return [[[best, 0.0]]] * 6

    conditions = [
        describe("base"),
        describe("down", baseline="base", change="less"),
        describe("same", baseline="base", change="equal"),
        describe("up", baseline="base", change="more"),
        describe("alone"),
    ]
    coverages = {"base": runs(0.3), "down": runs(0.1), "same": runs(0.3), "up": runs(0.4), "alone": runs(0.2)}
    folder = write_results(out, conditions, coverages)
    (group,) = compare_choices(folder)
    assert [choice.change for choice in group] == ["base", "more", "equal", "less"]
    assert [choice.effect for choice in group] == pytest.approx([0.0, 0.1, 0.0, -0.2])
    drawn = texts(draw_choices(folder).svg)
    assert [text for text in drawn if text[0] in "+−±"] == ["+0.100", "±0.000", "−0.200"]


def test_a_choice_of_how_cells_count_shows_both_counts(out):
    ends = settings(task={"cells": "ends"})
    conditions = [describe("base"), describe("ends", baseline="base", change="ends", settings=ends)]
    folder = write_results(out, conditions, {"base": random_runs(6), "ends": random_runs(6)})
    ((_, choice),) = compare_choices(folder)
    assert choice.other_median == pytest.approx(choice.median / 2)
    assert "median as its selection counts" in texts(draw_choices(folder).svg)


def test_there_is_no_figure_of_choices_without_baselines(out):
    folder = write_results(out, [describe("c")], {"c": random_runs(2)})
    assert compare_choices(folder) == []
    with pytest.raises(ValueError, match="names a baseline"):
        draw_choices(folder)
