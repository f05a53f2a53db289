"""The benchmark of those who watch does what it says; its figures count on an idle machine alone."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


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
    spec = importlib.util.spec_from_file_location("make_lab", ROOT / "docs" / "make_lab.py")
    assert spec is not None
    assert spec.loader is not None
    make_lab = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(make_lab)
    published = json.loads(make_lab.DATA.read_text("utf-8"))
    assert published.keys() == found.keys()
    assert f"{published['pages']} pages" in make_lab.table(published)
