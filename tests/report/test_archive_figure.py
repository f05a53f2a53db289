"""The figure of the novelty archive."""

from __future__ import annotations

import pytest

from realitygap.report import NARROW, draw_archive


def test_it_shows_whose_behaviors_the_archive_of_the_typical_run_holds(tiny_study):
    drawn = draw_archive(tiny_study)
    assert "end of novelty, run" in drawn.caption
    assert "8 behaviors" in drawn.caption  # the archive's size
    assert "SIM, n = 1 run" in drawn.caption
    assert "n = 7 runs" in drawn.caption
    assert "Recomputed from the records" in drawn.caption
    assert drawn.svg.count("<svg") == 1
    assert "mean novelty [cells]" in drawn.svg
    assert drawn.in_width(NARROW).svg != drawn.svg


def test_a_condition_that_does_not_select_by_novelty_has_none(tiny_study):
    with pytest.raises(ValueError, match="'coverage' does not select by novelty"):
        draw_archive(tiny_study, "coverage")
    with pytest.raises(ValueError, match="has no run 99"):
        draw_archive(tiny_study, "novelty", 99)
