"""The platform `enki`: a Thymio II in Enki, a 2-D simulator that is a separate program."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import ClassVar, Self

from pydantic import Field

from realitygap.robots import Command, Label, Observation, ProgramRobot, VirtualClock, check_command
from realitygap.world import Arena, Pose

from .._platform import ThymioBody
from ._harness import Harness, check_arena

PROX_MOST = 4505.0
"""The largest reading of an infrared sensor (Enki: Thymio2.cpp)."""

GROUND_BLACK, GROUND_WHITE = 76.3, 938.3
"""Mean readings of a ground sensor on black and white floor, of 3,000 each in Enki 1.6.99."""

ENKI_STEP_S = 0.03
"""Duration of a step of Enki, as in Aseba's playground [s]; a command takes as many as are nearest to it."""

CHANNELS = ("line.0", "line.1", "encoder.0", "encoder.1")


class EnkiPlatform(ThymioBody):
    """A Thymio II as Enki simulates it, in a program that `realitygap twin build-enki` compiles.

    The number of a trial alone chooses the noise of its wheels and sensors. Commands are wheel speeds.

    Source: Enki (S. Magnenat), robots/thymio2/Thymio2.cpp; GPL 2 or later.
    """

    name: ClassVar[str] = "enki"
    summary: ClassVar[str] = "a Thymio II in Enki: another simulator, in a separate program"
    channels: ClassVar[tuple[str, ...]] = CHANNELS
    version: ClassVar[str] = "Enki, harness 1"

    step_s: float = Field(0.1, gt=0, le=10, description="Duration of a command [s].")
    speed: float = Field(
        0.099,
        gt=0,
        le=0.166,
        description="Speed of a wheel at full command [m/s]; Enki's robot reaches 0.166.",
    )

    @property
    def label(self) -> str:
        """The label of its figures."""
        return "EMULATED"

    @property
    def command_s(self) -> float:
        """Duration of a command [s]."""
        return self.step_s

    def at_pace(self, step_s: float) -> Self:
        """Return the platform with commands of this duration [s]."""
        return self.model_copy(update={"step_s": step_s})

    def check(self, arena: Arena, inputs: Sequence[str], noise: float) -> None:
        """Raise an error if networks with these inputs cannot be tried here.

        Raises:
            ValueError: An input is missing, there is noise, or Enki cannot have the arena.
        """
        super().check(arena, inputs, noise)
        check_arena(arena)

    def open_robot(self, arena: Arena, *, noise: float = 0.0) -> EnkiRobot:
        """Open one robot, in a separate program.

        Raises:
            RobotError: The harness is not built.
            ValueError: There is noise, or Enki cannot have the arena.
        """
        self.check_noise(noise)
        return EnkiRobot(arena, self.step_s, self.speed)


def _seed_of(number: int) -> int:
    """Return a seed of 31 bits: those of successive numbers would begin with related random numbers in Enki."""
    return int.from_bytes(hashlib.blake2b(str(number).encode(), digest_size=4).digest(), "little") >> 1


class EnkiRobot(ProgramRobot):
    """A `Robot` that knows its pose.

    Args:
        arena: Arena of the robot.
        step_s: Duration of a command [s].
        speed: Speed of a wheel at full command [m/s].

    Raises:
        RobotError: The harness is not built, or cannot be started.
        ValueError: Enki cannot have the arena.
    """

    label: Label = "EMULATED"
    n_sensors = 7
    channels = CHANNELS

    def __init__(self, arena: Arena, step_s: float, speed: float) -> None:
        self.arena, self.step_s, self._speed = arena, step_s, speed
        self._n_steps = max(1, round(step_s / ENKI_STEP_S))
        self._selected: tuple[str, ...] = ()
        self.number = 0  # of the trial that the next `reset` begins
        self.clock = VirtualClock()
        self._harness = Harness(arena)
        self.reset()

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial at a pose, or at the arena's start."""
        self._check_open()
        self._harness.seed(_seed_of(self.number))
        self._state = self._harness.put(pose or self.arena.start)
        self._driven = (0.0, 0.0)

    def select(self, names: Sequence[str]) -> None:
        """Choose the sensors to read besides range sensors."""
        self._selected = tuple(name for name in self.channels if name in names)

    def observe(self) -> Observation:
        """Read the sensors: infrared as a share of 4505; floor from 0 (white) to 1 (black).

        The robot counts as stalled if it touched anything in the last command, even if it slides on.
        """
        self._check_open()
        prox = self._state.prox
        values = dict(zip(self.channels, (*self._darkness(), *self._speeds()), strict=True))
        chosen = {name: values[name] for name in self._selected}
        return Observation(tuple(value / PROX_MOST for value in prox), self._state.touched, prox, chosen)

    def drive(self, command: Command) -> None:
        """Drive for `step_s`; in Enki a new command begins one of its steps late."""
        self._check_open()
        before = self._state.wheels
        left, right = (self._speed * wheel for wheel in check_command(command).wheels)
        self._state = self._harness.drive(left, right, self._n_steps, self.step_s / self._n_steps)
        self.clock.sleep(self.step_s)
        after = self._state.wheels
        self._driven = (after[0] - before[0], after[1] - before[1])

    def close(self) -> None:
        """End the harness; safe to call twice."""
        super().close()
        self._harness.close()

    @property
    def pose(self) -> Pose:
        """The present pose."""
        return self._state.pose

    @property
    def encoders(self) -> tuple[float, float]:
        """The distance that each wheel turned since `reset` [m], at a wall, too."""
        return self._state.wheels

    def _darkness(self) -> tuple[float, ...]:
        dark = ((GROUND_WHITE - value) / (GROUND_WHITE - GROUND_BLACK) for value in self._state.ground)
        return tuple(min(1.0, max(0.0, value)) for value in dark)

    def _speeds(self) -> tuple[float, ...]:
        """Return the speed of each wheel in the last command, as a part of full speed."""
        full = self._speed * self.step_s
        return tuple(min(1.0, max(-1.0, distance / full)) for distance in self._driven)
