"""What goes into a folder of results comes out of it, and what does not belong there is named."""

from __future__ import annotations

import random
import shutil
import tempfile
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realitygap.errors import RecordError, RecordVersionError
from realitygap.records import RESULTS_VERSION, SCHEMA, RecordWarning, ResultsFolder
from realitygap.records import _chunk as chunk_module
from realitygap.records import _folder as folder_module
from realitygap.records import _published_results as published_module
from tests.records.rows import DESCRIPTION, HASH, make_folder, make_rows

READERS = {
    "chunks": lambda folder: folder.chunks(),
    "missing": lambda folder: folder.missing("coverage", 9),
    "read": lambda folder: folder.read(),
    "read a column": lambda folder: folder.read(columns=["stalls"]),
    "frames": lambda folder: list(folder.frames()),
    "scan": lambda folder: folder.scan(),
    "digest": lambda folder: folder.digest(),
}


# making and opening


def test_repr_says_which_study_and_how_much_of_it(tmp_path):
    folder = ResultsFolder.create(tmp_path / "r", DESCRIPTION | {"replicates": 5})
    folder.publish("coverage", 0, make_rows(n=3), HASH)
    expected = f"ResultsFolder('{tmp_path / 'r'}', 2 conditions, 3/10 runs)"
    assert repr(folder) == repr(ResultsFolder.open(folder.path)) == expected
    (folder.path / "trials" / "photo.jpg").touch()
    assert repr(folder) == f"ResultsFolder('{tmp_path / 'r'}', damaged)"


def test_repr_does_without_a_number_of_replicates(tmp_path):
    folder = ResultsFolder.create(tmp_path / "r", {"conditions": ["coverage"]})
    folder.publish("coverage", 0, make_rows(n=3), HASH)
    assert repr(folder).endswith(", 1 condition, 3 runs)")


def test_create_makes_a_folder_that_open_finds(tmp_path):
    created = ResultsFolder.create(tmp_path / "new" / "folder", DESCRIPTION)
    opened = ResultsFolder.open(str(tmp_path / "new" / "folder"))
    assert opened.description == created.description == DESCRIPTION
    assert opened.results_version == RESULTS_VERSION
    assert opened.version_note is None
    assert opened.chunks() == []
    assert opened.missing("coverage", 3) == [range(3)]
    assert opened.read().schema == SCHEMA
    assert opened.scan().collect().schema == SCHEMA
    assert opened.read(columns=["key", "stalls"]).columns == ["key", "stalls"]


def test_create_refuses_a_folder_that_holds_a_study(tmp_path):
    folder = make_folder(tmp_path / "r")
    with pytest.raises(RecordError, match=r"already has the results of a study.*--fresh"):
        ResultsFolder.create(folder.path, DESCRIPTION)


def test_create_refuses_and_names_what_is_not_ours(tmp_path):
    for name in ("thesis.tex", "photos"):
        (tmp_path / name).mkdir()
    with pytest.raises(RecordError, match=r"Found photos, thesis\.tex\."):
        ResultsFolder.create(tmp_path, DESCRIPTION)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["photos", "thesis.tex"]


def test_create_refuses_chunks_that_lost_their_description(tmp_path):
    folder = make_folder(tmp_path / "r")
    (folder.path / "study.json").unlink()
    with pytest.raises(RecordError, match="Found trials"):
        ResultsFolder.create(folder.path, DESCRIPTION)


def test_create_goes_on_after_a_create_that_was_interrupted(tmp_path):
    (tmp_path / "trials").mkdir()
    for name in (".lock", ".study.json.17.tmp", ".DS_Store"):
        (tmp_path / name).write_bytes(b"")
    ResultsFolder.create(tmp_path, DESCRIPTION)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".DS_Store", ".lock", "study.json", "trials"]


def test_create_refuses_a_file(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(RecordError, match="file"):
        ResultsFolder.create(tmp_path / "file", DESCRIPTION)


def test_open_names_what_it_found_instead(tmp_path):
    with pytest.raises(RecordError, match="does not exist"):
        ResultsFolder.open(tmp_path / "missing")
    (tmp_path / "a.txt").write_text("x")
    with pytest.raises(RecordError, match=r"no study\.json\. Found a\.txt\."):
        ResultsFolder.open(tmp_path)
    with pytest.raises(RecordError, match="is a file"):
        ResultsFolder.open(tmp_path / "a.txt")


@pytest.mark.parametrize("name", ["with a space", "ünï 雪", "100% [a]*?", "~tilde", "a=b", "#x;y"])
def test_any_name_of_a_folder_is_fine(tmp_path, name):
    folder = make_folder(tmp_path / name, 2)
    assert folder.read().equals(make_rows(n=4))
    assert folder.scan().collect().equals(make_rows(n=4))
    assert ResultsFolder.open(tmp_path / name).missing("coverage", 5) == [range(4, 5)]


def test_a_relative_path_is_fine(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make_folder(Path("r"), 1)
    assert ResultsFolder.open("r").scan().collect().equals(make_rows(n=2))
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    ResultsFolder.create(".", DESCRIPTION)


# publishing


def test_publish_returns_the_chunk_that_chunks_lists(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    chunk = folder.publish("a.b-c_1", 5, make_rows("a.b-c_1", 5, 3), HASH)
    assert folder.chunks() == folder.chunks("a.b-c_1") == [chunk]
    assert folder.chunks("coverage") == []
    assert chunk.path.name == "a.b-c_1.000000005-000000007.parquet"
    assert (chunk.replicates, chunk.n_rows, chunk.condition_hash) == (range(5, 8), 24, HASH)
    assert chunk.results_version == RESULTS_VERSION


def test_columns_are_stored_in_one_order(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    folder.publish("coverage", 0, make_rows().select(reversed(SCHEMA)), HASH)
    assert folder.read().equals(make_rows())


def test_missing_lists_the_gaps(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    for first in (2, 7, 5):
        folder.publish("coverage", first, make_rows(first=first, n=2), HASH)
    assert folder.missing("coverage", 12) == [range(0, 2), range(4, 5), range(9, 12)]
    assert folder.missing("coverage", 8) == [range(0, 2), range(4, 5)]
    assert folder.missing("coverage", 5) == [range(0, 2), range(4, 5)]
    assert folder.missing("coverage", 1) == [range(0, 1)]
    assert folder.missing("coverage", 0) == []
    assert folder.missing("a.b-c_1", 4) == [range(4)]


@pytest.mark.parametrize(("first", "n"), [(2, 2), (1, 2), (3, 4), (0, 9), (3, 1)])
def test_a_published_chunk_is_never_overwritten(tmp_path, first, n):
    folder = make_folder(tmp_path / "r", 0)
    chunk = folder.publish("coverage", 2, make_rows(first=2, n=2), HASH)
    before = chunk.path.read_bytes()
    with pytest.raises(RecordError, match="never overwritten"):
        folder.publish("coverage", first, make_rows(first=first, n=n), HASH)
    assert chunk.path.read_bytes() == before
    assert [path.name for path in chunk.path.parent.iterdir()] == [chunk.path.name]


def test_rows_that_do_not_fit_are_refused_and_leave_nothing(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    with pytest.raises(ValueError, match="no gap"):
        folder.publish("coverage", 0, make_rows().filter(pl.col("individual") != 1), HASH)
    with pytest.raises(ValueError, match=r"expected .1, 0, 0."):
        folder.publish("coverage", 1, make_rows(), HASH)
    with pytest.raises(ValueError, match="Did you mean 'coverage'"):
        folder.publish("covreage", 0, make_rows("covreage"), HASH)
    with pytest.raises(TypeError, match="hash"):
        folder.publish("coverage", 0, make_rows(), None)
    assert list((folder.path / "trials").iterdir()) == []


def test_a_condition_with_other_settings_is_refused(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    with pytest.raises(RecordError, match="other settings"):
        folder.publish("coverage", 2, make_rows(first=2), "another")
    folder.publish("a.b-c_1", 2, make_rows("a.b-c_1", first=2), "another")


# reading


def test_rows_come_in_key_order_with_conditions_as_described(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    for condition, first in (("a.b-c_1", 3), ("coverage", 2), ("a.b-c_1", 0), ("coverage", 0)):
        folder.publish(condition, first, make_rows(condition, first, 2), HASH)
    expected = pl.concat(
        [make_rows("coverage", 0, 4), make_rows("a.b-c_1", 0, 2), make_rows("a.b-c_1", 3, 2)]
    )
    assert folder.read().equals(expected)
    assert folder.scan().collect().equals(expected)
    assert pl.concat(folder.frames()).equals(expected)
    assert pl.concat(folder.frames("a.b-c_1", ["fitness"])).equals(expected.tail(32).select("fitness"))


def test_read_selects_conditions_replicates_and_columns(tmp_path):
    folder = make_folder(tmp_path / "r", 3)
    folder.publish("a.b-c_1", 0, make_rows("a.b-c_1"), HASH)
    part = folder.read("coverage", replicates=[4, 1, 77, -1], columns=["novelty", "cells"])
    expected = make_rows(n=6).filter(pl.col("replicate").is_in([1, 4])).select("novelty", "cells")
    assert part.equals(expected)
    assert folder.read(replicates=range(0)).is_empty()
    assert folder.derive("lineage", replicates=[4, 10**20, -1])["replicate"].unique().to_list() == [4]
    for wrong in ("4", 1.5, None):
        with pytest.raises(TypeError, match="expected a whole number"):
            folder.read(replicates=[wrong])
    assert folder.read(replicates=iter([2])).height == 16


def test_read_refuses_unknown_names(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    with pytest.raises(ValueError, match=r"Unknown condition 'covrage'\. Did you mean 'coverage'"):
        folder.read("covrage")
    with pytest.raises(ValueError, match=r"Unknown column 'fitnes'\. Did you mean 'fitness'"):
        folder.read(columns=["fitnes"])
    with pytest.raises(ValueError, match="Unknown column"):
        folder.frames(columns=["fitnes"])


def test_a_filtered_scan_gives_the_rows_of_a_filtered_read(tmp_path):
    folder = make_folder(tmp_path / "r", 3)
    wanted = (pl.col("replicate") == 3) & (pl.col("fitness") > 0.5)
    assert folder.scan().filter(wanted).collect().equals(folder.read().filter(wanted))


def test_a_reader_sees_what_a_writer_adds_meanwhile(tmp_path):
    writer = make_folder(tmp_path / "r", 1)
    reader = ResultsFolder.open(writer.path)
    assert len(reader.chunks()) == 1
    writer.update_description({"conditions": ["new", "coverage"]})
    writer.publish("new", 0, make_rows("new"), HASH)
    assert [chunk.condition for chunk in reader.chunks()] == ["new", "coverage"]
    assert reader.digest() == writer.digest()


# the digest


_PARTITIONS = st.lists(st.integers(1, 5), min_size=1, max_size=8).filter(lambda sizes: sum(sizes) >= 8)


@pytest.mark.slow
@given(one=_PARTITIONS, other=_PARTITIONS, swap=st.booleans(), seed=st.integers(0, 99))
@settings(max_examples=20, deadline=None)
def test_any_partition_into_chunks_gives_the_same_digest_and_the_same_rows(one, other, swap, seed):
    n = 8
    whole = {condition: make_rows(condition, 0, n) for condition in ("coverage", "a.b-c_1")}
    with tempfile.TemporaryDirectory() as path:
        plain = ResultsFolder.create(Path(path) / "plain", DESCRIPTION)
        for condition, rows in whole.items():
            plain.publish(condition, 0, rows, HASH)
        names = list(whole)[::-1] if swap else list(whole)
        folder = ResultsFolder.create(Path(path) / "parts", {"conditions": names})
        pieces = []
        for condition, sizes in zip(whole, (one, other), strict=True):
            first = 0
            for size in sizes:
                pieces.append((condition, first, min(first + size, n)))
                first += size
        random.Random(seed).shuffle(pieces)
        for condition, first, end in pieces:
            if first < end:
                here = pl.col("replicate").is_between(first, end - 1)
                folder.publish(condition, first, whole[condition].filter(here), HASH)
        assert folder.digest() == plain.digest()
        expected = pl.concat(whole[name] for name in names)
        assert folder.read().equals(expected)
        assert folder.scan().collect().equals(expected)


def test_the_digest_sees_a_value_a_replicate_a_name_and_a_hash(tmp_path):
    rows = make_rows()
    stalls = rows["stalls"].to_list()
    stalls[-1] += 1
    variants = {
        "base": ("coverage", rows, HASH),
        "value": ("coverage", rows.with_columns(stalls=pl.Series(stalls, dtype=pl.UInt32)), HASH),
        "fewer": ("coverage", rows.head(16), HASH),
        "name": ("a.b-c_1", rows.with_columns(condition=pl.lit("a.b-c_1")), HASH),
        "hash": ("coverage", rows, "another"),
    }
    digests = set()
    for name, (condition, frame, condition_hash) in variants.items():
        folder = ResultsFolder.create(tmp_path / name, DESCRIPTION)
        folder.publish(condition, 0, frame, condition_hash)
        digests.add(folder.digest())
    digests.add(ResultsFolder.create(tmp_path / "empty", DESCRIPTION).digest())
    assert len(digests) == 6


# what does not belong


def _spoilers():
    def flip(position):
        def spoil(data):
            data[position] ^= 16

        return spoil

    def cut(position):
        def spoil(data):
            del data[position:]

        return spoil

    def zero(start):
        def spoil(data):
            data[start : start + 64] = bytes(64)

        return spoil

    yield from ((f"flip {at}", flip(at)) for at in (0, 4, 100, 2000, -2000, -600, -100, -8, -6, -1))
    yield from ((f"cut {at}", cut(at)) for at in (0, 1, 4, 11, 100, 2000, -2000, -100, -8, -4, -1))
    yield from ((f"zero {at}", zero(at)) for at in (0, 4, 1000, 3000, -3000, -500, -64))
    yield "only zeros", lambda data: data.__setitem__(slice(None), bytes(len(data)))
    yield "longer", lambda data: data.extend(b"\0")
    yield "twice", lambda data: data.extend(bytes(data))


@pytest.fixture(scope="module")
def pristine(tmp_path_factory) -> ResultsFolder:
    return make_folder(tmp_path_factory.mktemp("pristine") / "r")


@pytest.mark.parametrize("spoil", [pytest.param(spoil, id=name) for name, spoil in _spoilers()])
def test_a_torn_chunk_is_named_and_refused_and_can_be_computed_again(tmp_path, pristine, spoil):
    shutil.copytree(pristine.path, tmp_path / "r")
    folder = ResultsFolder.open(tmp_path / "r")
    expected = folder.digest()
    path = folder.chunks()[1].path
    data = bytearray(path.read_bytes())
    spoil(data)
    path.write_bytes(data)
    for read in READERS.values():
        with pytest.raises(RecordError, match="Move it elsewhere or delete it, then run the same") as caught:
            read(folder)
        assert str(path) in str(caught.value)
    with pytest.raises(RecordError, match="overwritten"):
        folder.publish("coverage", 2, make_rows(first=2, n=2), HASH)
    path.unlink()
    assert folder.missing("coverage", 6) == [range(2, 4)]
    folder.publish("coverage", 2, make_rows(first=2, n=2), HASH)
    assert folder.digest() == expected


@pytest.mark.parametrize(
    "name", ["notes.txt", "coverage.parquet", ".hidden", "folder", "a b.000000000-1.parquet"]
)
@pytest.mark.parametrize("reader", READERS)
def test_a_foreign_file_among_the_trials_is_named_and_refused(tmp_path, name, reader):
    folder = make_folder(tmp_path / "r", 1)
    path = folder.path / "trials" / name
    path.mkdir() if name == "folder" else path.write_text("hello")
    with pytest.raises(RecordError, match="not a chunk of trials") as caught:
        READERS[reader](folder)
    assert name in str(caught.value)
    with pytest.raises(RecordError, match="not a chunk of trials"):
        folder.publish("coverage", 9, make_rows(first=9), HASH)


@pytest.mark.parametrize("reader", list(READERS))
def test_a_parquet_file_of_others_under_a_name_of_ours_is_refused(tmp_path, reader):
    folder = make_folder(tmp_path / "r", 1)
    path = folder.path / "trials" / "coverage.000000002-000000004.parquet"
    make_rows(first=2).write_parquet(path)
    with pytest.raises(RecordError, match="not written by realitygap") as caught:
        READERS[reader](folder)
    assert str(path) in str(caught.value)


def test_files_that_systems_put_into_folders_are_ignored(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    for name in (".DS_Store", "Thumbs.db", "._coverage.000000000-000000001.parquet", ".nfs000123"):
        (folder.path / "trials" / name).write_bytes(b"x")
    assert len(folder.chunks()) == 1


def test_a_renamed_chunk_is_refused(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    path = folder.chunks()[0].path
    path.rename(path.with_name("coverage.000000002-000000003.parquet"))
    with pytest.raises(RecordError, match="Was it renamed"):
        folder.chunks()


def test_overlapping_chunks_are_named_and_refused(tmp_path):
    folder = make_folder(tmp_path / "r", 2)
    other = ResultsFolder.create(tmp_path / "other", DESCRIPTION)
    chunk = other.publish("coverage", 1, make_rows(first=1), HASH)
    shutil.copy(chunk.path, folder.path / "trials")
    for read in READERS.values():
        with pytest.raises(
            RecordError, match=r"coverage.000000000-000000001.* and .*000000003.parquet overlap"
        ):
            read(folder)


def test_chunks_from_two_settings_of_a_condition_are_refused(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    other = ResultsFolder.create(tmp_path / "other", DESCRIPTION)
    chunk = other.publish("coverage", 2, make_rows(first=2), "another")
    shutil.copy(chunk.path, folder.path / "trials")
    for read in READERS.values():
        with pytest.raises(RecordError, match="two different settings"):
            read(folder)


def test_chunks_of_a_condition_that_is_not_described_are_refused(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    other = ResultsFolder.create(tmp_path / "other", {"conditions": ["stray"]})
    shutil.copy(other.publish("stray", 0, make_rows("stray"), HASH).path, folder.path / "trials")
    for read in READERS.values():
        with pytest.raises(RecordError, match=r"'stray', which study\.json does not list"):
            read(folder)


# extending and starting anew


def test_conditions_and_replicates_may_be_added_but_not_lost(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    more = {**DESCRIPTION, "conditions": [{"name": "new"}, {"name": "coverage"}]}
    folder.update_description(more)
    assert ResultsFolder.open(folder.path).description == more
    with pytest.raises(RecordError, match="trials of coverage"):
        folder.update_description({"conditions": ["new"]})
    assert ResultsFolder.open(folder.path).description == folder.description == more


@pytest.fixture
def older(tmp_path, monkeypatch) -> ResultsFolder:
    """Results that another version computed."""
    with monkeypatch.context() as patch:
        for module in (folder_module, published_module, chunk_module):
            patch.setattr(module, "RESULTS_VERSION", RESULTS_VERSION - 1)
        make_folder(tmp_path / "older", 2)
    return ResultsFolder.open(tmp_path / "older")


@pytest.mark.parametrize("reader", ["scan", "read", "frames", "digest"])
def test_results_of_another_version_are_read_with_a_warning(older, reader):
    assert older.results_version == RESULTS_VERSION - 1
    assert f"computed by results version {RESULTS_VERSION - 1}" in older.version_note
    with pytest.warns(RecordWarning, match="numbers may differ"):
        READERS[reader](older)


def test_results_of_another_version_are_never_extended(older):
    for write in (
        lambda: older.publish("coverage", 4, make_rows(first=4), HASH),
        lambda: older.update_description(DESCRIPTION),
    ):
        with pytest.raises(RecordVersionError, match="--fresh`, or name another folder"):
            write()
    assert len(older.chunks()) == 2


def test_the_version_is_in_the_digest(older, tmp_path):
    with pytest.warns(RecordWarning):
        assert older.digest() != make_folder(tmp_path / "r", 2).digest()


def test_a_chunk_of_another_version_is_named_and_refused(older, tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    path = Path(shutil.copy(older.chunks()[0].path, folder.path / "trials"))
    for name, read in READERS.items():
        with pytest.raises(
            RecordVersionError, match=rf"version {RESULTS_VERSION - 1}, study\.json says {RESULTS_VERSION}"
        ) as caught:
            read(folder)
        assert str(path) in str(caught.value), name


def test_clear_removes_only_our_files(tmp_path):
    folder = make_folder(tmp_path / "r")
    folder.append_log({"event": "start"})
    for name in ("report.html", "notes.txt"):
        (folder.path / name).write_text("x")
    folder.clear(also=["report.html", "never.made"])
    assert sorted(path.name for path in folder.path.iterdir()) == [".lock", "notes.txt"]
    (folder.path / "notes.txt").unlink()
    ResultsFolder.create(folder.path, DESCRIPTION)


def test_restart_begins_another_study_beside_the_files_of_others(tmp_path, older):
    for folder in (make_folder(tmp_path / "r"), older):
        (folder.path / "notes.txt").write_text("x")
        folder.restart({"conditions": ["other"]})
        opened = ResultsFolder.open(folder.path)
        assert opened.conditions == folder.conditions == ["other"]
        assert opened.results_version == RESULTS_VERSION
        assert opened.chunks() == []
        assert (folder.path / "notes.txt").exists()
        folder.publish("other", 0, make_rows("other"), HASH)


def test_restart_also_removes_torn_chunks(tmp_path):
    folder = make_folder(tmp_path / "r")
    (folder.path / "trials" / "coverage.000000000-000000001.parquet").write_bytes(b"torn")
    folder.restart(DESCRIPTION)
    assert folder.missing("coverage", 2) == [range(2)]


@pytest.mark.parametrize("begin", [lambda folder: folder.clear(), lambda folder: folder.restart(DESCRIPTION)])
def test_a_ledger_of_physical_trials_is_never_cleared(tmp_path, begin):
    folder = make_folder(tmp_path / "r")
    (folder.path / "ledger.sqlite").write_bytes(b"a year of work")
    with pytest.raises(RecordError, match="ledger of physical trials"):
        begin(folder)
    assert len(folder.chunks()) == 3


def test_clear_refuses_a_foreign_file_before_it_deletes_anything(tmp_path):
    folder = make_folder(tmp_path / "r")
    foreign = folder.path / "trials" / "photo.jpg"
    foreign.write_bytes(b"x")
    with pytest.raises(RecordError, match=r"photo\.jpg"):
        folder.clear()
    foreign.unlink()
    assert len(folder.chunks()) == 3


@pytest.mark.parametrize("name", ["../r2/x", "trials", "study.json", ".lock", "", ".", "..", "/etc/hosts"])
def test_clear_deletes_nothing_outside_the_folder(tmp_path, name):
    folder = make_folder(tmp_path / "r")
    with pytest.raises(ValueError, match="not a further file"):
        folder.clear(also=[name])
    assert len(folder.chunks()) == 3
