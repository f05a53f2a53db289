"""The commands of the study: run, fit, collect, analyze, and draw."""

from __future__ import annotations

import argparse
import importlib.util
import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from . import __doc__ as usage
from .figures import draw
from .outside import METHODS, fit_outside
from .plan import read_plan, small_plan
from .results import collect
from .tables import analyze
from .twin import TwinOfStudy


def main() -> None:
    """Carry out one of the commands."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.closing",
        description=usage,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True)
    for name, summary in (
        ("run", "compute all units that are missing"),
        ("fit", "fit outside calibrators to the trials of all driven twins"),
        ("collect", "write the results of all units as two tables"),
        ("analyze", "write the tables of the page into the folder of the collected results"),
        ("draw", "draw the figures of the page from the folder of the collected results"),
    ):
        command = commands.add_parser(name, help=summary)
        command.add_argument("folder", type=Path)
        command.add_argument("--small", action="store_true", help="the small plan, which shows no result")
        command.add_argument("--processes", type=int, default=multiprocessing.cpu_count())
        if name == "fit":
            command.add_argument("method", choices=sorted(METHODS))
        if name in ("collect", "draw"):
            command.add_argument("--out", type=Path, required=True, help="folder of what is written")
    options = parser.parse_args()
    if options.processes < 1:
        parser.error(f"--processes is {options.processes}, expected 1 or more.")
    plan = small_plan() if options.small else read_plan()
    if options.command == "collect":
        collect(plan, options.folder, options.out)
        return
    if options.command == "analyze":
        if importlib.util.find_spec("statsmodels") is None:
            raise SystemExit(
                "The mixed model needs statsmodels: uv run --with statsmodels,pandas python -m ..."
            )
        analyze(plan, options.folder)
        return
    if options.command == "draw":
        draw(plan, options.folder, options.out)
        return
    for part in ("twins", "units", "fits", "trials"):
        (options.folder / part).mkdir(parents=True, exist_ok=True)
    method = getattr(options, "method", None)
    twins = [TwinOfStudy(plan, twin, options.folder) for twin in plan.names()]
    left = [each for each in twins if (each.missing if method is None else _lacks(each, method))]
    print(f"{len(left)} of {len(twins)} twins are not done.", flush=True)
    since = time.perf_counter()
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.processes, mp_context=context) as pool:
        jobs = {
            pool.submit(*((each.carry_out,) if method is None else (fit_outside, each, method))): each.twin
            for each in left
        }
        try:
            for k, job in enumerate(as_completed(jobs), start=1):
                job.result()
                print(f"{k} of {len(left)}: {jobs[job]}, {time.perf_counter() - since:.0f} s", flush=True)
        except BaseException:  # else Ctrl-C would wait for all other jobs
            for child in multiprocessing.active_children():
                child.terminate()
            raise


def _lacks(twin: TwinOfStudy, method: str) -> bool:
    return twin.trials_path(twin.plan.budget).exists() and not twin.fit_path(twin.plan.arm[method]).exists()


if __name__ == "__main__":
    main()
