"""Files beside the results: whole or not at all, and never over the results."""

import os
import threading
from pathlib import Path

import pytest

from realitygap.errors import RecordError
from realitygap.records import ResultsFolder, write_whole

OWN = [
    "study.json",
    "STUDY.json",
    ".lock",
    "log.jsonl",
    "ledger.sqlite",
    "ledger.sqlite-wal",
    "trials/new.csv",
]


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "r"
    ResultsFolder.create(folder, {"conditions": ["a"]})
    return folder


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", OWN)
def test_the_files_of_a_study_are_never_written_over(results, name):
    """`report --out results/study.json` once replaced the study, and said that all was well."""
    before = contents(results)
    with pytest.raises(RecordError, match="nothing was written"):
        write_whole(results / name, b"page")
    assert contents(results) == before


def test_a_file_of_results_is_not_overwritten_through_a_link_or_a_relative_path(
    results, tmp_path, monkeypatch
):
    before = contents(results)
    (tmp_path / "link.html").symlink_to(results / "study.json")
    (tmp_path / "door").symlink_to(results, target_is_directory=True)
    monkeypatch.chdir(results / "trials")
    for path in (
        tmp_path / "link.html",
        tmp_path / "door" / "log.jsonl",
        Path("x.csv"),
        Path("../study.json"),
    ):
        with pytest.raises(RecordError, match="nothing was written"):
            write_whole(path, b"page")
    assert contents(results) == before


def test_a_ledger_is_kept_where_there_is_no_study(tmp_path):
    (tmp_path / "ledger.sqlite").write_bytes(b"trials")
    with pytest.raises(RecordError, match="nothing was written"):
        write_whole(tmp_path / "ledger.sqlite", b"page")
    assert (tmp_path / "ledger.sqlite").read_bytes() == b"trials"


def test_other_files_may_lie_in_the_folder_and_own_names_elsewhere(results, tmp_path):
    for path in (results / "report.html", tmp_path / "study.json"):
        write_whole(path, [b"one", b"two"])
        assert path.read_bytes() == b"onetwo"


def test_a_link_stays_and_what_it_leads_to_is_written(tmp_path):
    """The link itself was replaced, and the file behind it stayed as it was."""
    (tmp_path / "target.html").write_text("old")
    (tmp_path / "link.html").symlink_to("target.html")
    write_whole(tmp_path / "link.html", b"new")
    assert (tmp_path / "link.html").is_symlink()
    assert (tmp_path / "target.html").read_text() == "new"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.html", "target.html"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")
def test_a_pipe_is_written_to_and_not_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    write_whole(pipe, b"a page")
    reader.join(10)
    assert read == [b"a page"]
    assert pipe.is_fifo()


def test_a_folder_or_a_name_that_is_none_is_one_message(tmp_path, monkeypatch):
    """`report --out ""` once ended in a traceback."""
    monkeypatch.chdir(tmp_path)
    for path in (tmp_path, Path(), Path("/")):
        with pytest.raises(RecordError, match=r"Could not write .*: it is a folder"):
            write_whole(path, b"page")
    assert not list(tmp_path.iterdir())
