"""Processor seconds of first commands, from an empty cache of kernels; `--json` prints data.

Each command runs in a process of its own, twice: with what it has to compile, and with everything compiled. The data
name the commit of the package's sources.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from reference import loop_seconds

COMMANDS = {
    "run paper": "run paper --replicates 10 --out {out}/paper",
    "sim study": "run sim-paper --replicates 1 --out {out}/sim",
    "gap sim jyro": "gap sim jyro --n-controllers 10 --trials 5",
    "calibrate all": "calibrate all --robot sim --observe track --budget 8 -o {out}/fit.toml",
}

# Everything that the commands import.
IMPORTS = """
import numba, polars, pydantic, scipy.optimize, scipy.stats
from realitygap import calibration, cli, evolution, gap, records, report, robots, runs, study, tasks, trials, world
from realitygap.cli import _calibrate, _gap, _study
from numba.core.registry import cpu_target
cpu_target.target_context.refresh()
import numba.np.npyimpl, numba.np.ufunc, numba.cpython.mathimpl, numba.np.random.generator_core
"""


def _processor_seconds(command: str, out: Path, environment: dict[str, str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    out.mkdir(parents=True)
    subprocess.run(
        [sys.executable, "-m", "realitygap", *command.format(out=out).split()],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(names: list[str], source: Path | None) -> dict[str, dict[str, float]]:
    """Measure commands in their order, each on what those before it compiled.

    Args:
        names: Of `COMMANDS`.
        source: Folder that holds another version of the package; None: the one that is installed.

    Returns:
        For each command `first_s` and `again_s` [s of processor], and `first` and `again` in reference loops,
        which are measured around each command.
    """
    results = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        environment = {
            **os.environ,
            "REALITYGAP_CACHE": str(folder / "kernels"),
            "REALITYGAP_STATE": str(folder / "state"),
            "PYTHONPYCACHEPREFIX": str(folder / "bytecode"),
            "PYTHONDONTWRITEBYTECODE": "",
        }
        if source is not None:
            environment["PYTHONPATH"] = str(source)
        # Installers compile Python's own sources.
        command = [sys.executable, "-c", IMPORTS]
        subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=True)
        for name in names:
            loops = [loop_seconds()]
            first = _processor_seconds(
                COMMANDS[name], folder / f"{name.replace(' ', '-')}-first", environment
            )
            loops.append(loop_seconds())
            again = _processor_seconds(
                COMMANDS[name], folder / f"{name.replace(' ', '-')}-again", environment
            )
            loops.append(loop_seconds())
            results[name] = {
                "first_s": first,
                "first": first / ((loops[0] + loops[1]) / 2),
                "again_s": again,
                "again": again / ((loops[1] + loops[2]) / 2),
            }
    return results


def commit_of(source: Path) -> str:
    """Return the commit of a folder in a Git checkout, with "-dirty" if its files differ from the commit."""
    command = ["git", "-C", str(source), "describe", "--always", "--dirty", "--exclude=*"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=list(COMMANDS), nargs="+", default=list(COMMANDS))
    parser.add_argument("--source", type=Path, help="Folder that holds another version of the package.")
    parser.add_argument("--json", action="store_true", help="Print data.")
    arguments = parser.parse_args()
    results = measure(arguments.only, arguments.source)
    commit = commit_of(arguments.source or Path(__file__).parent)
    if arguments.json:
        print(json.dumps({"commit": commit, **results}, indent=2))
        return
    print(f"commit {commit}")
    print(f"{'command':16}{'first [s]':>12}{'[loops]':>10}{'again [s]':>12}{'[loops]':>10}")
    for name, row in results.items():
        print(
            f"{name:16}{row['first_s']:12.1f}{row['first']:10.1f}{row['again_s']:12.1f}{row['again']:10.1f}"
        )


if __name__ == "__main__":
    main()
