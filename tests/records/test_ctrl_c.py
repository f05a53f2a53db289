"""Ctrl-C ends what waits, whatever the libraries under us do with the signal."""

from __future__ import annotations

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


@pytest.mark.parametrize("module", ["records", "report", "study", "playback", "vision", "lab"])
@pytest.mark.parametrize("waits", WAITS)
def test_ctrl_c_ends_a_wait(module: str, waits: str) -> None:
    code = f"import realitygap.{module}\nprint('waits', flush=True)\n{WAITS[waits]}"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"waits\n"
        time.sleep(0.3)  # until it does
        process.send_signal(signal.SIGINT)
        try:
            assert process.wait(20) == -signal.SIGINT
        finally:
            process.kill()
