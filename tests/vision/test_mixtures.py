"""Colors are explained by one, two or three inks, and by whose traces pass."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.vision._ink import Mixtures

RED, BLUE = np.array([0.3, 2.0, 1.8]), np.array([2.2, 1.4, 0.4])
PURPLE = 0.5 * (RED + BLUE)  # looks like the other two on each other, drawn faintly
INKS = np.array([RED, BLUE, PURPLE], np.float32)


def _presence(density, passing=None, of_itself=0.08):
    mixtures = Mixtures.of(np.array([density], np.float32), INKS)
    if passing is None:
        return mixtures.presence(np.ones((1, 3), np.float32))[0]
    return mixtures.presence_along(np.array([passing], np.float32), np.full((1, 3), of_itself, np.float32))[0]


@pytest.mark.parametrize("pen", [0, 1, 2])
def test_a_single_ink_is_told(pen):
    assert _presence(INKS[pen]).argmax() == pen


def test_ink_that_two_passing_traces_explain_is_no_evidence_of_a_third():
    seen = 0.5 * (RED + BLUE)
    assert _presence(seen, (0.02, 0.02, 0.02))[2] > 0.7
    assert _presence(seen, (0.45, 0.45, 0.4))[2] < 0.3


def test_knowledge_of_a_pens_own_trace_counts_little_for_that_pen():
    seen = 0.5 * (RED + BLUE)
    sure, unsure = _presence(seen, (0.45, 0.45, 0.45)), _presence(seen, (0.45, 0.45, 0.08))
    assert sure[2] == pytest.approx(unsure[2], rel=1e-3)
    assert sure[0] < unsure[0]  # but for the others it does


def test_a_pen_whose_ink_is_not_there_is_ruled_out_though_its_trace_may_pass():
    assert _presence(BLUE, (0.5, 0.02, 0.02))[0] < 0.1
