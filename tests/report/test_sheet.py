"""Panels have the sizes that a figure asks for, and texts have room."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from realitygap.report import (
    NARROW,
    draw_choices,
    draw_coverage,
    draw_paths,
    draw_species,
)
from realitygap.report.charts.house import WIDE, house_style
from realitygap.report.charts.lines import head, line_key, write
from realitygap.report.charts.rows import stacked
from realitygap.report.charts.sheet import Sheet, grid


def size_of(axes: Axes) -> tuple[float, float]:
    """Width and height of a panel [in]."""
    width, height = axes.get_figure().get_size_inches()
    box = axes.get_position()
    return box.width * width, box.height * height


def extents(sheet: Sheet) -> list[Bbox]:
    sheet.figure.draw_without_rendering()
    return [axes.get_tightbbox() for axes in sheet.panels.values()]


def test_rows_have_their_heights_and_texts_do_not_meet():
    with house_style():
        sheet = Sheet(6.0, [["a", "b"], ["c", "c"]], [1.0, 0.5])
        for name, axes in sheet.panels.items():
            head(axes, f"title of {name}", "n = 3")
            axes.set_ylabel("a long name of a quantity", rotation=0, ha="right")
            axes.set_xlabel("generation")
        sheet.key([line_key("one"), line_key("two")])
        sheet.settle()
        assert size_of(sheet.panels["a"])[1] == pytest.approx(1.0)
        assert size_of(sheet.panels["b"])[1] == pytest.approx(1.0)
        assert size_of(sheet.panels["c"])[1] == pytest.approx(0.5)
        boxes = [*extents(sheet), *(legend.get_window_extent() for legend in sheet.figure.legends)]
        assert not any(Bbox.intersection(a, b) for a, b in itertools.combinations(boxes, 2))
        for box in boxes:
            assert box.x0 >= -1
            assert box.y0 >= -1
            assert box.x1 <= sheet.figure.bbox.width + 1
            assert box.y1 <= sheet.figure.bbox.height + 1


def test_a_row_to_scale_follows_the_limits_of_its_first_panel():
    with house_style():
        sheet, (first, second) = grid(4.0, 2, 2, None)
        for axes in (first, second):
            axes.set_xlim(0, 2)
            axes.set_ylim(0, 1)
        sheet.settle()
        for axes in (first, second):
            width, height = size_of(axes)
            assert height == pytest.approx(width / 2)


def test_a_panel_over_several_rows_is_to_scale():
    with house_style():
        sheet = Sheet(6.0, [["field", "x"], ["field", "y"]], [None, None])
        sheet.panels["field"].set_xlim(0, 3)
        sheet.panels["field"].set_ylim(0, 2)
        sheet.panels["y"].set_xlabel("time [s]")
        sheet.settle()
        width, height = size_of(sheet.panels["field"])
        assert height == pytest.approx(width * 2 / 3)


@pytest.mark.parametrize(("width", "most"), [(WIDE, 1), (NARROW, 3)])
def test_a_key_takes_as_few_lines_as_fit(width, most):
    with house_style():
        sheet, _ = grid(width, 1, 1, 1.0)
        sheet.key([line_key(f"a name of {k} and more words") for k in range(4)])
        (legend,) = sheet.figure.legends
        sheet.settle()
        sheet.figure.draw_without_rendering()
        assert legend.get_window_extent().width <= sheet.figure.bbox.width
        lines = {round(text.get_window_extent().y0) for text in legend.get_texts()}
        assert len(lines) >= 1
        assert (len(lines) == 1) == (most == 1)


def test_content_of_a_settled_panel_moves_nothing():
    with house_style():
        sheet, (axes,) = grid(4.0, 1, 1, 1.0)
        sheet.settle()
        before = axes.get_position().bounds
        write(
            axes, "beyond the panel, far to the right of it", (0.9, 0.5), (0, 0), 20, units=("data", "data")
        )
        sheet.settle()
        assert axes.get_position().bounds == before


@pytest.mark.parametrize("draw", [draw_choices, draw_coverage, draw_paths, draw_species])
@pytest.mark.parametrize("width", [WIDE, NARROW])
def test_no_text_of_a_figure_is_cut(tiny_study, draw, width):
    with house_style():
        figure = draw(tiny_study).in_width(width).figure
        figure.draw_without_rendering()
        for axes in figure.axes:
            box = axes.get_tightbbox()
            assert box.x0 >= -1
            assert box.y0 >= -1
            assert box.x1 <= figure.bbox.width + 1
            assert box.y1 <= figure.bbox.height + 1


def test_near_values_are_stacked_within_their_row():
    offsets = stacked(np.array([0.5] * 9 + [0.1]), 1.0)
    assert len(set(offsets[:9])) == 9
    assert abs(offsets).max() <= 0.5
    assert offsets[0] == 0.0
    assert offsets[9] == 0.0
