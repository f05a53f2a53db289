"""README.md says what is true: its commands print what stands there, its Python runs, its links lead somewhere."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

from realitygap import __version__
from realitygap.cli import app

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text("utf-8")


def _make_outputs():
    spec = importlib.util.spec_from_file_location("make_outputs", ROOT / "docs" / "make_outputs.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault("make_outputs", module)  # its dataclasses look their module up
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_commands_print_what_the_readme_shows_and_its_python_runs():
    _, problems = _make_outputs().rewrite(README, "README.md")
    assert problems == []


def test_every_command_stands_in_the_readme():
    for command in app.registered_commands:
        assert f"`realitygap {command.name} " in README or f"`realitygap {command.name}`" in README


def test_links_and_pictures_of_the_readme_are_there():
    targets = re.findall(r"\]\(([^)#]+)\)", README)
    assert targets
    for target in targets:
        assert (ROOT / target).exists(), target


def test_first_screen_is_one_sentence_one_picture_and_what_a_command_prints():
    first = README.splitlines()
    assert first[0] == "# realitygap"
    assert README.index("![") < README.index("```console") < README.index("## Install")


def test_newest_version_in_the_changelog_is_the_package_s():
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    assert re.search(r"^## (\S+)", changelog, re.MULTILINE)[1] == __version__
