"""The Thymio II as a robot that trials and calibration can use."""

from __future__ import annotations

import contextlib
import time
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

from realitygap.errors import RobotError, RobotStopped
from realitygap.robots._clock import HEAR_S
from realitygap.robots._contract import Command, Label, Observation, check_command
from realitygap.robots.scribbler._exits import EXITS
from realitygap.world import Pose

from ._link import Description, Link, open_port
from ._ports import label_of, port_name
from ._program import DRIVE, OWN, TICK_S

FULL_SCALE = 4505.0
"""Reading of an infrared sensor that touches white paper; source: Enki, `Thymio2.cpp`."""
GROUND_SCALE = 1023.0
"""Largest reading of a ground sensor."""
LIFE_MARGIN_S = 0.2
"""Time for which a command outlives its step, so that the next one finds the motors running [s]."""
RENEW_S = 0.2
"""Time after which a long command is sent again [s]."""
CLOCK_STANDS_S = 2.0
"""Time after which a clock on board that does not advance counts as stopped [s]."""
STOP_TRIES = 5
MOST_LIFE = 3000
_PROX, _GROUND = "prox.horizontal", "prox.ground.delta"
_TARGETS = ("motor.left.target", "motor.right.target")
_SPEEDS = ("motor.left.speed", "motor.right.speed")


@dataclass(frozen=True)
class ThymioInfo:
    """Facts about a robot.

    Attributes:
        name: Name in its description.
        node: Its number on the network.
        firmware: Version of its firmware.
        port: Port that it answers on.
        label: REAL or EMULATED.
    """

    name: str
    node: int
    firmware: int | None
    port: str
    label: Label


class BoardClock:
    """Time by the ticks that the program on board counts; a simulation may run faster than real time."""

    def __init__(self, robot: Thymio) -> None:
        self._robot = weakref.proxy(robot)
        self._ticks = 0
        self._last: int | None = None

    def now(self) -> float:
        """The time since the robot was opened [s]."""
        found = self._robot.own()[OWN.index("clock")] & 0xFFFF
        self._ticks += 0 if self._last is None else (found - self._last) & 0xFFFF
        self._last = found
        return self._ticks * TICK_S

    def sleep(self, seconds: float) -> None:
        """Let so much time pass [s].

        Raises:
            RobotError: The robot does not answer, or its clock stands still.
        """
        now = self.now()
        until, moved_s = now + seconds, time.monotonic()
        while now < until:
            time.sleep(min((until - now) / 16, HEAR_S / 2))
            before, now = now, self.now()
            if now > before:
                moved_s = time.monotonic()
            elif time.monotonic() - moved_s > CLOCK_STANDS_S:
                raise RobotError("The clock on board of the Thymio stands still: its program does not run.")


class Thymio:
    """A Thymio II on a cable, on a wireless dongle, or in a playground.

    | command | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | 1: both wheels at `full_speed` |
    | turn | -1 | 1 | 1: one wheel ahead, the other back, at `full_speed`, to the left |

    Its seven readings are those of the infrared sensors: five in front from left to right, two behind, left and right.
    Each is a share of `reading_max`. `line.0` and `line.1` are the left and the right ground sensor: 0 is a white
    floor, 1 is a black one. `stalled` is always False: no rule for it has been tried on a robot.

    A program on board stops the motors at the end of each command's life. `close`, the end of a `with` block, an
    exception, Ctrl-C and SIGTERM stop them immediately.

    Args:
        port: Name of its port, with or without `thymio:` before it; or an open port of pyserial.
        step_s: Duration of a command of `drive` [s].
        full_speed: Target of the wheels for a command of 1, at most 1000.
        reading_max: Infrared reading that is as near as can be told.

    Raises:
        RobotError: The port cannot be opened, no Thymio answers, or several do.
    """

    channels = ("line.0", "line.1")
    n_sensors = 7

    def __init__(
        self,
        port: str | Any,
        *,
        step_s: float = 0.1,
        full_speed: int = 300,
        reading_max: float = FULL_SCALE,
    ) -> None:
        if not (step_s >= 0 and 0 < full_speed <= 1000 and reading_max > 0):
            raise ValueError(
                f"step_s is {step_s}, full_speed {full_speed} and reading_max {reading_max}, expected 0 or more, "
                "1 to 1000, and more than 0."
            )
        name = port_name(port) if isinstance(port, str) else str(getattr(port, "name", None) or "a port")
        self.link = Link(open_port(name) if isinstance(port, str) else port, name)
        self.step_s = step_s
        self.full_speed = full_speed
        self.reading_max = reading_max
        self._selected: tuple[str, ...] = ()
        EXITS.hold()
        try:
            self.description = self.link.find()
            self._check_variables()
            self.link.write(self.description, self._at(_TARGETS[0]), (0,))
            self.link.write(self.description, self._at(_TARGETS[1]), (0,))
            self.link.load(self.description)
            self._wait_for_program()
            firmware = self._read_one("_fwversion")
        except BaseException:
            self.link.close()
            EXITS.release()
            raise
        self._released = weakref.finalize(self, _let_go, self.link, self.description)
        label = label_of(name, self.description.variables)
        self.label: Label = label
        self.info = ThymioInfo(self.description.name, self.description.node, firmware, name, label)
        self.clock = BoardClock(self)

    def _at(self, name: str) -> int:
        return self.description.variables[name][0]

    def _check_variables(self) -> None:
        wanted = {_PROX: 7, _GROUND: 2, **dict.fromkeys((*_TARGETS, *_SPEEDS), 1)}
        for name, size in wanted.items():
            if self.description.variables.get(name, (0, 0))[1] != size:
                raise RobotError(
                    f"The robot does not describe {name}: is it a Thymio II with its own firmware?"
                )

    def _wait_for_program(self) -> None:
        """Return when the program's clock advances."""
        first, until = self.own(), time.monotonic() + CLOCK_STANDS_S
        while time.monotonic() < until:
            if (now := self.own())[-1] != first[-1] and now[0] == now[1] == 0:
                return
        raise RobotError(
            "The safety program does not run on the Thymio. Nothing was driven. Switch it off and on."
        )

    def _read_one(self, name: str) -> int | None:
        """Return the first word of a variable; None if the robot does not describe it."""
        if name not in self.description.variables:
            return None
        return self.link.read(self.description, self._at(name), 1)[0]

    def own(self) -> tuple[int, ...]:
        """Return the variables of the program on board: life, halted, taps, clock."""
        return self.link.read(self.description, self.description.first_free, len(OWN))

    def _sensed(self) -> dict[str, tuple[int, ...]]:
        """Return the variables of a step, read in one question."""
        names = (_PROX, _GROUND, *_SPEEDS, *_TARGETS)
        places = {name: self.description.variables[name] for name in names}
        start = min(offset for offset, _ in places.values())
        end = max(offset + size for offset, size in places.values())
        values = self.link.read(self.description, start, end - start)
        return {name: values[at - start : at - start + size] for name, (at, size) in places.items()}

    def sensors(self) -> dict[str, tuple[int, ...]]:
        """Return the raw readings: seven of prox.horizontal, two of prox.ground, speeds and targets of the wheels."""
        return self._sensed()

    def speeds(self) -> tuple[int, int]:
        """Return the speeds of the left and the right wheel, in the robot's units; in a playground, their targets."""
        seen = self._sensed()
        return seen[_SPEEDS[0]][0], seen[_SPEEDS[1]][0]

    def battery(self) -> int:
        """Return the raw reading of the battery.

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
        self.stop()
        self.link.write(self.description, self.description.first_free + OWN.index("halted"), (0,))

    def observe(self) -> Observation:
        """Read the infrared sensors and the selected ground sensors."""
        seen = self._sensed()
        raw = tuple(map(float, seen[_PROX]))
        readings = tuple(min(max(value / self.reading_max, 0.0), 1.0) for value in raw)
        lines = (min(max(1.0 - value / GROUND_SCALE, 0.0), 1.0) for value in seen[_GROUND])
        channels = dict(zip(self.channels, lines, strict=True))
        return Observation(readings, False, raw, {name: channels[name] for name in self._selected})

    def drive(self, command: Command) -> None:
        """Drive one command for `step_s`: left wheel move - turn, right wheel move + turn, limited to -1..1.

        The robot drives on until the next command, or for 0.2 s.

        Raises:
            RobotError: The link is lost.
            RobotStopped: The center button was pressed.
        """
        move, turn = check_command(command)
        wheels = [round(self.full_speed * min(max(part, -1.0), 1.0)) for part in (move - turn, move + turn)]
        until = self.clock.now() + self.step_s
        while True:
            remaining = until - self.clock.now()
            if self.own()[OWN.index("halted")]:
                raise RobotStopped("The center button of the Thymio was pressed: its motors are stopped.")
            piece = max(min(remaining, RENEW_S), 0.0)
            life = min(round((piece + LIFE_MARGIN_S) / TICK_S), MOST_LIFE)
            self.link.emit(DRIVE, (*wheels, life))
            if remaining <= 0:
                return
            self.clock.sleep(piece)
            if remaining <= RENEW_S:
                return

    def stop(self) -> None:
        """Stop the motors and read back that their targets are 0; safe to call twice."""
        if self.link.is_open:
            _stop(self.link, self.description)

    def close(self) -> None:
        """Stop the motors and let go of the robot; safe to call twice.

        Raises:
            RobotError: The motors could not be stopped; the port is closed all the same.
        """
        if not self.link.is_open:
            return
        try:
            self.stop()
            self.link.reset(self.description)
        finally:
            self.link.close()
            self._released()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except RobotError as failure:
            if error is None:
                raise
            error.add_note(str(failure))


def _stop(link: Link, robot: Description) -> None:
    """End the life of the last command, set both targets to 0, and read them back."""
    for _ in range(STOP_TRIES):
        link.emit(DRIVE, (0, 0, 1))
        targets = [robot.variables[name][0] for name in _TARGETS]
        for offset in targets:
            link.write(robot, offset, (0,))
        if all(link.read(robot, offset, 1) == (0,) for offset in targets):
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
