"""Hashes of conditions and digests of results are those that are stored."""

from __future__ import annotations

import json

import pytest

from . import make

GOLDEN = json.loads(make.FILE.read_text("utf-8"))


def test_hashes_of_conditions_are_unchanged() -> None:
    assert make.hashes_of_conditions() == GOLDEN["conditions"]


@pytest.mark.slow
@pytest.mark.parametrize("name", make.results())
def test_results_are_unchanged(name: str) -> None:
    assert make.results()[name]() == GOLDEN["results"][name]
