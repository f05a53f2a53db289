"""The simulators as targets: what an observer would see of their trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import ControllerInterface, decode_all
from realitygap.kernels.math.philox import MAX_INDIVIDUALS
from realitygap.records import EndReason, Observe, TrialRecord, sees
from realitygap.robots import Label
from realitygap.trials import (
    NoiseKey,
    RepeatableTarget,
    RobotObserver,
    Target,
    TellTrial,
    TrialPlan,
    carry_out_on_robot,
    check_plans,
    counters_of_individuals,
    kind_of,
    poses_of,
)
from realitygap.world import Arena, Pose

from ._platform import Opening, Platform
from ._try import open_for_genomes

# Trials in a call: enough that the overhead of the call is small, but few enough that stored steps need little memory.
TOGETHER = 256


class SimulatedPlatform(Platform):
    """A platform whose trials are computed, many in one call, and whose robot is stepped by the same kernels."""

    is_simulator: ClassVar[bool] = True
    is_slow: ClassVar[bool] = False
    takes_noise: ClassVar[bool] = True

    def open(self, arena: Arena, how: Opening) -> Target:
        """Open the platform for trials one by one."""
        return SimTarget(self, arena, how.noise, key=how.key, name=how.name)

    def lasting(self, step_s: float) -> Self:
        """Return the platform with commands of another duration [s].

        Raises:
            ValueError: The duration is always the same.
        """
        raise ValueError(
            f"step_s is {step_s:g}, expected {self.command_s:g}: a step of {self.name} always lasts this time."
        )

    def placed(self, arena: Arena, start: Pose) -> tuple[Self, Arena]:
        """Return platform and arena with trials that begin at a pose."""
        return self, replace(arena, start=start)

    def noisy_readings(
        self,
        arena: Arena,
        distances: NDArray[np.floating],
        counters: NDArray[np.uint32],
        key: int,
        noise: float,
    ) -> NDArray[np.floating] | None:
        """Return (t + 1, s, n) the readings of n trials with noise; None if the trace has them."""
        return None


class SimTarget(RepeatableTarget):
    """A simulator as a target.

    Controllers run in calls of the compiled trials, and given commands run one by one on the simulated robot. The
    result is the same as if a controller had driven that robot (in double precision, in which a network computes
    outside of trials). Trial `number` draws the random numbers of individual `number`, as in `try_genomes`.

    Args:
        platform: The robot as simulated.
        arena: Arena of the trials.
        noise: The paper's a, on top of the robot's own noise.
        key: Key of the random numbers.
        name: Name, as the user gave it. Default: the platform's.
    """

    label: Label = "SIM"
    observes: Observe = "track"

    def __init__(
        self, platform: SimulatedPlatform, arena: Arena, noise: float = 0.0, *, key: int = 0, name: str = ""
    ) -> None:
        self.name = name or platform.name
        self.platform = platform
        self.arena = arena.alone
        self.noise = noise
        self.key = key
        self.step_s = platform.command_s
        self.is_paced = platform.is_paced
        self._robot: Any = platform.open_robot(self.arena, noise=noise)
        numbers = [*arena.vary, *platform.arena_numbers]
        self._is_start_set = any(name.startswith("arena.start.") for name in numbers)
        self.n_sensors = self._robot.n_sensors

    @cached_property
    def identity(self) -> str:
        """Identity, which is equal for the same simulated robot with any random numbers."""
        return f"{self.platform.fingerprint}, noise {self.noise:g}"

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial | None = None
    ) -> list[TrialRecord]:
        """See `Target.carry_out`."""
        check_plans(plans, observe, self, MAX_INDIVIDUALS - 1)
        trials: list[TrialRecord] = []
        for first in range(0, len(plans), TOGETHER):
            for trial in self._carry_out_some(plans[first : first + TOGETHER], observe):
                trials.append(trial)
                if tell is not None:
                    tell(len(trials) - 1, trial)
        return trials

    def lasting(self, step_s: float) -> SimTarget:
        """Return the same target with commands of another duration [s].

        Raises:
            ValueError: The duration of a step is always the same.
        """
        return SimTarget(self.platform.lasting(step_s), self.arena, self.noise, key=self.key, name=self.name)

    def close(self) -> None:
        """Nothing is held."""

    def _carry_out_some(self, plans: Sequence[TrialPlan], observe: Observe) -> list[TrialRecord]:
        trials: dict[int, TrialRecord] = {}
        alike: dict[Any, list[int]] = {}
        for k, plan in enumerate(plans):
            if plan.genome is None:
                trials[k] = self._command(plan, observe)
            else:
                kind = tuple(kind_of(plan.genome).values())
                alike.setdefault((plan.start, plan.steps, plan.genome.interface, kind), []).append(k)
        for (*_, interface, _), group in alike.items():
            tried = self._try([plans[k] for k in group], interface, observe)
            trials |= dict(zip(group, tried, strict=True))
        return [trials[k] for k in range(len(plans))]

    def _command(self, plan: TrialPlan, observe: Observe) -> TrialRecord:
        """Return the command after command."""
        self._robot.noise_key = NoiseKey(self.key, individual=plan.number)
        start = plan.start or self._drawn_start()
        return carry_out_on_robot(self._robot, plan, observe, RobotObserver(self._robot), start)

    def _drawn_start(self) -> Pose:
        """Return the arena's start with what is drawn of it for the robot's trial."""
        if not self._is_start_set:
            return self.arena.start
        self._robot.reset()
        pose: Pose = self._robot.pose
        return pose

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Names of all inputs that networks can have."""
        return self.platform.inputs(self.arena)

    def _try(
        self, plans: Sequence[TrialPlan], interface: ControllerInterface, observe: Observe
    ) -> list[TrialRecord]:
        """Return trials of controllers of one kind from one start."""
        start, steps = plans[0].start, plans[0].steps
        platform, arena = self.platform.model_copy(update={"steps": steps}), self.arena
        if start is not None:
            platform, arena = platform.placed(arena, start)
        by_id = {id(plan.genome): plan.genome for plan in plans if plan.genome is not None}
        place, genomes = {each: k for k, each in enumerate(by_id)}, list(by_id.values())
        which = np.array([place[id(plan.genome)] for plan in plans], np.int32)
        counters = counters_of_individuals(NoiseKey(self.key), [plan.number for plan in plans])
        trials = open_for_genomes(platform, arena, genomes, inputs=interface.inputs, noise=self.noise)
        tried = trials.carry_out(decode_all(genomes), which, self.key, counters, trace=True)
        noisy = platform.noisy_readings(arena, tried.distances, counters, self.key, self.noise)
        readings = tried.trace.readings if noisy is None else noisy
        made = []
        for k, plan in enumerate(plans):
            poses = poses_of(tried.trace.poses[:, :, k], trials.arena.start)
            x, y, heading = start or (poses[0].tolist() if self._is_start_set else self.arena.start)
            commands = tried.trace.commands[:, :, k].astype(np.float64)
            trial = TrialRecord(
                start=(x, y, heading),
                step_s=self.step_s,
                commands=commands,
                readings=readings[:-1, : self.n_sensors, k].astype(np.float64),
                stalled=tried.trace.stalled[:-1, k].copy(),
                cells=tuple(sorted(int(cell) for cell in tried.batch.behavior(k)))
                if sees(observe, "cells")
                else (),
                wheels=self._wheels(plan, commands) if sees(observe, "encoders") else np.empty((0, 2)),
                poses=poses if observe == "track" else np.empty((0, 3)),
                genome="" if plan.genome is None else plan.genome.to_json(),
                number=plan.number,
                purpose=plan.purpose,
                end=str(EndReason.STEP_LIMIT),
            )
            if plan.sees_end:
                last = readings[-1, : self.n_sensors, k].astype(np.float64)
                trial = replace(trial, last_readings=last, last_stalled=bool(tried.trace.stalled[-1, k]))
            made.append(trial)
        return made

    def _wheels(self, plan: TrialPlan, commands: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the encoders of a trial, from a simulation of its commands."""
        if RobotObserver(self._robot).wheels() is None:
            return np.empty((0, 2))
        return self._command(replace(plan, genome=None, commands=commands), "encoders").wheels
