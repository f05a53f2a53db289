"""The staged road gives the rows of the whole-run kernel, bit for bit."""

from __future__ import annotations

from typing import Any

import pytest

from realitygap.runs import Condition, run_replicates

pytestmark = pytest.mark.slow

VARIANTS: list[dict[str, Any]] = [
    {"selection": "coverage", "noise": 0.5},
    {"selection": "random"},
    {"selection": "novelty", "noise": 0.8},
    {"selection": "novelty", "novelty": {"archive_size": 3, "enter": "above-least", "sort": "y-then-x"}},
    {
        "selection": "novelty",
        "novelty": {"kind": "lehman-stanley", "neighbors": 4, "threshold": 20.0, "patience": 9},
    },
    {"selection": "novelty", "task": {"cells": "ends"}},
    {"selection": "coverage", "task": {"cells": "ends", "bias_input": "always"}},
    {"selection": "novelty", "novelty": {"kind": "lehman-stanley"}, "task": {"cells": "ends"}},
    {"selection": "novelty", "novelty": {"distance": "final"}},
    {"selection": "novelty", "novelty": {"distance": "alignment"}},
    {"neat": {"add_node": 0.9, "add_link": 0.9, "generations": 12, "node_bias": True, "recurrent": True}},
    {"jyro": {"precision": "double", "turn_per_step": 0.9}, "neat": {"population": 5, "start_hidden": 2}},
]


@pytest.mark.parametrize("variant", VARIANTS, ids=str)
def test_staged_road_gives_the_rows_of_the_whole_run_kernel(variant: dict[str, Any]) -> None:
    condition = Condition(name="c", **{"pair": False, **variant})
    whole = run_replicates(condition, 3, 37)
    staged = run_replicates(condition, 3, 37, staged=True)
    assert staged.equals(whole)


def test_rows_do_not_depend_on_the_block(monkeypatch: pytest.MonkeyPatch) -> None:
    condition = Condition(name="c", selection="novelty")
    whole = run_replicates(condition, 0, 40, staged=True)
    monkeypatch.setattr("realitygap.runs._staged.BLOCK_TRIALS", 8)
    monkeypatch.setattr("realitygap.runs._staged.LEAST_RUNS", 7)
    assert run_replicates(condition, 0, 40, staged=True).equals(whole)
    alone = run_replicates(condition, 25, 1, staged=True)
    assert alone.equals(whole.filter(whole["replicate"] == 25))
