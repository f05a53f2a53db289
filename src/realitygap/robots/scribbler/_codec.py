"""Bytes to values and back: what is sent for each command, and what its answer says. Nothing here waits or fails.

Except that an answer that no robot gives is refused (`ProtocolError`): on a link without checksums, that is how a lost
byte shows.

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
"""How long an answer may take to begin [s]: an S1 in the dark takes 0.4 s; the rest is for Bluetooth."""

VOLTS_PER_COUNT = 1 / 20.9813
"""Of the battery's reading. Source: Myro's scribbler.py and the Fluke's fluke.c."""

MAX_OBSTACLE = 8191
"""More than an obstacle sensor can count: the loop of a Fluke 1 allows about 8000."""


@dataclass(frozen=True, slots=True)
class Request:
    """One command as it goes over the wire, and what to expect of its answer.

    Attributes:
        name: What people call it.
        data: All of its bytes.
        answer: Bytes of its answer after the echo, or one of the kinds in `opcodes` (LINE, COUNTED ...).
        echoed: Whether the bytes come back first, as a robot's do; a Fluke's do not.
        repeatable: Whether sending it twice does what sending it once does.
        wait_s: How long the answer may take to begin [s].
        pause_s: How long the robot wants to be left alone afterwards [s].
        may_stay_out: Whether a Fluke 2, which waits only 0.3 s for a robot, may swallow the answer.
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
    """All senses of a robot without its Fluke, as they came.

    Attributes:
        ir: (2,) left, right: 1 is free, 0 an obstacle.
        light: (3,) left, center, right: 0 (bright) to 65535 (dark).
        line: (2,) left, right: 1 is dark, a line.
        stall: Whether the wheels do not turn as they should.
    """

    ir: tuple[int, int]
    light: tuple[int, int, int]
    line: tuple[int, int]
    stall: bool


class MotorStats(NamedTuple):
    """How an S2 moves.

    Attributes:
        left: Encoder counts of the last 0.1 s, -128 to 127.
        right: Likewise.
        idler_age_s: Since when the idler wheel has not moved [s].
        idler_speed: 0 to 63.
        moving: Whether a motor turns.
        ready: Whether a new motion may be given.
    """

    left: int
    right: int
    idler_age_s: float
    idler_speed: int
    moving: bool
    ready: bool


class Blob(NamedTuple):
    """The patch of the color asked for: how many pixels, and their middle in columns and rows of the picture."""

    n_pixels: int
    column: int
    row: int


def packet(op: Op, arguments: bytes = b"") -> bytes:
    """The nine bytes of a robot's command."""
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
    """A command of the robot, answered with an echo and bytes as the table has them."""
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
    """A command of the Fluke; `answer` where the table leaves it open."""
    if answer is None:
        answer = FLUKE_2_COMMANDS[op].answer
    return Request(name, bytes((op,)) + arguments, answer, False, repeatable, wait_s, pause_s)


INFO = Request("info", bytes((Op.GET_INFO,)) + b" " * 8, ROBOT_ANSWERS[Op.GET_INFO], False)
STOP = robot_request("stop", Op.SET_MOTORS_OFF)
ECHO_OFF = robot_request("echo mode off", Op.SET_ECHO_MODE, b"\0")
VERSION = fluke_request("version of the Fluke", Op.GET_VERSION)
BATTERY = fluke_request("battery", Op.GET_BATTERY)


def wheel_byte(value: float) -> int:
    """The byte of one wheel: 0 full back, 100 stop, 200 full ahead; the fraction is cut off, as Myro does."""
    return int((value + 1.0) * 100.0)


def motors(left: float, right: float) -> Request:
    """Turn the wheels, each -1 to 1, until told otherwise; the right one comes first on the wire."""
    return Request(
        "motors",
        bytes((Op.SET_MOTORS, wheel_byte(right), wheel_byte(left), 0, 0, 0, 0, 0, 0)),
        ROBOT_ANSWERS[Op.SET_MOTORS],
        True,
    )


def is_echo(sent: bytes, got: bytes) -> bool:
    """Whether these nine bytes are what a robot sends back of a command.

    A Fluke that has itself ahead turns the motors round before it passes them on, so their echo may come turned.
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
    """The senses in the 11 bytes with which every setting is answered."""
    ir_left, ir_right, left, center, right, line_left, line_right, stall = struct.unpack(">BBHHHBBB", answer)
    if ir_left > 1 or ir_right > 1 or line_left > 1 or line_right > 1 or stall > 1:
        _bits("A flag of the sensors", bytes((ir_left, ir_right, line_left, line_right, stall)))
    return SensorBlock((ir_left, ir_right), (left, center, right), (line_left, line_right), stall == 1)


def nothing(answer: bytes) -> None:
    """Of an answer that is of no interest."""


def flag(answer: bytes) -> int:
    """One byte that is 0 or 1."""
    return _bits("The answer", answer)[0]


def two_flags(answer: bytes) -> tuple[int, int]:
    """Left and right, each 0 or 1."""
    left, right = _bits("The answer", answer)
    return left, right


def binary_block(answer: bytes) -> tuple[tuple[int, int], tuple[int, int], bool]:
    """IR (left, right), line (left, right) and stall from the bits of one byte."""
    bits = answer[0]
    if bits > 31:
        raise ProtocolError(f"The flags are {bits}, expected at most 31: a byte was lost or added")
    return (bits >> 4 & 1, bits >> 3 & 1), (bits >> 1 & 1, bits & 1), bool(bits >> 2 & 1)


def light_words(answer: bytes) -> tuple[int, int, int]:
    """Light left, center, right."""
    left, center, right = struct.unpack(">HHH", answer)
    return left, center, right


def word(answer: bytes) -> int:
    """A whole number of one to three bytes, high one first."""
    return int.from_bytes(answer, "big")


def obstacle(answer: bytes) -> int:
    """How much infrared came back: 0 is free, 6400 and above an obstacle."""
    value = int.from_bytes(answer, "big")
    if value > MAX_OBSTACLE:
        raise ProtocolError(
            f"An obstacle reading is {value}, expected at most {MAX_OBSTACLE}: a byte was lost or added"
        )
    return value


def volts(answer: bytes) -> float:
    """The battery [V]."""
    value = int.from_bytes(answer, "big")
    if value > 511:
        raise ProtocolError(f"The battery reads {value}, expected at most 511: a byte was lost or added")
    return value * VOLTS_PER_COUNT


def distance(answer: bytes) -> int:
    """How far an S2 sees: 0 (touching) to 99 (nothing seen)."""
    if answer[0] > 100:
        raise ProtocolError(f"A distance is {answer[0]}, expected at most 100: a byte was lost or added")
    return answer[0]


def signed_long(answer: bytes) -> int:
    """Four bytes, two's complement."""
    return int.from_bytes(answer, "big", signed=True)


def signed_longs(answer: bytes) -> tuple[int, int]:
    """Eight bytes: two of them."""
    one, other = struct.unpack(">ii", answer)
    return one, other


def motor_stats(answer: bytes) -> MotorStats:
    """How an S2 moves, from five bytes."""
    left, right, age, idler, ready = struct.unpack(">bbBBB", answer)
    return MotorStats(left, right, age / 10, idler >> 2, bool(idler & 3), ready == 1)


def blob(answer: bytes) -> Blob:
    """Count, column and row from four bytes."""
    return Blob(*struct.unpack(">HBB", answer))


def text(answer: bytes) -> str:
    """Characters of a name, without what fills it up."""
    return answer.decode("latin-1").strip("\0 ")


def name_bytes(what: str, value: str) -> bytes:
    """A name or password as 16 bytes, filled up with blanks as the robot's own are.

    Raises:
        ValueError: it is longer, or has a letter beyond ASCII.
    """
    if not value.isascii() or not value.isprintable() or len(value) > 16:
        raise ValueError(f"The {what} is {value!r}, expected at most 16 printable ASCII characters.")
    return value.encode("ascii").ljust(16)


class InfoLine(NamedTuple):
    """What a robot and its Fluke say of themselves.

    Attributes:
        model: "s1", "s2" (also an S3), or None where no robot answers.
        fluke: "none", "1" or "2".
        robot_version: As it came; empty where there is no robot.
        fluke_version: As it came; empty where there is no Fluke.
    """

    model: str | None
    fluke: str
    robot_version: str
    fluke_version: str


_INFO_KEY = re.compile(rb"(fluke|dongle|robot-version|robot|api|mode)\s*:", re.IGNORECASE)
_MODELS = {"scribbler": "s1", "scribbler2": "s2", "scribbler3": "s2"}


def info_line(answer: bytes) -> InfoLine:
    """Who answers, from the info line, whatever of an echo or of a name comes before it."""
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
    """Whether an info line is letter by letter as the firmware known to us writes it."""
    return _PLAIN_INFO.fullmatch(answer) is not None


def late_sensor_block(answer: bytes) -> SensorBlock | None:
    """The senses, or None where a Fluke 2 did not wait for them."""
    return sensor_block(answer) if answer else None
