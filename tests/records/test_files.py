"""Killed writers, full disks and folders that cannot be written: what was published stays."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from realitygap.errors import RecordError
from realitygap.records import RecordWarning, ResultsFolder
from realitygap.records import _files as files_module
from tests.records.rows import DESCRIPTION, HASH, make_folder, make_rows

_REPOSITORY = Path(__file__).parents[2]

_PUBLISH_ON = """
import sys
from realitygap.records import ResultsFolder
from tests.records.rows import HASH, make_rows

folder = ResultsFolder.open(sys.argv[1])
print("ready", flush=True)
for gap in folder.missing("coverage", 10**6):
    for first in gap:
        folder.publish("coverage", first, make_rows(first=first, n=1), HASH)
"""

_STOP_IN_SYNC = """
import os, sys, time
from realitygap.records import ResultsFolder
from tests.records.rows import HASH, make_rows

folder = ResultsFolder.open(sys.argv[1])
rows = make_rows(first=2)
os.fsync = lambda descriptor: (print("ready", flush=True), time.sleep(60))
folder.publish("coverage", 2, rows, HASH)
"""

_FILL = """
import sys
from pathlib import Path
import pytest
from realitygap.errors import RecordError
from realitygap.records import RecordWarning, ResultsFolder
from tests.records.rows import DESCRIPTION, HASH, make_rows

path, limit = Path(sys.argv[1]), int(sys.argv[2])
folder = ResultsFolder.create(path / "results", DESCRIPTION)
if limit:
    import resource
    for first in range(3):
        folder.publish("coverage", first, make_rows(first=first, n=1), HASH)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
    message, rows = "File too large", 300
else:
    (path / "ballast").write_bytes(bytes(100_000))
    message, rows = "No space left on device", 1
first = len(folder.chunks())
try:
    while first < 1000:
        folder.publish("coverage", first, make_rows(first=first, n=rows), HASH)
        first += rows
except RecordError as error:
    print(error)
    assert message in str(error)
    assert "Everything published before is safe. Make room" in str(error)
    assert "run the same command again" in str(error)
else:
    raise AssertionError("the disk never filled")
assert first >= 3
names = sorted(entry.name for entry in (path / "results" / "trials").iterdir())
assert len(names) == first and not any(name.endswith(".tmp") for name in names), names
assert folder.missing("coverage", first + 1) == [range(first, first + 1)]
assert folder.read().equals(make_rows(n=first))
before = folder.description
with pytest.raises(RecordError, match="Everything published before is safe"):
    folder.update_description({**DESCRIPTION, "ballast": "x" * 1_000_000})
assert ResultsFolder.open(folder.path).description == before
with pytest.warns(RecordWarning, match="log.jsonl"):
    assert not folder.append_log({"ballast": "x" * 1_000_000})
if limit:
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.getrlimit(resource.RLIMIT_FSIZE)[1],) * 2)
else:
    (path / "ballast").unlink()
folder.publish("coverage", first, make_rows(first=first, n=1), HASH)
assert ResultsFolder.open(folder.path).read().equals(make_rows(n=first + 1))
print("all well")
"""


def _child(code: str, *arguments: str) -> list[str]:
    return [sys.executable, "-c", code, *arguments]


def _start(code: str, path: Path) -> subprocess.Popen[bytes]:
    child = subprocess.Popen(_child(code, str(path)), cwd=_REPOSITORY, stdout=subprocess.PIPE)
    assert child.stdout.readline() == b"ready\n"
    return child


def _kill(child: subprocess.Popen[bytes]) -> None:
    child.kill()
    child.wait()
    child.stdout.close()


@pytest.mark.slow
def test_writers_killed_at_any_time_leave_whole_chunks_and_a_free_lock(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    done = 0
    for i in range(5):
        child = _start(_PUBLISH_ON, folder.path)
        until = time.monotonic() + 60
        while len(folder.chunks()) <= done and time.monotonic() < until:
            time.sleep(0.01)
        time.sleep(0.037 * i)
        assert child.poll() is None
        _kill(child)
        chunks = folder.chunks()
        assert [chunk.first for chunk in chunks] == list(range(len(chunks)))
        assert len(chunks) > done
        done = len(chunks)
    with folder.locked():
        assert not list(folder.path.rglob("*.tmp"))
    assert folder.read().equals(make_rows(n=done))


def test_a_writer_killed_between_writing_and_renaming_leaves_a_file_that_the_next_one_removes(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    child = _start(_STOP_IN_SYNC, folder.path)
    _kill(child)
    (temporary,) = (folder.path / "trials").glob(".coverage.000000002-000000004.parquet.*.tmp")
    assert folder.missing("coverage", 5) == [range(2, 5)]
    folder.publish("coverage", 2, make_rows(first=2), HASH)
    assert not temporary.exists()
    assert folder.read().equals(make_rows(n=5))


@pytest.mark.slow
def test_a_full_disk_is_told_and_loses_nothing(tmp_path):
    """A file system of 1 MB where one can be mounted, else a limit on the size of files in its place."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = 'mount -t tmpfs -o size=1m tmpfs "$1" || exit 77; shift; exec "$@"'
    inside = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", mount, "sh", str(disk)]
    if sys.platform != "linux" or shutil.which("unshare") is None:
        _limited(tmp_path)
        return
    probe = subprocess.run([*inside, "true"], capture_output=True, check=False)
    if probe.returncode != 0:
        _limited(tmp_path)
        return
    _check([*inside, *_child(_FILL, str(disk), "0")])


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limits on file sizes")
def test_a_limit_on_the_size_of_files_is_told_and_loses_nothing(tmp_path):
    _limited(tmp_path)


def _limited(path: Path) -> None:
    _check(_child(_FILL, str(path), "60000"))


def _check(command: list[str]) -> None:
    result = subprocess.run(command, cwd=_REPOSITORY, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.endswith("all well\n")


@pytest.fixture
def public_path():
    """A new folder which other accounts can reach, unlike pytest's."""
    path = Path(tempfile.mkdtemp())
    path.chmod(0o755)
    yield path
    shutil.rmtree(path)


@contextlib.contextmanager
def _unprivileged():
    """Root may write anywhere; for a while, be somebody else."""
    before = os.geteuid()
    try:
        os.seteuid(65534)
    except PermissionError:  # not root, or a root without its powers: bound by the modes already
        yield
        return
    try:
        yield
    finally:
        os.seteuid(before)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps no such modes")
def test_a_folder_that_may_only_be_read_is_read_and_says_so_when_written(public_path):
    folder = make_folder(public_path / "r", 1)
    rows = make_rows(first=2)
    paths = [folder.path, folder.path / "trials"]
    for path in paths:
        path.chmod(0o555)
    try:
        with _unprivileged():
            opened = ResultsFolder.open(folder.path)
            assert opened.read().equals(make_rows(n=2))
            assert opened.scan().collect().height == 16
            assert opened.digest() == folder.digest()
            for write in (
                lambda: opened.publish("coverage", 2, rows, HASH),
                lambda: opened.update_description(DESCRIPTION),
                lambda: opened.clear(),
                lambda: ResultsFolder.create(folder.path / "inner", DESCRIPTION),
            ):
                with pytest.raises(RecordError, match=r"Permission denied.*Make the folder writable"):
                    write()
            with pytest.warns(RecordWarning, match="Permission denied"):
                assert not opened.append_log({"event": "start"})
    finally:
        for path in paths:
            path.chmod(0o755)
    assert len(folder.chunks()) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps no such modes")
def test_a_chunk_that_may_not_be_read_is_named(public_path):
    folder = make_folder(public_path / "r", 1)
    path = folder.chunks()[0].path
    path.chmod(0)
    with _unprivileged(), pytest.raises(RecordError, match="Permission denied") as caught:
        ResultsFolder.open(folder.path).chunks()
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError(5, "Input/output error")])
def test_an_interrupted_write_leaves_no_temporary_file(tmp_path, monkeypatch, error):
    folder = make_folder(tmp_path / "r", 1)

    def interrupt(_descriptor: int) -> None:
        raise error

    with monkeypatch.context() as patch:
        patch.setattr(files_module.os, "fsync", interrupt)
        expected = KeyboardInterrupt if error is KeyboardInterrupt else RecordError
        with pytest.raises(expected):
            folder.publish("coverage", 2, make_rows(first=2), HASH)
    assert len(list((folder.path / "trials").iterdir())) == 1
    folder.publish("coverage", 2, make_rows(first=2), HASH)


def test_file_size_limits_do_not_kill_python():
    """What the test with a limit on the size of files stands on."""
    if hasattr(signal, "SIGXFSZ"):
        assert signal.getsignal(signal.SIGXFSZ) == signal.SIG_IGN
