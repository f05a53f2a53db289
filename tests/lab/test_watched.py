"""The benchmark of those who watch does what it says; its figures count on an idle machine alone."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


def make_lab() -> ModuleType:
    """The script that writes the table of the page on the lab."""
    spec = importlib.util.spec_from_file_location("make_lab", ROOT / "docs" / "make_lab.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_table_of_the_page_on_the_lab_is_made_of_its_data():
    script = make_lab()
    published = json.loads(script.DATA.read_text("utf-8"))
    assert f"{published['pages']} pages" in script.table(published)


@pytest.mark.long
def test_pages_that_watch_hear_and_are_answered():
    command = [
        sys.executable,
        str(ROOT / "benchmarks" / "lab.py"),
        "--pages",
        "3",
        "--seconds",
        "2",
        "--rounds",
        "1",
    ]
    done = subprocess.run([*command, "--json"], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    for name in ("computing", "driving"):
        assert found[name]["open"] == found["pages"] == 3
        assert found[name]["rate"]["alone"] > 0
        assert found[name]["messages_per_s"] > 1
    assert found["computing"]["answers"] > 0
    assert json.loads(make_lab().DATA.read_text("utf-8")).keys() == found.keys()
