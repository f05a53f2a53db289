"""Processes in which a twin lives, as many as there are processors: all that this one knows is the path of its file."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import threading
import weakref
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from realitygap import errors
from realitygap._process import usable_processors
from realitygap.errors import RobotError, whole_number
from realitygap.world import Arena

TOLD = 2000
"""Maximum number of characters that are reported of the last output of a process that ended."""


class _EndedError(Exception):
    """The process is not there any more."""


class TwinProcess:
    """A process with one twin.

    Args:
        setup: The request by which the twin is opened.
    """

    def __init__(self, setup: Mapping[str, Any]) -> None:
        self._setup = setup
        self._process: subprocess.Popen[bytes] | None = None
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the process
        self._lock = threading.Lock()

    @property
    def pid(self) -> int | None:
        """Process ID, or None without a process."""
        return None if self._process is None else self._process.pid

    def start(self) -> Any:
        """Start it, unless it runs, and open the twin there. Return its properties, or None if it already runs."""
        if self._process is not None:
            return None
        self._said.truncate(0)
        self._process = subprocess.Popen(
            # -P: otherwise Python looks for modules in the current folder first, which may hold anybody's files.
            [sys.executable, "-P", "-m", "realitygap.platforms.twin._worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"},
            start_new_session=True,  # Ctrl-C is for who asks
        )
        return self._ask(self._setup)

    def ask(self, request: Mapping[str, Any]) -> Any:
        """Return the answer to a request; a process that was not there is started first."""
        self.start()
        return self._ask(request)

    def _ask(self, request: Mapping[str, Any]) -> Any:
        process = self._process
        if process is None or process.stdin is None or process.stdout is None:
            raise _EndedError
        try:
            process.stdin.write(json.dumps(request, separators=(",", ":")).encode() + b"\n")
            process.stdin.flush()
            line = process.stdout.readline()
        except (OSError, ValueError):
            line = b""
        if not line.endswith(b"\n"):
            raise _EndedError
        reply = json.loads(line)
        if "error" in reply:
            raise _error(reply["kind"], reply["error"])
        return reply["result"]

    def last_words(self) -> str:
        """Return the exit status of the process, and its last message."""
        with contextlib.suppress(OSError, ValueError):
            size = self._said.seek(0, os.SEEK_END)
            self._said.seek(max(0, size - TOLD))
            said = self._said.read().decode(errors="replace").strip().splitlines()
            return said[-1] if said else "it said nothing"
        return "it said nothing"

    def end(self) -> int | None:
        """End it, and wait until it is gone; its exit status. Safe to call twice, and from another thread."""
        with self._lock:
            process, self._process = self._process, None
            if process is None:
                return None
            status = process.poll()
            if status is None:
                process.kill()  # it holds nothing that would be lost
                status = process.wait()
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    with contextlib.suppress(OSError):
                        pipe.close()
            return status

    def close(self) -> None:
        """End it for good; safe to call twice."""
        self.end()
        self._said.close()


class TwinPool:
    """Processes with the same twin in the same arena, which share the trials among themselves.

    A process that ends is started again, and its trial is tried once more. All end with the pool.

    Args:
        file: File of the twin.
        arena: Arena of the robot.
        processes: Number of processes. Default: one for each processor that may be used.

    Attributes:
        step_s: Duration of a command [s].
        n_sensors: Range sensors of the twin.
        channels: Names of its other sensors.
        sha256: Hash of its file when it was read.

    Raises:
        DescriptionError: There is no such file, or it cannot be used.
        MissingExtraError: MuJoCo is not installed.
        RobotError: The process does not come up.
    """

    def __init__(self, file: str, arena: Arena, processes: int | None = None) -> None:
        n = usable_processors() if processes is None else whole_number("processes", processes, 1, 1024)
        setup = {"do": "open", "file": str(Path(file).resolve()), "arena": arena.to_dict()}
        self.file = file
        self._processes = [TwinProcess(setup) for _ in range(n)]
        self._idle: SimpleQueue[TwinProcess] = SimpleQueue()
        self._closed = threading.Event()
        self.end = weakref.finalize(self, _end_all, self._processes, self._closed)
        self._threads = ThreadPoolExecutor(n, thread_name_prefix="twin")
        try:
            facts = self._processes[0].start()
        except _EndedError:
            words = self._processes[0].last_words()
            self.close()
            raise RobotError(f"The process of twin {file} does not start: {words}.") from None
        except BaseException:
            self.close()
            raise
        self.step_s, self.n_sensors = float(facts["step_s"]), int(facts["n_sensors"])
        self.channels = tuple(facts["channels"])
        self.sha256: str = facts["sha256"]
        for process in self._processes:
            self._idle.put(process)

    @property
    def is_closed(self) -> bool:
        """True if its processes have ended for good."""
        return self._closed.is_set()

    @property
    def pids(self) -> tuple[int, ...]:
        """IDs of the running processes."""
        return tuple(pid for process in self._processes if (pid := process.pid) is not None)

    def ask_all(self, requests: Sequence[Mapping[str, Any]]) -> Iterator[Any]:
        """Yield the answers in order.

        Raises:
            RobotError: A process ended twice in the same trial; the others go on to the end of theirs.
        """
        if self._closed.is_set():
            raise RobotError(f"Twin {self.file} is closed: open it again.")
        asked: deque[Future[Any]] = deque(self._threads.submit(self._ask, each) for each in requests)
        try:
            while asked:
                yield asked.popleft().result()
        finally:  # also if the caller does not need the rest
            for future in asked:
                future.cancel()

    def _ask(self, request: Mapping[str, Any]) -> Any:
        process = self._idle.get()
        try:
            for _ in range(2):
                if self._closed.is_set():
                    break
                try:
                    return process.ask(request)
                except _EndedError:
                    status, words = process.end(), process.last_words()
            else:
                raise RobotError(
                    f"The process of twin {self.file} ended twice in the same trial (exit status {status}): {words}. "
                    "The trials before are not lost."
                )
            raise RobotError(f"Twin {self.file} is closed: open it again.")
        finally:
            self._idle.put(process)

    def close(self) -> None:
        """End all processes; safe to call twice."""
        self.end()
        self._threads.shutdown(wait=True, cancel_futures=True)


def _end_all(processes: Sequence[TwinProcess], closed: threading.Event) -> None:
    closed.set()
    for process in processes:
        process.close()


def _error(kind: str, text: str) -> Exception:
    """Return the error of the other process, as an error of this one."""
    found = getattr(errors, kind, None)
    if isinstance(found, type) and issubclass(found, errors.RealityGapError):
        return found(text)
    return ValueError(text) if kind == "ValueError" else RobotError(text)
