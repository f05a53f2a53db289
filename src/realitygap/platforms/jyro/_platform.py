"""The platform `jyro`: the paper's simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from realitygap.evolution import PAPER_INPUTS, ControllerInterface
from realitygap.robots import Robot
from realitygap.trials import PlatformTrials
from realitygap.world import JYRO_SCRIBBLER, Arena, RangeSensors

from .._simulated import SimulatedPlatform

if TYPE_CHECKING:
    from realitygap.kernels.neat.block import RunRows, RunRules
    from realitygap.kernels.neat.genome import NeatRules

    from .._fleet import Fleet

STEP_S = 0.1  # one step of Jyro, one command [s]


class JyroPlatform(SimulatedPlatform):
    """The Scribbler as the paper simulated it.

    Box body, a blocked robot freezes, three thin rays, uniform noise. A step lasts 0.1 s; full output
    moves 0.1 m.

    Source: Jyro 0.3.2, checked against its trajectories; Rosenzweig & Remy, sections 2.2 and 2.3. Differs:
    Jyro's rounding to seven decimals is left out, which moves a reading by less than 1e-6 m. Under given
    commands the poses are Jyro's within 1e-9; a network that closes the loop lets a difference grow. The
    rounding is in `realitygap simulate`.
    """

    name: ClassVar[str] = "jyro"
    summary: ClassVar[str] = (
        "the paper’s simulation: a box for a body, a blocked robot freezes, uniform noise on its sensors"
    )
    default_noise: ClassVar[float] = 0.1
    is_paced: ClassVar[bool] = False
    runs_whole: ClassVar[bool] = True

    steps: int = Field(
        87,
        ge=1,
        le=100_000,
        description="Steps of a trial. 87 as printed (section 2.2); 70 from the paper's own lengths "
        "(13.75 in / 19.7 in of 100 steps).",
    )
    turn_per_step: float = Field(
        0.1,
        gt=0,
        le=3.0,
        description="Turn at full output [rad]. Jyro: 0.1; the robot turns up to about 0.9 rad in one command.",
    )
    sensor_offset: float = Field(
        0.05,
        ge=0,
        le=0.5,
        description="How far the outer two sensors are mounted to the sides of the middle one [m]. Not in the "
        "paper; 0.05 as in an older simulator's IR pair.",
    )
    sensor_range: float = Field(
        0.2, gt=0, le=10, description="Longest distance that a sensor sees [m] (section 2.1: 0.2)."
    )
    noisy_reading: Literal["leave", "clip"] = Field(
        "leave",
        description="After adding noise: leave the reading as it is, or limit it to 0..1. The paper limits it "
        "before adding noise and does not say what happens after.",
    )

    precision: Literal["single", "double"] = Field(
        "single",
        description="Of the arithmetic of trials: 32 or 64 bits. Single is about a third faster; rounding changes "
        "what one in several hundred trials visits.",
    )

    @property
    def sensors(self) -> RangeSensors:
        """Three rays from the front edge, straight ahead."""
        front = max(forward for forward, _ in JYRO_SCRIBBLER.corners)
        lefts = (self.sensor_offset, 0.0, -self.sensor_offset)
        return RangeSensors(tuple((front, left, 0.0) for left in lefts), self.sensor_range)

    @property
    def speed(self) -> float:
        """Speed at full output [m/s]: Jyro takes outputs as meters a second."""
        return 1.0

    @property
    def turn_rate(self) -> float:
        """Turn rate at full output [rad/s]."""
        return self.turn_per_step / STEP_S

    @property
    def command_s(self) -> float:
        """Duration of a command: one step of Jyro [s]."""
        return STEP_S

    @property
    def outline_words(self) -> str:
        """The origin of the outline in figures, for their captions."""
        return "Jyro’s; the paper does not state the start and where the sensors are mounted"

    def inputs(self, arena: Arena) -> tuple[str, ...]:
        """Return the names of all inputs that networks can have here."""
        return (*PAPER_INPUTS, *(f"range.{k}" for k in range(len(self.sensors.mounts))))

    def check(self, arena: Arena, inputs: Sequence[str], noise: float) -> None:
        """Raise an error if networks with these inputs cannot be tried here.

        Raises:
            ValueError: An input is missing, or the arena is not of straight walls.
        """
        ControllerInterface(tuple(inputs)).check(self.inputs(arena), "A network", f"platform {self.name!r}")
        arena.straight_walls()  # which says where there are none

    def open_robot(self, arena: Arena, *, noise: float = 0.0) -> Robot:
        """Open one robot."""
        from ._robot import JyroRobot

        return JyroRobot(self, arena, noise=noise)

    def prepare(
        self, arena: Arena, rules: NeatRules, *, inputs: Sequence[str], noise: float, bias_value: float
    ) -> PlatformTrials:
        """Set the platform up for many trials in one call."""
        from ._trials import JyroTrials

        self.check(arena, inputs, noise)
        return JyroTrials(self, arena, rules, inputs=inputs, noise=noise, bias_value=bias_value)

    def run_whole(
        self,
        arena: Arena,
        neat: NeatRules,
        rules: RunRules,
        *,
        inputs: Sequence[str],
        noise: float,
        bias_value: float,
        key: int,
        first_replicate: int,
        rows: RunRows,
        room: tuple[int, int],
    ) -> bool:
        """Compute whole evolutions in one call of a kernel; return whether all genomes found room."""
        from realitygap.kernels.jyro import run

        from ._trials import jyro_rules, jyro_scene

        scene = jyro_scene(self, arena)
        constant = neat.bias_input >= 0
        trial = jyro_rules(self, noise=noise, bias_input=constant, bias_value=bias_value, inputs=inputs)
        space = run.make_run_room(scene, neat, rules, rows.fitness.shape[0], *room)
        return bool(
            run.run_replicates(scene, trial, neat, rules, np.uint64(key), first_replicate, space, rows)
        )

    def fleet(self, arena: Arena, inputs: Sequence[str], noise: float, n: int) -> Fleet:
        """Open n robots that are driven step by step."""
        from ._fleet import JyroFleet

        self.check(arena, inputs, noise)
        return JyroFleet(self, arena, inputs, noise, n)

    def noisy_readings(
        self,
        arena: Arena,
        distances: NDArray[np.floating],
        counters: NDArray[np.uint32],
        key: int,
        noise: float,
    ) -> NDArray[np.floating] | None:
        """Return the readings with noise, which a trace of these trials does not have."""
        from ._fleet import noisy_readings

        return noisy_readings(self, arena, distances, counters, key, noise)
