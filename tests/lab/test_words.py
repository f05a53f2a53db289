"""Words of pages that follow from numbers."""

from __future__ import annotations

import pytest

pytest.importorskip("nicegui", reason="needs the extra lab")

from realitygap.lab.pages._calibrate import _with_minus
from realitygap.lab.pages._new import _Summary


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("-1 to 1", "−1 to 1"),
        ("-0.5 to -0.25", "−0.5 to −0.25"),
        ("1e-05 to 2e-05", "1e-05 to 2e-05"),
        ("0.2 m-1", "0.2 m-1"),
    ],
)
def test_numbers_below_zero_have_a_minus_sign(text, shown):
    assert _with_minus(text) == shown


@pytest.mark.parametrize(
    ("summary", "words"),
    [
        (_Summary(), ""),
        (_Summary("x", 0.0, 2, -5), ""),
        (_Summary("x", 0.0, 1, 1), "1 condition × 1 run = 1 run"),
        (
            _Summary("x", 0.0, 2, 50, seconds=0.1),
            "2 conditions × 50 runs = 100 runs · less than 5 s on this machine",
        ),
        (
            _Summary("x", 0.0, 2, 50, is_checked=True, seconds=600.0),
            "No mistakes. 2 conditions × 50 runs = 100 runs · about 10 min on this machine",
        ),
        (_Summary("x", 0.0, 2, 3, n_trials=240), "2 conditions × 3 runs = 6 runs · 240 trials on the robot"),
    ],
)
def test_summary_of_a_new_study_states_its_size_and_time(summary, words):
    assert summary.words == words
