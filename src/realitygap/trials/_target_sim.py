"""The simulators as targets: what an observer would see of their trials."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import PAPER_INPUTS, ControllerInterface
from realitygap.kernels._fleet import make_fleet, read_robots, start_robots
from realitygap.kernels._lanes import LANES
from realitygap.kernels._philox import MAX_INDIVIDUALS
from realitygap.records import Observe, ObservedTrial
from realitygap.robots import STEP_S, JyroPlatform, Label, SimPlatform
from realitygap.world import Arena, Pose

from ._batch import NoiseKey, counters_of_individuals, kind_of, poses_of
from ._carry_out import carry_out_on_robot
from ._jyro import jyro_rules, jyro_scene
from ._jyro_robot import JyroRobot
from ._onlooker import RobotOnlooker
from ._physical import EndReason
from ._sim_robot import SimRobot, placed
from ._sim_scene import sim_inputs
from ._target import TrialPlan, check_plans
from ._try import try_all

Platform = JyroPlatform | SimPlatform

# Trials in a call: so many that the call costs little beside them, so few that what is kept of each step stays small.
TOGETHER = 256


class SimTarget:
    """`sim` or `jyro` as a target.

    Controllers are tried in calls of the compiled trials, commands one by one on the simulated robot; what comes out is
    the same as if a controller had driven that robot (in double precision; a network computes in it outside of trials).
    Trial `number` draws the random numbers of individual `number`, as in `try_genomes`.

    Args:
        platform: The robot as simulated.
        arena: Where.
        noise: The paper's a, on top of the robot's own noise.
        key: Of the random numbers.
        name: As the user named it; the platform's when not given.
    """

    label: Label = "SIM"
    observes: Observe = "track"

    def __init__(
        self, platform: Platform, arena: Arena, noise: float = 0.0, *, key: int = 0, name: str = ""
    ) -> None:
        is_sim = isinstance(platform, SimPlatform)
        self.name = name or ("sim" if is_sim else "jyro")
        self.platform = platform
        self.arena = arena
        self.noise = noise
        self.key = key
        self.step_s = platform.command_s if isinstance(platform, SimPlatform) else STEP_S
        self._robot = _robot(platform, arena, noise)
        numbers = [*arena.vary, *(platform.arena_numbers if isinstance(platform, SimPlatform) else ())]
        self._is_start_set = any(name.startswith("arena.start.") for name in numbers)
        self.n_sensors = self._robot.n_sensors

    @cached_property
    def identity(self) -> str:
        """Equal where the same robot is simulated, whatever random numbers it draws."""
        settings = json.dumps(self.platform.model_dump(mode="json"), sort_keys=True)
        digest = hashlib.sha256(settings.encode()).hexdigest()[:16]
        kind = "sim" if isinstance(self.platform, SimPlatform) else "jyro"
        return f"{kind} {digest}, noise {self.noise:g}"

    def carry_out(
        self,
        plans: Sequence[TrialPlan],
        observe: Observe,
        tell: Callable[[int, ObservedTrial], None] | None = None,
    ) -> list[ObservedTrial]:
        """As `Target.carry_out`."""
        check_plans(plans, observe, self, MAX_INDIVIDUALS - 1, self._inputs)
        trials: list[ObservedTrial] = []
        for first in range(0, len(plans), TOGETHER):
            for trial in self._carry_out_some(plans[first : first + TOGETHER], observe):
                trials.append(trial)
                if tell is not None:
                    tell(len(trials) - 1, trial)
        return trials

    def lasting(self, step_s: float) -> SimTarget:
        """The same with commands of another length [s].

        Raises:
            ValueError: It is `jyro`, whose step is always the same.
        """
        if not isinstance(self.platform, SimPlatform):
            raise ValueError(f"A step of {self.name} lasts {self.step_s:g} s, and no other time.")
        platform = self.platform.model_copy(update={"step_s": step_s})
        return SimTarget(platform, self.arena, self.noise, key=self.key, name=self.name)

    def close(self) -> None:
        """Nothing is held."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _carry_out_some(self, plans: Sequence[TrialPlan], observe: Observe) -> list[ObservedTrial]:
        trials: dict[int, ObservedTrial] = {}
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

    def _command(self, plan: TrialPlan, observe: Observe) -> ObservedTrial:
        """Command after command."""
        self._robot.noise_key = NoiseKey(self.key, individual=plan.number)
        start = plan.start or self._drawn_start()
        return carry_out_on_robot(self._robot, plan, observe, RobotOnlooker(self._robot), start)[0]

    def _drawn_start(self) -> Pose:
        """The arena's start with what is drawn of it for the robot's trial."""
        if not self._is_start_set:
            return self.arena.start
        self._robot.reset()
        return self._robot.pose

    @cached_property
    def _inputs(self) -> tuple[str, ...]:
        """Names of all inputs that networks can have."""
        if isinstance(self.platform, SimPlatform):
            return sim_inputs(self.platform.model, self.arena)
        return PAPER_INPUTS

    def _try(
        self, plans: Sequence[TrialPlan], interface: ControllerInterface, observe: Observe
    ) -> list[ObservedTrial]:
        """Trials of controllers of one kind from one start."""
        start, steps = plans[0].start, plans[0].steps
        platform, arena = self.platform.model_copy(update={"steps": steps}), self.arena
        if start is not None:
            platform, arena = _placed(platform, arena, start)
        genomes = {id(plan.genome): plan.genome for plan in plans if plan.genome is not None}
        place = {each: k for k, each in enumerate(genomes)}
        which = np.array([place[id(plan.genome)] for plan in plans], np.int32)
        counters = counters_of_individuals(NoiseKey(self.key), [plan.number for plan in plans])
        trials, tried = try_all(
            platform, arena, list(genomes.values()), which, self.key, counters,
            inputs=interface.inputs, noise=self.noise, trace=True,
        )  # fmt: skip
        readings = tried.trace.readings
        if isinstance(platform, JyroPlatform):  # its trace has them without noise
            readings = self._noisy(platform, arena, tried.distances, counters)
        made = []
        for k, plan in enumerate(plans):
            poses = poses_of(tried.trace.poses[:, :, k], trials.arena.start)
            x, y, heading = start or (poses[0].tolist() if self._is_start_set else self.arena.start)
            commands = tried.trace.commands[:, :, k].astype(np.float64)
            trial = ObservedTrial(
                start=(x, y, heading),
                step_s=self.step_s,
                commands=commands,
                readings=readings[:-1, : self.n_sensors, k].astype(np.float64),
                stalled=tried.trace.stalled[:-1, k].copy(),
                cells=tuple(sorted(int(cell) for cell in tried.batch.behavior(k))),
                wheels=self._wheels(plan, commands) if observe != "cells" else np.empty((0, 2)),
                poses=poses if observe == "track" else np.empty((0, 3)),
                genome="" if plan.genome is None else plan.genome.to_json(),
                number=plan.number,
                purpose=plan.purpose,
                end=str(EndReason.STEP_LIMIT),
            )
            made.append(trial)
        return made

    def _wheels(self, plan: TrialPlan, commands: NDArray[np.float64]) -> NDArray[np.float64]:
        """What encoders say of a trial: it is driven again by the commands that it had."""
        if RobotOnlooker(self._robot).wheels() is None:
            return np.empty((0, 2))
        return self._command(replace(plan, genome=None, commands=commands), "encoders").wheels

    def _noisy(
        self,
        platform: JyroPlatform,
        arena: Arena,
        fractions: NDArray[np.floating],
        counters: NDArray[np.uint32],
    ) -> NDArray[np.float64]:
        """(t + 1, s, n) what the sensors of `jyro` read, noise and all, from distances (t + 1, s, n) in their range."""
        n_looks, n_sensors, n = fractions.shape
        scene = jyro_scene(platform, arena)
        rules = jyro_rules(platform, noise=self.noise, bias_input=False, bias_value=1.0)
        fleet = make_fleet(scene, n)
        start_robots(
            scene,
            rules,
            fleet,
            counters,
            np.zeros((n, arena.grid.n_cells), np.uint8),
            np.zeros((n, 3), np.int32),
        )
        seen = np.empty((n_looks, n, n_sensors))
        for step in range(n_looks):
            for block in range(len(fleet.fractions)):
                part = fractions[step, :, block * LANES : (block + 1) * LANES]
                fleet.fractions[block, :, : part.shape[1]] = part
            read_robots(rules, fleet, np.uint64(self.key), step, seen[step])
        return seen.transpose(0, 2, 1)


def _robot(platform: Platform, arena: Arena, noise: float) -> SimRobot | JyroRobot:
    if isinstance(platform, SimPlatform):
        return SimRobot(platform, arena, noise=noise)
    return JyroRobot(platform, arena, noise=noise)


def _placed(platform: Platform, arena: Arena, start: Pose) -> tuple[Platform, Arena]:
    """Platform and arena with trials that begin at a pose."""
    if isinstance(platform, SimPlatform):
        return placed(platform, arena, start)
    return platform, replace(arena, start=start)
