"""The command line in this process, with a fake robot and nobody at a terminal."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable

import pytest

from realitygap.cli import _progress, main
from realitygap.study import parse_study, run_study
from tests.commands import Done

from .fake_port import open_fake

STUDY = """
[study]
name = "tiny"
title = "Tiny"
replicates = 3
[neat]
settings = "rosenzweig-remy"
population = 4
generations = 3
add_node = 0.5
[platform.jyro]
steps = 20
[[condition]]
name = "coverage-50"
noise = 0.5
[[condition]]
name = "novelty-50"
selection = "novelty"
noise = 0.5
"""


@pytest.fixture(autouse=True)
def slow_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let commands print each line of their progress, as on a slow machine, so that no test depends on the speed."""
    monkeypatch.setattr(_progress, "_LINE_EVERY_S", 0.0)


@pytest.fixture
def no_terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Runs a command by its words."""
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    monkeypatch.setattr("realitygap.study._run.connect_robot", open_fake)

    def run(*words: object) -> Done:
        monkeypatch.setattr(sys, "argv", ["realitygap", *map(str, words)])
        try:
            main()
            code = 0
        except SystemExit as ended:
            code = int(ended.code or 0)
        return Done(code, *capsys.readouterr())

    return run


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Folder of a finished study of two conditions, three runs, and three generations, which no test changes."""
    return str(run_study(parse_study(STUDY, "tiny.toml"), tmp_path_factory.mktemp("tiny")).folder.path)
