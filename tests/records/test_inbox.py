"""An inbox: others leave chunks, the holder of the lock publishes them."""

import contextlib
import os
import threading

import pytest

from realitygap.errors import RecordError
from realitygap.records import Delivery, MissingInboxError, ResultsFolder, deliver
from realitygap.records._chunk import ChunkName
from realitygap.records._published import PublishedNames

from .rows import HASH, make_folder, make_rows


def leave(inbox, first, n, condition="coverage", condition_hash=HASH):
    deliver(inbox, condition, first, make_rows(condition, first, n), condition_hash)
    return Delivery(condition, first, n, condition_hash)


def test_accepted_chunks_equal_published_ones(tmp_path):
    folder, other = make_folder(tmp_path / "a", 0), make_folder(tmp_path / "b", 0)
    with folder.inbox() as inbox:
        folder.accept(inbox, [leave(inbox, 3, 2), leave(inbox, 0, 3)])
        folder.accept(inbox, [leave(inbox, 5, 1)])
        assert not list(inbox.iterdir())
    other.publish("coverage", 0, make_rows(n=6), HASH)
    assert folder.digest() == other.digest()
    assert not inbox.exists()


def test_delivered_twice_is_once(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    with folder.inbox() as inbox:
        leave(inbox, 0, 3)
        folder.accept(inbox, [leave(inbox, 0, 3)])
        again = leave(inbox, 0, 3)
        with pytest.raises(RecordError, match="overlap"):
            folder.accept(inbox, [again])
    assert folder.read().equals(make_rows(n=3))


def test_an_inbox_of_an_earlier_sitting_is_gone(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    with folder.inbox() as inbox:
        pass
    with pytest.raises(MissingInboxError):
        leave(inbox, 0, 3)
    with folder.inbox() as other:
        assert other != inbox


@pytest.mark.slow
def test_an_inbox_goes_while_others_still_deliver_into_it(tmp_path):
    """Before an inbox was renamed first, each of five runs of this test left one behind."""
    folder = make_folder(tmp_path / "r", 0)
    ended = threading.Event()

    def go_on(inbox):
        first = 0
        while not ended.is_set():
            with contextlib.suppress(MissingInboxError):
                leave(inbox, first, 1)
            first += 1

    for _ in range(4):
        with folder.inbox() as inbox:
            workers = [threading.Thread(target=go_on, args=(inbox,)) for _ in range(3)]
            for worker in workers:
                worker.start()
            for first in range(100_000, 100_050):
                leave(inbox, first, 1)
        ended.set()
        for worker in workers:
            worker.join()
        ended.clear()
        assert not list(folder.path.glob(".inbox-*"))


@pytest.mark.parametrize("late", [1, 3])
def test_a_file_that_is_made_while_an_inbox_is_removed_goes_with_it(tmp_path, monkeypatch, late):
    folder = make_folder(tmp_path / "r", 0)
    rmdir, made = os.rmdir, []

    def make_and_rmdir(path, **where):
        """A worker found the inbox before it was renamed, and opens its file after the others were listed."""
        if len(made) < late:
            (left,) = folder.path.glob(".inbox-*")
            made.append(left / ".chunk.tmp")
            made[-1].touch()
        rmdir(path, **where)

    with folder.inbox():
        monkeypatch.setattr(os, "rmdir", make_and_rmdir)
    assert len(made) == late
    assert not list(folder.path.glob(".inbox-*"))


def test_chunks_that_were_not_accepted_are_removed_with_the_inbox(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    with folder.inbox() as inbox:
        leave(inbox, 0, 3)
    assert folder.chunks() == []
    left = folder.path / ".inbox-0123456789abcdef"
    left.mkdir()
    (left / "coverage.000000000-000000002.parquet").write_bytes(b"of a killed process")
    with ResultsFolder.open(folder.path).locked():
        assert not left.exists()


@pytest.mark.parametrize("spoil", ["missing", "empty", "cut", "foreign"])
def test_a_file_that_is_not_whole_is_refused(tmp_path, spoil):
    folder = make_folder(tmp_path / "r", 0)
    with folder.inbox() as inbox:
        delivery = leave(inbox, 0, 3)
        path = inbox / str(delivery.name)
        data = path.read_bytes()
        if spoil == "missing":
            path.unlink()
        else:
            path.write_bytes(
                {"empty": b"", "cut": data[:-20], "foreign": b"PAR1" + bytes(99) + b"PAR1"}[spoil]
            )
        with pytest.raises(
            RecordError, match="no longer exists" if spoil == "missing" else "run the same|Run the same"
        ):
            folder.accept(inbox, [delivery])
    assert folder.chunks() == []


def test_other_settings_and_unknown_conditions_are_refused(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    folder.publish("coverage", 0, make_rows(n=3), HASH)
    with folder.inbox() as inbox:
        with pytest.raises(RecordError, match="other settings"):
            folder.accept(inbox, [leave(inbox, 3, 1, condition_hash="other")])
        with pytest.raises(ValueError, match="Unknown condition 'nobody'"):
            folder.accept(inbox, [leave(inbox, 3, 1, condition="nobody")])


def test_an_inbox_keeps_other_writers_out(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    with folder.inbox(), pytest.raises(RecordError, match="is in use"):
        ResultsFolder.open(folder.path).publish("coverage", 0, make_rows(n=1), HASH)


def test_many_may_deliver_the_same_at_once(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    with folder.inbox() as inbox:
        threads = [threading.Thread(target=leave, args=(inbox, 0, 3)) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert [path.name for path in inbox.iterdir()] == ["coverage.000000000-000000002.parquet"]
        folder.accept(inbox, [Delivery("coverage", 0, 3, HASH)])
    assert folder.read().equals(make_rows(n=3))


def test_published_names_find_every_overlap():
    def chunk(first, last, condition="a"):
        return ChunkName(condition, first, last)

    names = PublishedNames([chunk(10, 19), chunk(0, 4), chunk(30, 30), chunk(5, 9, "b")])
    held = {"a": [*range(5), *range(10, 20), 30], "b": [*range(5, 10)]}
    for condition in ("a", "b", "c"):
        for first in range(35):
            for last in range(first, 35):
                found = names.overlapping(chunk(first, last, condition))
                wanted = any(first <= each <= last for each in held.get(condition, []))
                assert (found is not None) == wanted, (condition, first, last)
                if found is not None:
                    assert found.first <= last
                    assert first <= found.last
    assert names.first("a") == chunk(0, 4)
    assert names.first("c") is None
