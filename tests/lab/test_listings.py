"""Lists of the files and studies in the lab's folder: links and damaged entries do not keep the others from a page."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from realitygap.lab import _studies
from realitygap.lab._files import plain_files
from realitygap.lab._lab import Lab
from realitygap.lab._video import videos_in
from realitygap.records import LEDGER_NAME

from .robot_study import make_study


@pytest.fixture
def root(tmp_path) -> Path:
    root = tmp_path.resolve()
    make_study(root)
    return root


def damage(folder: Path, ending: str) -> None:
    """Put what is no plain file into a folder."""
    folder.mkdir(exist_ok=True)
    (folder / f"dangling{ending}").symlink_to("nowhere")
    (folder / f"circle{ending}").symlink_to(f"circle{ending}")
    (folder / f"outside{ending}").symlink_to("/etc/passwd")
    (folder / f"folder{ending}").mkdir()
    os.mkfifo(folder / f"pipe{ending}")


def test_gap_reports_leave_out_links_and_folders(root):
    damage(root / "gaps", ".html")
    for number, name in enumerate(("first", "second")):
        (root / "gaps" / f"{name}.html").write_text("")
        os.utime(root / "gaps" / f"{name}.html", (number, number))
    assert Lab(root).gap_reports() == ["second", "first"]
    shutil.rmtree(root / "gaps")
    assert Lab(root).gap_reports() == []


def test_files_that_pages_propose_are_plain(root):
    for ending in (".toml", ".mp4"):
        damage(root, ending)
        (root / f"mine{ending}").write_text("")
    assert [path.name for path in plain_files(root, (".toml",))] == ["mine.toml"]
    assert videos_in(root) == ["mine.mp4"]


def test_studies_are_listed_next_to_damaged_folders(root, monkeypatch):
    damage(root, "")
    for target in ("nowhere", "study.json"):
        folder = root / f"with-{target}"
        folder.mkdir()
        (folder / "study.json").symlink_to(target)
    assert Lab(root).studies.names() == ["by-robot"]
    shutil.copytree(root / "by-robot", root / "another")
    changed = _studies._changed

    def vanish(path: Path) -> float | None:
        if path.name == "another":
            shutil.rmtree(path)  # by another program, in the middle of the listing
        return changed(path)

    monkeypatch.setattr(_studies, "_changed", vanish)
    assert Lab(root).studies.names() == ["by-robot"]


def test_study_whose_ledger_cannot_be_read_has_failed_and_shows_no_path(root):
    lab = Lab(root)
    for kind in ("empty", "torn", "folder", "pipe"):
        folder = root / kind
        shutil.copytree(root / "by-robot", folder)
        ledger = folder / LEDGER_NAME
        ledger.unlink(missing_ok=True)
        if kind == "folder":
            ledger.mkdir()
        elif kind == "pipe":
            os.mkfifo(ledger)
        else:
            ledger.write_bytes(b"no ledger" * 1000 * (kind == "torn"))
    standings = {each.state.name: each for each in lab.standings()}
    assert standings.pop("by-robot").word == "Waiting for robot"
    assert {name: each.word for name, each in standings.items()} == dict.fromkeys(standings, "Failed")
    assert all(each.message and str(root) not in each.message for each in standings.values())
