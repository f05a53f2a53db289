"""How fast studies are on this machine."""

from __future__ import annotations

import platform
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
import polars

from realitygap._version import __version__
from realitygap.evolution import Population, random_key
from realitygap.records import ResultsFolder
from realitygap.runs import Condition, run_replicates, run_rows
from realitygap.trials import NoiseKey, try_genomes

from ._executors import usable_processors
from ._file import load_study
from ._run import machine_facts

# So many that the start of a call does not count, as in a study of thousands of replicates.
TRIALS_PER_CALL = 12_800
RUNS_PER_CALL = 1_000
MOST_SECONDS = 3600


def measure_speed(seconds: float = 2.0) -> dict[str, Any]:
    """Robot-steps and paper runs a second on this machine.

    Args:
        seconds: How long each figure is measured, after everything is compiled.

    Returns:
        `robot_steps_per_second`, `paper_runs_per_second` (coverage at 50 % noise, NEAT included) and
        `paper_runs_recorded_per_second` (their rows written as well), each with `per_core` and `all_cores`;
        `machine` and `versions`. A robot-step holds its noise and its line coverage; its networks have no
        hidden node.

    Raises:
        ValueError: `seconds` is not more than 0 and at most 3600.
    """
    if not 0 < seconds <= MOST_SECONDS:
        raise ValueError(f"seconds is {seconds}, expected more than 0 and at most {MOST_SECONDS}.")
    study = load_study("paper")
    condition = next(item for item in study.conditions if item.name == "coverage-50")
    with tempfile.TemporaryDirectory() as temporary:
        folder = ResultsFolder.create(Path(temporary) / "bench", study.description())
        with folder.locked():
            return {
                "robot_steps_per_second": _rates(_trial_work(condition), seconds),
                "paper_runs_per_second": _rates(_run_work(condition), seconds),
                "paper_runs_recorded_per_second": _rates(_recorded_work(condition, folder), seconds),
                "machine": machine_facts(),
                "versions": {
                    "realitygap": __version__,
                    "python": platform.python_version(),
                    "numpy": np.__version__,
                    "numba": numba.__version__,
                    "llvmlite": llvmlite.__version__,
                    "polars": polars.__version__,
                },
            }


def _rates(work: Callable[[int], int], seconds: float) -> dict[str, float]:
    """How much work is done a second, on one thread and on all; `work` gets the number of its call."""
    work(0)
    threads = usable_processors()
    return {"per_core": _rate(work, 1, seconds), "all_cores": _rate(work, threads, seconds)}


def _rate(work: Callable[[int], int], threads: int, seconds: float) -> float:
    since = time.perf_counter()
    until = since + seconds

    def go_on(thread: int) -> int:
        done = 0
        call = 1 + thread
        while time.perf_counter() < until:
            done += work(call)
            call += threads
        return done

    with ThreadPoolExecutor(threads) as pool:
        done = sum(pool.map(go_on, range(threads)))
    return done / (time.perf_counter() - since)


def _trial_work(condition: Condition) -> Callable[[int], int]:
    settings = condition.neat.model_copy(update={"population": TRIALS_PER_CALL})
    genomes = Population(3, 2, settings, seed=condition.seed, bias=False).ask()
    arena = condition.arena.arena()

    def work(call: int) -> int:
        noise_key = NoiseKey(random_key(condition.seed), replicate=call)
        try_genomes(condition.jyro, arena, genomes, noise=condition.noise, noise_key=noise_key)
        return len(genomes) * condition.jyro.steps

    return work


def _run_work(condition: Condition) -> Callable[[int], int]:
    def work(call: int) -> int:
        run_rows(condition, call * RUNS_PER_CALL, RUNS_PER_CALL)
        return RUNS_PER_CALL

    return work


def _recorded_work(condition: Condition, folder: ResultsFolder) -> Callable[[int], int]:
    # Both measurements, on one thread and on all, publish into one folder: each call needs runs of its own.
    next_first = iter(range(0, 2**31, RUNS_PER_CALL))

    def work(call: int) -> int:
        first = next(next_first)
        frame = run_replicates(condition, first, RUNS_PER_CALL)
        folder.publish(condition.name, first, frame, condition.hash())
        return RUNS_PER_CALL

    return work
