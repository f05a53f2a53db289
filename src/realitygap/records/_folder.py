"""A folder with the results of one study: who writes it, and how."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

import realitygap
from realitygap.errors import MissingExtraError, RecordError, RecordVersionError
from realitygap.records._chunk import (
    Chunk,
    ChunkName,
    encode_chunk,
)
from realitygap.records._description import DESCRIPTION_NAME, Description
from realitygap.records._files import reading, sync_folder, write_durably, writing
from realitygap.records._inbox import Delivery, is_inbox, make_inbox, remove_inbox
from realitygap.records._inside import refuse_links
from realitygap.records._listing import (
    LEDGER_NAME,
    TRIALS_NAME,
    is_temporary,
    is_trace,
    list_chunks,
    listed,
)
from realitygap.records._lock import LOCK_NAME, FolderLock
from realitygap.records._log import LOG_NAME, append_line
from realitygap.records._published import PublishedNames
from realitygap.records._published_results import PublishedResults
from realitygap.records._seal import BrokenSeal, check_ends
from realitygap.records._version import RESULTS_VERSION

if TYPE_CHECKING:
    import pandas

_FACE = (
    *("best", "conditions", "digest", "labels", "open", "paths", "path", "plot", "replay", "report", "scan"),
    *("summary", "to_pandas", "to_polars"),
)
"""Members that completion offers. The others are for programs that write results."""


class ResultsFolder(PublishedResults):
    """The results of one study: `study.json`, `trials/*.parquet`, `log.jsonl`, and with a robot `ledger.sqlite`.

    `Study.run` returns one, and `open` reads one. To look at results: `best`, `summary`, `plot`, `paths`, `replay`,
    `report`, `to_polars`, and `to_pandas`. The other methods are for programs that write results. They begin with
    `create`. Any number of processes may read while one writes; whatever is read was
    published as a whole. Writing takes the lock by itself; `locked` keeps others out for longer.
    """

    def __init__(self, path: Path, description: Description) -> None:
        super().__init__(path, description)
        self._lock = FolderLock(path)
        self._publishing = threading.Lock()
        self._published: PublishedNames | None = None

    def __fspath__(self) -> str:
        return str(self._path)

    def __dir__(self) -> list[str]:
        return sorted(_FACE)

    # looking at results: each verb is a function of a package above, called through the front door

    def best(self) -> pl.DataFrame:
        """Return the best trial of each condition, the highest score first, as `realitygap.report.best_trials`."""
        return realitygap.report.best_trials(self)

    def summary(self) -> pl.DataFrame:
        """Return the median best coverage of each condition with its interval, as `realitygap.summarize`."""
        return realitygap.summarize(self)

    def plot(self) -> realitygap.report.Drawing:
        """Draw the best score by generation, run by run, with medians. Coverage comes before the scores of other tasks.

        Raises:
            RecordError: The folder holds no trials yet, or a file in it is damaged.
        """
        return realitygap.report.draw_best(self)

    def paths(self, condition: str | None = None, run: int | None = None) -> realitygap.report.Drawing:
        """Draw the path of the best trial of each generation of one run, as `realitygap.report.draw_paths`.

        Args:
            condition: Condition. Default: the first one.
            run: Run. Default: the typical one, whose best trial is the median.

        Raises:
            ValueError: There is no such condition or run; the message names those that exist.
        """
        return realitygap.report.draw_paths(self, condition, run)

    def replay(
        self,
        condition: str | None = None,
        run: int | None = None,
        generation: int | None = None,
        individual: int | None = None,
    ) -> realitygap.playback.MovingTrial:
        """Return one trial in motion, recomputed from its row: a player in a notebook, and `save` for a film.

        Args:
            condition: Condition. Default: the first one.
            run: Run. Default: the typical one, whose best trial is the median.
            generation: Generation of the run. Default: that of its best trial.
            individual: Individual of the generation. Default: the best one by the task.

        Raises:
            ValueError: There is no such condition or trial; the message names those that exist.
        """
        return realitygap.report.choose_moving([self], None, condition, run, generation, individual)[1][0]

    def report(self, out: str | Path | None = None) -> Path:
        """Write the report of the study and return its path, as `realitygap.write_report`."""
        return realitygap.write_report(self, out)

    def to_polars(self) -> pl.DataFrame:
        """Return all rows, one for each individual, as a Polars frame; `scan` reads them lazily."""
        return self.read()

    def to_pandas(self) -> pandas.DataFrame:
        """Return all rows, one for each individual, as a pandas frame.

        Raises:
            MissingExtraError: pandas or pyarrow is not installed.
        """
        for module in ("pandas", "pyarrow"):
            try:
                import_module(module)
            except ImportError as error:
                raise MissingExtraError(
                    f"to_pandas needs {module}, which is not installed. Install both packages (pip install pandas "
                    "pyarrow), or use to_polars."
                ) from error
        return self.read().to_pandas()

    # making

    @classmethod
    def create(cls, path: str | Path, description: Mapping[str, Any]) -> ResultsFolder:
        """Begin a study in a folder that is new or empty.

        Args:
            path: Folder, which is made with all folders above it.
            description: Study as resolved: JSON values, with `conditions` a list of names, or of tables that have a
                `name`.

        Raises:
            RecordError: the folder holds something, cannot be made, or another process writes to it.
            TypeError: a value of the description is not JSON's.
            ValueError: the description has no valid list of conditions.
        """
        folder = cls(Path(path), Description.of(description, RESULTS_VERSION))
        if not folder._path.is_dir():
            with writing(folder._path):
                folder._path.mkdir(parents=True, exist_ok=True)
                sync_folder(folder._path.parent)
        folder._refuse_unless_empty()
        with folder._hold(reload=False):
            folder._refuse_unless_empty()
            folder._begin()
        return folder

    def update_description(self, description: Mapping[str, Any]) -> None:
        """Replace the description, when a study gets more runs or conditions.

        Raises:
            RecordError: a condition with published chunks would be missing from it, or the file cannot be
                written.
            RecordVersionError: another version computed the results.
            TypeError: a value of the description is not JSON's.
            ValueError: the description has no valid list of conditions.
        """
        new = Description.of(description, RESULTS_VERSION)
        with self._hold():
            self._refuse_other_version()
            lost = sorted({name.condition for name in list_chunks(self._trials)} - set(new.conditions))
            if lost:
                raise RecordError(
                    f"{self._path} holds trials of {listed(lost)}, which the new description does not list. "
                    "List them, or restart (`realitygap run --fresh`, or another folder)."
                )
            new.write(self._path / DESCRIPTION_NAME)
            self._description = new

    # chunks

    def publish(self, condition: str, first: int, frame: pl.DataFrame, condition_hash: str) -> Chunk:
        """Add the rows of one or more whole replicates; once this returns, they survive a crash.

        Args:
            condition: One of `conditions`.
            first: The first replicate in `frame`.
            frame: Columns as in `SCHEMA`, and any of `EXTRA`; rows sorted by replicate, generation and individual,
                without a gap.
            condition_hash: Hash of the condition as resolved; the same for all chunks of a condition.

        Raises:
            RecordError: replicates are published already, the condition's hash is another, the disk is full,
                the folder cannot be written, or another process writes to it. What was published stays.
            RecordVersionError: another version computed what is in the folder.
            TypeError: `frame` is not a polars frame.
            ValueError: the condition is not in the description, or the rows are not fit to be published.
        """
        self._check_known(condition)
        chunk, data = encode_chunk(self._trials, condition, first, frame, condition_hash)
        with self._hold(), self._publishing:
            self._refuse_other_version()
            name = ChunkName(condition, first, chunk.last)
            self._refuse_overlap(name, condition_hash)
            with writing(self._trials):
                self._trials.mkdir(exist_ok=True)
            write_durably(chunk.path, data, replace=False)
            self._names_published().add(name)
        return chunk

    @contextlib.contextmanager
    def inbox(self) -> Iterator[Path]:
        """Yield a folder into which processes without the lock, on any machine that sees it, `deliver` chunks.

        It is removed on the way out, and with it what was not accepted; one that a killed process left, when
        the lock is next taken.

        Raises:
            RecordError: another process writes to the folder, or it cannot be written.
        """
        with self._hold():
            inbox = make_inbox(self._path)
            try:
                yield inbox
            finally:
                remove_inbox(inbox)

    def accept(self, inbox: Path, deliveries: Sequence[Delivery]) -> None:
        """Publish chunks out of an inbox of this folder; once this returns, they survive a crash.

        Both ends of a file are checked here, and the whole file whenever it is read.

        Raises:
            RecordError: a file is not there or not whole, replicates are published already, a
                condition's hash is another, or the system refused. What was published stays.
            RecordVersionError: another version computed what is in the folder.
            ValueError: a condition is not in the description.
        """
        with self._hold(), self._publishing:
            self._refuse_other_version()
            with writing(self._trials):
                self._trials.mkdir(exist_ok=True)
            for delivery in deliveries:
                self._accept_one(inbox, delivery)
            with writing(self._trials):
                sync_folder(self._trials)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Be the only writer for a while; may be nested, and used by several threads of the holder.

        The operating system gives the lock back when the process dies. Temporary files that killed writers
        left are removed on the way in.

        Raises:
            RecordError: another writer is in the folder, or it cannot be written.
        """
        with self._hold():
            yield

    # log

    def append_log(self, event: Mapping[str, Any]) -> bool:
        """Append an event to the log, with its `time` (UTC) and `host`; whether it was written.

        A failure never stops a run, because no result depends on the log. It gives a `RecordWarning`.
        """
        return append_line(self._path / LOG_NAME, event)

    # restart

    def clear(self, *, also: Iterable[str] = ()) -> None:
        """Delete the results: chunks, log, the files named by the caller, and last `study.json`.

        Everything else in the folder stays. A folder with a ledger of physical trials is never cleared.

        Args:
            also: Names of further files in this folder that belong to the results, such as a report. Missing ones are
                ignored.

        Raises:
            RecordError: there is a ledger, a foreign file in `trials/`, or another process writes to the
                folder.
            ValueError: a name in `also` is not that of a file in this folder.
        """
        with self._hold(reload=False):
            self._delete_results(also)
            with writing(self._path):
                (self._path / DESCRIPTION_NAME).unlink(missing_ok=True)
                sync_folder(self._path)
            with contextlib.suppress(OSError):
                self._trials.rmdir()

    def restart(self, description: Mapping[str, Any], *, also: Iterable[str] = ()) -> None:
        """Delete the results as `clear` does and begin another study in the same folder (`--fresh`).

        Unlike `clear` and `create`, it leaves no moment at which the folder is nobody's, and other people's
        files may stay in it.

        Raises:
            RecordError: as `clear`.
            TypeError: a value of the description is not JSON's.
            ValueError: as `clear` and `create`.
        """
        new = Description.of(description, RESULTS_VERSION)
        with self._hold(reload=False):
            self._delete_results(also)
            self._description = new
            self._begin()

    # inside

    @contextlib.contextmanager
    def _hold(self, *, reload: bool = True) -> Iterator[None]:
        self._lock.acquire(self._settle if reload else self._sweep)
        try:
            yield
        finally:
            self._lock.release()

    def _accept_one(self, inbox: Path, delivery: Delivery) -> None:
        self._check_known(delivery.condition)
        name = delivery.name
        self._refuse_overlap(name, delivery.condition_hash)
        path = inbox / str(name)
        try:
            with reading(path):
                check_ends(path)
        except BrokenSeal as error:
            raise RecordError(f"{path} {error}. Run the same command again to resume.") from None
        with writing(self._trials / str(name)):
            path.rename(self._trials / str(name))
        self._names_published().add(name)

    def _settle(self) -> None:
        """Refresh after locking, because another process may have written since this object was made."""
        self._description = Description.read(self._path / DESCRIPTION_NAME)
        self._sweep()

    def _sweep(self) -> None:
        """Remove files of killed writers. The lock ensures that no process writes."""
        self._published = None
        own = (DESCRIPTION_NAME, LOG_NAME, TRIALS_NAME, LEDGER_NAME)
        refuse_links(self._path, *(self._path / name for name in own))
        with writing(self._path):
            for entry in self._path.iterdir():
                if is_inbox(entry.name):
                    remove_inbox(entry)
            for folder in (self._path, self._trials):
                for entry in folder.iterdir() if folder.is_dir() else ():
                    if is_temporary(entry.name):
                        entry.unlink(missing_ok=True)

    def _begin(self) -> None:
        with writing(self._trials):
            self._trials.mkdir(exist_ok=True)
        self._description.write(self._path / DESCRIPTION_NAME)

    def _refuse_unless_empty(self) -> None:
        if (self._path / DESCRIPTION_NAME).exists():
            raise RecordError(
                f"{self._path} already has the results of a study. Resume it, restart (`realitygap run --fresh`), or "
                "name another folder."
            )
        with reading(self._path):
            found = sorted(entry.name for entry in self._path.iterdir() if not is_trace(entry))
        if found:
            raise RecordError(
                f"{self._path} is not empty and holds no results. Found {listed(found)}. Name another folder."
            )

    def _refuse_other_version(self) -> None:
        if self.version_note is not None:
            raise RecordVersionError(
                f"{self.version_note} They are not extended, because versions must not mix. Restart with "
                "`realitygap run --fresh`, or name another folder."
            )

    def _refuse_overlap(self, name: ChunkName, condition_hash: str) -> None:
        published = self._names_published()
        other = published.overlapping(name)
        if other is not None:
            raise RecordError(
                f"Replicates {name.first} to {name.last} of {name.condition!r} overlap with "
                f"{self._trials / str(other)}. A published chunk is never overwritten."
            )
        first = published.first(name.condition)
        if first is not None and self._load(first).condition_hash != condition_hash:
            raise RecordError(
                f"{self._path} holds trials of condition {name.condition!r} with other settings. Restart "
                "(`realitygap run --fresh`), name another folder, or give the condition another name."
            )

    def _names_published(self) -> PublishedNames:
        """Return the published names, listed once after locking: no other process publishes meanwhile."""
        if self._published is None:
            self._published = PublishedNames(self._names())
        return self._published

    def _delete_results(self, also: Iterable[str]) -> None:
        if (self._path / LEDGER_NAME).exists():
            raise RecordError(
                f"{self._path} holds a ledger of physical trials ({LEDGER_NAME}), which is never deleted. "
                "Name another folder."
            )
        extra = [self._path / name for name in also]
        for path in extra:
            reserved = path.name in (DESCRIPTION_NAME, LOCK_NAME)
            if path.parent != self._path or reserved or path.is_dir():
                raise ValueError(f"{path} in `also` is not a further file in {self._path}.")
        chunks = list_chunks(self._trials)
        with writing(self._path):
            for path in [*(self._trials / str(name) for name in chunks), *extra, self._path / LOG_NAME]:
                path.unlink(missing_ok=True)
            sync_folder(self._path)
        self._checked.clear()
        self._published = None
