"""Processes for the jobs of a long benchmark."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager


@contextmanager
def processes(n: int) -> Iterator[ProcessPoolExecutor]:
    """Yield n new processes. They end at an error or Ctrl-C, where a pool would wait for all jobs.

    Raises:
        SystemExit: n is below 1.
    """
    if n < 1:
        raise SystemExit(f"--processes is {n}, expected 1 or more.")
    with ProcessPoolExecutor(n, mp_context=multiprocessing.get_context("spawn")) as pool:
        try:
            yield pool
        except BaseException:
            for child in multiprocessing.active_children():
                child.terminate()
            raise
