"""SIGINT at random moments of long commands, twice at once as `timeout` sends it: each command ends and resumes."""

from __future__ import annotations

import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from realitygap.runs import prepare_kernels
from realitygap.study import load_study
from tests.interrupted import INTERRUPTED

from .forked import text_of
from .simulated_kills import digest_of

COMMANDS = {
    "run": "run paper --replicates 300 --out run",
    "run in full": "run paper --replicates 200000 --out full",
    "report": "report whole",
    "gap": "gap sim jyro --n-controllers 20 --trials 5 -o gap.sqlite",
    "calibrate": "calibrate path --robot sim -o path.toml",
    "transfer": "transfer sim-paper --to sim:scribbler-s1 --budget 8 --strategy plain --runs 20 -o transfer",
    "run without saved kernels": "run paper --replicates 200000 --out cold",
}
SHORTEST_S, LONGEST_S = 0.3, 9.0
LONGEST_COMPILING_S = 60.0
ENDS_WITHIN_S = 30.0
"""Time within which a command has to end; LLVM cannot be interrupted in the middle of a kernel [s]."""


def inject(seed: int, n: int, folder: Path) -> Iterator[str]:
    """Yield what did not hold after each of n interrupts."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell has jobs in the background ignore it
    draw = random.Random(seed)
    study = load_study("paper", replicates=300)
    prepare_kernels(study.conditions)
    wanted = text_of(partial(digest_of, study, folder / "whole"), folder / "digest")
    for number in range(n):
        name = list(COMMANDS)[number % len(COMMANDS)]
        while (problem := _interrupted(name, draw, folder)) is None:
            pass
        if not problem and name == "run":
            digest = text_of(partial(digest_of, study, folder / "run"), folder / "digest")
            if digest != wanted:
                problem = f"the digest is {digest}, expected {wanted}"
            shutil.rmtree(folder / "run")
        yield problem and f"{name}: {problem}"


def _interrupted(name: str, draw: random.Random, folder: Path) -> str | None:
    """Interrupt a command at a random moment; return what did not hold, None if the command ended before."""
    environment = dict(os.environ)
    cold = name.endswith("without saved kernels")
    with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryFile("w+") as errors:
        if cold:
            environment["REALITYGAP_CACHE"] = cache
        process = subprocess.Popen(
            [sys.executable, "-m", "realitygap", *COMMANDS[name].split()],
            cwd=folder,
            env=environment,
            stdout=errors,
            stderr=errors,
            start_new_session=True,
        )
        after = draw.uniform(SHORTEST_S, LONGEST_COMPILING_S if cold else LONGEST_S)
        try:
            with contextlib.suppress(subprocess.TimeoutExpired):
                return f"it failed with {process.returncode}" if process.wait(after) else None
            process.send_signal(signal.SIGINT)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGINT)
            try:
                process.wait(ENDS_WITHIN_S)
            except subprocess.TimeoutExpired:
                return f"lost after {after:.2f} s"
            errors.seek(0)
            text = errors.read()
            if process.returncode not in INTERRUPTED or "Exception ignored" in text:
                return f"after {after:.2f} s it ended with {process.returncode}: {text[-800:]}"
            return ""
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
