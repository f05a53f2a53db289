"""A worker or the scheduler of a Dask cluster is killed: the study resumes or ends with one message, digest equal."""

from __future__ import annotations

import random
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Literal

from realitygap.errors import ClusterError
from realitygap.study import Progress, Study, parse_study, run_study
from tests.study.dask_processes import DaskProcesses, kill

from .forked import text_of
from .simulated_kills import digest_of

STUDY = """
[study]
name = "clustered"
replicates = 40
[[condition]]
name = "coverage"
[[condition]]
name = "novelty"
selection = "novelty"
"""
BACK_AFTER_S = 1.0

Victim = Literal["worker", "scheduler"]


def inject(seed: int, n: int, folder: Path) -> Iterator[str]:
    """Yield what did not hold after each of n kills, of a worker and of the scheduler in turn."""
    draw = random.Random(seed)
    study = parse_study(STUDY, "clustered.toml")
    wanted = text_of(partial(digest_of, study, folder / "whole"), folder / "report")
    for number in range(n):
        victim: Victim = "scheduler" if number % 2 else "worker"
        after = draw.randrange(1, study.about.replicates * len(study.conditions) - 10)
        path = folder / f"{number}"
        path.mkdir()
        problem = _killed(study, wanted, path, victim, after)
        yield problem and f"{victim} killed after {after} runs: {problem}"


def _killed(study: Study, wanted: str, path: Path, victim: Victim, after: int) -> str:
    """Kill a process of a cluster while it computes a study, and start it again; return what did not hold."""
    with DaskProcesses(path) as dask:
        processes = {"scheduler": dask.scheduler(), "worker": dask.worker()}
        dask.worker()
        is_killed = False

        def start_again() -> None:
            if victim == "scheduler":
                dask.scheduler()
            dask.worker()

        def strike(progress: Progress) -> None:
            nonlocal is_killed
            if progress.n_computed >= after and not is_killed:
                is_killed = True
                kill(processes[victim])
                threading.Timer(BACK_AFTER_S, start_again).start()

        for _ in range(2):
            try:
                result = run_study(study, path / "r", chunk=1, cluster=dask.address, tell=strike)
            except ClusterError:  # one message, and the same command resumes
                continue
            except Exception as error:
                return f"not a ClusterError: {error!r}"
            if not is_killed:
                return "nothing was killed"
            digest = result.folder.digest()
            return "" if digest == wanted else f"the digest is {digest}, expected {wanted}"
    return "the second run ended with an error, too"
