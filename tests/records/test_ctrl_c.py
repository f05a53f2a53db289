"""Ctrl-C ends what waits, whatever the libraries under us do with the signal."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.slow

WAITS = {
    "lock": "import threading; lock = threading.Lock(); lock.acquire(); lock.acquire()",
    "input": "input()",
    "process": f"import subprocess; subprocess.Popen([{sys.executable!r}, '-c', 'input()']).wait()",
}

FORKS = """
import os, signal, sys
import realitygap.{module}
for waits in sys.argv[1:]:  # each in a process of its own, with the same imports
    child = os.fork()
    if child == 0:
        signal.alarm(20)
        print(os.getpid(), flush=True)
        exec(waits)
        os._exit(0)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


@pytest.mark.parametrize("module", ["records", "report", "study", "playback", "vision", "lab"])
def test_ctrl_c_ends_a_wait(module: str) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", FORKS.format(module=module), *WAITS.values()],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        for name in WAITS:
            waiting = int(process.stdout.readline())
            time.sleep(0.3)  # until it does
            os.kill(waiting, signal.SIGINT)
            assert int(process.stdout.readline()) == -signal.SIGINT, name
