"""Files of any size are read in parts: memory does not grow with the file."""

import multiprocessing
from pathlib import Path

import pytest

from realitygap.logs import LogMap, read_logs
from realitygap.world import load_robot

MIB = 1 << 20
LINE = b"0.125000000,0.250000000,1.000000000,2.000000000,0.500000000\n"
PART = {"left": 1, "right": 2, "rate_hz": 1000.0}
MAP = LogMap(commands=PART, poses={"x": 3, "y": 4, "heading": 5, "rate_hz": 1000.0}, step_s=1.0)


def peak_mib(path):
    """Memory that a process of its own needs at most while it reads a log, and the steps that it finds."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_read, (path,))


def _read(path):
    robot = load_robot("pioneer")
    steps = sum(len(log.commands) for log in read_logs(path, MAP, robot))
    status = Path("/proc/self/status").read_text()  # unlike getrusage, without what the process before it had
    return int(status.partition("VmHWM:")[2].split()[0]) / 1024, steps


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs Linux to measure memory")
def test_memory_does_not_grow_with_the_file(tmp_path):
    """A file that is four times as large needs at most 60 MiB more, for its steps."""
    peaks = []
    for size in (32 * MIB, 128 * MIB):
        path = tmp_path / "log.csv"
        with path.open("wb") as file:
            for _ in range(size // MIB):
                file.write(LINE * (MIB // len(LINE)))
        peak, steps = peak_mib(path)
        assert steps == size // MIB * (MIB // len(LINE)) // 1000 - (
            (size // MIB * (MIB // len(LINE))) % 1000 == 0
        )
        peaks.append(peak)
    assert peaks[1] - peaks[0] < 60
    assert peaks[1] < 600
