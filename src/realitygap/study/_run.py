"""Carrying out a study: chunks on threads, published as they are done."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realitygap.errors import StudyError, whole_number
from realitygap.records import ResultsFolder
from realitygap.runs import Condition, prepare_kernels, run_replicates

from ._file import load_study
from ._study import Study

# A chunk is as many runs as take about this many robot-steps: some tenths of a second of one core.
CHUNK_STEPS = 1_500_000
LARGEST_CHUNK = 2000
# At least so many chunks a condition, so that progress shows and little is lost in a crash.
CHUNKS_PER_CONDITION = 4


@dataclass(frozen=True)
class Progress:
    """How far a study is: told after each chunk.

    Attributes:
        n_done: Runs published, those of earlier sittings counted.
        n_runs: Runs in all.
        n_computed: Runs computed in this sitting.
        seconds: Since this sitting began to compute.
    """

    n_done: int
    n_runs: int
    n_computed: int
    seconds: float


@dataclass(frozen=True)
class StudyResult:
    """A study carried out.

    Attributes:
        folder: Its results.
        n_runs: Runs in the study.
        n_computed: Runs computed in this sitting; the others were there.
        seconds: Computing took [s].
    """

    folder: ResultsFolder
    n_runs: int
    n_computed: int
    seconds: float


def run_study(
    study: Study | str | Path,
    out: str | Path | None = None,
    *,
    seed: int | None = None,
    replicates: int | None = None,
    threads: int | None = None,
    chunk: int | None = None,
    fresh: bool = False,
    tell: Callable[[Progress], None] | None = None,
) -> StudyResult:
    """Carry out a simulated study, or what is missing of it.

    What is in the folder already is kept: an interrupted study goes on, more replicates and new conditions
    extend it. Interrupt it (Ctrl-C) at any moment; runs that were published are safe, and the results do not
    depend on threads, chunks or interruptions.

    Args:
        study: A study, the name of one that comes with realitygap, or the path of a study file.
        out: Folder for the results; `results/NAME` when not given.
        seed: In place of the study's, when it is given by name or path.
        replicates: In place of the study's, likewise.
        threads: Kernels at once; as many as there are processors when not given.
        chunk: Runs computed and written together; chosen by their length when not given.
        fresh: Delete the study that is in the folder first; never where a ledger of physical trials is.
        tell: Called with the progress after each chunk.

    Raises:
        StudyError: The study cannot be carried out as written, or the folder holds another one: the
            difference is shown.
        RecordError: The folder holds something that cannot be trusted, or cannot be written.
        TypeError: A count is not a whole number, or the study is none of these.
        ValueError: A count below 1.
    """
    threads = None if threads is None else whole_number("threads", threads, 1)
    chunk = None if chunk is None else whole_number("chunk", chunk, 1)
    if not isinstance(study, Study):
        study = load_study(study, seed=seed, replicates=replicates)
    elif seed is not None or replicates is not None:
        raise ValueError("seed and replicates go with a study's name or path; this study has its own.")
    path = Path(out) if out is not None else Path("results") / study.about.name
    folder = _open_folder(path, study, fresh=fresh)
    n_threads = threads or usable_processors()
    with folder.locked():
        _adopt(folder, study)
        missing = {
            condition.name: folder.missing(condition.name, study.about.replicates)
            for condition in study.conditions
        }
        n_missing = sum(len(gap) for gaps in missing.values() for gap in gaps)
        folder.append_log(
            {"event": "start", "missing_runs": n_missing, "threads": n_threads, "machine": machine_facts()}
        )
        progress = _Counter(study.n_runs, study.n_runs - n_missing, tell)
        if n_missing:
            prepare_kernels()
            _compute(study, folder, missing, n_threads, chunk, progress)
        folder.append_log(
            {"event": "end", "computed_runs": progress.n_computed, "seconds": round(progress.seconds, 3)}
        )
    return StudyResult(folder, study.n_runs, progress.n_computed, progress.seconds)


def usable_processors() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def machine_facts() -> dict[str, Any]:
    """What a measured time depends on."""
    return {
        "host": platform.node(),
        "system": platform.platform(),
        "processor": processor_name(),
        "processors": usable_processors(),
    }


def processor_name() -> str:
    """The processor's name, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(errors="replace").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def _open_folder(path: Path, study: Study, *, fresh: bool) -> ResultsFolder:
    if not (path / "study.json").exists():
        return ResultsFolder.create(path, study.description())
    folder = ResultsFolder.open(path)
    if fresh:
        folder.restart(study.description(), also=["report.html"])
    return folder


def _adopt(folder: ResultsFolder, study: Study) -> None:
    """Bring the folder's description up to date; refuse another study, and a condition that has changed."""
    old = folder.description
    new = study.description()
    there = {condition["name"]: condition for condition in old["conditions"]}
    differences: list[str] = []
    for condition in new["conditions"]:
        before = there.pop(condition["name"], None)
        if before is not None and before["hash"] != condition["hash"]:
            lines = _differences(before["settings"], condition["settings"])
            differences += [f"{condition['name']}: {line}" for line in lines]
    if there:
        # conditions that this study lacks may stay in a folder of its own, but not in that of another
        differences = [
            f"the study's {key} is {old.get(key)!r} there, {new[key]!r} here"
            for key in ("name", "seed", "pair")
            if old.get(key) != new[key]
        ] + differences
    if differences:
        shown = differences[:20] + (
            [f"... and {len(differences) - 20} more"] if len(differences) > 20 else []
        )
        raise StudyError(
            "\n  ".join(
                [
                    f"{folder.path} holds results of other settings; nothing was run and nothing is lost.",
                    *shown,
                    "Use another folder (--out DIR), or --fresh to delete what is there and start anew.",
                ]
            )
        )
    new["conditions"] += list(there.values())
    new["replicates"] = max(new["replicates"], old["replicates"])
    if new != old:
        folder.update_description(new)


def _differences(old: Any, new: Any, place: str = "") -> list[str]:
    if isinstance(old, dict) and isinstance(new, dict):
        lines: list[str] = []
        for key in [*old, *(key for key in new if key not in old)]:
            where = f"{place}.{key}" if place else key
            if key not in old or key not in new:
                lines.append(f"{where} is {'new here' if key in new else 'only there'}")
            else:
                lines += _differences(old[key], new[key], where)
        return lines
    return [] if old == new else [f"{place} is {old!r} there, {new!r} here"]


class _Counter:
    """Counts runs and tells of them."""

    def __init__(self, n_runs: int, n_done: int, tell: Callable[[Progress], None] | None) -> None:
        self._n_runs = n_runs
        self._n_before = n_done
        self._tell = tell
        self._since = time.perf_counter()
        self.n_computed = 0
        self.seconds = 0.0
        self.add(0)

    def begin(self) -> None:
        """Computing begins now."""
        self._since = time.perf_counter()

    def add(self, n: int) -> None:
        self.n_computed += n
        self.seconds = time.perf_counter() - self._since
        if self._tell is not None:
            self._tell(
                Progress(self._n_before + self.n_computed, self._n_runs, self.n_computed, self.seconds)
            )


def _chunks(
    study: Study, missing: dict[str, list[range]], chunk: int | None
) -> Iterator[tuple[Condition, int, int]]:
    """(condition, first replicate, runs) of each chunk to compute."""
    for condition in study.conditions:
        size = chunk or _chunk_size(condition, study.about.replicates)
        for gap in missing[condition.name]:
            for first in range(gap.start, gap.stop, size):
                yield condition, first, min(size, gap.stop - first)


def _chunk_size(condition: Condition, replicates: int) -> int:
    steps = condition.neat.generations * condition.neat.population * condition.jyro.steps
    by_time = CHUNK_STEPS // steps
    by_progress = -(-replicates // CHUNKS_PER_CONDITION)
    return max(1, min(by_time, by_progress, LARGEST_CHUNK))


def _compute(
    study: Study,
    folder: ResultsFolder,
    missing: dict[str, list[range]],
    threads: int,
    chunk: int | None,
    progress: _Counter,
) -> None:
    """Compute the chunks on threads; few are under way at once, so that memory stays flat."""

    def compute(condition: Condition, first: int, n_runs: int) -> int:
        frame = run_replicates(condition, first, n_runs)
        folder.publish(condition.name, first, frame, condition.hash())
        return n_runs

    todo = _chunks(study, missing, chunk)
    progress.begin()
    with ThreadPoolExecutor(threads, thread_name_prefix="run") as pool:
        under_way: set[Future[int]] = set()
        try:
            while True:
                while len(under_way) < 2 * threads and (task := next(todo, None)) is not None:
                    under_way.add(pool.submit(compute, *task))
                if not under_way:
                    return
                # The time-out lets Ctrl-C through on every system.
                done, under_way = wait(under_way, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in done:
                    progress.add(future.result())
        except BaseException:
            for future in under_way:
                future.cancel()
            raise
