"""Processes that are forked from one that has imported everything: there at once."""

from __future__ import annotations

import contextlib
import multiprocessing.forkserver
from multiprocessing.context import ForkServerContext
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
IMPORTED = ["tests.commands", "tests.lab.served", "tests.study.dask_processes"]
"""Modules of everything that is forked: a test process has one such server, which imports them when it starts."""


_server: Any = multiprocessing.forkserver._forkserver  # type: ignore[attr-defined]


def fork_context() -> ForkServerContext:
    """Return the context of `multiprocessing` whose processes have the modules."""
    context = multiprocessing.get_context("forkserver")
    if _server._forkserver_pid is None and _server._forkserver_address is not None:
        # This process is a fork itself: it asks the same server, where Python would start another one.
        _server.ensure_running = lambda: None
        return context
    context.set_forkserver_preload(IMPORTED)
    with contextlib.chdir(ROOT):  # where it looks for them
        multiprocessing.forkserver.ensure_running()
    return context
