"""Running a study: chunks on threads or on a cluster, published as they are done; or what a robot drives."""

from __future__ import annotations

import contextlib
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realitygap._process import usable_processors, use_polars
from realitygap.errors import OutgrownError, StudyError, whole_number
from realitygap.platforms import built_in_platforms
from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder
from realitygap.runs import Condition
from realitygap.stats import SequentialTest
from realitygap.tasks import source_hash
from realitygap.trials import Operator

from ._cluster import Cluster
from ._code import AllowCode, with_code_allowed
from ._design import hold_to_design
from ._executors import ChunkTask, Executor, Threads
from ._file import load_study
from ._physical import (
    OpenRobot,
    PhysicalResult,
    PhysicalStudy,
    connect_robot,
    default_operator,
    n_complete,
    physical_conditions,
)
from ._study import Study, same_file

# A chunk is as many runs as take about this many robot-steps: some tenths of a second of one core.
CHUNK_STEPS = 7_000_000
LARGEST_CHUNK = 2000
# Minimum number of chunks per condition, so that progress is visible and little is lost in a crash.
CHUNKS_PER_CONDITION = 4


@dataclass(frozen=True)
class Progress:
    """The progress of a study, reported after each chunk.

    Attributes:
        n_done: Runs published, those of earlier sittings counted.
        n_runs: Total number of runs.
        n_computed: Runs computed in this sitting.
        seconds: Computing time since the start [s].
        waiting_for: Missing part of a cluster, such as a worker; empty if computing continues.
    """

    n_done: int
    n_runs: int
    n_computed: int
    seconds: float
    waiting_for: str = ""


@dataclass(frozen=True)
class StudyResult:
    """The result of a study.

    Attributes:
        folder: Folder of its results.
        n_runs: Simulated runs of the study; 0 if a robot was driven.
        n_computed: Runs computed in this sitting; the others were there.
        seconds: Computing took [s].
        physical: Progress of the conditions that a robot drives; None if the study has none.
    """

    folder: ResultsFolder
    n_runs: int
    n_computed: int
    seconds: float
    physical: PhysicalResult | None = None


def run_study(
    study: Study | str | Path,
    out: str | Path | None = None,
    *,
    seed: int | None = None,
    replicates: int | None = None,
    threads: int | None = None,
    chunk: int | None = None,
    fresh: bool = False,
    cluster: str | None = None,
    tell: Callable[[Progress], None] | None = None,
    allow_code: AllowCode = False,
) -> StudyResult:
    """Compute the simulated conditions of a study, or what is missing of them; `drive_study` drives the others.

    Existing results stay: an interrupted study resumes, and more replicates and new conditions extend it. You can
    interrupt it (Ctrl-C) at any moment. Published runs are safe, and the results do not depend on threads, chunks, or
    interruptions.

    Args:
        study: Study, name of one that comes with realitygap, or path of a study file.
        out: Folder for the results; `results/NAME` when not given.
        seed: Seed that replaces the study's, if the study is given by name or path.
        replicates: Number of replicates that replaces the study's, if the study is given by name or path.
        threads: Number of threads. Default: the number of processors.
        chunk: Number of runs that are computed and written together. Default: chosen by their length.
        fresh: True to delete a study in the folder first. A folder with a ledger of physical trials is never deleted.
        cluster: Cluster that replaces this machine's threads: `tcp://HOST:PORT` of a running Dask scheduler, or
            `slurm`, `pbs`, `sge`, `lsf`, `oar`, `htcondor` or `moab` for jobs of that batch system, with the user's
            Dask configuration. `slurm:20` asks for 20 jobs. All workers must see `out` under the same path.
        tell: Called with the progress after each chunk.
        allow_code: True to run Python files of tasks (`kind = "python:FILE.py:FUNCTION"`) that the user has not
            allowed before. Or a function that gets the `PythonTask` and returns whether its file may run.

    Raises:
        TaskError: A Python file is not allowed, cannot be run, or lacks its function; nothing was written.
        StudyError: The study cannot be run as written, or the folder has another one; the message shows the difference.
        RecordError: The folder has an untrustworthy file, or cannot be written.
        RealityGapError: The cluster cannot be reached.
        RuntimeError: This process was forked from one that had used polars. Use the start method `spawn`.
        TypeError: A count is not a whole number, or study or cluster is none of these.
        ValueError: A count below 1, or both threads and a cluster.
    """
    use_polars()
    threads = None if threads is None else whole_number("threads", threads, 1)
    chunk = None if chunk is None else whole_number("chunk", chunk, 1)
    study, path = _resolved(study, out, seed, replicates, allow_code, fresh=fresh)
    with _executor(threads, cluster) as executor:
        folder = _open_folder(path, study, fresh=fresh)
        with folder.locked():
            _adopt(folder, study)
            progress = _carry_out(study, folder, executor, chunk, tell)
            physical = _physical_result(study, folder, 0, "") if study.n_physical else None
    return StudyResult(folder, progress.n_runs, progress.n_computed, progress.seconds, physical)


def drive_study(
    study: Study | str | Path,
    port: str,
    out: str | Path | None = None,
    *,
    seed: int | None = None,
    replicates: int | None = None,
    operator: Operator | None = None,
    open_robot: OpenRobot | None = None,
    allow_code: AllowCode = False,
    lock: bool = False,
    who: str | None = None,
) -> StudyResult:
    """Drive the conditions of a study that are on a robot, or what is missing of them.

    Each trial is in the folder's ledger as soon as it is known. Interrupt it (Ctrl-C) at any moment: the same call
    resumes.

    Args:
        study: Study, name of one that comes with realitygap, or path of a study file.
        port: The robot's, such as `/dev/rfcomm0`, `COM3`, `socket://HOST:PORT`, or `emulator://s2?speed=off`, an
            emulated robot in this program.
        out: Folder for the results; `results/NAME` when not given.
        seed: Replaces the study's, if the study is given by name or path.
        replicates: Replaces the study's, likewise.
        operator: Places the robot and reports what it drew; the emulator's witness when not given, which only an
            emulated robot in this program has.
        open_robot: Called with the settings of a condition when a trial is to be driven; opens `port` when not given.
        allow_code: Permission to run Python files, as in `run_study`.
        lock: True to lock the design of these conditions before the first trial. `[trials]` decides their order, and
            whether they are blind.
        who: Person who locks it. Default: the name of the account.

    Raises:
        StudyError: No condition of the study is on a robot, nobody places the robot, the folder holds another study,
            or the study differs from the locked design.
        RealityGapError: The robot cannot be reached, or failed; what was scored is safe.
    """
    study, path = _resolved(study, out, seed, replicates, allow_code)
    check_has_robot(study)
    operator = operator or default_operator(port)
    arena = physical_conditions(study)[0].arena.arena()
    folder = _open_folder(path, study)
    with folder.locked():
        _adopt(folder, study)
        ledger_path = path / LEDGER_NAME
        with Ledger.open(ledger_path) if ledger_path.exists() else Ledger.create(ledger_path) as ledger:
            hold_to_design(ledger, _physical_design(study, port), lock=lock, who=who)
            physical = PhysicalStudy(study, ledger, operator, open_robot or connect_robot(port, arena), port)
            waiting = physical.carry_out()
        return StudyResult(folder, 0, 0, 0.0, _physical_result(study, folder, physical.n_driven, waiting))


def _physical_design(study: Study, port: str) -> dict[str, Any]:
    """Return all that decides which trials of a study a robot drives, and how they are judged."""
    conditions, trials = physical_conditions(study), study.trials
    test = SequentialTest(null=trials.null, margin=trials.margin or None)
    return {
        "command": "drive",
        "settings": {
            "study": study.about.name,
            "replicates": study.about.replicates,
            **trials.model_dump(mode="json"),
        },
        "names": {"port": port},
        "target": {"name": port},
        "arms": [{"name": each.name, "sha256": each.hash()} for each in conditions],
        "others": [],
        "unit": "",
        "blocks": 0,
        "first": 0,
        "stride": None,
        "score": ", ".join(dict.fromkeys(each.task_of_trials.name for each in conditions)),
        "exclusion": "A trial counts unless it is void, for a reason that does not depend on its score. It is driven "
        "again.",
        "test": test.to_dict(),
    }


def check_has_robot(study: Study) -> None:
    """Raise an error if no condition of a study is on a robot.

    Raises:
        StudyError: The study has no such condition.
    """
    if not study.n_physical:
        robots = [repr(model.name) for model in built_in_platforms() if model.is_physical]
        raise StudyError(
            f"No condition of study {study.about.name!r} is on a robot (platform {' or '.join(robots)}). "
            "`realitygap run` computes it."
        )


def _resolved(
    study: Study | str | Path,
    out: str | Path | None,
    seed: int | None,
    replicates: int | None,
    allow_code: AllowCode,
    *,
    fresh: bool = False,
) -> tuple[Study, Path]:
    """Return a study that may run, and the folder of its results, which holds no other study unless `fresh`."""
    if not isinstance(study, Study):
        study = load_study(study, seed=seed, replicates=replicates)
    elif seed is not None or replicates is not None:
        raise ValueError("seed and replicates go with a study's name or path; this study has its own.")
    path = Path(out) if out is not None else Path("results") / study.about.name
    if not fresh and (path / "study.json").exists():
        _refuse_other_settings(ResultsFolder.open(path), study)
    return with_code_allowed(study, allow_code), path


def _physical_result(study: Study, folder: ResultsFolder, n_driven: int, waiting: str) -> PhysicalResult:
    conditions = physical_conditions(study)
    n_runs = len(conditions) * study.about.replicates
    path = folder.path / LEDGER_NAME
    if not path.exists():
        return PhysicalResult(n_runs, 0, n_driven, waiting)
    with Ledger.open(path, writable=False) as ledger:
        return PhysicalResult(
            n_runs, n_complete(ledger, conditions, study.about.replicates), n_driven, waiting
        )


@contextlib.contextmanager
def _executor(threads: int | None, cluster: str | None) -> Iterator[Executor]:
    """Yield the executor; a cluster is connected before anything in the folder changes."""
    if cluster is None:
        yield Threads(threads or usable_processors())
        return
    if threads is not None:
        raise ValueError(
            "threads and cluster exclude each other. Set the number of threads of a worker when you start it "
            "(`dask worker --nthreads`, or `cores` in the settings of its jobs)."
        )
    if not isinstance(cluster, str):
        raise TypeError(f"cluster is {cluster!r}, expected a text, such as 'tcp://HOST:8786' or 'slurm:20'.")
    with Cluster(cluster) as executor:
        yield executor


def _carry_out(
    study: Study,
    folder: ResultsFolder,
    executor: Executor,
    chunk: int | None,
    tell: Callable[[Progress], None] | None,
) -> _Counter:
    """Compute what is missing in a folder that is locked, and note it in the log."""
    missing = {
        condition.name: folder.missing(condition.name, study.about.replicates)
        for condition in study.conditions
        if not condition.is_physical
    }
    n_missing = sum(len(gap) for gaps in missing.values() for gap in gaps)
    start = {"event": "start", "missing_runs": n_missing, **executor.facts(), "machine": machine_facts()}
    folder.append_log(start)
    n_runs = len(missing) * study.about.replicates
    progress = _Counter(n_runs, n_runs - n_missing, tell)
    if n_missing:
        executor.prepare([each for each in study.conditions if missing.get(each.name)])
        progress.begin()
        try:
            executor.carry_out(folder, _chunks(study, missing, chunk), progress)
        except OutgrownError as error:
            folder.append_log({"event": "outgrown", "message": str(error)})
            raise
    seconds = round(progress.seconds, 3)
    end = {"event": "end", "computed_runs": progress.n_computed, "seconds": seconds, **executor.facts()}
    folder.append_log(end)
    return progress


def machine_facts() -> dict[str, Any]:
    """Return the facts about the machine that measured times depend on."""
    return {
        "host": platform.node(),
        "system": platform.platform(),
        "processor": processor_name(),
        "processors": usable_processors(),
    }


def processor_name() -> str:
    """Return the processor's name, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(errors="replace").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def _open_folder(path: Path, study: Study, *, fresh: bool = False) -> ResultsFolder:
    if not (path / "study.json").exists():
        return ResultsFolder.create(path, study.description())
    folder = ResultsFolder.open(path)
    if fresh:
        folder.restart(study.description(), also=["report.html"])
    return folder


def _adopt(folder: ResultsFolder, study: Study) -> None:
    """Bring the folder's description up to date.

    Raises:
        StudyError: As `_refuse_other_settings`.
    """
    _refuse_other_settings(folder, study)
    old, new = folder.description, study.description()
    existing = _with_results(folder)
    if existing:
        names = [condition["name"] for condition in new["conditions"]]
        new["conditions"] += [each for name, each in existing.items() if name not in names]
        new["replicates"] = max(new["replicates"], old["replicates"])
    if new != old:
        folder.update_description(new)


def _refuse_other_settings(folder: ResultsFolder, study: Study) -> None:
    """Refuse a folder that holds another study, or a condition that has changed.

    Raises:
        StudyError: It does; each difference has a line.
    """
    old = folder.description
    new = study.description()
    existing = _with_results(folder)
    differences: list[str] = []
    for condition in new["conditions"]:
        before = existing.pop(condition["name"], None)
        if before is not None and before["hash"] != condition["hash"]:
            lines = _differences(before["settings"], condition["settings"])
            differences += [f"{condition['name']}: {line}" for line in lines]
    for condition in new["conditions"]:
        if (alike := same_file(condition["name"], existing)) is not None:
            differences.append(
                f"condition {condition['name']!r} would share files with the existing condition {alike!r}; "
                "give it another name"
            )
    if existing:
        # conditions that this study lacks may stay in its own folder, but not in that of another study
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
                    _ways_out(folder),
                ]
            )
        )


def _with_results(folder: ResultsFolder) -> dict[str, dict[str, Any]]:
    """Return the conditions of a folder by name; without a ledger, only those that have results."""
    conditions = {condition["name"]: condition for condition in folder.description["conditions"]}
    if (folder.path / LEDGER_NAME).exists():
        return conditions
    computed = {name.condition for name, _ in folder.files()}
    return {name: condition for name, condition in conditions.items() if name in computed}


def _ways_out(folder: ResultsFolder) -> str:
    if (folder.path / LEDGER_NAME).exists():
        return "Use another folder (--out DIR); this one holds trials of a robot, which are never deleted."
    return "Use another folder (--out DIR), or `realitygap run --fresh` to delete the existing results and restart."


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
    if old == new:
        return []
    if place in ("task.source", "archive.own.source") and isinstance(old, str) and isinstance(new, str):
        return [f"the text of the Python file has SHA-256 {source_hash(old)} there, {source_hash(new)} here"]
    return [f"{place} is {old!r} there, {new!r} here"]


class _Counter:
    """Counts runs and tells of them."""

    def __init__(self, n_runs: int, n_done: int, tell: Callable[[Progress], None] | None) -> None:
        self.n_runs = n_runs
        self._n_before = n_done
        self._tell = tell
        self._since = time.perf_counter()
        self._waiting_for = ""
        self.n_computed = 0
        self.seconds = 0.0
        self.add(0)

    def begin(self) -> None:
        """Computing begins now."""
        self._since = time.perf_counter()

    def add(self, n_runs: int) -> None:
        self.n_computed += n_runs
        self.seconds = time.perf_counter() - self._since
        self._tell_now()

    def wait_for(self, what: str) -> None:
        if what != self._waiting_for:
            self._waiting_for = what
            self._tell_now()

    def _tell_now(self) -> None:
        if self._tell is not None:
            n_done = self._n_before + self.n_computed
            self._tell(Progress(n_done, self.n_runs, self.n_computed, self.seconds, self._waiting_for))


def _chunks(study: Study, missing: dict[str, list[range]], chunk: int | None) -> Iterator[ChunkTask]:
    """Yield the chunks to compute."""
    for condition in study.conditions:
        if condition.is_physical:
            continue
        size = chunk or _chunk_size(condition, study.about.replicates)
        for gap in missing[condition.name]:
            for first in range(gap.start, gap.stop, size):
                yield ChunkTask(condition, first, min(size, gap.stop - first))


def _chunk_size(condition: Condition, replicates: int) -> int:
    if condition.on.is_slow:
        return 1
    steps = condition.neat.generations * condition.neat.population * condition.on.steps
    by_time = CHUNK_STEPS // steps
    by_progress = -(-replicates // CHUNKS_PER_CONDITION)
    return max(1, min(by_time, by_progress, LARGEST_CHUNK))
