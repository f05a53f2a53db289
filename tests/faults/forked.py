"""Work in a forked process that has everything imported, may be killed at a moment, and may not hang.

The parent must not use Polars: its threads do not survive a fork.
"""

from __future__ import annotations

import os
import signal
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Literal

HANG_S = 600.0
LOOK_S = 0.001

End = Literal["done", "killed", "failed"]


def run_forked(work: Callable[[], object], report: Path, *, kill_after: float | None = None) -> End:
    """Run work in a forked process, and kill it after a time [s].

    Args:
        work: What the process does. If it returns a text, the text is written to `report`.
        report: File for that text, or for the traceback of an exception.
        kill_after: Time after which the process is killed with SIGKILL. Default: never.
    """
    child = os.fork()
    if child == 0:
        status = 1
        try:
            found = work()
            if isinstance(found, str):
                report.write_text(found, "utf-8")
            status = 0
        except BaseException:
            report.write_text(traceback.format_exc(), "utf-8")
        finally:
            os._exit(status)
    until = time.monotonic() + (HANG_S if kill_after is None else kill_after)
    while True:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            return "done" if status == 0 else "failed"
        if time.monotonic() >= until:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            if kill_after is not None:
                return "killed"
            report.write_text(f"still running after {HANG_S:.0f} s", "utf-8")
            return "failed"
        time.sleep(LOOK_S)


def text_of(work: Callable[[], str], report: Path) -> str:
    """Return the text that work returns in a forked process.

    Raises:
        RuntimeError: The work failed.
    """
    if run_forked(work, report) != "done":
        raise RuntimeError(report.read_text("utf-8"))
    return report.read_text("utf-8")
