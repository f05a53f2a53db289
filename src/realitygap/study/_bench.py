"""The speed of studies on this machine."""

from __future__ import annotations

import platform
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, cast

import llvmlite
import numba
import numpy as np
import polars

from realitygap._process import usable_processors
from realitygap._version import __version__
from realitygap.evolution import Population, decode_all
from realitygap.kernels.jyro.trial import make_block, make_trace, run_trials
from realitygap.kernels.math.peak import peak_flops
from realitygap.platforms import JyroPlatform, jyro_rules, jyro_scene
from realitygap.records import ResultsFolder
from realitygap.runs import Condition, run_replicates, run_rows
from realitygap.trials import NoiseKey, counters_of

from ._file import load_study
from ._run import machine_facts

# So many that the start of a call does not count, as in a study of thousands of replicates.
TRIALS_PER_CALL = 12_800
RUNS_PER_CALL = 1_000
MOST_SECONDS = 3600


def measure_speed(seconds: float = 2.0) -> dict[str, Any]:
    """Return robot-steps and paper runs a second on this machine.

    Args:
        seconds: Measuring time of each figure [s], after everything is compiled.

    Returns:
        Rates, each `per_core` and on `all_cores`: `robot_steps_per_second` of networks without hidden nodes and
        `robot_steps_two_hidden_per_second` of networks with two (noise and both counts of cells are part of a
        step); `paper_runs_per_second` (coverage at 50 % noise, NEAT included),
        `paper_runs_novelty_per_second`, and `paper_runs_recorded_per_second` (of coverage, their rows written as
        well). `neat_share`: the part of the time of a paper run, one core, that its trials do not take.
        `peak_gflops`: fused multiply-adds of one core in single precision, each two operations, in 10^9 a second.
        `robot_steps_per_gflop`: robot-steps of one core for 10^9 operations of that peak, both in time of the thread:
        machines of different speed can be compared by it. `machine` and `versions`.

    Raises:
        ValueError: `seconds` is not more than 0 and at most 3600.
    """
    check_seconds(seconds)
    study = load_study("paper")
    coverage, novelty = (
        next(item for item in study.conditions if item.name == name) for name in ("coverage-50", "novelty-50")
    )
    with tempfile.TemporaryDirectory() as temporary:
        folder = ResultsFolder.create(Path(temporary) / "bench", study.description())
        with folder.locked():
            runs = _rates(_run_work(coverage), seconds)
            peak_gflops = peak_flops() / 1e9
            return {
                "robot_steps_per_second": _rates(_trial_work(coverage, 0), seconds),
                "robot_steps_two_hidden_per_second": _rates(_trial_work(coverage, 2), seconds),
                "paper_runs_per_second": runs,
                "paper_runs_novelty_per_second": _rates(_run_work(novelty), seconds),
                "paper_runs_recorded_per_second": _rates(_recorded_work(coverage, folder), seconds),
                "neat_share": _share_without_trials(coverage, runs["per_core"], seconds),
                "peak_gflops": peak_gflops,
                "robot_steps_per_gflop": fastest_rate(_trial_work(coverage, 0), seconds) / peak_gflops,
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


def check_seconds(seconds: float) -> None:
    """Raise an error if a measuring time is out of range.

    Raises:
        ValueError: `seconds` is not more than 0 and at most 3600.
    """
    if not 0 < seconds <= MOST_SECONDS:
        raise ValueError(f"seconds is {seconds}, expected more than 0 and at most {MOST_SECONDS}.")


def _share_without_trials(condition: Condition, rate: float, seconds: float) -> float:
    """Return the share of a run's time without its trials, from runs whose trials last one step."""
    steps = condition.on.steps
    short = condition.model_copy(update={"on": condition.on.model_copy(update={"steps": 1})})
    work = _run_work(short)
    work(0)
    whole, least = 1 / rate, 1 / _rate(work, 1, seconds)
    return 1 - (whole - least) * steps / (steps - 1) / whole


def _rates(work: Callable[[int], int], seconds: float) -> dict[str, float]:
    """Return the work per second, on one thread and on all; `work` gets the number of its call."""
    work(0)
    threads = usable_processors()
    return {"per_core": _rate(work, 1, seconds), "all_cores": _rate(work, threads, seconds)}


def _rate(work: Callable[[int], int], threads: int, seconds: float) -> float:
    since = time.perf_counter()
    until = since + seconds

    def go_on(thread: int) -> int:
        done = 0
        call = 1 + thread
        while not done or time.perf_counter() < until:  # a thread may begin late
            done += work(call)
            call += threads
        return done

    with ThreadPoolExecutor(threads) as pool:
        done = sum(pool.map(go_on, range(threads)))
    return done / (time.perf_counter() - since)


def fastest_rate(work: Callable[[int], int], seconds: float) -> float:
    """Return the work a second of the fastest call, in time of the thread, which other programs hardly change."""
    work(0)
    until, fastest, call = time.perf_counter() + seconds, 0.0, 1
    while time.perf_counter() < until or not fastest:
        since = time.thread_time()
        done = work(call)
        fastest = max(fastest, done / (time.thread_time() - since))
        call += 1
    return fastest


def _trial_work(condition: Condition, n_hidden: int) -> Callable[[int], int]:
    """Return trials by the kernel alone, of networks that are decoded already."""
    changes = {"population": TRIALS_PER_CALL, "start_hidden": n_hidden}
    settings = condition.neat.model_copy(update=changes)
    genomes = Population(3, 2, settings, seed=condition.seed, bias=False).ask()
    networks, neat = decode_all(genomes), genomes[0].rules
    platform = cast("JyroPlatform", condition.on)
    scene = jyro_scene(platform, condition.arena.arena())
    rules = jyro_rules(platform, noise=condition.noise, bias_input=False, bias_value=1.0)
    rows = np.arange(TRIALS_PER_CALL, dtype=np.int32)
    nothing = make_trace(scene.heading, scene.sensors.shape[0], neat.n_inputs, -1, 1)
    no_ends = np.zeros((0, scene.columns * scene.rows), np.uint8)

    def work(call: int) -> int:
        cells = np.zeros((TRIALS_PER_CALL, scene.columns * scene.rows), np.uint8)
        counts = np.zeros((TRIALS_PER_CALL, 3), np.int32)
        ended = np.zeros((TRIALS_PER_CALL, 2))
        lanes, wiring = make_block(scene, neat, networks.place.shape[1])
        counters = counters_of(NoiseKey(0, replicate=call), TRIALS_PER_CALL)
        key = np.uint64(condition.key)
        run_trials(
            scene,
            rules,
            neat,
            networks,
            rows,
            key,
            counters,
            lanes,
            wiring,
            cells,
            no_ends,
            ended,
            counts,
            nothing,
        )
        return TRIALS_PER_CALL * condition.on.steps

    return work


def _run_work(condition: Condition) -> Callable[[int], int]:
    def work(call: int) -> int:
        run_rows(condition, call * RUNS_PER_CALL, RUNS_PER_CALL)
        return RUNS_PER_CALL

    return work


def _recorded_work(condition: Condition, folder: ResultsFolder) -> Callable[[int], int]:
    # Both measurements, on one thread and on all, publish into one folder: each call needs its own runs.
    next_first = iter(range(0, 2**31, RUNS_PER_CALL))

    def work(call: int) -> int:
        first = next(next_first)
        frame = run_replicates(condition, first, RUNS_PER_CALL)
        folder.publish(condition.name, first, frame, condition.hash())
        return RUNS_PER_CALL

    return work
