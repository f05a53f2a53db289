"""Real time: waits are as long as they should be, and whoever ends a program need not wait for them."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

import realitygap
from realitygap.robots import SystemClock
from realitygap.robots import _clock as module


@pytest.mark.parametrize("seconds", [-1.0, 0.0, 0.02, 0.35])
def test_a_wait_is_as_long_as_it_should_be(monkeypatch, seconds):
    now, pieces = [5.0], []

    def pass_time(piece):
        assert piece >= 0
        pieces.append(piece)
        now[0] += piece + 0.004  # as systems do

    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(module.time, "sleep", pass_time)
    SystemClock().sleep(seconds)
    assert max(seconds, 0) <= now[0] - 5 <= max(seconds, 0) + 0.005
    assert max(pieces) <= module.HEAR_S


def test_ctrl_c_that_comes_just_before_a_wait_is_heard_soon(monkeypatch):
    sleep = time.sleep

    def unaware(seconds):
        """As Python's where a signal comes between its last look and the system's sleep."""
        sleep(seconds)
        raise KeyboardInterrupt

    monkeypatch.setattr(module.time, "sleep", unaware)
    since = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        SystemClock().sleep(60.0)
    assert time.monotonic() - since < 30.0


def test_nothing_that_drives_robots_depends_on_the_time_of_day():
    """The computer's clock can jump while a robot drives; the monotonic clock cannot."""
    packages = Path(realitygap.__file__).parent
    for package in ("robots", "emulator", "trials"):
        for path in (packages / package).rglob("*.py"):
            assert "time.time(" not in path.read_text("utf-8"), path
