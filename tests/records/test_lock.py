"""One writer at a time, in this process and in others."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from realitygap.errors import RecordError
from realitygap.records import RecordWarning, ResultsFolder
from realitygap.records import _lock as lock_module
from tests.records.rows import DESCRIPTION, HASH, make_folder, make_rows

_HOLD = """
import sys
from realitygap.records import ResultsFolder
with ResultsFolder.open(sys.argv[1]).locked():
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_second_writer_in_this_process_is_refused_until_the_first_is_done(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    other = ResultsFolder.open(folder.path)
    with folder.locked():
        with pytest.raises(RecordError, match=f"in use: process {os.getpid()} on ") as caught, other.locked():
            pass
        assert str(folder.path) in str(caught.value)
        with pytest.raises(RecordError, match="in use"):
            other.publish("coverage", 9, make_rows(first=9), HASH)
        with pytest.raises(RecordError, match="in use"):
            other.update_description(DESCRIPTION)
        with pytest.raises(RecordError, match="in use"):
            other.clear()
        assert other.read().equals(folder.read())
    with other.locked():
        pass


def test_a_second_process_is_named_and_frees_the_lock_when_it_is_killed(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    command = [sys.executable, "-c", _HOLD, str(folder.path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(RecordError, match=f"process {holder.pid} on "), folder.locked():
            pass
        assert len(folder.chunks()) == 1
        holder.kill()
        holder.wait()
    with folder.locked():
        folder.publish("coverage", 2, make_rows(first=2), HASH)


def test_the_holder_may_take_the_lock_again_and_share_it_between_threads(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    with folder.locked(), folder.locked(), ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda i: folder.publish("coverage", i, make_rows(first=i, n=1), HASH), range(12)))
        with pytest.raises(RecordError, match="in use"), ResultsFolder.open(folder.path).locked():
            pass
    assert folder.read().equals(make_rows(n=12))


def test_threads_without_a_common_lock_do_not_lose_chunks(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    barrier = threading.Barrier(4)

    def publish(i: int) -> None:
        barrier.wait()
        folder.publish("coverage", i, make_rows(first=i, n=1), HASH)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(publish, range(4)))
    assert folder.read().equals(make_rows(n=4))


def test_the_lock_is_given_back_after_an_error(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    with pytest.raises(ZeroDivisionError), folder.locked():
        raise ZeroDivisionError
    with ResultsFolder.open(folder.path).locked():
        pass


def test_temporary_files_of_killed_writers_are_removed_under_the_lock_and_no_others(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    stale = [
        folder.path / "trials" / ".coverage.000000002-000000003.parquet.99.tmp",
        folder.path / ".study.json.99.tmp",
    ]
    kept = [folder.path / ".notes.99.tmp", folder.path / "notes.tmp", folder.path / "trials" / ".DS_Store"]
    for path in [*stale, *kept]:
        path.write_bytes(b"x")
    assert len(folder.chunks()) == 1
    with folder.locked():
        assert not any(path.exists() for path in stale)
        assert all(path.exists() for path in kept)


def test_a_file_system_without_locks_gives_a_warning(tmp_path, monkeypatch):
    def refuse(_descriptor: int) -> None:
        raise OSError(38, "Function not implemented")

    folder = make_folder(tmp_path / "r", 0)
    monkeypatch.setattr(lock_module, "lock_descriptor", refuse)
    with pytest.warns(RecordWarning, match="cannot lock"):
        folder.publish("coverage", 0, make_rows(), HASH)
    assert folder.missing("coverage", 3) == []
