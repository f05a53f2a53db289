"""What the tests of the emulator share: packets, and a conversation without real time."""

from realitygap.families.scribbler.emulator import Emulator
from realitygap.world import Arena, Grid, Pose

SET_UPS = [(model, fluke) for model in ("s1", "s2") for fluke in ("none", "1", "2")]
OPEN_FIELD = Arena("open", (), Grid(-5.0, -5.0, 1.0, 10, 10), Pose(0.0, 0.0, 0.0))
"""No walls anywhere near."""


def packet(*values):
    """A robot's command: nine bytes."""
    return bytes(values) + bytes(9 - len(values))


def word(value):
    return [value >> 8 & 0xFF, value & 0xFF]


def long(value):
    return [value >> shift & 0xFF for shift in (24, 16, 8, 0)]


def signed(data):
    return int.from_bytes(data, "big", signed=True)


def say(robot, data, seconds=1.0):
    """Send bytes, let time pass, and give what came back."""
    robot.receive(bytes(data))
    robot.advance(seconds)
    return robot.transmit()


def ask(robot, *values, seconds=1.0):
    """Send a robot's command and give its answer after the echo, which is checked."""
    sent = packet(*values)
    answer = say(robot, sent, seconds)
    assert answer[:9] == sent, (sent, answer)
    return answer[9:]


def make(model="s2", fluke="none", **given):
    given.setdefault("timing", True)
    return Emulator(model, fluke, **given)
