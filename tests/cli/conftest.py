"""The command line in this process, with a fake robot and nobody at a terminal."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable

import pytest

from realitygap.cli import main
from tests.commands import Done

from .fake_port import open_fake


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
