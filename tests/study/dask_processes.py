"""A scheduler and workers as processes of their own, on the loopback interface, ended by their numbers."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_until(condition: Callable[[], object], seconds: float = 60.0) -> None:
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "what was waited for did not happen"
        time.sleep(0.01)


def kill(process: subprocess.Popen) -> None:
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
        self._started: list[subprocess.Popen] = []
        self.port = free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"

    def __enter__(self) -> DaskProcesses:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._started:
            kill(process)

    def scheduler(self, prelude: str = "") -> subprocess.Popen:
        process = self._start(
            "scheduler", prelude, ["--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard"]
        )
        wait_until(self._answers)
        return process

    def worker(
        self, prelude: str = "", *, nanny: bool = False, threads: int = 1, path: Path | None = None
    ) -> subprocess.Popen:
        """A worker; `prelude` is Python that it runs first, `path` goes before its other packages."""
        options = ["--nthreads", str(threads), "--host", "127.0.0.1", "--no-dashboard"]
        options += ["--local-directory", str(self._folder), "--death-timeout", "60"]
        options += [] if nanny else ["--no-nanny"]
        return self._start("worker", prelude, [self.address, *options], path)

    def _start(
        self, kind: str, prelude: str, arguments: list[str], path: Path | None = None
    ) -> subprocess.Popen:
        code = f"import sys\n{prelude}\nfrom distributed.cli.dask_{kind} import main\nmain()"
        environment = dict(os.environ)
        if path is not None:
            environment["PYTHONPATH"] = str(path)
        log = (self._folder / f"{kind}-{len(self._started)}.log").open("wb")
        with log:
            process = subprocess.Popen(
                [sys.executable, "-c", code, *arguments],
                cwd=self._folder,
                env=environment,
                stdout=log,
                stderr=subprocess.STDOUT,
            )
        self._started.append(process)
        return process

    def _answers(self) -> bool:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1):
            return True
        return False
