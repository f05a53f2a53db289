"""A port with a script, and a plain Scribbler behind a port, for the wire and its faults.

The Scribbler here follows the protocol in the plainest way, for the faults; what a real one would say beyond that is
the emulator's business, which has tests of its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from realitygap.families.scribbler.opcodes import (
    COUNTED,
    FLUKE_2_COMMANDS,
    FLUKE_COMMANDS,
    LINE,
    ROBOT_ANSWERS,
    S2_ANSWERS,
    Op,
)

from ...robots.ports import BufferPort


def packet(*values: int) -> bytes:
    return bytes(values).ljust(9, b"\0")


BLOCK = bytes([1, 1, 0, 100, 0, 101, 0, 102, 0, 1, 0])
INFO_S2_FLUKE_1 = b"fluke:2.9.1,Robot-Version:1.1.5,Robot:Scribbler2,Mode:Serial\n"
INFO_S2_FLUKE_2 = b"fluke:3.0.5,Robot-Version:1.1.5,Robot:Scribbler2,Mode:Serial\n"
INFO_S2 = b"Robot-Version:1.1.5,Robot:Scribbler2,Mode:Serial\n"
INFO_S1 = b"P        Robot-Version:2.6.2,Robot:Scribbler,Mode:Serial\n"
INFO_S1_FLUKE_1 = b"P        fluke:2.9.1, Robot-Version:2.6.2,Robot:Scribbler,Mode:Serial\n"
INFO_FLUKE_1 = b"fluke:2.9.1\n"
INFOS = {
    "s1": INFO_S1,
    "s2": INFO_S2,
    "s1+fluke1": INFO_S1_FLUKE_1,
    "s2+fluke1": INFO_S2_FLUKE_1,
    "s2+fluke2": INFO_S2_FLUKE_2,
    "fluke1": INFO_FLUKE_1,
}


def echoed(*values: int, answer: bytes = BLOCK) -> tuple[bytes, bytes]:
    """A packet, and what a robot sends back."""
    return packet(*values), packet(*values) + answer


def greeting(info: bytes) -> list[tuple[bytes, bytes]]:
    """What is said as a robot is opened."""
    asked = (b"P" + b" " * 8, info)
    return [asked] if info == INFO_FLUKE_1 else [asked, echoed(98, 0), echoed(108)]


class ScriptedPort(BufferPort):
    """Expects exactly these bytes, each write as one, and answers with these; anything else fails the test."""

    def __init__(self, script: Iterable[tuple[bytes, bytes]]) -> None:
        super().__init__()
        self.script = list(script)
        self.writes: list[bytes] = []
        self.n_late_stops = 0

    def write(self, data: bytes) -> int:
        self.writes.append(data)
        if not self.script and data == packet(Op.SET_MOTORS_OFF):  # of a robot that is thrown away
            self.n_late_stops += 1
            self.incoming += data + BLOCK
            return len(data)
        assert self.script, f"{data!r} was sent after the end of the script"
        sent, answer = self.script.pop(0)
        assert data == sent, f"{list(data)} was sent, the script has {list(sent)}"
        self.incoming += answer
        return len(data)

    def check_all_said(self) -> None:
        assert not self.script, f"Not said: {self.script}"
        assert not self.incoming, f"Not read: {bytes(self.incoming)!r}"
        assert not self.n_late_stops, "It was stopped once more"


@dataclass
class FakeScribbler:
    """A robot behind an optional Fluke, byte by byte; a Fluke 1 never forgets how far it is in a packet."""

    setup: str = "s2+fluke1"
    motors: tuple[int, int] = (100, 100)
    carried_out: list[bytes] = field(default_factory=list)
    robot_buffer: bytearray = field(default_factory=bytearray)
    last_byte_s: float = -10.0
    fluke_count: int = 0
    fluke_pending: bytearray = field(default_factory=bytearray)
    memory: int = 0

    @property
    def fluke(self) -> str:
        return self.setup[-1] if "fluke" in self.setup else ""

    def receive(self, byte: int, now: float) -> bytes:
        if not self.fluke:
            return self.robot_byte(byte, now)
        if self.fluke_count:
            self.fluke_count = (self.fluke_count + 1) % 9
            return self.robot_byte(byte, now)
        lengths = FLUKE_2_COMMANDS if self.fluke == "2" else FLUKE_COMMANDS
        if self.fluke_pending or byte in lengths:
            self.fluke_pending.append(byte)
            if len(self.fluke_pending) <= lengths[Op(self.fluke_pending[0])].arguments:
                return b""
            command, self.fluke_pending = bytes(self.fluke_pending), bytearray()
            return self.fluke_command(command, lengths[Op(command[0])].answer)
        self.fluke_count = 1
        return self.robot_byte(byte, now)

    def fluke_command(self, command: bytes, n_answer: int) -> bytes:
        self.carried_out.append(command)
        if command[0] == Op.SET_FORWARDNESS:
            self.memory = 0 if command[1] else 0xDF
        if command[0] == Op.GET_BATTERY:
            return bytes((0, 180))
        if command[0] == Op.GET_SERIAL_MEMORY:
            return bytes((self.memory,))
        if n_answer == LINE:
            return b"fluke:2.9.1\n"
        if n_answer == COUNTED:
            return bytes((0, 3)) + b"abc"
        return bytes((3, 32) * (n_answer // 2)) if n_answer > 0 else b""

    def robot_byte(self, byte: int, now: float) -> bytes:
        if self.setup.startswith("fluke"):
            if byte == 32 and self.fluke_count == 0:  # the last blank of an info request
                return INFO_FLUKE_1
            return b""
        if now - self.last_byte_s > 1.0:
            self.robot_buffer.clear()
        self.last_byte_s = now
        self.robot_buffer.append(byte)
        if len(self.robot_buffer) < 9:
            return b""
        command = bytes(self.robot_buffer)
        self.robot_buffer.clear()
        return self.robot_command(command)

    def robot_command(self, command: bytes) -> bytes:
        self.carried_out.append(command)
        if command[0] == Op.SET_MOTORS:
            self.motors = (command[1], command[2])
        elif command[0] == Op.SET_MOTORS_OFF:
            self.motors = (100, 100)
        if command[0] == Op.GET_INFO:
            return INFOS[self.setup]
        known = ROBOT_ANSWERS if self.setup.startswith("s1") else ROBOT_ANSWERS | S2_ANSWERS
        n_answer = known.get(command[0], 0)  # type: ignore[call-overload]
        answer = BLOCK if n_answer == 11 else bytes(n_answer)
        return command + answer
