"""The platform `jyro`: the paper's simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import PAPER_INPUTS, ControllerInterface
from realitygap.kernels.jyro import run
from realitygap.robots import Robot
from realitygap.trials import PlatformTrials
from realitygap.world import Arena

from .._fleet import Fleet
from ._fleet import JyroFleet, noisy_readings
from ._robot import JyroRobot
from ._settings import JyroSettings
from ._trials import JyroTrials, jyro_rules, jyro_scene

if TYPE_CHECKING:
    from realitygap.kernels.neat.block import RunRows, RunRules
    from realitygap.kernels.neat.genome import NeatRules


class JyroPlatform(JyroSettings):
    """The robot as the paper simulated it.

    Its body is a box, a blocked robot stops dead, and three thin rays have uniform noise. A step lasts 0.1 s; full
    output moves 0.1 m.

    Source: Jyro 0.3.2, checked against its trajectories; Rosenzweig & Remy, sections 2.2 and 2.3. Differs:
    Jyro's rounding to seven decimals is left out, which moves a reading by less than 1e-6 m. Under given
    commands the poses are Jyro's within 1e-9; a network that closes the loop lets a difference grow. The
    rounding is in `realitygap simulate`.
    """

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
        return JyroRobot(self, arena, noise=noise)

    def prepare(
        self, arena: Arena, rules: NeatRules, *, inputs: Sequence[str], noise: float, bias_value: float
    ) -> PlatformTrials:
        """Set the platform up for many trials in one call."""
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
        scene = jyro_scene(self, arena)
        constant = neat.bias_input >= 0
        trial = jyro_rules(self, noise=noise, bias_input=constant, bias_value=bias_value, inputs=inputs)
        space = run.make_run_room(scene, neat, rules, rows.fitness.shape[0], *room)
        return bool(
            run.run_replicates(scene, trial, neat, rules, np.uint64(key), first_replicate, space, rows)
        )

    def fleet(self, arena: Arena, inputs: Sequence[str], noise: float, n: int) -> Fleet:
        """Open n robots that are driven step by step."""
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
        return noisy_readings(self, arena, distances, counters, key, noise)
