"""How messages tell people to start realitygap, and to add packages to it."""

import json
import sys
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest

from realitygap._how_to_run import install_command, launcher


@pytest.fixture
def shell(monkeypatch, tmp_path):
    """A terminal below `uv run` with these programs on the shell's PATH."""

    def has(*programs):
        for program in programs:
            (tmp_path / program).touch(mode=0o755)
        own = str(Path(sys.executable).parent)
        monkeypatch.setenv("PATH", f"{own}:{tmp_path}")
        monkeypatch.setenv("UV", "/somewhere/uv")
        monkeypatch.setattr(sys, "stdout", SimpleNamespace(isatty=lambda: True))

    return has


@pytest.mark.parametrize(
    ("programs", "expected"),
    [
        (["uv"], "uv run realitygap"),
        ([], "python3 -m uv run realitygap"),
        (["uv", "realitygap"], "realitygap"),
    ],
)
def test_a_command_is_shown_as_the_shell_finds_it(shell, programs, expected):
    shell(*programs)
    assert launcher() == expected


def test_saved_output_and_other_environments_have_the_plain_name(shell, monkeypatch):
    shell("uv")
    monkeypatch.setattr(sys, "stdout", SimpleNamespace(isatty=lambda: False))
    assert launcher() == "realitygap"
    monkeypatch.setattr(sys, "stdout", SimpleNamespace(isatty=lambda: True))
    monkeypatch.delenv("UV")
    assert launcher() == "realitygap"


@pytest.mark.parametrize(
    ("origin", "config", "expected"),
    [
        (None, "", "pip install 'realitygap[lab]'"),
        ("clone", "", "pip install '.[lab]'"),
        ("clone", "home = /usr/bin\nuv = 0.9\n", "uv sync --inexact --extra lab"),
    ],
)
def test_an_extra_is_installed_from_where_realitygap_came(
    shell, monkeypatch, tmp_path, origin, config, expected
):
    shell("uv")
    (tmp_path / "pyproject.toml").touch()
    (tmp_path / "pyvenv.cfg").write_text(config)
    text = None if origin is None else json.dumps({"url": tmp_path.as_uri(), "dir_info": {"editable": True}})
    monkeypatch.setattr(metadata, "distribution", lambda name: SimpleNamespace(read_text=lambda file: text))
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert install_command("lab") == expected
