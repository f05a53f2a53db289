"""Pens are told apart, their traces followed, and cells come with how sure they are."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from realitygap.errors import VisionError
from realitygap.vision import (
    SheetLayout,
    SheetScore,
    overlay_png,
    read_photo,
    score_sheet,
)

from .sheets import ARENA, LAYOUT, ORDINARY, SCAN, curve, photo, truth


def _ious(score):
    paths = [curve(trace.pen) for trace in score.traces]
    found = [(set(trace.cells), truth(path)) for trace, path in zip(score.traces, paths, strict=True)]
    return [len(a & b) / len(a | b) for a, b in found]


@cache
def _score_of_one_pen() -> SheetScore:
    return score_sheet(read_photo(photo(1, ORDINARY, n=1).jpeg), LAYOUT, [0])


@pytest.mark.slow
def test_eight_pens_on_a_clean_scan_are_read_without_a_mistake_of_more_than_a_cell():
    score = score_sheet(read_photo(photo(1, SCAN, size=None).jpeg), LAYOUT)
    assert np.mean(_ious(score)) > 0.97
    for trace in score.traces:
        assert trace.is_tried
        assert abs(len(trace.cells) - len(truth(curve(trace.pen)))) <= 1


@pytest.mark.slow
def test_an_ordinary_photo_is_read_nearly_as_well():
    """Of 20 such photographs the worst had a mean of .93."""
    assert np.mean(_ious(score_sheet(read_photo(photo(3, ORDINARY, size=None).jpeg), LAYOUT))) > 0.9


@pytest.mark.slow
def test_only_pens_that_drew_are_looked_for_and_others_have_next_to_no_cells():
    image = read_photo(photo(2, ORDINARY, n=2).jpeg)
    score = score_sheet(image, LAYOUT, [0, 1])
    assert [trace.pen for trace in score.traces] == [0, 1]
    assert min(_ious(score)) > 0.9
    assert all(len(trace.cells) <= 2 for trace in score_sheet(image, LAYOUT).traces[2:])


@pytest.mark.slow
def test_colors_of_untried_pens_come_from_names_and_that_is_reported():
    score = score_sheet(read_photo(photo(4, SCAN, n=3, has_key=False).jpeg), LAYOUT, [0, 1, 2])
    assert not any(trace.is_tried for trace in score.traces)
    assert min(_ious(score)) > 0.9


@pytest.mark.slow
def test_a_pen_whose_name_is_no_color_must_be_tried():
    layout = SheetLayout.of(ARENA, ("mine", "red", "blue"))
    with pytest.raises(VisionError, match="Pen 'mine': its box on the sheet is empty"):
        score_sheet(read_photo(photo(4, SCAN, n=3, has_key=False).jpeg), layout)


@pytest.mark.slow
def test_the_path_goes_through_the_whole_trace_from_the_start():
    (trace,) = _score_of_one_pen().traces
    start = np.array([ARENA.start.x, ARENA.start.y])
    assert np.hypot(*(trace.path[0] - start)) < 0.006
    drawn = curve(0)
    away = np.sqrt(((drawn[:, None] - trace.path[None]) ** 2).sum(axis=2)).min(axis=1)
    assert np.percentile(away, 95) < 0.004


@pytest.mark.slow
def test_probabilities_say_cells_and_doubt():
    (trace,) = _score_of_one_pen().traces
    assert trace.probability.shape == (72,)
    assert ((trace.probability >= 0) & (trace.probability <= 1)).all()
    assert set(trace.cells) == set(np.flatnonzero(trace.probability >= 0.5))
    assert (trace.confidence >= 0.5).all()
    assert all(trace.confidence[cell] < 0.9 for cell in trace.doubtful)


@pytest.mark.slow
def test_the_overlay_is_a_picture():
    data = overlay_png(_score_of_one_pen(), {0: "black, trial 1"})
    assert data.startswith(b"\x89PNG")
    assert len(data) > 100_000
