"""Measure start-up, reports, memory and a calibration, each in a process of its own.

    python benchmarks/memory_and_start.py [--only NAME ...] [--replicates N ...] [--json]

Each command runs once before it is measured, so that kernels are compiled and Python's byte code is on the disk. Times
are seconds of processor time, of the command and of the processes that it started: the least of the repeats. Peak
memory of `run paper` is that of its process; of `calibrate all` it is the largest sum over all of its processes.

Example: python benchmarks/memory_and_start.py --only start report
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from environments import machine

COMMAND = (sys.executable, "-m", "realitygap")
REPEATS = 5
REPORT_REPEATS = 3
REPORTS = (100, 1000)  # replicates of each of the nine conditions of `paper`
MEMORY = (10_000, 50_000)
POLL_S = 0.05
MB = 1024 * 1024


class Usage(NamedTuple):
    """What a command used."""

    processor_s: float
    wall_s: float
    peak_mb: float  # largest sum over its processes, as seen every `POLL_S`


def run(command: Sequence[str]) -> Usage:
    """Run a command to its end, and raise an error if it fails."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before, since, peak = _children_s(), time.perf_counter(), 0
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environment)
    while process.poll() is None:
        peak = max(peak, sum(_memory(pid) for pid in _family(process.pid)))
        time.sleep(POLL_S)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} failed with status {process.returncode}.")
    return Usage(_children_s() - before, time.perf_counter() - since, peak / MB)


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _family(pid: int) -> list[int]:
    """Return the process and all that descend from it."""
    found = [pid]
    for each in found:
        try:
            tasks = list(Path(f"/proc/{each}/task").iterdir())
            found += [int(child) for task in tasks for child in (task / "children").read_text().split()]
        except OSError:  # it has ended
            continue
    return found


def _memory(pid: int) -> int:
    """Return the memory of a process [bytes]; pages that several processes share count in parts."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(1024 * int(line.split()[1]) for line in lines if line.startswith("Pss:"))


def _least(command: Sequence[str], repeats: int) -> float:
    run(command)
    return min(run(command).processor_s for _ in range(repeats))


def measure_start() -> dict[str, Any]:
    """Measure an empty Python, the import and the help [s]."""
    commands = {
        "python": (sys.executable, "-c", "pass"),
        "import realitygap": (sys.executable, "-c", "import realitygap"),
        "realitygap --help": (*COMMAND, "--help"),
    }
    return {name: {"processor_s": _least(command, REPEATS)} for name, command in commands.items()}


def measure_reports(folder: Path) -> dict[str, Any]:
    """Measure reports of 900 and 9,000 runs [s]."""
    answer = {}
    for replicates in REPORTS:
        results = str(folder / f"report-{replicates}")
        run((*COMMAND, "run", "paper", "--replicates", str(replicates), "--out", results))
        seconds = _least((*COMMAND, "report", results), REPORT_REPEATS)
        answer[f"report of {9 * replicates} runs"] = {"processor_s": seconds}
    return answer


def measure_memory(folder: Path, replicates: Sequence[int]) -> dict[str, Any]:
    """Measure the peak memory of `run paper` [MB], which is to stay the same with any number of replicates."""
    answer = {}
    run((*COMMAND, "run", "paper", "--replicates", "10", "--out", str(folder / "compiled")))
    for n in replicates:
        results = str(folder / f"memory-{n}")
        answer[f"run paper --replicates {n}"] = run(
            (*COMMAND, "run", "paper", "--replicates", str(n), "--out", results)
        )._asdict()
    return answer


def measure_calibration(folder: Path) -> dict[str, Any]:
    """Measure `calibrate all` of 20 trials of a twin under a camera: time and the memory of all processes."""
    twin = str(folder / "worn.toml")
    run((*COMMAND, "twin", "sample", "--family", "worn", "--seed", "1", "-o", twin))

    def command(name: str, budget: int) -> tuple[str, ...]:
        options = ("--observe", "track", "--budget", str(budget), "-o", str(folder / f"{name}.toml"))
        return (*COMMAND, "calibrate", "all", "--robot", f"twin:{twin}", *options)

    run(command("compiled", 2))
    return {"calibrate all --observe track --budget 20": run(command("fit", 20))._asdict()}


def main() -> None:
    """Measure and print."""
    names = ("start", "report", "memory", "calibration")
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "--only", nargs="+", choices=names, default=names, metavar="NAME", help=", ".join(names)
    )
    parser.add_argument(
        "--replicates",
        nargs="+",
        type=int,
        default=MEMORY,
        metavar="N",
        help="of the runs whose memory is measured",
    )
    parser.add_argument("--json", action="store_true", help="print data instead of a table")
    options = parser.parse_args()
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        parts: dict[str, Callable[[], dict[str, Any]]] = {
            "start": measure_start,
            "report": lambda: measure_reports(folder),
            "memory": lambda: measure_memory(folder, options.replicates),
            "calibration": lambda: measure_calibration(folder),
        }
        for name in options.only:
            print(f"{name} ...", file=sys.stderr)
            figures |= parts[name]()
    if options.json:
        print(json.dumps({"figures": figures, "machine": machine()}, indent=2))
        return
    for name, used in figures.items():
        memory = f"  {used['peak_mb']:6.0f} MB at most" if "peak_mb" in used else ""
        wall = f"  {used['wall_s']:6.1f} s by the clock" if "wall_s" in used else ""
        print(f"{name:42} {used['processor_s']:8.2f} s of processor time{wall}{memory}")


if __name__ == "__main__":
    main()
