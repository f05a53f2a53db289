"""The clock on board while time passes between any two looks at ours."""

import random

from realitygap.families.thymio import _clock as module
from realitygap.families.thymio._clock import BoardClock
from realitygap.families.thymio._program import TICK_S


def test_a_wait_ends_however_long_each_look_takes(monkeypatch):
    numbers = random.Random(3)
    now = [5.0]

    def look():
        now[0] += numbers.expovariate(100.0)
        return now[0]

    def pass_time(piece):
        assert piece >= 0
        now[0] += piece

    monkeypatch.setattr(module.time, "monotonic", look)
    monkeypatch.setattr(module.time, "sleep", pass_time)
    clock = BoardClock(lambda: clock.note(round(now[0] / TICK_S) & 0xFFFF))
    clock.note(round(now[0] / TICK_S) & 0xFFFF)
    for _ in range(100):
        began = clock.now()
        clock.sleep(0.5)
        assert 0.5 - module.SHORTEST_S <= clock.now() - began < 1.0
