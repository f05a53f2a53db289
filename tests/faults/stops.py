"""Run a command while random processes that it began stop for a moment: `python -m tests.faults.stops COMMAND...`.

A stop finds more races than a busy processor does: two processes that depend on each other have any delay between them.
A process that something else has stopped, as tests of guardians do, is left as it is.
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

N_STOPPED = 2  # or half of the processes, if that is less
STOP_S = 1 / 3


def main(command: list[str]) -> int:
    """Run a command to its end; return its exit status."""
    rng = random.Random()
    process = subprocess.Popen(command)
    while process.poll() is None:
        running = [pid for pid in descendants(process.pid) if state_of(pid) not in "TZ"]
        stopped = [
            pid for pid in rng.sample(running, min(N_STOPPED, len(running) // 2)) if send(pid, signal.SIGSTOP)
        ]
        time.sleep(STOP_S)
        for pid in stopped:
            send(pid, signal.SIGCONT)
        time.sleep(0.01)  # in which all run
    return process.returncode


def descendants(pid: int) -> list[int]:
    """Return the processes that a process has begun, and those that they have."""
    threads: list[Path] = []
    with contextlib.suppress(OSError):  # it has ended
        threads = list(Path(f"/proc/{pid}/task").iterdir())
    children = [int(child) for thread in threads for child in content(thread / "children").split()]
    return children + [below for child in children for below in descendants(child)]


def state_of(pid: int) -> str:
    """Return the letter of a process's state; Z if it has ended."""
    return content(Path(f"/proc/{pid}/stat")).rpartition(")")[2][1:2] or "Z"


def content(path: Path) -> str:
    """Return the text of a file in /proc; empty if its process has ended."""
    with contextlib.suppress(OSError):
        return path.read_text()
    return ""


def send(pid: int, number: int) -> bool:
    """Send a signal; return whether the process was there."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)
        return True
    return False


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
