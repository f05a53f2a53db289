"""The time that a study will take on this machine."""

from __future__ import annotations

import statistics
import time
from concurrent.futures import ThreadPoolExecutor

from realitygap._process import usable_processors
from realitygap.runs import Condition, prepare_kernels, run_replicates

from ._code import python_functions
from ._study import Study

LEAST_S = 0.1
"""Shortest time for which runs of a condition are measured [s]: a call has costs of its own."""
LONG_S = 1.0
"""A run of this length [s] is measured alone: its first call costs little beside it."""
MOST_S = 3.0
"""Time after which no other condition is measured [s]; the others count as the mean of those measured."""


def estimate_seconds(study: Study) -> float | None:
    """Estimate the computing time of the simulated runs of a study on all cores [s].

    Some runs of each condition are computed, and nothing is written. Kernels that are not compiled yet are compiled;
    this does not count.

    Returns:
        Time [s]; None for a study without simulated conditions, with Python files of tasks, or on a platform each of
        whose runs takes long, such as twins in MuJoCo.
    """
    conditions = [each for each in study.conditions if not each.is_physical]
    if not conditions or python_functions(study) or any(each.on.is_slow for each in conditions):
        return None
    replicates = study.about.replicates
    prepare_kernels(conditions)
    began, costs = time.perf_counter(), []
    cores = usable_processors()
    with ThreadPoolExecutor(cores) as pool:
        for condition in conditions:
            costs.append(_seconds_per_run(condition, replicates, pool, cores))
            if time.perf_counter() - began > MOST_S:
                break
    return statistics.fmean(costs) * len(conditions) * replicates


def _seconds_per_run(condition: Condition, replicates: int, pool: ThreadPoolExecutor, cores: int) -> float:
    """Return the time per run while all cores compute runs of this condition [s]."""
    began = time.perf_counter()
    run_replicates(condition, 0, 1)  # the first loads what the others find
    if (seconds := time.perf_counter() - began) >= LONG_S:
        return seconds / cores
    n_runs = 1
    while True:
        # The shorter of two times: another program may take a core for a moment.
        seconds = min(_seconds(condition, n_runs, pool, cores) for _ in range(2))
        if seconds >= LEAST_S or n_runs * cores >= replicates:
            return seconds / (n_runs * cores)
        n_runs *= 2


def _seconds(condition: Condition, n_runs: int, pool: ThreadPoolExecutor, cores: int) -> float:
    began = time.perf_counter()
    for future in [pool.submit(run_replicates, condition, 0, n_runs) for _ in range(cores)]:
        future.result()
    return time.perf_counter() - began
