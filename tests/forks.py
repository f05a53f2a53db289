"""Processes that are forked from one that has imported everything: there at once."""

from __future__ import annotations

import contextlib
import multiprocessing.forkserver
from multiprocessing.context import ForkServerContext
from pathlib import Path

ROOT = Path(__file__).parent.parent
IMPORTED = ["tests.commands", "tests.lab.served", "tests.study.dask_processes"]
"""Modules of everything that is forked: a test process has one such server, which imports them when it starts."""


def fork_context() -> ForkServerContext:
    """Return the context of `multiprocessing` whose processes have the modules."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(IMPORTED)
    with contextlib.chdir(ROOT):  # where it looks for them
        multiprocessing.forkserver.ensure_running()
    return context
