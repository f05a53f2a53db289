"""Bytes lost, doubled, added, changed or late, and links that break, between the driver and an emulated robot.

No real time passes. Each session ends in values of the right kind or in a RobotError. Its motors are off at the end,
unless the error says that they may be running because the link is away.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import serial

import realitygap.emulator  # noqa: F401  # its ports are known from then on
from realitygap.emulator import nanoseconds
from realitygap.errors import RobotError
from realitygap.families.scribbler import Scribbler
from realitygap.families.scribbler.emulator._link import Faults, FaultyLink
from realitygap.robots import Command

SETUPS = ("s1?fluke=1", "s2?fluke=none", "s2?fluke=1", "s2?fluke=2")
KINDS = ("drop", "double", "add", "change", "delay", "break")
SESSION_BYTES = 700
"""Bytes of a session, roughly: faults strike among them."""
LONGEST_SESSION_S = 600.0
"""Simulated time that a session may take [s]."""
STILL_WITHIN_S = 3.0


class StruckLink(FaultyLink):
    """A link that one fault befalls at each of some bytes, counted in both directions together.

    Attributes:
        n_struck: Number of faults that befell it.
    """

    def __init__(self, at: dict[int, str], draw: random.Random) -> None:
        super().__init__(Faults(), 0)
        self._at = at
        self._draw = draw
        self._n_bytes = 0
        self._late = 0
        self.now = 0
        self.n_struck = 0

    def is_up(self, now: int) -> bool:
        """Whether the link is there at a time [ns]."""
        self.now = now
        return super().is_up(now)

    def spoil(self, data: bytes) -> bytes:
        """Return what arrives of some bytes."""
        out = bytearray()
        for byte in data:
            kind = self._at.pop(self._n_bytes, "")
            self._n_bytes += 1
            self.n_struck += bool(kind)
            if kind == "delay":
                self._late = nanoseconds(self._draw.choice((0.05, 0.5, 3.0)))
            elif kind == "break":
                self.hang_up(self.now, self._draw.choice((0.2, 2.0, 1000.0)))
            if kind != "drop":
                out.append(byte ^ 1 << self._draw.randrange(8) if kind == "change" else byte)
            if kind == "double":
                out.append(byte)
            elif kind == "add":
                out.append(self._draw.randrange(256))
        return bytes(out)

    def lateness(self) -> int:
        """Return how late the bytes come that were spoiled last [ns]."""
        late, self._late = self._late, 0
        return late


def inject(seed: int, n: int, folder: Path) -> Iterator[str]:
    """Yield what did not hold in the session of each of n faults."""
    draw = random.Random(seed)
    left = n
    while left > 0:
        at = {draw.randrange(SESSION_BYTES): draw.choice(KINDS) for _ in range(draw.randint(1, min(4, left)))}
        setup = draw.choice(SETUPS)
        told = f"{setup} {sorted(at.items())}"
        n_struck, problem = _session(setup, at, draw)
        yield from [""] * (n_struck - 1)
        if n_struck or problem:
            yield problem and f"{told}: {problem}"
        left -= n_struck


def _session(setup: str, at: dict[int, str], draw: random.Random) -> tuple[int, str]:
    """Drive and read a robot while faults strike; return how many struck, and what did not hold."""
    port: Any = serial.serial_for_url(f"emulator://{setup}&speed=off&seed=1", timeout=1.0)
    emulator = port.emulator
    link = emulator.link = StruckLink(at, draw)
    emulator._spoils, emulator._is_plain = True, False
    told, problem = "", ""
    try:
        with Scribbler(port) as robot:
            for step in range(6):
                robot.drive(Command(draw.uniform(-1, 1), draw.uniform(-1, 1)))
                problem = problem or _invalid(robot, step)
    except RobotError as error:
        told = " ".join([str(error), *getattr(error, "__notes__", ())])
    except Exception as error:
        return link.n_struck, f"not a RobotError: {error!r}"
    is_away = not link.is_up(emulator.now_ns)
    emulator.advance(STILL_WITHIN_S)
    if not problem and any(emulator.wheel_speeds()) and not (is_away and "switch the robot off" in told):
        problem = f"the motors run at the end; the error was {told!r}"
    if not problem and emulator.now > LONGEST_SESSION_S:
        problem = f"the session took {emulator.now:.0f} s"
    return link.n_struck, problem


def _invalid(robot: Scribbler, step: int) -> str:
    """Return what is wrong with the readings of a robot."""
    seen = robot.observe()
    if not all(0.0 <= reading <= 1.0 for reading in seen.readings):
        return f"readings {seen.readings} are outside 0 to 1"
    if step == 2 and not all(0 <= value <= 65535 for value in robot.light()):
        return "light is outside 0 to 65535"
    if step == 4 and robot.info.fluke != "none" and not 0 <= robot.battery() <= 20:
        return "battery is outside 0 to 20 V"
    return ""
