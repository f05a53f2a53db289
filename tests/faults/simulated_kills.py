"""SIGKILL at random moments of simulated studies: each resumes, and its digest is that of the undisturbed study."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from realitygap.records import ResultsFolder
from realitygap.runs import prepare_kernels
from realitygap.study import Study, load_study, run_study

from .forked import run_forked, text_of

ON_SIM = """
[study]
name = "on-sim"
replicates = 6
[[condition]]
name = "coverage"
platform = "sim"
[[condition]]
name = "novelty"
selection = "novelty"
"""
COMMAND_SHARE = 0.02
"""Share of the studies that run through the command line, which takes seconds to start."""
COMMAND_S = 8.0
"""Longest time before a command is killed [s]."""
MOST_KILLS = 100
"""Kills of one study, before it is left to end."""


def digest_of(study: Study, path: Path) -> str:
    """Run what is missing of a study, and return its digest."""
    return run_study(study, path, threads=2, chunk=2).folder.digest()


def inject(seed: int, n: int, folder: Path) -> Iterator[str]:
    """Yield what did not hold after each of n kills."""
    draw = random.Random(seed)
    report = folder / "report"
    file = folder / "on-sim.toml"
    file.write_text(ON_SIM, "utf-8")
    studies: dict[str, Study] = {"paper": load_study("paper", replicates=4), str(file): load_study(file)}
    wanted: dict[str, str] = {}
    seconds: dict[str, float] = {}
    for name, study in studies.items():
        prepare_kernels(study.conditions)
        begun = time.monotonic()
        wanted[name] = text_of(partial(digest_of, study, folder / f"whole-{study.about.name}"), report)
        seconds[name] = time.monotonic() - begun
    left = n
    number = 0
    while left:
        name = draw.choice(sorted(studies))
        study, path = studies[name], folder / f"killed-{number}"
        n_kills, end = 0, "killed"
        if draw.random() < COMMAND_SHARE:
            n_kills += _kill_command(name, study, path, draw.uniform(0, COMMAND_S))
        while end == "killed":
            threads, chunk = draw.choice((1, 2, 3)), draw.choice((1, 2, 4))
            more = n_kills < min(left, MOST_KILLS)
            end = run_forked(
                partial(run_study, study, path, threads=threads, chunk=chunk),
                report,
                kill_after=draw.uniform(0, 1.1 * seconds[name]) if more else None,
            )
            n_kills += end == "killed"
        problem = ""
        if end == "failed":
            problem = report.read_text("utf-8")
        elif (digest := text_of(lambda path=path: ResultsFolder.open(path).digest(), report)) != wanted[name]:
            problem = f"the digest is {digest}, expected {wanted[name]}"
        elif leftovers := list(path.rglob("*.tmp")):
            problem = f"{leftovers[0].name} was left behind"
        yield from [""] * (n_kills - 1)
        if n_kills or problem:
            yield problem and f"{path.name} ({name}): {problem}"
        left -= n_kills
        number += 1


def _kill_command(name: str, study: Study, path: Path, after: float) -> bool:
    """Start the command that runs the study, and return whether it was killed before its end."""
    command = [sys.executable, "-m", "realitygap", "run", name, "--out", str(path), "--chunk", "2"]
    process = subprocess.Popen(
        [*command, "--replicates", str(study.about.replicates)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        process.wait(after)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return True
    return False
