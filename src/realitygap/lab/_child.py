"""A process of the lab, seen from the server: begun, told, listened to, ended."""

from __future__ import annotations

import contextlib
import queue
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from pathlib import Path

from ._messages import Ended, Message, Quit, Work, from_line, to_line

PATIENCE_S = 10.0
"""Time after which a process that was told to end is killed [s]. It stops its robot first."""


class Child:
    """A process that works.

    Nothing here but `end` waits for the process: what it is told is sent by a thread, because a pipe whose other end
    does not read is full at some time.

    Args:
        work: What it is to do.
        folder: In which it works.
        hear: Called with each thing that it says, in a thread of its own; at last with `Ended`.
    """

    def __init__(self, work: Work, folder: Path, hear: Callable[[Message], None]) -> None:
        self._hear = hear
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._process = subprocess.Popen(
            # -P: otherwise Python looks for modules in the folder first, and would run a numpy.py of anybody's.
            [sys.executable, "-P", "-m", "realitygap.lab._work"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=folder,
            text=True,
            encoding="utf-8",
            start_new_session=True,  # Ctrl-C reaches it through the server, after which it stops its robot
        )
        self.tell(work)
        for act in (self._listen, self._send):
            threading.Thread(target=act, daemon=True).start()

    @property
    def is_alive(self) -> bool:
        """True if the process is still running."""
        return self._process.poll() is None

    @property
    def process_id(self) -> int:
        """Number of the process."""
        return self._process.pid

    def tell(self, message: Message) -> None:
        """Send a message to the process; do nothing if the process has ended."""
        self._lines.put(to_line(message))

    def ask_to_end(self) -> None:
        """Ask the process to stop its robot, then its work."""
        self.tell(Quit())

    def end(self) -> None:
        """Ask the process to end, and wait for its end."""
        self.ask_to_end()
        try:
            self._process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def kill(self) -> None:
        """Kill the process."""
        self._process.kill()

    def _send(self) -> None:
        pipe = self._process.stdin
        with contextlib.suppress(OSError, ValueError):
            while pipe is not None and (line := self._lines.get()) is not None:
                pipe.write(line)
                pipe.flush()

    def _listen(self) -> None:
        pipe = self._process.stdout
        with contextlib.suppress(OSError, ValueError):
            for line in pipe or ():
                if not line.endswith("\n"):  # the process ended in the middle of a message
                    break
                try:
                    self._hear(from_line(line))
                except Exception:  # a process that is not heard to its end could not be ended
                    traceback.print_exc()
        status = self._process.wait()
        self._lines.put(None)
        self._hear(Ended(status))
