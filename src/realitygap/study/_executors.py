"""Executors that compute the chunks of a study on threads; `_cluster.py` has those on other machines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Any, Protocol

from realitygap._interrupts import kept_interrupts
from realitygap.platforms import close_twins, release_twins
from realitygap.records import ResultsFolder
from realitygap.runs import Condition, prepare_kernels, run_replicates


@dataclass(frozen=True)
class ChunkTask:
    """A chunk to compute: `n_runs` replicates of a condition, from `first` on."""

    condition: Condition
    first: int
    n_runs: int


class Listener(Protocol):
    """A receiver of progress."""

    def add(self, n_runs: int) -> None:
        """Report n more published runs."""

    def wait_for(self, what: str) -> None:
        """Report that work waits for `what`; empty: that it continues."""


class Executor(Protocol):
    """Computes chunks and publishes them in a folder whose lock the caller holds."""

    def facts(self) -> dict[str, Any]:
        """Return facts for the log: names and numbers, as JSON values."""

    def prepare(self, conditions: Sequence[Condition]) -> None:
        """Do what is done once for these conditions and not counted as computing."""

    def carry_out(self, folder: ResultsFolder, tasks: Iterator[ChunkTask], listener: Listener) -> None:
        """Compute all tasks; return when they are published.

        Whatever ends it early, Ctrl-C included, what was published stays, and nothing more is published once
        it has ended.
        """


class Threads:
    """An executor that runs kernels on threads of this process, with few chunks at a time to limit memory."""

    def __init__(self, n: int) -> None:
        self._n = n

    def facts(self) -> dict[str, Any]:
        """Return the number of threads."""
        return {"threads": self._n}

    def prepare(self, conditions: Sequence[Condition]) -> None:
        """Compile the kernels, or load them from disk."""
        with kept_interrupts():
            prepare_kernels(conditions)

    def carry_out(self, folder: ResultsFolder, tasks: Iterator[ChunkTask], listener: Listener) -> None:
        """See `Executor`."""

        def compute(task: ChunkTask) -> int:
            frame = run_replicates(task.condition, task.first, task.n_runs)
            folder.publish(task.condition.name, task.first, frame, task.condition.hash())
            return task.n_runs

        with ThreadPoolExecutor(self._n, thread_name_prefix="run") as pool:
            under_way: set[Future[int]] = set()
            try:
                while True:
                    while len(under_way) < 2 * self._n and (task := next(tasks, None)) is not None:
                        under_way.add(pool.submit(compute, task))
                    if not under_way:
                        return
                    # The time-out lets Ctrl-C through on every system.
                    done, under_way = wait(under_way, timeout=0.2, return_when=FIRST_COMPLETED)
                    for future in done:
                        listener.add(future.result())
            except BaseException:
                for future in under_way:
                    future.cancel()
                close_twins()  # otherwise a chunk would be computed to its end
                raise
            finally:
                release_twins()
