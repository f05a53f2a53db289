from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from realitygap.errors import RecordError
from realitygap.records import ResultsFolder
from realitygap.report import write_report
from realitygap.study import parse_study, run_study

STUDY = """
[study]
name = "tiny"
title = "A tiny study"
replicates = 7

[neat]
settings = "rosenzweig-remy"
population = 8
generations = 3

[platform.jyro]
steps = 30

[[condition]]
name = "coverage"
selection = "coverage"
noise = 0.1
published = [0.154, 0.222, 0.166]
published_source = "Table 2, 10% noise"

[[condition]]
name = "novelty"
selection = "novelty"
noise = 0.1

[[condition]]
name = "turn"
selection = "coverage"
noise = 0.1
baseline = "coverage"
change = "turn 0.9 rad per step"

[condition.jyro]
turn_per_step = 0.9

[[condition]]
name = "ends"
selection = "coverage"
noise = 0.1
baseline = "coverage"
change = "select by the cells at the ends of steps"

[condition.task]
cells = "ends"
"""


@pytest.fixture(scope="session")
def tiny_study(tmp_path_factory: pytest.TempPathFactory) -> ResultsFolder:
    """A study of four conditions that was really run: 7 runs of 3 generations of 8."""
    return run_study(parse_study(STUDY, "tiny.toml"), tmp_path_factory.mktemp("tiny")).folder


@pytest.fixture(scope="session")
def tiny_html(tiny_study: ResultsFolder) -> str:
    """The page of that study, which takes two seconds."""
    return write_report(tiny_study).read_text("utf-8")


@pytest.fixture
def no_replay(monkeypatch: pytest.MonkeyPatch) -> None:
    """Genomes of synthetic rows mean nothing, so their trials cannot be recomputed."""

    def refuse(condition: Any, row: Mapping[str, Any]) -> None:
        raise RecordError("The trial cannot be recomputed.")

    monkeypatch.setattr("realitygap.report._chosen_run.replay", refuse)
    monkeypatch.setattr("realitygap.report._replay.replay", refuse)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "results"
