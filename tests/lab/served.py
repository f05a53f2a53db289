"""A lab in a process that is forked from one that has imported everything: there at once, killed as any other."""

from __future__ import annotations

import asyncio
import contextlib
import faulthandler
import importlib
import os
import re
import resource
import sys
import threading
import time
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import uvicorn  # noqa: F401  # imported once, for all that are forked
from fastapi import FastAPI  # noqa: F401
from nicegui import app, ui

import realitygap.lab.pages
from realitygap.lab import _child, open_lab
from realitygap.lab._counts import Counts
from realitygap.lab.pages import _robot
from realitygap.robots import PortGuess
from tests.forks import fork_context

from .forked_children import FOR_CHILDREN, Forking

for name in (
    "anyio._backends._asyncio",
    "uvicorn.lifespan.on",
    "uvicorn.loops.auto",
    "uvicorn.protocols.http.auto",
    "uvicorn.protocols.websockets.auto",
):
    importlib.import_module(name)
for path in Path(realitygap.lab.pages.__file__).parent.glob("*.py"):
    for name in re.findall(r"\bui\.([a-z_]+)", path.read_text("utf-8")):
        getattr(ui, name)  # which NiceGUI imports at its first use

LOG = "lab.log"
"""What a lab says to its terminal, beside its folder."""

BEAT_S = 0.01


class _Beats:
    """Measures how late the event loop is, by beats of another thread: they stop when the whole process pauses."""

    n = 0
    """Beats of the thread."""
    most_late = 0
    """The most beats between two of the event loop."""

    def count(self) -> None:
        while True:
            time.sleep(BEAT_S)
            self.n += 1


_beats = _Beats()


@app.on_startup
async def _beat() -> None:
    threading.Thread(target=_beats.count, daemon=True).start()
    while True:
        began = _beats.n
        await asyncio.sleep(BEAT_S)
        _beats.most_late = max(_beats.most_late, _beats.n - began - 1)


@app.get("/lag")
async def lag() -> float:
    """The most that the event loop was late since this was asked last [s]."""
    late, _beats.most_late = _beats.most_late, 0
    return late * BEAT_S


@ui.page("/broken")
def broken() -> None:
    """A page with a mistake."""
    raise RuntimeError("a mistake for a test")


@app.get("/list-port/{name:path}")
async def list_port(name: str) -> None:
    """From now on, this is the only port of the computer."""
    _robot.list_ports = lambda: [PortGuess(f"/{name}", "a serial port", "")]


@app.get("/slow-counts")
async def slow_counts() -> None:
    """From now on, whoever enters a count waits for a second after it is in the ledger."""
    score = Counts.score

    def score_slowly(*given: Any) -> None:
        score(*given)
        time.sleep(1.0)

    Counts.score = score_slowly  # type: ignore[method-assign]


def serve(
    root: Path, port: int, told: Connection, is_forking: bool, limits: dict[int, int], has_class: bool
) -> None:
    """Serve the lab of a folder; say its address."""
    for limit, value in limits.items():
        resource.setrlimit(limit, (value, value))
    os.environ.pop("PYTEST_CURRENT_TEST", None)  # of which NiceGUI thinks that it is under test itself
    sys.stdout = sys.stderr = (root.parent / LOG).open("a", buffering=1, encoding="utf-8")
    os.dup2(sys.stderr.fileno(), 2)
    os.environ["PYTHONPATH"] = str(root.parent / FOR_CHILDREN)
    faulthandler.enable(sys.stderr)
    if is_forking:
        _child.subprocess = Forking(root.parent / LOG)  # type: ignore[attr-defined]

    def tell(line: str) -> None:
        if line.startswith("Open "):
            told.send(line.split()[1])

    with contextlib.suppress(KeyboardInterrupt):  # as the command does
        open_lab(root, port=port, host="127.0.0.1", show=False, tell=tell, classroom=has_class)


def begin(
    root: Path,
    port: int,
    *,
    is_forking: bool = True,
    limits: dict[int, int] | None = None,
    has_class: bool = False,
) -> tuple[BaseProcess, str]:
    """Begin to serve; the process, and its address.

    Args:
        root: The lab's folder.
        port: Of the lab.
        is_forking: Whether the lab's child processes are forked; a new Python takes seconds of a processor.
        limits: Limits of the process, such as `resource.RLIMIT_NOFILE`, and their values.
        has_class: Whether the lab has a class.
    """
    context = fork_context()
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=serve, args=(root, port, there, is_forking, limits or {}, has_class))
    process.start()
    there.close()
    try:
        return process, here.recv()
    except EOFError:
        raise AssertionError(f"the lab told no address: {(root.parent / LOG).read_text('utf-8')}") from None
