"""The contract of a robot: what trials and calibration know of it, simulated or physical."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType, TracebackType
from typing import Any, Literal, NamedTuple, Protocol, Self, runtime_checkable

from realitygap.world import Pose

Label = Literal["SIM", "TWIN", "EMULATED", "REAL"]
"""What every figure says of the trials of a robot."""


class Command(NamedTuple):
    """What a controller asks for: move (ahead positive) and turn (to the left positive), each -1 to 1."""

    move: float
    turn: float


class Observation(NamedTuple):
    """What a robot sees.

    Attributes:
        readings: (s,) one a sensor from left to right, 0 (nothing seen) to 1 (as near as can be told).
        stalled: Whether it is blocked.
        raw: (s,) the same in the robot's native units, as they came.
        channels: Values of the sensors that `select_channels` chose, by name: `light.K`, `line.K` and `bump.K` from 0
            to 1, `encoder.K` (part of full speed in the last command) from -1 to 1.
    """

    readings: tuple[float, ...]
    stalled: bool
    raw: tuple[float, ...]
    channels: Mapping[str, float] = MappingProxyType({})


@runtime_checkable
class Robot(Protocol):
    """Anything that can be reset, read, driven and stopped.

    As a context manager it stops its motors and lets go of the robot on the way out, whatever happened.

    A robot with other sensors than range sensors also has `channels`, their names, such as `light.0`, and a method
    `select(names)`. Its observations then have the chosen ones: a sensor that no controller sees is not read.

    Attributes:
        label: What figures of its trials say.
        step_s: How long one command lasts [s].
        n_sensors: How many readings an observation has.
    """

    label: Label
    step_s: float
    n_sensors: int

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial: motors stopped, clock at 0.

        Args:
            pose: Where the robot is put, where the program can put it there; a physical robot has been put there by
                an operator and ignores it.
        """
        ...

    def observe(self) -> Observation:
        """Read the sensors; does not move the robot, nor stop it."""
        ...

    def drive(self, command: Command) -> None:
        """Carry out one command for `step_s`; the robot moves on until the next command or `stop`.

        Raises:
            ValueError: A part is not within -1..1. The robot goes on as before.
        """
        ...

    def stop(self) -> None:
        """Stop the motors; safe to call at any moment, and twice."""
        ...

    def close(self) -> None:
        """Stop the motors and let go of the robot; safe to call twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def channels_of(robot: Any) -> tuple[str, ...]:
    """Return the names of the sensors that a robot has besides its range sensors."""
    return tuple(getattr(robot, "channels", ()))


def select_channels(robot: Any, names: Sequence[str]) -> None:
    """Choose the sensors that a robot reads besides its range sensors, from the next `observe` on."""
    if channels_of(robot):
        robot.select(tuple(names))


def check_command(command: Command) -> Command:
    """The command, if a robot may be given it.

    Raises:
        ValueError: A part is not a number within -1..1.
    """
    for part, value in zip(("move", "turn"), command, strict=True):
        if not -1.0 <= value <= 1.0:
            raise ValueError(f"{part} is {value!r}, expected a number from -1 to 1. No command was sent.")
    return Command(float(command[0]), float(command[1]))
