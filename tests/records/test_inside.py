"""Nothing is written through a link, a pipe or a hard link inside a folder that may come from elsewhere."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from realitygap.errors import RecordError
from realitygap.families.scribbler.emulator._memory import Memory
from realitygap.lab._photos import Photos
from realitygap.lab._scoring_files import keep_drawn
from realitygap.records import (
    Ledger,
    ObservationsHead,
    ResultsFolder,
    open_saved_trials,
    refuse_links,
    refuse_links_in,
    write_whole,
)
from realitygap.study._transfer.strategies import _adopt
from realitygap.world import paper_arena
from tests.formats import FORMATS, transfer_plan
from tests.records.rows import DESCRIPTION, HASH, make_rows
from tests.records.test_ledger import new_ledger

SECRET = b"not to be touched"
KINDS = ("link", "dangling link", "link to a folder", "pipe")


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """A folder of the victim, with a file in it."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "victim").write_bytes(SECRET)
    return folder


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A folder of results, as somebody else may have made it."""
    folder = ResultsFolder.create(tmp_path / "results", DESCRIPTION)
    folder.publish("coverage", 0, make_rows(n=1), HASH)
    return folder.path


def put(kind: str, path: Path, elsewhere: Path) -> None:
    """Put a link or a pipe at a path."""
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "hard link":
        path.hardlink_to(elsewhere / "victim")
    else:
        place = {"link": elsewhere / "victim", "dangling link": elsewhere / "new"}
        path.symlink_to(place.get(kind, elsewhere))


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def is_untouched(elsewhere: Path) -> bool:
    return names_in(elsewhere) == ["victim"] and (elsewhere / "victim").read_bytes() == SECRET


def refused(write: Callable[[], object], elsewhere: Path) -> str:
    """Return the message with which writing is refused."""
    with pytest.raises(RecordError) as caught:
        write()
    assert is_untouched(elsewhere)
    return str(caught.value)


@pytest.mark.parametrize("kind", [*KINDS, "hard link"])
@pytest.mark.parametrize("name", [".lock", "log.jsonl"])
def test_results_folder_refuses_to_write_in_place_through(results, elsewhere, name, kind):
    put(kind, results / name, elsewhere)

    def write() -> None:
        folder = ResultsFolder.open(results)
        with folder.locked():
            folder.append_log({"event": "start"})

    message = refused(write, elsewhere)
    assert name in message
    assert "Nothing was written" in message


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["trials", "ledger.sqlite"])
def test_results_folder_refuses_to_begin_to_write(results, elsewhere, name, kind):
    put(kind, results / name, elsewhere)
    folder = ResultsFolder.open(results)
    assert name in refused(lambda: folder.publish("coverage", 1, make_rows(first=1, n=1), HASH), elsewhere)
    assert name in refused(lambda: folder.clear(), elsewhere)


@pytest.mark.parametrize("name", [".lock", "trials"])
def test_new_results_folder_refuses_links_that_wait_in_it(tmp_path, elsewhere, name):
    folder = tmp_path / "new"
    folder.mkdir()
    put("link to a folder" if name == "trials" else "link", folder / name, elsewhere)
    refused(lambda: ResultsFolder.create(folder, DESCRIPTION), elsewhere)


def test_results_folder_that_is_itself_a_link_is_followed(tmp_path, results):
    (tmp_path / "short").symlink_to(results)
    ResultsFolder.open(tmp_path / "short").publish("coverage", 1, make_rows(first=1, n=1), HASH)
    assert len(ResultsFolder.open(results).chunks()) == 2


def test_inbox_that_is_a_link_is_not_emptied(results, elsewhere):
    (results / ".inbox-0123456789abcdef").symlink_to(elsewhere)
    with ResultsFolder.open(results).locked():
        pass
    assert is_untouched(elsewhere)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["study.json", "trials/coverage.000000000-000000000.parquet"])
def test_reading_results_never_waits(results, elsewhere, name, kind):
    put(kind, results / name, elsewhere)
    refused(lambda: ResultsFolder.open(results).digest(), elsewhere)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ending", ["", "-wal", "-shm", "-journal"])
@pytest.mark.parametrize("writable", [True, False])
def test_ledger_refuses_links_beside_it(tmp_path, elsewhere, ending, kind, writable):
    new_ledger(tmp_path).close()
    path = tmp_path / "ledger.sqlite"
    put(kind, Path(f"{path}{ending}"), elsewhere)
    with pytest.raises(RecordError):
        Ledger.open(path, writable=writable)
    assert is_untouched(elsewhere)


def test_ledger_with_two_names_is_read_and_not_written(tmp_path):
    new_ledger(tmp_path).close()
    path = tmp_path / "ledger.sqlite"
    (tmp_path / "backup.sqlite").hardlink_to(path)
    Ledger.open(path, writable=False).close()
    with pytest.raises(RecordError, match="2 names"):
        Ledger.open(path)


def test_new_ledger_refuses_a_dangling_link(tmp_path, elsewhere):
    put("dangling link", tmp_path / "ledger.sqlite", elsewhere)
    refused(lambda: Ledger.create(tmp_path / "ledger.sqlite"), elsewhere)


HEAD = ObservationsHead("sim", "SIM", "scribbler-s2-fluke2", paper_arena().to_dict(), 0.5, "cells")


@pytest.mark.parametrize("kind", [*KINDS, "hard link"])
def test_observations_refuse_a_name_that_is_not_the_users(tmp_path, elsewhere, kind):
    folder = tmp_path / "transfer"
    folder.mkdir()
    put(kind, folder / "trials.sqlite", elsewhere)
    refused(lambda: open_saved_trials(folder / "trials.sqlite", HEAD, within=folder), elsewhere)


def test_observations_follow_a_link_that_the_user_names(tmp_path):
    (tmp_path / "named.sqlite").symlink_to(tmp_path / "kept.sqlite")
    open_saved_trials(tmp_path / "named.sqlite", HEAD).close()
    assert (tmp_path / "kept.sqlite").stat().st_size
    assert (tmp_path / "named.sqlite").is_symlink()


def test_output_follows_a_link_that_the_user_names_and_no_other(tmp_path, elsewhere):
    (tmp_path / "page.html").symlink_to(tmp_path / "kept.html")
    write_whole(tmp_path / "page.html", b"a page")
    assert (tmp_path / "kept.html").read_bytes() == b"a page"
    put("link", tmp_path / "report.html", elsewhere)
    refused(lambda: write_whole(tmp_path / "report.html", b"a page", within=tmp_path), elsewhere)
    (tmp_path / "sub").symlink_to(elsewhere)
    refused(lambda: write_whole(tmp_path / "sub" / "new.html", b"a page", within=tmp_path), elsewhere)


def test_temporary_file_cannot_be_guessed(tmp_path, elsewhere, monkeypatch):
    names = []
    replace = Path.replace
    monkeypatch.setattr(Path, "replace", lambda path, to: names.append(path.name) or replace(path, to))
    for _ in range(2):
        write_whole(tmp_path / "a.txt", b"a")
        Memory("s2", tmp_path / "memory.json").save()
    assert len(set(names)) == len(names) >= 6
    assert names_in(tmp_path) == ["a.txt", "elsewhere", "memory.json"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "name",
    ["transfer.json", "result.json", "trials", "fresh/plain-0-0.jsonl", "champions", "calibrations/1.toml"],
)
def test_transfer_folder_refuses_links(tmp_path, elsewhere, name, kind):
    folder = tmp_path / "transfer"
    (folder / name).parent.mkdir(parents=True)
    put(kind, folder / name, elsewhere)
    refused(lambda: _adopt(folder, transfer_plan()), elsewhere)


@pytest.mark.parametrize("name", ["lab", "lab/line-1.json"])
def test_lab_refuses_links_in_a_study(results, elsewhere, name):
    (results / name).parent.mkdir(exist_ok=True)
    put("link to a folder" if name == "lab" else "link", results / name, elsewhere)
    refused(lambda: keep_drawn(results, 1, [(0.0, 0.0)]), elsewhere)


@pytest.mark.parametrize("name", ["lab", "lab/photos"])
def test_lab_refuses_to_save_a_photo_through_a_link(results, elsewhere, name):
    (results / name).parent.mkdir(exist_ok=True)
    put("link to a folder", results / name, elsewhere)
    photos = Photos(results, results.parent, lambda: None)
    refused(lambda: photos.add(FORMATS["photo.jpg"].valid, "sheet.jpg", 1), elsewhere)


def test_refuse_links_takes_what_is_plain_or_missing(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "b").touch()
    refuse_links(tmp_path, tmp_path / "a" / "b", tmp_path / "a" / "c" / "d", tmp_path / "a" / "b" / "c")
    refuse_links_in(tmp_path, "a", "none")
