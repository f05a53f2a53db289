"""Conversion between bytes and values: the bytes of each command, and the content of its answer. Nothing here waits.

An answer that no robot gives raises a `ProtocolError`. On a link without checksums, this is how a lost byte is
detected.

Source: the protocol of Myro's firmware and clients (`opcodes.py`).
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import NamedTuple

from realitygap.errors import ProtocolError

from .opcodes import FLUKE_2_COMMANDS, PACKET, ROBOT_ANSWERS, S2_ANSWERS, Op

ANSWER_S = 2.0
"""Maximum time until an answer begins [s]: an S1 in the dark needs 0.4 s; the rest is for Bluetooth."""

VOLTS_PER_COUNT = 1 / 20.9813
"""Voltage per count of the battery's reading. Source: Myro's scribbler.py and the Fluke's fluke.c."""

MAX_OBSTACLE = 8191
"""A value above the range of an obstacle sensor: the loop of a Fluke 1 allows about 8000."""


@dataclass(frozen=True, slots=True)
class Request:
    """The bytes of one command, and the expected answer.

    Attributes:
        name: Name of the command, for messages.
        data: All of its bytes.
        answer: Number of bytes of its answer after the echo, or one of the kinds in `opcodes` (LINE, COUNTED ...).
        echoed: Whether an echo precedes the answer. A robot sends an echo, a Fluke does not.
        repeatable: Whether sending the command twice has the same effect as sending it once.
        wait_s: Maximum time until the answer begins [s].
        pause_s: Time without commands that the robot needs afterwards [s].
        may_stay_out: Whether the answer may be missing, because a Fluke 2 waits only 0.3 s for a robot.
    """

    name: str
    data: bytes
    answer: int
    echoed: bool
    repeatable: bool = True
    wait_s: float = ANSWER_S
    pause_s: float = 0.0
    may_stay_out: bool = False


class SensorBlock(NamedTuple):
    """All sensors of a robot without its Fluke, in raw values.

    Attributes:
        ir: (2,) left, right: 1 is free, 0 an obstacle.
        light: (3,) left, center, right: 0 (bright) to 65535 (dark).
        line: (2,) left, right: 1 is dark, a line.
        stall: Whether the robot reports a stall.
    """

    ir: tuple[int, int]
    light: tuple[int, int, int]
    line: tuple[int, int]
    stall: bool


class MotorStats(NamedTuple):
    """State of the motors of an S2.

    Attributes:
        left: Encoder counts of the last 0.1 s, -128 to 127.
        right: Encoder counts of the right wheel, as for `left`.
        idler_age_s: Time since the idler wheel last moved [s].
        idler_speed: Speed of the idler wheel, 0 to 63.
        moving: Whether a motor turns.
        ready: Whether the robot accepts a new motion.
    """

    left: int
    right: int
    idler_age_s: float
    idler_speed: int
    moving: bool
    ready: bool


class Blob(NamedTuple):
    """The patch with the color of `configure_blob`: number of pixels, and their center in columns and rows."""

    n_pixels: int
    column: int
    row: int


def packet(op: Op, arguments: bytes = b"") -> bytes:
    """Return the nine bytes of a robot's command."""
    return bytes((op,)) + arguments.ljust(PACKET - 1, b"\0")


def robot_request(
    name: str,
    op: Op,
    arguments: bytes = b"",
    *,
    repeatable: bool = True,
    wait_s: float = ANSWER_S,
    may_stay_out: bool = False,
) -> Request:
    """Return a command of the robot, which is answered with an echo and the number of bytes in the table."""
    answer = ROBOT_ANSWERS[op] if op in ROBOT_ANSWERS else S2_ANSWERS[op]
    return Request(
        name, packet(op, arguments), answer, True, repeatable, wait_s=wait_s, may_stay_out=may_stay_out
    )


def fluke_request(
    name: str,
    op: Op,
    arguments: bytes = b"",
    *,
    answer: int | None = None,
    repeatable: bool = True,
    wait_s: float = ANSWER_S,
    pause_s: float = 0.0,
) -> Request:
    """Return a command of the Fluke. `answer` is needed if the table has no length of the answer."""
    if answer is None:
        answer = FLUKE_2_COMMANDS[op].answer
    return Request(name, bytes((op,)) + arguments, answer, False, repeatable, wait_s, pause_s)


INFO = Request("info", bytes((Op.GET_INFO,)) + b" " * 8, ROBOT_ANSWERS[Op.GET_INFO], False)
STOP = robot_request("stop", Op.SET_MOTORS_OFF)
ECHO_OFF = robot_request("echo mode off", Op.SET_ECHO_MODE, b"\0")
VERSION = fluke_request("version of the Fluke", Op.GET_VERSION)
BATTERY = fluke_request("battery", Op.GET_BATTERY)


def wheel_byte(value: float) -> int:
    """Return the byte of one wheel: 0 full back, 100 stop, 200 full ahead. The fraction is cut off, as in Myro."""
    return int((value + 1.0) * 100.0)


def motors(left: float, right: float) -> Request:
    """Return the command that turns the wheels, each -1 to 1, until the next one. The right wheel is sent first."""
    return Request(
        "motors",
        bytes((Op.SET_MOTORS, wheel_byte(right), wheel_byte(left), 0, 0, 0, 0, 0, 0)),
        ROBOT_ANSWERS[Op.SET_MOTORS],
        True,
    )


def is_echo(sent: bytes, got: bytes) -> bool:
    """Return whether nine bytes are the echo of a command.

    A Fluke whose own end is ahead swaps the motors before it passes the command on, so their echo may be swapped.
    """
    if sent == got:
        return True
    turned = sent[0] == Op.SET_MOTORS and got[:3] == bytes(
        (sent[0], (200 - sent[2]) % 256, (200 - sent[1]) % 256)
    )
    return turned and got[3:] == sent[3:]


def _bits(name: str, values: bytes) -> tuple[int, ...]:
    if max(values) > 1:
        raise ProtocolError(f"{name} is {max(values)}, expected 0 or 1: a byte was lost or added")
    return tuple(values)


def sensor_block(answer: bytes) -> SensorBlock:
    """Decode the sensors from the 11 bytes that answer every setting."""
    ir_left, ir_right, left, center, right, line_left, line_right, stall = struct.unpack(">BBHHHBBB", answer)
    if ir_left > 1 or ir_right > 1 or line_left > 1 or line_right > 1 or stall > 1:
        _bits("A flag of the sensors", bytes((ir_left, ir_right, line_left, line_right, stall)))
    return SensorBlock((ir_left, ir_right), (left, center, right), (line_left, line_right), stall == 1)


def nothing(answer: bytes) -> None:
    """Discard an answer."""


def flag(answer: bytes) -> int:
    """Decode one byte that is 0 or 1."""
    return _bits("The answer", answer)[0]


def two_flags(answer: bytes) -> tuple[int, int]:
    """Decode left and right, each 0 or 1."""
    left, right = _bits("The answer", answer)
    return left, right


def binary_block(answer: bytes) -> tuple[tuple[int, int], tuple[int, int], bool]:
    """Decode IR (left, right), line (left, right), and stall from the bits of one byte."""
    bits = answer[0]
    if bits > 31:
        raise ProtocolError(f"The flags are {bits}, expected at most 31: a byte was lost or added")
    return (bits >> 4 & 1, bits >> 3 & 1), (bits >> 1 & 1, bits & 1), bool(bits >> 2 & 1)


def light_words(answer: bytes) -> tuple[int, int, int]:
    """Decode light left, center, right."""
    left, center, right = struct.unpack(">HHH", answer)
    return left, center, right


def word(answer: bytes) -> int:
    """Decode a whole number of one to three bytes, high byte first."""
    return int.from_bytes(answer, "big")


def obstacle(answer: bytes) -> int:
    """Decode the infrared light that returned: 0 is free, 6400 and above an obstacle."""
    value = int.from_bytes(answer, "big")
    if value > MAX_OBSTACLE:
        raise ProtocolError(
            f"An obstacle reading is {value}, expected at most {MAX_OBSTACLE}: a byte was lost or added"
        )
    return value


def volts(answer: bytes) -> float:
    """Decode the battery voltage [V]."""
    value = int.from_bytes(answer, "big")
    if value > 511:
        raise ProtocolError(f"The battery reads {value}, expected at most 511: a byte was lost or added")
    return value * VOLTS_PER_COUNT


def distance(answer: bytes) -> int:
    """Decode the distance by an S2: 0 (touching) to 99 (nothing in range)."""
    if answer[0] > 100:
        raise ProtocolError(f"A distance is {answer[0]}, expected at most 100: a byte was lost or added")
    return answer[0]


def signed_long(answer: bytes) -> int:
    """Decode four bytes in two's complement."""
    return int.from_bytes(answer, "big", signed=True)


def signed_longs(answer: bytes) -> tuple[int, int]:
    """Decode two numbers from eight bytes."""
    one, other = struct.unpack(">ii", answer)
    return one, other


def motor_stats(answer: bytes) -> MotorStats:
    """Decode the state of an S2's motors from five bytes."""
    left, right, age, idler, ready = struct.unpack(">bbBBB", answer)
    return MotorStats(left, right, age / 10, idler >> 2, bool(idler & 3), ready == 1)


def blob(answer: bytes) -> Blob:
    """Decode count, column, and row from four bytes."""
    return Blob(*struct.unpack(">HBB", answer))


def text(answer: bytes) -> str:
    """Decode the characters of a name, without padding."""
    return answer.decode("latin-1").strip("\0 ")


def name_bytes(what: str, value: str) -> bytes:
    """Return a name or password as 16 bytes, padded with blanks as the robot's own names are.

    Raises:
        ValueError: The name is longer, or has a character that is not ASCII.
    """
    if not value.isascii() or not value.isprintable() or len(value) > 16:
        raise ValueError(f"The {what} is {value!r}, expected at most 16 printable ASCII characters.")
    return value.encode("ascii").ljust(16)


class InfoLine(NamedTuple):
    """Models and firmware versions of a robot and its Fluke.

    Attributes:
        model: "s1", "s2" (also an S3), or None if no robot answers.
        fluke: "none", "1" or "2".
        robot_version: Firmware version of the robot as sent. Empty if there is no robot.
        fluke_version: Firmware version of the Fluke as sent. Empty if there is no Fluke.
    """

    model: str | None
    fluke: str
    robot_version: str
    fluke_version: str


_INFO_KEY = re.compile(rb"(fluke|dongle|robot-version|robot|api|mode)\s*:", re.IGNORECASE)
_MODELS = {"scribbler": "s1", "scribbler2": "s2", "scribbler3": "s2"}


def info_line(answer: bytes) -> InfoLine:
    """Decode the info line. Parts of an echo or of a name may precede it."""
    first = _INFO_KEY.search(answer)
    if first is None:
        raise ProtocolError(f"{answer[:60]!r} is not how a Scribbler or a Fluke presents itself")
    values: dict[str, str] = {}
    for part in answer[first.start() :].decode("latin-1").split(","):
        key, colon, value = part.partition(":")
        if colon:
            values[key.strip().lower()] = value.strip()
    robot = values.get("robot", "").lower()
    model = _MODELS.get(robot)
    if robot and model is None:
        raise ProtocolError(f"The robot calls itself {robot!r}, expected Scribbler or Scribbler2")
    fluke_version = values.get("fluke", values.get("dongle", ""))
    if model is None and not fluke_version:
        raise ProtocolError(f"{answer[:60]!r} names neither a robot nor a Fluke")
    numbers = re.findall(r"\d+", fluke_version)
    fluke = "none" if not fluke_version else "2" if numbers and int(numbers[0]) >= 3 else "1"
    return InfoLine(model, fluke, values.get("robot-version", values.get("api", "")), fluke_version)


_FLUKE_INFO = rb"((fluke|dongle):\d\.\d+\.\d+"
_ROBOT_INFO = rb"(robot-version|api):\d\.\d+\.\d+,robot:scribbler"
_PLAIN_INFO = re.compile(
    rb"P +" + _FLUKE_INFO + rb", ?)?" + _ROBOT_INFO + rb",mode:serial\n"  # an S1 sends the command back first
    rb"|" + _FLUKE_INFO + rb",)?" + _ROBOT_INFO + rb"[23],mode:serial\n"
    rb"|" + _FLUKE_INFO + rb"\n)",
    re.IGNORECASE,
)


def is_plain_info(answer: bytes) -> bool:
    """Return whether an info line has exactly the form of the known firmware."""
    return _PLAIN_INFO.fullmatch(answer) is not None


def late_sensor_block(answer: bytes) -> SensorBlock | None:
    """Decode the sensors, or return None if a Fluke 2 did not wait for them."""
    return sensor_block(answer) if answer else None
