"""The contract of a robot, simulated or physical, on which trials and calibration depend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType, TracebackType
from typing import Any, Literal, NamedTuple, Protocol, Self, runtime_checkable

from realitygap.errors import RobotError, check_finite
from realitygap.world import Pose

Label = Literal["SIM", "TWIN", "EMULATED", "REAL"]
"""Label of a robot's trials in every figure."""


class Command(NamedTuple):
    """A command of a controller: move (ahead positive) and turn (to the left positive), each -1 to 1."""

    move: float
    turn: float

    @property
    def wheels(self) -> tuple[float, float]:
        """The speeds of the left and the right wheel: move - turn and move + turn, each limited to -1..1."""
        return _within(self.move - self.turn), _within(self.move + self.turn)


class Observation(NamedTuple):
    """The sensor values of a robot at one moment.

    Attributes:
        readings: (s,) readings of the range sensors from left to right, 0 (nothing in range) to 1 (nearest).
        stalled: Whether the robot is blocked.
        raw: (s,) the same readings in the robot's native units.
        channels: Values of the sensors that `select_channels` chose, by name: `light.K`, `line.K` and `bump.K` from 0
            to 1, `encoder.K` (part of full speed in the last command) from -1 to 1.
    """

    readings: tuple[float, ...]
    stalled: bool
    raw: tuple[float, ...]
    channels: Mapping[str, float] = MappingProxyType({})


@runtime_checkable
class Robot(Protocol):
    """A robot that can be reset, read, driven, and stopped.

    As a context manager it stops its motors and releases the robot at the end of the block, also after an exception.

    A robot with other sensors than range sensors also has `channels`, their names, such as `light.0`, and a method
    `select(names)`. Its observations then have the chosen channels only. Sensors that no controller uses are not read.

    Attributes:
        label: Label of its trials in figures.
        step_s: Duration of one command [s].
        n_sensors: Number of range readings in an observation.
    """

    label: Label
    step_s: float
    n_sensors: int

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial: motors stopped, clock at 0.

        Args:
            pose: Start of the robot. A physical robot ignores it, because an operator has placed the robot.
        """
        ...

    def observe(self) -> Observation:
        """Read the sensors. This neither moves nor stops the robot."""
        ...

    def drive(self, command: Command) -> None:
        """Drive one command for `step_s`. The robot moves on until the next command or `stop`.

        Raises:
            ValueError: A part is not within -1..1. The robot keeps its previous command.
        """
        ...

    def stop(self) -> None:
        """Stop the motors. This is safe at any moment, and if called twice."""
        ...

    def close(self) -> None:
        """Stop the motors and release the robot. This is safe if called twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def channels_of(robot: object) -> tuple[str, ...]:
    """Return the names of a robot's sensors other than range sensors."""
    return tuple(getattr(robot, "channels", ()))


def select_channels(robot: Any, names: Sequence[str]) -> None:
    """Choose the sensors, other than range sensors, that a robot reads from the next `observe` on."""
    if channels_of(robot):
        robot.select(tuple(names))


def check_observation(seen: Observation) -> Observation:
    """Return what a robot observed if it is valid.

    Raises:
        RobotError: A number is infinite or NaN.
    """
    try:
        check_finite({"readings": tuple(seen.readings), **seen.channels})
    except ValueError as error:
        raise RobotError(
            f"The robot returned a wrong observation: {error} Check its sensors or its driver."
        ) from error
    return seen


def check_command(command: Command) -> Command:
    """Return the command if it is valid.

    Raises:
        ValueError: A part is not a number within -1..1.
    """
    for part, value in zip(("move", "turn"), command, strict=True):
        if not -1.0 <= value <= 1.0:
            raise ValueError(f"{part} is {value!r}, expected a number from -1 to 1. No command was sent.")
    return Command(float(command[0]), float(command[1]))


def _within(speed: float) -> float:
    return min(max(speed, -1.0), 1.0)
