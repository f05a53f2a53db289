"""NEAT on a classical task, from many seeds, with the published results."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any, TypeVar

from realitygap._process import usable_processors
from realitygap.errors import StudyError, did_you_mean, whole_number
from realitygap.evolution import NAMED_SETTINGS, NeatSettings
from realitygap.runs import TaskRun, run_task
from realitygap.tasks import CLASSICAL_TASKS, ClassicalTask

from ._problems import Problems
from ._run import Progress

Run = TypeVar("Run")


def measure_task(
    task: str,
    settings: str = "default",
    *,
    seeds: int = 100,
    seed: int = 1,
    changes: Mapping[str, Any] | None = None,
    threads: int | None = None,
    tell: Callable[[Progress], None] | None = None,
) -> dict[str, Any]:
    """Count the evaluations that NEAT needs for a classical task, from many seeds, with the published results.

    An evaluation is one network tried once; a run counts them up to and with the first network that solves the
    task. The results do not depend on the threads.

    Args:
        task: 'xor', 'double-pole' or 'double-pole-no-velocity'.
        settings: A named set of NEAT's settings; population, generations, recurrence and the constant input's
            value are the task's.
        seeds: Number of runs, 1 to 2**32.
        seed: Seed of the random numbers of all runs, 0 to 2**63 - 1.
        changes: Settings by name that replace those of the set and the task.
        threads: Number of runs in parallel. Default: the number of processors.
        tell: Called with the progress after each run.

    Returns:
        `task`, `settings`, `seeds`, `solved` (runs). Over the runs that solved the task: `mean_evaluations`,
        `median_evaluations`, `sd_evaluations`, `worst_evaluations`. Over the networks that solved it: `mean_hidden`,
        `mean_connections` (enabled) and, without velocities, `mean_generalization` (of 625 starts) and
        `sd_generalization`. Values are None if too few runs solved it. `published` has the same values from the
        source, as far as they are given.

    Raises:
        StudyError: No such task or set, or a setting that cannot be.
        TypeError: A count or the seed is not a whole number.
        ValueError: One of them is out of its range.
    """
    seeds = whole_number("seeds", seeds, 1, 2**32)
    seed = whole_number("seed", seed, 0, 2**63 - 1)
    threads = usable_processors() if threads is None else whole_number("threads", threads, 1)
    chosen = task_settings(task, settings, changes)
    runs = _run_all(CLASSICAL_TASKS[task], chosen, seeds, seed, threads, tell)
    changed = "".join(f" {name}={value}" for name, value in (changes or {}).items())
    return summarize_runs(CLASSICAL_TASKS[task], settings + changed, runs)


def task_settings(
    task: str, settings: str = "default", changes: Mapping[str, Any] | None = None
) -> NeatSettings:
    """Return the settings that NEAT has in a classical task: of a named set, of the task, and changed.

    Raises:
        StudyError: No such task or set, or a setting that cannot be.
    """
    if task not in CLASSICAL_TASKS:
        raise StudyError(f"Unknown task {task!r}. {did_you_mean(task, CLASSICAL_TASKS)}")
    own = CLASSICAL_TASKS[task].settings
    if settings == "stanley-2002":
        own = {**own, **CLASSICAL_TASKS[task].published_settings}
    return checked_settings(settings, own, changes)


def checked_settings(
    settings: str, own: Mapping[str, Any], changes: Mapping[str, Any] | None
) -> NeatSettings:
    """Return NEAT's settings of a named set, of a task, and changed.

    Raises:
        StudyError: No such set, or a setting that cannot be.
    """
    if settings not in NAMED_SETTINGS:
        raise StudyError(f"Unknown NEAT settings {settings!r}. {did_you_mean(settings, NAMED_SETTINGS)}")
    if "settings" in (changes or {}):
        raise StudyError(f"The set is {settings!r} already; name another one in its place (--settings).")
    problems = Problems()
    checked = problems.check(NeatSettings, {**NAMED_SETTINGS[settings], **own, **(changes or {})}, "")
    if checked is None:
        raise StudyError("These settings cannot be:\n  " + "\n  ".join(problems.lines))
    return checked


def summarize_runs(task: ClassicalTask, settings: str, runs: Sequence[TaskRun]) -> dict[str, Any]:
    """Return the figures of `measure_task` for these runs."""
    solvers = [run for run in runs if run.solved]
    evaluations = [run.evaluations for run in solvers]
    figures: dict[str, Any] = {
        "task": task.name,
        "settings": settings,
        "seeds": len(runs),
        "solved": len(solvers),
        "mean_evaluations": _mean(evaluations),
        "median_evaluations": statistics.median(evaluations) if evaluations else None,
        "sd_evaluations": _deviation(evaluations),
        "worst_evaluations": max(evaluations, default=None),
        "mean_hidden": _mean([run.n_hidden for run in solvers]),
        "mean_connections": _mean([run.n_connections for run in solvers]),
    }
    if "mean_generalization" in task.published:
        passed = [run.generalization for run in solvers]
        figures["mean_generalization"] = _mean(passed)
        figures["sd_generalization"] = _deviation(passed)
    figures["published"] = {**task.published, "source": task.source}
    return figures


def _mean(values: Sequence[int]) -> float | None:
    return statistics.fmean(values) if values else None


def _deviation(values: Sequence[int]) -> float | None:
    return statistics.stdev(values) if len(values) > 1 else None


def _run_all(
    task: ClassicalTask,
    settings: NeatSettings,
    seeds: int,
    seed: int,
    threads: int,
    tell: Callable[[Progress], None] | None,
) -> list[TaskRun]:
    """Return all runs, on threads, in the order of their replicates."""

    def compile_kernels() -> None:
        run_task(task, settings.model_copy(update={"population": 2, "generations": 1}), seed, 0)

    return run_in_threads(
        lambda replicate: run_task(task, settings, seed, replicate), seeds, threads, tell, compile_kernels
    )


def run_in_threads(
    run: Callable[[int], Run],
    n_runs: int,
    threads: int,
    tell: Callable[[Progress], None] | None,
    begin: Callable[[], None],
    stop: Callable[[], None] = lambda: None,
) -> list[Run]:
    """Compute runs 0 to n_runs - 1 on threads and return them in order; an error in one ends all.

    Args:
        run: Computes the run of a number.
        n_runs: Number of runs.
        threads: Number of runs in parallel.
        tell: Called with the progress.
        begin: Called before the time is taken, such as to compile the kernels.
        stop: Called when an error or Ctrl-C ends the others.
    """
    tell = tell or (lambda _: None)
    tell(Progress(0, n_runs, 0, 0.0))
    begin()
    since = time.perf_counter()
    with ThreadPoolExecutor(threads, thread_name_prefix="run") as pool:
        futures = [pool.submit(run, number) for number in range(n_runs)]
        left = set(futures)
        try:
            while left:
                # The time-out lets Ctrl-C through on every system.
                done, left = wait(left, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in done:
                    future.result()
                if done:
                    n_done = n_runs - len(left)
                    tell(Progress(n_done, n_runs, n_done, time.perf_counter() - since))
        except BaseException:
            stop()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [future.result() for future in futures]
