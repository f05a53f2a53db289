"""The commands of the study: run and write."""

from __future__ import annotations

import argparse
import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from . import __doc__ as usage
from .page import write_page
from .plan import PLANS, adopt_plan, small
from .sitting import SittingOfStudy


def main() -> None:
    """Carry out one of the commands."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.closing_thymio",
        description=usage,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run", help="compute all units that are missing")
    run.add_argument("folder", type=Path)
    run.add_argument("--plan", choices=PLANS, default="thymio")
    run.add_argument("--small", action="store_true", help="a small plan, which shows no result")
    run.add_argument("--families", help="robots, separated by commas; default: all in the plan")
    run.add_argument("--processes", type=int, default=multiprocessing.cpu_count())
    write = commands.add_parser("write", help="write the data of the page")
    write.add_argument("folder", type=Path, nargs="?", help="results; default: the stored summary")
    write.add_argument("--playground", action="store_true", help="results of the plan playground")
    options = parser.parse_args()
    if getattr(options, "processes", 1) < 1:
        parser.error(f"--processes is {options.processes}, expected 1 or more.")
    if options.command == "write":
        write_page(options.folder, is_of_playground=options.playground)
        return
    plan = small(PLANS[options.plan]) if options.small else PLANS[options.plan]
    families = plan.families if options.families is None else options.families.split(",")
    if unknown := set(families) - set(plan.families):
        parser.error(
            f"--families has {', '.join(sorted(unknown))}, expected some of {', '.join(plan.families)}"
        )
    adopt_plan(options.folder, plan)
    sittings = [
        SittingOfStudy(plan, each, options.folder) for each in plan.sittings if each.family in families
    ]
    left = [each for each in sittings if each.missing]
    print(f"{len(left)} of {len(sittings)} sittings are not done.", flush=True)
    since = time.perf_counter()
    with ProcessPoolExecutor(options.processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        jobs = {pool.submit(each.carry_out): each.sitting for each in left}
        try:
            for k, job in enumerate(as_completed(jobs), start=1):
                job.result()
                print(f"{k} of {len(left)}: {jobs[job]}, {time.perf_counter() - since:.0f} s", flush=True)
        except BaseException:  # else Ctrl-C would wait for all other jobs
            for child in multiprocessing.active_children():
                child.terminate()
            raise


if __name__ == "__main__":
    main()
