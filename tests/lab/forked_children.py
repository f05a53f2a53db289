"""Child processes of a lab that are forked from one that has imported everything, instead of new Pythons."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import matplotlib.figure  # noqa: F401  # imported once, for all that are forked

import realitygap.report  # noqa: F401
from realitygap.lab import (  # noqa: F401
    _calibration,
    _checks,
    _child,
    _drawing,
    _gap,
    _hand,
    _live,
    _photos,
    _study,
    _video,
    _work,
)
from tests.forks import fork_context

FOR_CHILDREN = "modules"
"""Folder next to the lab's: a `sitecustomize.py` in it changes the lab's child processes."""


class ForkedChild:
    """What `Child` uses of `subprocess.Popen`."""

    def __init__(self, command: list[str], *, cwd: Path, log: Path | None = None, **_: Any) -> None:
        context = fork_context()
        source, stdin = context.Pipe(duplex=False)
        stdout, sink = context.Pipe(duplex=False)
        order = (command, cwd, dict(os.environ), log, source, sink)
        self._process = context.Process(target=_work_as_child, args=order)
        self._process.start()
        source.close()
        sink.close()
        self.stdin = _text(stdin, "wb")
        self.stdout = _text(stdout, "rb")

    @property
    def pid(self) -> int:
        number = self._process.pid
        assert number is not None
        return number

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        status = self._process.exitcode
        if status is None:
            raise subprocess.TimeoutExpired("a child process", timeout or 0.0)
        return status

    def kill(self) -> None:
        self._process.kill()


class Forking:
    """Takes the place of the module `subprocess` in `Child`.

    Args:
        log: File for the messages of child processes; None for those of the server that forks them.
    """

    PIPE, TimeoutExpired = subprocess.PIPE, subprocess.TimeoutExpired

    def __init__(self, log: Path | None = None) -> None:
        self._log = log

    def Popen(self, command: list[str], **options: Any) -> ForkedChild:  # its name there
        return ForkedChild(command, log=self._log, **options)


def _text(connection: Connection, mode: str) -> io.TextIOWrapper:
    """Return the end of a pipe as a text file."""
    number = os.dup(connection.fileno())
    connection.close()
    return io.TextIOWrapper(os.fdopen(number, mode), encoding="utf-8")


def _work_as_child(
    command: list[str],
    folder: Path,
    environment: dict[str, str],
    log: Path | None,
    source: Connection,
    sink: Connection,
) -> None:
    os.setsid()
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    for number, end in enumerate((source, sink)):
        os.dup2(end.fileno(), number)
        end.close()
    if log is not None:
        with log.open("ab") as file:
            os.dup2(file.fileno(), 2)
    sys.stdin = io.TextIOWrapper(os.fdopen(0, "rb", closefd=False), encoding="utf-8")
    sys.stdout = io.TextIOWrapper(os.fdopen(1, "wb", closefd=False), encoding="utf-8")
    sys.stderr = io.TextIOWrapper(os.fdopen(2, "wb", closefd=False), encoding="utf-8", write_through=True)
    sys.orig_argv = [sys.executable, *command]
    change = Path(environment.get("PYTHONPATH", os.devnull)) / "sitecustomize.py"
    if change.is_file():
        exec(compile(change.read_text("utf-8"), str(change), "exec"), {})  # a new Python does this itself
    sys.exit(_work.main())
