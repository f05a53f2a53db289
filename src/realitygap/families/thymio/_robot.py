"""The Thymio II as a robot that trials and calibration can use."""

from __future__ import annotations

import contextlib
import time
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realitygap.errors import RobotError, RobotStopped, check_finite
from realitygap.robots import (
    EXITS,
    Command,
    Label,
    Observation,
    Port,
    PortDriver,
    StallRule,
    check_command,
)
from realitygap.world import Pose

from ._clock import BoardClock
from ._link import Description, Link
from ._messages import set_variables, user_event
from ._ports import label_of, open_port, port_name
from ._program import DRIVE, OWN, TICK_S, with_sum

FULL_SCALE = 4505.0
"""Reading of an infrared sensor that touches white paper; source: Enki, `Thymio2.cpp`."""
GROUND_WHITE, GROUND_BLACK = 938.0, 76.0
"""Readings of a ground sensor on white and on black; source: means of 3,000 readings each in Enki 1.6.99."""
UNIT_M_S = 0.00033
"""Speed of a wheel for a target of 1 [m/s]; source: frfa1/robotics, `thymio/README.md`, a real robot."""
MOTOR_S = 0.01
"""Time between two `motor` events [s]; source: Aseba, `thymio-api`."""
LIFE_MARGIN_S = 0.2
"""Time for which a command outlives its step, so that the next one finds the motors running [s]."""
EMULATED_MARGIN_S = 0.06
"""Time for which a command outlives its step in a playground, two of the playground's steps [s]. A robot that stops for
a moment loses no speed there. A longer time would move it far during a delay of this program if its time is faster than
real time."""
RENEW_S = 0.2
"""Time after which a long command is sent again [s]."""
START_S = 2.0
"""Time in which the program on board has to run [s]."""
WATCH_S = 0.1
"""Time for which its clock is compared with ours at the beginning [s]."""
STOP_TRIES = 5
MOST_LIFE = 3000
_PROX, _GROUND = "prox.horizontal", "prox.ground.delta"
_TARGETS = ("motor.left.target", "motor.right.target")
_SPEEDS = ("motor.left.speed", "motor.right.speed")
_ENCODERS = ("encoder.0", "encoder.1")


LEAST_TARGET = 50
"""Targets below it count as standing: measured speeds are noisy [units]."""


@dataclass(frozen=True)
class ThymioInfo:
    """Facts about a robot.

    Attributes:
        name: Name in its description.
        node: Number on the network.
        firmware: Version of its firmware.
        port: Port that it answers on.
        label: REAL or EMULATED.
    """

    name: str
    node: int
    firmware: int | None
    port: str
    label: Label


@dataclass(frozen=True)
class _Seen:
    """A reading of everything that a step needs.

    Attributes:
        values: The robot's variables.
        own: Values of the program on board.
    """

    values: dict[str, tuple[int, ...]]
    own: dict[str, int]


class Thymio(PortDriver):
    """A Thymio II on a cable, on a wireless dongle, or in a playground.

    | command | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | 1: both wheels at `full_speed` |
    | turn | -1 | 1 | 1: one wheel ahead, the other back, at `full_speed`, to the left |

    Its seven readings are those of the infrared sensors: five in front from left to right, two behind, left and right.
    Each is a share of `reading_max`. `line.0` and `line.1` are the left and the right ground sensor: 0 is a floor of
    `ground_white`, 1 one of `ground_black`.

    A robot that is REAL also has `encoder.0` and `encoder.1`, the mean measured speed of each wheel since the last
    observation as a part of `full_speed`, and the distance of its wheels. It counts as stalled by `StallRule`. Nobody
    has tried these on a robot. In a playground the measured speed is the target, so there are none of them.

    A program on board stops the motors at the end of each command's life. `close`, the end of a `with` block, an
    exception, Ctrl-C and SIGTERM stop them immediately. If this program is killed, a guardian process stops them.

    Args:
        port: Name of its port, with or without `thymio:` before it; or an open port of pyserial.
        step_s: Duration of a command of `drive` [s].
        full_speed: Target of the wheels for a command of 1, at most 1000.
        reading_max: Infrared reading of the nearest distance that the sensor can measure.
        ground_white, ground_black: Readings of the ground sensors on a white and on a black floor.
        record: New file for all messages, one by one.

    Raises:
        RobotError: The port cannot be opened, no Thymio answers, or several do.
    """

    n_sensors = 7
    lasts_s = 0.0
    """Minimum duration of a command, if another program waits for its end [s]."""
    platform: Any = None
    """The platform that opened it, for figures."""

    def __init__(
        self,
        port: str | Port,
        *,
        step_s: float = 0.1,
        full_speed: int = 300,
        reading_max: float = FULL_SCALE,
        ground_white: float = GROUND_WHITE,
        ground_black: float = GROUND_BLACK,
        record: Path | str | None = None,
    ) -> None:
        check_finite(
            {
                "step_s": step_s,
                "reading_max": reading_max,
                "ground_white": ground_white,
                "ground_black": ground_black,
            }
        )
        if not (step_s >= 0 and 0 < full_speed <= 1000 and reading_max > 0 and ground_white > ground_black):
            raise ValueError(
                f"step_s is {step_s}, full_speed {full_speed}, reading_max {reading_max}, ground_white {ground_white} "
                f"and ground_black {ground_black}, expected 0 or more, 1 to 1000, more than 0, and white above black."
            )
        name = port_name(port) if isinstance(port, str) else str(getattr(port, "name", None) or "a port")
        self.link: Link = Link(open_port(name) if isinstance(port, str) else port, name)
        self.step_s = step_s
        self.full_speed = full_speed
        self.reading_max = reading_max
        self.ground_white, self.ground_black = ground_white, ground_black
        self._selected: tuple[str, ...] = ()
        self._stall = StallRule(LEAST_TARGET)
        self._sums: tuple[int, int] | None = None
        self._way = [0, 0]  # sums of measured speeds since the robot was opened
        self._observed = (0.0, 0, 0)  # time and sums at the last observation
        self.has_encoders = False
        proxy = weakref.proxy(self)
        self.clock = BoardClock(lambda: proxy._read())
        recorder, clock = self._record_into(record, self.clock), self.clock
        if record is not None:  # the link must not hold the robot, which would never be let go
            self.link.tell = lambda name, sent, came: recorder.wire(clock.now(), 0.0, name, sent, came, "ok")
        EXITS.hold()
        try:
            self.description = self.link.find()
            self._check_variables()
            self._load_program()
            firmware = self._read_one("_fwversion")
        except BaseException as error:
            self._give_up(name, error)
            raise
        self._released = weakref.finalize(self, _let_go, self.link, self.description)
        label = label_of(name, self.description.variables)
        self.has_encoders = label == "REAL"
        self.channels = ("line.0", "line.1", *(_ENCODERS if self.has_encoders else ()))
        self.label: Label = label
        self.info: ThymioInfo = ThymioInfo(
            self.description.name, self.description.node, firmware, name, label
        )
        self._record_set_up(name, full_speed=full_speed)

    @property
    def port(self) -> Any:
        """The open port; that of a playground has a `witness`."""
        return self.link.port

    @property
    def name(self) -> str:
        """The robot's name and number, by which it is recognized."""
        return f"{self.info.name} {self.info.node}"

    def _give_up(self, name: str, error: BaseException) -> None:
        self.link.close()
        EXITS.release()
        self._record_failure(name, error)

    def _at(self, name: str) -> int:
        return self.description.variables[name][0]

    def _check_variables(self) -> None:
        wanted = {_PROX: 7, _GROUND: 2, **dict.fromkeys((*_TARGETS, *_SPEEDS), 1)}
        for name, size in wanted.items():
            if self.description.variables.get(name, (0, 0))[1] != size:
                raise RobotError(
                    f"The robot does not describe {name}: is it a Thymio II with its own firmware?"
                )

    def _load_program(self) -> None:
        """Stop the motors, and load what stops them later; if that fails, stop them without it."""
        try:
            _stop(self.link, self.description)
            self.link.load(self.description)
            self._wait_for_program()
            self.link.guard(_stop_messages(self.description))
        except BaseException:
            with contextlib.suppress(RobotError):
                self.link.send(_stop_messages(self.description))
            raise

    def _wait_for_program(self) -> None:
        """Return when the program runs, and its clock has been compared with ours."""
        first, began = self._read(), time.monotonic()
        while (waited := time.monotonic() - began) < START_S:
            seen = self._read()
            is_at_rest = seen.own["life"] == seen.own["halted"] == 0
            if seen.own["clock"] != first.own["clock"] and is_at_rest and waited > WATCH_S:
                return
        raise RobotError(
            "The safety program does not run on the Thymio. Nothing was driven. Switch it off and on."
        )

    def _read_one(self, name: str) -> int | None:
        """Return the first word of a variable; None if the robot does not describe it."""
        if name not in self.description.variables:
            return None
        return self.link.read(self.description, (self._at(name), 1))[0][0]

    def _read(self) -> _Seen:
        """Read everything that a step needs, in one round trip."""
        names = (_PROX, _GROUND, *_SPEEDS, *_TARGETS)
        places = {name: self.description.variables[name] for name in names}
        start = min(offset for offset, _ in places.values())
        end = max(offset + size for offset, size in places.values())
        spans = (start, end - start), (self.description.first_free, len(OWN))
        values, words = self.link.read(self.description, *spans)
        own = dict(zip(OWN, words, strict=True))
        self.clock.note(own["clock"] & 0xFFFF)
        self._own = own
        sums = own["left_sum"], own["right_sum"]
        for k, (now, before) in enumerate(zip(sums, self._sums or sums, strict=True)):
            self._way[k] += (now - before + 0x8000) % 0x10000 - 0x8000
        self._sums = sums
        return _Seen(
            {name: values[at - start : at - start + size] for name, (at, size) in places.items()}, own
        )

    def sensors(self) -> dict[str, tuple[int, ...]]:
        """Return the raw readings: seven of prox.horizontal, two of prox.ground, speeds and targets of the wheels."""
        return self._read().values

    def speeds(self) -> tuple[int, int]:
        """Return the speeds of the left and the right wheel, in the robot's units; in a playground, their targets."""
        seen = self._read().values
        return seen[_SPEEDS[0]][0], seen[_SPEEDS[1]][0]

    def wheels(self) -> tuple[float, float]:
        """Return the distance of each wheel since the robot was opened [m], by measured speeds; not in a playground."""
        self._read()
        left, right = (way * MOTOR_S * UNIT_M_S for way in self._way)
        return left, right

    def battery(self) -> int:
        """Return the raw reading of the battery, whose unit is not documented.

        Raises:
            RobotError: The robot does not describe one, as in a playground.
        """
        found = self._read_one("_vbat")
        if found is None:
            raise RobotError(f"The Thymio on {self.info.port} has no reading of its battery.")
        return found

    # the contract

    def select(self, names: Sequence[str]) -> None:
        """Choose the sensors that `observe` reads besides infrared sensors."""
        self._selected = tuple(names)

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial: motors stopped, and armed again if its center button was pressed."""
        self._recorder.call("reset")
        with self._noted("reset"):
            self._stop_motors()
            halted = self.description.first_free + OWN.index("halted")
            self.link.write(self.description, halted, (0,))
            self._read()
        self._stall = StallRule(LEAST_TARGET)

    def observe(self) -> Observation:
        """Read the infrared sensors, and the selected other ones."""
        with self._noted("observe"):
            seen = self._read()
        raw = tuple(map(float, seen.values[_PROX]))
        readings = tuple(min(max(value / self.reading_max, 0.0), 1.0) for value in raw)
        span = self.ground_white - self.ground_black
        lines = (min(max((self.ground_white - value) / span, 0.0), 1.0) for value in seen.values[_GROUND])
        channels = dict(zip(self.channels, (*lines, *self._encoders()), strict=True))
        stalled = self._is_stalled(seen)
        chosen = {name: channels[name] for name in self._selected}
        return self._seen(Observation(readings, stalled, raw, chosen))

    def _encoders(self) -> tuple[float, ...]:
        """Return the mean speed of each wheel since the last observation, as a part of `full_speed`."""
        if not self.has_encoders:
            return ()
        (before_s, *before), now_s = self._observed, self.clock.now()
        self._observed = (now_s, self._way[0], self._way[1])
        events = max((now_s - before_s) / MOTOR_S, 1.0)
        parts = ((now - then) / events / self.full_speed for now, then in zip(self._way, before, strict=True))
        return tuple(min(max(part, -1.0), 1.0) for part in parts)

    def _is_stalled(self, seen: _Seen) -> bool:
        if not self.has_encoders:
            return False
        targets, speeds = ([seen.values[name][0] for name in names] for names in (_TARGETS, _SPEEDS))
        return self._stall.is_stalled(self.clock.now(), targets, speeds)

    def drive(self, command: Command) -> None:
        """Drive one command for `step_s`: left wheel move - turn, right wheel move + turn, limited to -1..1.

        The robot drives on until the next command, or for 0.2 s; in a playground for 0.06 s.

        Raises:
            RobotError: The link is lost.
            RobotStopped: The center button was pressed.
        """
        command = check_command(command)
        self._recorder.call("drive", move=command.move, turn=command.turn)
        with self._noted("drive"):
            self._drive(command)

    def _drive(self, command: Command) -> None:
        self.link.expect_motion()
        until = self.clock.now() + self.step_s
        while True:
            if self.clock.unread_s >= RENEW_S:
                self._read()
            if self._own["halted"]:
                raise RobotStopped("The center button of the Thymio was pressed: its motors are stopped.")
            remaining = until - self.clock.now()
            piece = max(min(remaining, RENEW_S), 0.0)
            # a playground may be faster than this program can renew commands
            self._send_wheels(command, piece if self.label == "REAL" else max(remaining, 0.0))
            if remaining <= 0:
                return
            self.clock.sleep(piece)
            if remaining <= RENEW_S:
                return

    def _send_wheels(self, command: Command, seconds: float) -> None:
        """Send a command with a life of so much time [s], and a margin."""
        wheels = [round(self.full_speed * wheel) for wheel in command.wheels]
        margin = LIFE_MARGIN_S if self.label == "REAL" else EMULATED_MARGIN_S
        life = round((max(seconds, self.lasts_s) + margin) / TICK_S)
        self.link.emit(DRIVE, (*wheels, min(life, MOST_LIFE)))

    def motors(self, left: float, right: float) -> None:
        """Turn the wheels, each -1 (full back) to 1 (full ahead), until the next command, or for 0.4 s at most.

        Raises:
            RobotError: The link is lost.
        """
        command = check_command(Command((left + right) / 2, (right - left) / 2))
        self.link.expect_motion()
        self._send_wheels(command, RENEW_S * max(self.clock.rate, 1.0))

    def line(self) -> tuple[int, ...]:
        """Return the raw readings of the ground sensors, left and right."""
        return self._read().values[_GROUND]

    def _stop_motors(self) -> None:
        """Stop the motors, and read back that their targets are 0."""
        _stop(self.link, self.description)

    def _end(self) -> None:
        self._stop_motors()
        self.link.reset(self.description)


def _stop_messages(robot: Description) -> bytes:
    """Return the messages that end the life of the last command and set both targets to 0."""
    off = [set_variables(robot.node, robot.variables[name][0], (0,)) for name in _TARGETS]
    return user_event(DRIVE, with_sum((0, 0, 1))) + b"".join(off)


def _stop(link: Link, robot: Description) -> None:
    """Stop the motors, and read back that their targets are 0."""
    targets = [(robot.variables[name][0], 1) for name in _TARGETS]
    for _ in range(STOP_TRIES):
        link.send(_stop_messages(robot))
        if link.read(robot, *targets) == [(0,), (0,)]:
            link.expect_rest()
            return
    raise RobotError(f"The motors of the Thymio on {link.name} do not stop: switch the robot off.")


def _let_go(link: Link, robot: Description) -> None:
    """Stop the motors of a robot that was not closed, and close its port."""
    try:
        if link.is_open:
            with contextlib.suppress(RobotError):
                _stop(link, robot)
                link.reset(robot)
    finally:
        link.close()
        EXITS.release()
