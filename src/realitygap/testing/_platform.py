"""Checks of the contract of a platform."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from realitygap.errors import RealityGapError
from realitygap.evolution import ControllerInterface, Genome, NeatSettings, Population, decode_all, listed
from realitygap.platforms import Opening, Platform
from realitygap.records import TrialRecord
from realitygap.robots import channels_of
from realitygap.trials import NoiseKey, Target, TrialPlan, counters_of
from realitygap.world import Arena, paper_arena

from ._robot import RobotContractError, check_robot

N_CONTROLLERS, STEPS = 3, 10


class PlatformContractError(RealityGapError):
    """A platform does not keep the contract; the text lists how, and what to do."""


def check_platform(platform: Platform, arena: Arena | None = None) -> None:
    """Raise an error unless a platform keeps the contract of `realitygap.platforms.Platform`.

    A simulated platform is opened in each way that studies, targets, environments and live views open it. For a
    physical platform, only the settings are checked. `check_robot` checks its robot.

    Args:
        platform: Platform with settings for short trials.
        arena: Arena. Default: the paper's.

    Raises:
        PlatformContractError: It does not keep the contract. The text lists every problem, and what to do.
    """
    problems = _Check(platform, arena or paper_arena()).problems()
    if problems:
        lines = "\n".join(f"  - {problem}" for problem in problems)
        raise PlatformContractError(
            f"{type(platform).__name__} does not keep the contract of a platform:\n{lines}"
        )


class _Check:
    """The checks of one platform."""

    def __init__(self, platform: Platform, arena: Arena) -> None:
        self.platform, self.arena = platform, arena
        settings = NeatSettings.named("default").model_copy(update={"population": N_CONTROLLERS})
        self.genomes: list[Genome] = Population(3, 2, settings, seed=1, bias=False).ask()

    def problems(self) -> list[str]:
        problems: list[str] = []
        checks: list[Callable[[], list[str]]] = [self.settings, self.description]
        if not self.platform.is_physical:
            checks += [self.robot, self.target, self.batch, self.fleet]
        for check in checks:
            try:
                problems += check()
            except RobotContractError as error:
                problems.append(str(error))
            except RealityGapError as error:
                problems.append(f"{check.__name__}: {error}")
            except Exception as error:  # whatever an outside platform does
                problems.append(
                    f"{check.__name__}: {type(error).__name__} ({error}). Raise a RealityGapError or ValueError that "
                    "says what was expected."
                )
        return problems

    def settings(self) -> list[str]:
        """Check that settings have a name and survive JSON."""
        values = self.platform.identified().model_dump_json()
        if type(self.platform).model_validate_json(values).model_dump_json() != values:
            return [
                "Its settings change when they are written as JSON and read again. Give each a serializer."
            ]
        return []

    def description(self) -> list[str]:
        """Check that figures and messages have what they need."""
        platform, problems = self.platform, []
        if not platform.name.isidentifier():
            problems.append(f"Its name is {platform.name!r}, expected letters, digits and underscores.")
        if platform.label not in ("SIM", "TWIN", "EMULATED", "REAL", "not driven"):
            problems.append(f"Its label is {platform.label!r}, expected SIM, TWIN, EMULATED or REAL.")
        if not platform.command_s > 0:
            problems.append(f"command_s is {platform.command_s!r}, expected the duration of a command [s].")
        if not {"obstacle", "stall", "time"} <= set(platform.inputs(self.arena)):
            problems.append("`inputs` lacks obstacle, stall or time, which the paper's networks see.")
        return problems

    def robot(self) -> list[str]:
        """Return a robot that is driven step by step."""
        robot = self.platform.open_robot(self.arena)
        problems = [] if hasattr(robot, "pose") else ["Its robot has no `pose`, or the platform is physical."]
        if robot.label != self.platform.label:
            problems.append(
                f"The label of its robot is {robot.label!r}, and its own is {self.platform.label!r}."
            )
        inputs = ControllerInterface(tuple(self.platform.inputs(self.arena)))
        missing = [name for name in inputs.channels if name not in channels_of(robot)]
        if missing:
            problems.append(
                f"Its robot has no channel {listed(missing)}, and networks can see it. Give the robot `channels` and "
                "`select`, or leave it out of the platform's inputs."
            )
        n_ranges = sum(name.startswith("range.") for name in inputs.inputs)
        if robot.n_sensors < n_ranges:
            problems.append(
                f"Its robot has {robot.n_sensors} range sensors, and networks can see {n_ranges}. Give the platform "
                "its `sensors`."
            )
        if robot.step_s != self.platform.command_s:
            problems.append(
                f"Its robot's step_s is {robot.step_s:g}, and command_s is {self.platform.command_s:g}."
            )
        check_robot(robot)
        robot.close()
        return problems

    def target(self) -> list[str]:
        """Check trials one by one."""
        plans = [TrialPlan(genome=genome, steps=STEPS, number=k) for k, genome in enumerate(self.genomes)]
        how = Opening(self.platform.name)
        with self.platform.open(self.arena, how) as target:
            kept: list[int] = []
            first = target.carry_out(plans, "track", lambda k, trial: kept.append(k))
            second = target.carry_out(plans[::-1], "track")[::-1]
            problems = (
                []
                if kept == list(range(len(plans)))
                else ["`carry_out` does not call `tell` after each trial."]
            )
            target.close()
            problems += _sizes(target, first)
        if not all(map(_same, first, second)):
            problems.append(
                "A trial of the same number differs in another order. Let `number` alone choose the noise."
            )
        return problems

    def batch(self) -> list[str]:
        """Check that many trials in one call agree with trials one by one."""
        rules, bias_value = self.genomes[0].rules, self.genomes[0].bias_value
        short = self.platform.model_copy(update={"steps": STEPS})
        trials = short.prepare(
            self.arena, rules, inputs=("obstacle", "stall", "time"), noise=0.0, bias_value=bias_value
        )
        which = np.arange(len(self.genomes), dtype=np.int32)
        tried = trials.carry_out(
            decode_all(self.genomes), which, 1, counters_of(NoiseKey(1), len(which)), ends=True, trace=True
        )
        expected = (STEPS + 1, len(trials.sensors), len(which))
        if tried.trace.readings.shape != expected:
            return [
                f"A trace of {len(which)} trials has readings {tried.trace.readings.shape}, expected {expected}."
            ]
        if not (tried.batch.n_line >= 1).all():
            return ["A trial visits no cell, expected at least the start's."]
        return []

    def fleet(self) -> list[str]:
        """Check several robots that are driven together."""
        fleet = self.platform.fleet(self.arena, ("obstacle", "stall", "time"), 0.0, 2)
        try:
            fleet.start(NoiseKey(1))
            fleet.step(np.array([[0.3, 0.0], [0.0, 0.3]]))
            shape = fleet.observe().shape
        finally:
            fleet.close()
            fleet.close()
        return [] if shape == (2, 3) else [f"Two robots have inputs of shape {shape}, expected (2, 3)."]


def _sizes(target: Target, trials: list[TrialRecord]) -> list[str]:
    problems = []
    for trial in trials:
        if trial.readings.shape != (STEPS, target.n_sensors):
            problems.append(
                f"Readings have shape {trial.readings.shape}, expected {(STEPS, target.n_sensors)}."
            )
        if trial.poses.shape != (STEPS + 1, 3):
            problems.append(f"Poses have shape {trial.poses.shape}, expected {(STEPS + 1, 3)}.")
    return problems[:1]


def _same(first: TrialRecord, second: TrialRecord) -> bool:
    return bool(np.array_equal(first.poses, second.poses) and np.array_equal(first.readings, second.readings))
