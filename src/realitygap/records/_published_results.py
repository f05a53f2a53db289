"""The published results of one study, readable while another process writes."""

from __future__ import annotations

import copy
import itertools
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Self

import polars as pl

from realitygap.drawing import ShownAsCard
from realitygap.errors import RecordError, RecordVersionError, did_you_mean, whole_number
from realitygap.records._chunk import (
    MAX_REPLICATE,
    Chunk,
    ChunkName,
    check_condition,
    digest_rows,
    load_chunk,
    read_rows,
)
from realitygap.records._columns import EXTRA_SCHEMA, SCHEMA, schema_with
from realitygap.records._derived import DERIVED, DerivedFrame
from realitygap.records._description import DESCRIPTION_NAME, Description
from realitygap.records._digest import RowsDigest, row_streams, study_digest
from realitygap.records._files import reading
from realitygap.records._ledger import Ledger
from realitygap.records._ledger_rows import complete_runs, ledger_frame
from realitygap.records._listing import (
    LEDGER_NAME,
    TRIALS_NAME,
    list_chunks,
    listed,
)
from realitygap.records._log import LOG_NAME, read_lines
from realitygap.records._output import refuse_results
from realitygap.records._parquet import write_frames
from realitygap.records._version import RESULTS_VERSION, RecordWarning


class PublishedResults(ShownAsCard):
    """Published results of a folder: `study.json`, `trials/*.parquet`, `log.jsonl`, `ledger.sqlite`.

    For conditions that a robot drove, the ledger gives the rows of complete runs.
    """

    def __init__(self, path: Path, description: Description) -> None:
        self._path = path
        self._trials = path / TRIALS_NAME
        self._description = description
        self._checked: dict[str, tuple[tuple[int, ...], Chunk]] = {}

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Return the study in a folder.

        Raises:
            RecordError: there is no such folder, it holds no results, or its `study.json` is torn or foreign.
        """
        path = Path(path)
        if not path.is_dir():
            what = "is a file, not a folder of results" if path.exists() else "does not exist"
            raise RecordError(
                f"{path} {what}. Check the path, or run a study with it as the folder for results."
            )
        if not (path / DESCRIPTION_NAME).exists():
            with reading(path):
                found = sorted(entry.name for entry in path.iterdir())
            raise RecordError(
                f"{path} holds no results: there is no {DESCRIPTION_NAME}. Found {listed(found)}. "
                "Check the path; if the file was lost, restore it from a copy."
            )
        return cls(path, Description.read(path / DESCRIPTION_NAME))

    # what it is

    def __repr__(self) -> str:
        where = f"{type(self).__name__}({str(self._path)!r}"
        try:
            n_conditions = len(self.conditions)
            n_there, n_runs = self.count_runs()
            labels = self.labels
        except Exception:  # messages and debuggers show it, whatever is in the folder
            return f"{where}, damaged)"
        of = "" if n_runs is None else f"/{n_runs:,}"
        shown = [f"{n_conditions} condition{'s' * (n_conditions != 1)}", f"{n_there:,}{of} runs"]
        return ", ".join([where, *shown, *(["+".join(labels)] if labels else [])]) + ")"

    @property
    def path(self) -> Path:
        """The folder."""
        return self._path

    @property
    def description(self) -> dict[str, Any]:
        """A copy of the study as resolved."""
        return copy.deepcopy(self._description.study)

    @property
    def conditions(self) -> list[str]:
        """Names of the conditions, in the description's order."""
        return self._description.conditions

    @property
    def labels(self) -> tuple[str, ...]:
        """SIM, TWIN, EMULATED, or REAL of the conditions, each once; the ledger has that of a robot.

        Raises:
            RecordError: The ledger is damaged.
        """
        told = [each.get("label") for each in self._description.study["conditions"] if isinstance(each, dict)]
        if (self._path / LEDGER_NAME).exists():
            with self._ledger() as ledger:
                told += [about["label"] for about in ledger.conditions().values()]
        return tuple(dict.fromkeys(str(label) for label in told if label))

    @property
    def results_version(self) -> int:
        """The version of what computed the numbers in this folder; see `RESULTS_VERSION`."""
        return self._description.results_version

    @property
    def version_note(self) -> str | None:
        """A sentence for reports when another version computed the numbers; None when it was this one."""
        if self.results_version == RESULTS_VERSION:
            return None
        return (
            f"The results in {self._path} were computed by results version {self.results_version}; "
            f"this realitygap computes version {RESULTS_VERSION}, whose numbers may differ."
        )

    @property
    def missing_note(self) -> str | None:
        """Return a sentence on missing runs, by the names of chunks; None if none is missing or this is unknown."""
        n_there, n_runs = self.count_runs()
        if n_runs is None or n_there >= n_runs:
            return None
        return (
            f"{n_there:,} of {n_runs:,} runs exist, and the digest is of these only. To run the others, repeat "
            "the command that ran the study."
        )

    def count_runs(self) -> tuple[int, int | None]:
        """Return the number of finished runs by the names of files, and of planned runs, None if it is unknown.

        Raises:
            RecordError: A file in `trials/` is foreign or in the wrong place, or the ledger is damaged.
        """
        replicates = self._description.study.get("replicates")
        n = replicates if isinstance(replicates, int) else MAX_REPLICATE + 1
        n_there = sum(max(0, min(name.last + 1, n) - name.first) for name in self._names())
        n_there += sum(run < n for runs in self._complete_runs().values() for run in runs)
        return n_there, replicates * len(self.conditions) if isinstance(replicates, int) else None

    def count_of(self, condition: str) -> int:
        """Return the number of finished runs of a condition by the names of files.

        Raises:
            RecordError: As `count_runs`.
        """
        n_there = sum(name.last + 1 - name.first for name in self._names(condition))
        return n_there + len(self._complete_runs().get(condition, []))

    # chunks

    def files(self) -> list[tuple[ChunkName, Path]]:
        """Return the name and the path of each published file in key order, whose bytes are not checked.

        Raises:
            RecordError: As `count_runs`.
        """
        return [(name, self._trials / str(name)) for name in self._names()]

    def chunks(self, condition: str | None = None) -> list[Chunk]:
        """Return all published chunks, or those of one condition, in key order; every byte of them was checked.

        A file that was checked before and has not changed since is not read again.

        Raises:
            RecordError: a file in `trials/` is torn, foreign or in the wrong place, or chunks overlap or
                disagree.
            RecordVersionError: a chunk is of another version than the folder.
        """
        chunks = [self._load(name) for name in self._names(condition)]
        self._check_together(chunks)
        return chunks

    def missing(self, condition: str, n_replicates: int) -> list[range]:
        """Return the replicates of 0 to `n_replicates` - 1 that are not published, as ranges in order.

        Raises:
            RecordError: as `chunks`.
            ValueError: the condition cannot name a file.
        """
        check_condition(condition)
        gaps: list[range] = []
        begin = 0
        for chunk in self.chunks(condition):
            gaps.append(range(begin, min(chunk.first, n_replicates)))
            begin = chunk.last + 1
        gaps.append(range(begin, n_replicates))
        return [gap for gap in gaps if gap]

    # rows

    def scan(self) -> pl.LazyFrame:
        """Return all rows, lazily, in key order; warns when another version computed them.

        Raises:
            RecordError: as `chunks`.
        """
        self._warn_of_version()
        parts: list[pl.LazyFrame] = []
        physical = self._complete_runs()
        for name in self.conditions:
            if name in physical:
                parts += [frame.lazy() for frame in self.driven_frames(name)]
            elif paths := [chunk.path for chunk in self.chunks(name)]:
                parts.append(pl.scan_parquet(paths, glob=False, hive_partitioning=False))
        return pl.concat(parts, how="diagonal") if parts else pl.LazyFrame(schema=SCHEMA)

    def frames(
        self, condition: str | None = None, columns: Sequence[str] | None = None
    ) -> Iterator[pl.DataFrame]:
        """Return the rows chunk by chunk, in key order, so that memory holds one chunk at a time.

        Args:
            condition: Condition. Default: all, in the description's order.
            columns: Columns. Default: all.

        Raises:
            RecordError: as `chunks`.
            TypeError: a replicate is not a whole number.
            ValueError: no such condition or column.
        """
        self._check_selection(condition, columns)
        self._warn_of_version()
        return self._all_frames(condition, columns)

    def read(
        self,
        condition: str | None = None,
        replicates: Iterable[int] | None = None,
        columns: Sequence[str] | None = None,
    ) -> pl.DataFrame:
        """Return rows in key order: conditions as in the description, then replicate, generation and individual.

        Args:
            condition: Condition. Default: all.
            replicates: Replicates, of which missing ones are left out. Default: all.
            columns: Columns, in this order. Default: all.

        Raises:
            RecordError: as `chunks`.
            TypeError: a replicate is not a whole number.
            ValueError: no such condition or column.
        """
        self._check_selection(condition, columns)
        self._warn_of_version()
        if replicates is None:
            parts = list(self._all_frames(condition, columns))
        else:
            wanted = _wanted(replicates)
            needed = None if columns is None else list(dict.fromkeys([*columns, "replicate"]))
            chosen = pl.col("replicate").cast(pl.Int64).is_in(wanted.implode())
            parts = [frame.filter(chosen) for frame in self._all_frames(condition, needed, wanted)]
        frame = pl.concat(parts, how="diagonal") if parts else pl.DataFrame(schema=schema_with(columns or ()))
        return frame if columns is None else frame.select(columns)

    def derive(
        self, what: DerivedFrame, condition: str | None = None, replicates: Iterable[int] | None = None
    ) -> pl.DataFrame:
        """Return species, innovations or lineage of the runs, derived from their rows.

        Args:
            what: species (a row is one species in one generation), innovations (one innovation number in one run), or
                lineage (one individual); `derived_table` has their columns.
            condition: Condition. Default: all.
            replicates: Replicates, of which missing ones are left out. Default: all.

        Raises:
            RecordError: as `chunks`.
            TypeError: a replicate is not a whole number.
            ValueError: no such condition, or nothing of that name to derive.
        """
        parts = list(self.derived_frames(what, condition, replicates))
        return pl.concat(parts) if parts else pl.DataFrame(schema=DERIVED[what].schema)

    def derived_frames(
        self, what: DerivedFrame, condition: str | None = None, replicates: Iterable[int] | None = None
    ) -> Iterator[pl.DataFrame]:
        """Yield the frames of `derive` chunk by chunk, so that memory holds one chunk at a time."""
        if what not in DERIVED:
            raise ValueError(f"Unknown frame {what!r}. {did_you_mean(what, DERIVED)}")
        self._check_selection(condition, None)
        self._warn_of_version()
        wanted = None if replicates is None else _wanted(replicates)
        return self._derived(what, condition, wanted)

    def write_derived(
        self,
        what: DerivedFrame,
        path: str | Path,
        condition: str | None = None,
        replicates: Iterable[int] | None = None,
    ) -> int:
        """Write `derive` to a Parquet file, chunk by chunk. An existing file is replaced once the new one is complete.

        Args:
            what, condition, replicates: Arguments of `derive`.
            path: The file; none of a study's own.

        Returns:
            The number of rows.

        Raises:
            RecordError: as `chunks`, or the file is one of a study's own or cannot be written.
            ValueError: as `derive`.
        """
        path = Path(path)
        refuse_results(path)
        return write_frames(path, self.derived_frames(what, condition, replicates), DERIVED[what].schema)

    def digest(self) -> str:
        """Return the sha256 of all rows, as 64 hexadecimal digits.

        It depends on the values, the conditions' names and hashes, and the results version: not on the order
        of the conditions, on how replicates were split into chunks, nor on when, where and with how many
        threads they were computed.

        Raises:
            RecordError: as `chunks`.
        """
        self._warn_of_version()
        return self.digest_with(lambda _condition, _frame: None)

    def digest_with(self, look: Callable[[str, pl.DataFrame], None]) -> str:
        """Return the digest without a warning about its version.

        Args:
            look: Called with the condition and the rows of each file.

        Raises:
            RecordError: As `chunks`.
        """
        rows: dict[str, RowsDigest] = {}
        chunks: list[Chunk] = []
        for name in self._names():
            digest = rows.setdefault(name.condition, RowsDigest())
            chunk, frame = digest_rows(self._trials / str(name), digest)
            chunks.append(chunk)
            look(name.condition, frame)
        self._check_together(chunks)
        hashes = {chunk.condition: chunk.condition_hash for chunk in chunks}
        hashes |= self._digest_driven(rows)
        return study_digest(
            self.results_version, {name: (hashes[name], rows[name].hexdigest()) for name in hashes}
        )

    # log

    def read_log(self) -> list[dict[str, Any]]:
        """Return the events in the log, oldest first; warns of lines that a crash has torn."""
        return read_lines(self._path / LOG_NAME)

    # inside

    def _names(self, condition: str | None = None) -> list[ChunkName]:
        """Return the published chunks, by name and in key order, after all checks of names."""
        names = list_chunks(self._trials)
        if not {name.condition for name in names} <= set(self.conditions):
            # another process may have extended the study since it was read here
            self._description = Description.read(self._path / DESCRIPTION_NAME)
        order = {name: index for index, name in enumerate(self.conditions)}
        for name in names:
            if name.condition not in order:
                raise RecordError(
                    f"{self._trials / str(name)} belongs to condition {name.condition!r}, which "
                    f"{DESCRIPTION_NAME} does not list. Move it elsewhere or delete it."
                )
        names.sort(key=lambda name: (order[name.condition], name.first, name.last))
        for before, name in itertools.pairwise(names):
            if before.condition == name.condition and name.first <= before.last:
                raise RecordError(
                    f"{self._trials / str(before)} and {name} overlap. "
                    "Move one of them elsewhere or delete it."
                )
        return [name for name in names if condition in (None, name.condition)]

    def _frames(self, names: Iterable[ChunkName], columns: Sequence[str] | None) -> Iterator[pl.DataFrame]:
        before: list[Chunk] = []
        for name in names:
            chunk, frame = read_rows(self._trials / str(name), columns)
            self._check_together([*before, chunk])
            before = [chunk]
            yield frame

    def _all_frames(
        self, condition: str | None, columns: Sequence[str] | None, replicates: pl.Series | None = None
    ) -> Iterator[pl.DataFrame]:
        """Yield rows in key order, of chunks and of the ledger; of chunks only those with some of the replicates."""
        names = self._names(condition)
        if replicates is not None:
            names = [name for name in names if replicates.is_between(name.first, name.last).any()]
        chunks = {
            key: list(group) for key, group in itertools.groupby(names, key=lambda name: name.condition)
        }
        physical = self._complete_runs()
        for name in self.conditions if condition is None else [condition]:
            if name in physical:
                for frame in self.driven_frames(name):
                    there = set(frame.columns)
                    lacking = [
                        pl.lit(None, dtype).alias(extra)
                        for extra, dtype in EXTRA_SCHEMA.items()
                        if extra not in there
                    ]
                    yield frame if columns is None else frame.with_columns(lacking).select(columns)
            else:
                yield from self._frames(chunks.get(name, []), columns)

    def _digest_driven(self, rows: dict[str, RowsDigest]) -> dict[str, str]:
        """Add the rows of the ledger to those digested; the hashes of their conditions."""
        if not (self._path / LEDGER_NAME).exists():
            return {}
        hashes: dict[str, str] = {}
        with self._ledger() as ledger:
            for name, about in ledger.conditions().items():
                frame = ledger_frame(ledger, name)
                if frame.height:
                    rows[name] = RowsDigest()
                    rows[name].update(row_streams(frame), frame.height)
                    hashes[name] = about["hash"]
        return hashes

    def driven_frames(self, condition: str) -> Iterator[pl.DataFrame]:
        """Yield the rows of the complete runs that a robot drove, nothing if it drove none.

        Raises:
            RecordError: The ledger is damaged.
        """
        if not (self._path / LEDGER_NAME).exists():
            return
        with self._ledger() as ledger:
            frame = ledger_frame(ledger, condition)
        if frame.height:
            yield frame

    def _complete_runs(self) -> dict[str, list[int]]:
        """Return the complete runs of each condition in the ledger; nothing without a ledger."""
        if not (self._path / LEDGER_NAME).exists():
            return {}
        with self._ledger() as ledger:
            return {name: complete_runs(ledger, name) for name in ledger.conditions()}

    def _ledger(self) -> Ledger:
        return Ledger.open(self._path / LEDGER_NAME, writable=False)

    def _derived(
        self, what: DerivedFrame, condition: str | None, replicates: pl.Series | None
    ) -> Iterator[pl.DataFrame]:
        derived = DERIVED[what]
        for frame in self._all_frames(condition, derived.needs, replicates):
            if replicates is not None:
                frame = frame.filter(pl.col("replicate").cast(pl.Int64).is_in(replicates.implode()))
            yield derived.frame(frame)

    def _load(self, name: ChunkName) -> Chunk:
        path = self._trials / str(name)
        with reading(path):
            status = path.stat()
        identity = (status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino)
        known = self._checked.get(path.name)
        chunk = known[1] if known is not None and known[0] == identity else load_chunk(path)
        self._checked[path.name] = (identity, chunk)
        return chunk

    def _check_together(self, chunks: Sequence[Chunk]) -> None:
        """All chunks must be of the folder's version, and those of a condition of the same settings."""
        first_of: dict[str, Chunk] = {}
        for chunk in chunks:
            if chunk.results_version != self.results_version:
                raise RecordVersionError(
                    f"{chunk.path} was computed by results version {chunk.results_version}, {DESCRIPTION_NAME} "
                    f"says {self.results_version}. Move it elsewhere, delete it, or restart (`realitygap run --fresh`)."
                )
            first = first_of.setdefault(chunk.condition, chunk)
            if chunk.condition_hash != first.condition_hash:
                raise RecordError(
                    f"{chunk.path} and {first.path.name} come from two different settings of condition "
                    f"{chunk.condition!r}. Move one of them elsewhere, or restart (`realitygap run --fresh`)."
                )

    def _check_known(self, condition: str) -> None:
        if condition not in self.conditions:
            raise ValueError(f"Unknown condition {condition!r}. {did_you_mean(condition, self.conditions)}")

    def _check_selection(self, condition: str | None, columns: Sequence[str] | None) -> None:
        if condition is not None:
            self._check_known(condition)
        for column in columns or ():
            if column not in (known := schema_with(EXTRA_SCHEMA)):
                raise ValueError(f"Unknown column {column!r}. {did_you_mean(column, known)}")

    def _warn_of_version(self) -> None:
        if self.version_note is not None:
            warnings.warn(self.version_note, RecordWarning, stacklevel=3)


def _wanted(replicates: Iterable[int]) -> pl.Series:
    """Return the possible replicates, ascending, because those beyond any chunk may be beyond polars' numbers, too."""
    numbers = {whole_number("replicate", number) for number in replicates}
    return pl.Series(sorted(number for number in numbers if 0 <= number <= MAX_REPLICATE), dtype=pl.Int64)
