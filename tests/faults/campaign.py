"""Campaigns of faults in batches: one seed, one new process, and one line of JSON each."""

from __future__ import annotations

import datetime
import json
import multiprocessing
import platform
import tempfile
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from realitygap import __version__

EXAMPLES = 5
"""Failures that a line quotes."""
LONGEST_EXAMPLE = 1500


class Kind(NamedTuple):
    """A kind of fault: its module, the numbers of faults for a release and in a batch, and the killed command."""

    module: str
    n: int
    batch: int
    command: str = ""


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "interrupts": Kind("interrupts", 64, 8),
        "simulated-kills": Kind("simulated_kills", 1000, 50),
        "physical-kills": Kind("physical_kills", 200, 20),
        "gap-kills": Kind("trial_kills", 200, 20, "gap"),
        "calibrate-kills": Kind("trial_kills", 200, 20, "calibrate"),
        "transfer-kills": Kind("trial_kills", 200, 20, "transfer"),
        "try-kills": Kind("trial_kills", 200, 20, "try"),
        "wire": Kind("wire", 10_000, 500),
        "cluster": Kind("cluster_kills", 20, 4),
        "full-disk": Kind("full_disk", 600, 30),
        "mutations": Kind("mutations", 100_000, 5000),
    }
)


def strike(kind: str, seed: int, n: int) -> list[str]:
    """Inject n faults of a kind in this process; return what did not hold after each, empty if everything did."""
    command = [KINDS[kind].command] if KINDS[kind].command else []
    inject = import_module(f"tests.faults.{KINDS[kind].module}").inject
    with tempfile.TemporaryDirectory(prefix="faults-") as folder:
        problems: list[str] = []
        for problem in inject(seed, n, Path(folder), *command):
            problems.append(problem)
            if len(problems) >= n:
                break
        return problems


def strike_apart(kind: str, seed: int, n: int) -> list[str]:
    """Return what `strike` does in a new process, which has no threads that a fork would lose."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        return pool.submit(strike, kind, seed, n).result()


def run_campaign(kind: str, n: int | None = None, out: Path | None = None, batch: int | None = None) -> int:
    """Inject faults in batches until the file has n of them; print each batch; return the number of failures.

    Args:
        kind: Name in `KINDS`.
        n: Number of faults; default: as many as a release needs.
        out: File of lines of JSON, one per batch. Batches that it has are not repeated.
        batch: Faults in a batch.
    """
    n = n or KINDS[kind].n
    before = [line for line in read_lines(out) if line["kind"] == kind]
    seed, done = len(before), sum(line["n"] for line in before)
    n_failures = sum(line["failures"] for line in before)
    while done < n:
        begun = time.monotonic()
        problems = strike_apart(kind, seed, min(batch or KINDS[kind].batch, n - done))
        failed = [problem[-LONGEST_EXAMPLE:] for problem in problems if problem]
        line = {
            "kind": kind, "seed": seed, "n": len(problems), "failures": len(failed), "examples": failed[:EXAMPLES],
            "seconds": round(time.monotonic() - begun, 1), **circumstances(),
        }  # fmt: skip
        if out is not None:
            with out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
        done += len(problems)
        seed += 1
        n_failures += len(failed)
        print(
            f"{kind}: {done} of {n} faults, {n_failures} failures", *failed[:EXAMPLES], sep="\n  ", flush=True
        )
    return n_failures


def read_lines(path: Path | None) -> list[dict[str, Any]]:
    """Return the batches in a file, none if there is no file."""
    if path is None or not path.exists():
        return []
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()]


def circumstances() -> dict[str, str]:
    """Return what figures depend on: date, version, machine and Python."""
    from realitygap.study._run import processor_name

    return {
        "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d"),
        "version": __version__,
        "machine": f"{processor_name()}, {multiprocessing.cpu_count()} processors, {platform.system()}",
        "python": platform.python_version(),
    }
