"""A scheduler and workers as processes of their own, on the loopback interface, ended by their numbers.

Most are forked from a process that has imported Dask, which takes two seconds of a processor otherwise.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import distributed.cli.dask_scheduler
import distributed.cli.dask_worker  # noqa: F401  # imported once, for all that are forked
import psutil

import realitygap.study._order  # noqa: F401
from tests.forks import fork_context


class Forked:
    """A process that was forked, with the methods of `subprocess.Popen` that are used here."""

    def __init__(self, *order: object) -> None:
        self._process = fork_context().Process(target=_run, args=order)
        self._process.start()
        self.pid = self._process.pid

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self) -> None:
        self._process.join()


Process = subprocess.Popen | Forked


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def reserved_port() -> socket.socket:
    """Return a socket whose port the system gives to nobody who asks for any port.

    A scheduler can listen on it, again and again, because neither socket insists on a port of its own.
    """
    reserved = socket.socket()
    reserved.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    reserved.bind(("127.0.0.1", 0))
    return reserved


def wait_until(condition: Callable[[], object], seconds: float = 60.0) -> None:
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "what was waited for did not happen"
        time.sleep(0.01)


def kill(process: Process) -> None:
    """End a process and its children without warning."""
    with contextlib.suppress(psutil.NoSuchProcess):
        family = psutil.Process(process.pid)
        for each in [family, *family.children(recursive=True)]:
            with contextlib.suppress(psutil.NoSuchProcess):
                each.send_signal(signal.SIGKILL)
    process.wait()


class DaskProcesses:
    """Starts and ends them; use it as a context manager."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._started: list[Process] = []
        self._reserved = reserved_port()
        self.port = self._reserved.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"

    def __enter__(self) -> DaskProcesses:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._started:
            kill(process)
        self._reserved.close()

    def scheduler(self, prelude: str = "", *, new: bool = False) -> Process:
        options = ["--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard"]
        process = self._start("scheduler", prelude, options, new=new)
        wait_until(self._answers)
        return process

    def worker(
        self,
        prelude: str = "",
        *,
        nanny: bool = False,
        threads: int = 1,
        path: Path | None = None,
        new: bool = False,
    ) -> Process:
        """A worker, as a new Python if so ordered.

        `prelude` is Python that it runs first, `path` goes before its other packages.
        """
        options = ["--nthreads", str(threads), "--host", "127.0.0.1", "--no-dashboard"]
        options += ["--local-directory", str(self._folder), "--death-timeout", "60"]
        options += [] if nanny else ["--no-nanny"]
        is_new = new or nanny or path is not None
        return self._start("worker", prelude, [self.address, *options], path, new=is_new)

    def _start(
        self, kind: str, prelude: str, arguments: list[str], path: Path | None = None, *, new: bool
    ) -> Process:
        environment = dict(os.environ)
        if path is not None:
            environment["PYTHONPATH"] = str(path)
        log = self._folder / f"{kind}-{len(self._started)}.log"
        if new:
            code = f"import sys\n{prelude}\nfrom distributed.cli.dask_{kind} import main\nmain()"
            with log.open("wb") as file:
                process: Process = subprocess.Popen(
                    [sys.executable, "-c", code, *arguments],
                    cwd=self._folder,
                    env=environment,
                    stdout=file,
                    stderr=subprocess.STDOUT,
                )
        else:
            process = Forked(kind, prelude, arguments, environment, self._folder, log)
        self._started.append(process)
        return process

    def _answers(self) -> bool:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1):
            return True
        return False


def _run(
    kind: str, prelude: str, arguments: list[str], environment: dict[str, str], folder: Path, log: Path
) -> None:
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    file = os.open(log, os.O_WRONLY | os.O_CREAT)
    for stream in (1, 2):
        os.dup2(file, stream)
    sys.argv = [f"dask-{kind}", *arguments]
    exec(prelude, {})
    importlib.import_module(f"distributed.cli.dask_{kind}").main()
