"""The README: its Python runs, its numbers are those of the documents, its links lead somewhere."""

import csv
import importlib.util
import re
import sys
from pathlib import Path

import pytest

from realitygap import __version__

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


def test_links_and_pictures_of_the_readme_are_there():
    targets = re.findall(r"\]\(([^)]+)\)", README)
    assert targets
    for target in targets:
        assert (ROOT / target.partition("#")[0]).exists(), target


def test_first_screen_leads_to_a_result():
    first = README.splitlines()[:30]
    assert first[0] == "# realitygap"
    for text in ("git clone", "![", "uv run realitygap run paper", "| Novelty |"):
        assert any(text in line for line in first), text


def test_tests_and_the_study_each_start_with_one_command():
    for command in (
        "uv run realitygap run paper --open",
        "uv run --extra dev pytest -n auto --dist worksteal",
    ):
        assert f"\npython3 -m pip install --quiet uv && python3 -m {command}\n" in README


def test_table_of_the_readme_has_the_numbers_that_the_tutorial_prints():
    printed = (ROOT / "docs" / "tutorials" / "first-study.md").read_text("utf-8")
    rows = {"Novelty": "novelty-50", "Coverage": "coverage-50", "Random networks": "random-50"}
    for title, condition in rows.items():
        median, low, high = re.search(
            rf"^ {condition} +100 +(\S+) \[(\S+), (\S+)\]", printed, re.MULTILINE
        ).groups()
        assert f"| {title} | {median} | [{low}, {high}] |" in README
    published = re.search(r"^ novelty-50 .* (0\.\d+) (0\.\d+)\n.* (0\.\d+)$", printed, re.MULTILINE).groups()
    assert "reached {}, {}, and {}.".format(*published) in README


def test_gap_of_the_readme_is_that_of_the_study():
    goals = csv.DictReader(
        (ROOT / "docs" / "data" / "closing-2" / "goals.csv").read_text("utf-8").splitlines()
    )
    row = next(row for row in goals if (row["goal"], row["simulator"]) == ("P3 prediction, random", "track"))
    fall = f"{row['figure']} smaller ({row['95 % interval']})"
    sentence = f"on {row['twins']} unseen MuJoCo twins (TWIN) was {fall} for random networks."
    assert sentence in " ".join(README.split())


def test_newest_version_in_the_changelog_is_the_package_s():
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    assert re.search(r"^## (\S+)", changelog, re.MULTILINE)[1] == __version__
