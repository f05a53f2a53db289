"""One trial on anything that meets the contract of a robot, observed as far as somebody looks."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError
from realitygap.evolution import Network, Sense
from realitygap.records import Observe, ObservedTrial
from realitygap.robots import Command, Observation, Robot, check_command
from realitygap.world import Pose

from ._physical import EndReason, limited, warm_up
from ._target import TrialPlan

Answer = Callable[[int, Observation], Command]
"""What a robot is told at a step, by what it sees."""


class Onlooker(Protocol):
    """Who knows of a robot what its sensors do not tell; asked only for what is to be observed."""

    def battery_v(self) -> float:
        """Of the robot at the start of a trial [V]; nan where it is not known."""
        ...

    def wheels(self) -> tuple[float, float] | None:
        """Way of the left and the right wheel since the start of the trial, by encoders [m]; None: it has none."""
        ...

    def look(self) -> None:
        """Remember where the robot is: before each command, and after the last."""
        ...

    def poses(self) -> NDArray[np.float64]:
        """(n, 3) x [m], y [m], heading [rad] at each look of the trial."""
        ...

    def cells(self) -> tuple[int, ...]:
        """The cells that were crossed, in any order."""
        ...


class TrialStopped(KeyboardInterrupt):
    """The program is being stopped in the middle of a trial; the motors are stopped as far as the wire allows.

    Attributes:
        trial: What was seen of it up to there.
    """

    def __init__(self, trial: ObservedTrial) -> None:
        super().__init__("the program was stopped in the middle of a trial")
        self.trial = trial


@dataclass
class _Seen:
    """What was seen of a trial so far."""

    battery_v: float = float("nan")
    sensed: list[Observation] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)
    wheels: list[tuple[float, float]] = field(default_factory=list)
    n_looks: int = 0

    @property
    def n_steps(self) -> int:
        """Commands whose end was seen, too."""
        return max(min(len(self.commands), self.n_looks - 1), 0)


def carry_out_on_robot(
    robot: Robot, plan: TrialPlan, observe: Observe, onlooker: Onlooker, start: Pose
) -> tuple[ObservedTrial, str]:
    """Carry out one trial on a robot, and keep what is to be observed and nothing more.

    A controller sees what its interface names; its outputs, limited to -1..1, are move and turn. The motors are stopped
    on every way out.

    Args:
        robot: Connected. A simulated one is put at the start, a physical one has been put there.
        plan: What to do.
        observe: How much to look at.
        onlooker: Who looks.
        start: Where the robot is put.

    Returns:
        The trial, and what went wrong with it. A robot that fails, or an onlooker, ends it as LOST: then it has what
        was seen whole.

    Raises:
        ControllerError: A controller that sees other things than range readings, stall and time.
        ValueError: Commands that no robot takes.
        TrialStopped: In place of a KeyboardInterrupt or SystemExit, which is its cause.

    Source: Rosenzweig & Remy, sections 2.1 to 2.3.
    """
    answer, n_steps = _answers(plan)
    seen, end, problem = _Seen(), EndReason.STEP_LIMIT, ""
    try:
        robot.reset(start)
        seen.battery_v = onlooker.battery_v()
        _drive(robot, answer, n_steps, observe, onlooker, seen)
    except RobotError as error:
        end, problem = EndReason.LOST, str(error)
    except (KeyboardInterrupt, SystemExit) as error:
        _stop(robot)
        raise TrialStopped(_kept(plan, start, robot, seen, EndReason.INTERRUPTED)) from error
    finally:
        _stop(robot)
    trial = _kept(plan, start, robot, seen, end)
    try:
        return _with_what_is_seen(trial, observe, onlooker), problem
    except RobotError as error:
        return _kept(plan, start, robot, seen, EndReason.LOST), problem or str(error)
    except (KeyboardInterrupt, SystemExit) as error:  # while somebody is asked for cells
        raise TrialStopped(_kept(plan, start, robot, seen, EndReason.INTERRUPTED)) from error


def _stop(robot: Robot) -> None:
    with contextlib.suppress(RobotError):
        robot.stop()


def _answers(plan: TrialPlan) -> tuple[Answer, int]:
    """What the robot is told at each step, and how many there are."""
    if plan.genome is None:
        given = [check_command(Command(*map(float, row))) for row in plan.commands]
        return lambda step, seen: given[step], len(given)
    network = plan.genome.network()
    warm_up(network)
    return _controller(network, plan.genome.interface.bind(plan.steps)), plan.steps


def _controller(network: Network, sense: Sense) -> Answer:
    def answer(step: int, seen: Observation) -> Command:
        outputs = network.activate(sense(seen.readings, seen.stalled, step))
        return Command(limited(float(outputs[0])), limited(float(outputs[1])))

    return answer


def _drive(
    robot: Robot, answer: Answer, n_steps: int, observe: Observe, onlooker: Onlooker, seen: _Seen
) -> None:
    for step in range(n_steps):
        sensed = robot.observe()
        _look(observe, onlooker, seen)
        seen.sensed.append(sensed)
        command = answer(step, sensed)
        robot.drive(command)
        seen.commands.append(command)
    robot.stop()
    _look(observe, onlooker, seen)


def _look(observe: Observe, onlooker: Onlooker, seen: _Seen) -> None:
    if observe != "cells" and (wheels := onlooker.wheels()) is not None:
        seen.wheels.append(wheels)
    if observe == "track":
        onlooker.look()
    seen.n_looks += 1


def _kept(plan: TrialPlan, start: Pose, robot: Robot, seen: _Seen, end: EndReason) -> ObservedTrial:
    """A trial as far as the robot itself told of it."""
    t = seen.n_steps
    return ObservedTrial(
        start=(start.x, start.y, start.heading),
        step_s=robot.step_s,
        commands=np.array(seen.commands[:t], np.float64).reshape(t, 2),
        readings=np.array([each.readings for each in seen.sensed[:t]]).reshape(t, robot.n_sensors),
        stalled=np.array([each.stalled for each in seen.sensed[:t]], np.bool_),
        cells=(),
        wheels=np.array(seen.wheels[: t + 1], np.float64).reshape(-1, 2),
        genome="" if plan.genome is None else plan.genome.to_json(),
        number=plan.number,
        purpose=plan.purpose,
        battery_v=seen.battery_v,
        end=str(end),
    )


def _with_what_is_seen(trial: ObservedTrial, observe: Observe, onlooker: Onlooker) -> ObservedTrial:
    """A trial with what the onlooker saw of it."""
    poses = onlooker.poses()[: len(trial.commands) + 1] if observe == "track" else np.empty((0, 3))
    return replace(trial, cells=tuple(sorted(set(onlooker.cells()))), poses=poses)
