"""Novelty and objective in Lehman & Stanley's mazes, from many seeds, with the published results."""

from __future__ import annotations

import statistics
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from realitygap._process import usable_processors
from realitygap.errors import StudyError, did_you_mean, whole_number
from realitygap.evolution import NeatSettings
from realitygap.runs import MAZE_REWARDS, MazeRun, MazeTrials, run_maze
from realitygap.tasks import MAZE_TASKS, MazeTask
from realitygap.world import load_arena

from ._run import Progress
from ._task import checked_settings, run_in_threads

MAZE_SEEDS = 40
"""Runs of each reward, as published."""


def measure_maze(
    task: str,
    settings: str = "default",
    *,
    seeds: int = MAZE_SEEDS,
    seed: int = 1,
    changes: Mapping[str, Any] | None = None,
    threads: int | None = None,
    tell: Callable[[Progress], None] | None = None,
) -> dict[str, Any]:
    """Count the evaluations that NEAT needs for a maze, rewarded for novelty and for nearness to the exit.

    An evaluation is one network tried once; a run counts them up to and with the first network that reaches the
    exit. A run in which none does counts as the limit, generations times population. Replicate k has the same
    first networks under both rewards. The results do not depend on the threads.

    Args:
        task: 'maze-medium' or 'maze-hard'.
        settings: A named set of NEAT's settings; population and generations are the task's.
        seeds: Number of runs of each reward, 1 to 2**32.
        seed: Seed of the random numbers of all runs, 0 to 2**63 - 1.
        changes: Settings by name that replace those of the set and the task.
        threads: Number of runs in parallel. Default: the number of processors.
        tell: Called with the progress after each run.

    Returns:
        `task`, `settings`, `limit` (evaluations), `source` and, by reward, `novelty` and `objective`. These have
        `seeds`, `solved` (runs), `mean_evaluations`, `median_evaluations`, `sd_evaluations` (None for a single run),
        `evaluations` (one of each run, None if it is unsolved) and `published`, the same values from the source, as
        far as they are given.

    Raises:
        StudyError: No such task or set, or a setting that cannot be.
        TypeError: A count or the seed is not a whole number.
        ValueError: One of them is out of its range.
    """
    seeds = whole_number("seeds", seeds, 1, 2**32)
    seed = whole_number("seed", seed, 0, 2**63 - 1)
    threads = usable_processors() if threads is None else whole_number("threads", threads, 1)
    if task not in MAZE_TASKS:
        raise StudyError(f"Unknown maze {task!r}. {did_you_mean(task, MAZE_TASKS)}")
    maze = MAZE_TASKS[task]
    chosen = checked_settings(settings, maze.settings, changes)
    limit = chosen.population * chosen.generations
    runs = _run_all(maze, chosen, seeds, seed, threads, tell)
    changed = "".join(f" {name}={value}" for name, value in (changes or {}).items())
    return {
        "task": task,
        "settings": settings + changed,
        "limit": limit,
        **{
            reward: {
                **summarize_maze_runs(runs[k * seeds : (k + 1) * seeds], limit),
                "published": dict(maze.published[reward]),
            }
            for k, reward in enumerate(MAZE_REWARDS)
        },
        "source": maze.source,
    }


def summarize_maze_runs(runs: Sequence[MazeRun], limit: int) -> dict[str, Any]:
    """Return the figures of runs of one reward, an unsolved one counted as the limit."""
    evaluations = [run.evaluations if run.solved else limit for run in runs]
    return {
        "solved": sum(run.solved for run in runs),
        "seeds": len(runs),
        "mean_evaluations": statistics.fmean(evaluations),
        "median_evaluations": statistics.median(evaluations),
        "sd_evaluations": statistics.stdev(evaluations) if len(evaluations) > 1 else None,
        "evaluations": [run.evaluations if run.solved else None for run in runs],
    }


def _run_all(
    maze: MazeTask,
    settings: NeatSettings,
    seeds: int,
    seed: int,
    threads: int,
    tell: Callable[[Progress], None] | None,
) -> list[MazeRun]:
    """Return all runs, those for novelty first, on threads."""
    trials, over = MazeTrials(load_arena(maze.name)), threading.Event()

    def compile_kernels() -> None:
        small = settings.model_copy(update={"population": 2, "generations": 2})
        for reward in MAZE_REWARDS:
            run_maze(maze, trials, reward, small, seed, 0)

    def run(k: int) -> MazeRun:
        reward, replicate = MAZE_REWARDS[k // seeds], k % seeds
        return run_maze(maze, trials, reward, settings, seed, replicate, go_on=lambda: not over.is_set())

    return run_in_threads(run, len(MAZE_REWARDS) * seeds, threads, tell, compile_kernels, over.set)
