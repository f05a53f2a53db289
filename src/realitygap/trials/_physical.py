"""One controller on one robot, step by step, until it ends."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import StrEnum

from realitygap.errors import RobotError
from realitygap.evolution import Network
from realitygap.records import ObservedTrial, Step
from realitygap.robots import Clock, Command, Observation, Robot, SystemClock


class EndReason(StrEnum):
    """Why a trial on a robot ended."""

    STEP_LIMIT = "step limit"
    """After its last step."""
    ABORTED = "aborted"
    """By the operator."""
    LOST = "lost"
    """The robot, or the link to it, failed."""
    INTERRUPTED = "interrupted"
    """The program was stopped."""


def is_whole(trial: ObservedTrial) -> bool:
    """Whether a trial came to its own end, and was not cut off."""
    return trial.end == EndReason.STEP_LIMIT


def taken_back(trial: ObservedTrial) -> ObservedTrial:
    """A trial that somebody does not let count."""
    return replace(trial, end=str(EndReason.ABORTED))


def is_taken_back(trial: ObservedTrial) -> bool:
    """Whether a trial is the word that the one before it, of the same plan, does not count."""
    return trial.end == EndReason.ABORTED


def those_that_count(trials: Iterable[ObservedTrial]) -> list[ObservedTrial]:
    """Trials that came to their own end and were not taken back; of those of one plan, driven again, the last."""
    last: dict[object, ObservedTrial] = {}
    for trial in trials:
        what = (trial.purpose, trial.number, trial.start, trial.genome)
        if is_whole(trial):
            last[what] = trial
        elif is_taken_back(trial):
            last.pop(what, None)
    return list(last.values())


@dataclass(frozen=True)
class DrivenTrial:
    """What a robot did in a trial.

    Attributes:
        end: Why it ended.
        steps: What it saw and was told, one a command; fewer than asked for unless `end` is STEP_LIMIT.
        problem: What was said of the end; empty after the last step.
    """

    end: EndReason
    steps: tuple[Step, ...]
    problem: str = ""

    @property
    def stalls(self) -> int:
        """Steps that began with the robot blocked."""
        return sum(step.stalled for step in self.steps)


class TrialInterrupted(KeyboardInterrupt):
    """The program is being stopped in the middle of a trial; the motors are stopped as far as the wire allows.

    Attributes:
        driven: The trial up to there.
    """

    def __init__(self, driven: DrivenTrial) -> None:
        super().__init__("the program was stopped in the middle of a trial")
        self.driven = driven


Watch = Callable[[int, Observation, Command], bool]
"""Told the step's number, what the robot saw and what it is told; True aborts the trial before that is sent."""


def drive_trial(
    robot: Robot,
    network: Network,
    n_steps: int,
    *,
    watch: Watch | None = None,
    clock: Clock | None = None,
) -> DrivenTrial:
    """Let a network drive a robot that stands at its start.

    The network sees the largest reading, whether the robot is blocked, and step / steps; a constant input, where it has
    one, is its own. Its two outputs, limited to -1..1, are move and turn. The motors are stopped on every way out.

    Args:
        robot: Connected, and put at the start.
        network: With three inputs, the constant one not counted, and two outputs.
        n_steps: Commands in a whole trial, >= 1.
        watch: Called at each step.
        clock: By which steps are timed; the robot's own, or real time, when not given.

    Returns:
        What it did. A robot that fails ends the trial as LOST.

    Raises:
        ValueError: The network has other inputs or outputs.
        TrialInterrupted: In place of a KeyboardInterrupt or SystemExit, which is its cause.

    Source: Rosenzweig & Remy, sections 2.1 to 2.3.
    """
    check_network(network)
    steps: list[Step] = []
    clock = clock or getattr(robot, "clock", None) or SystemClock()
    warm_up(network)
    try:
        return _drive(robot, network, n_steps, watch, clock, steps)
    except RobotError as error:
        return DrivenTrial(EndReason.LOST, tuple(steps), str(error))
    except (KeyboardInterrupt, SystemExit) as error:
        driven = DrivenTrial(EndReason.INTERRUPTED, tuple(steps), "the program was stopped")
        raise TrialInterrupted(driven) from error
    finally:
        with contextlib.suppress(RobotError):
            robot.stop()


def _drive(
    robot: Robot, network: Network, n_steps: int, watch: Watch | None, clock: Clock, steps: list[Step]
) -> DrivenTrial:
    robot.reset()
    began = clock.now()
    for number in range(n_steps):
        seen = robot.observe()
        time = clock.now() - began
        outputs = network.activate([max(seen.readings), float(seen.stalled), number / n_steps])
        command = Command(limited(float(outputs[0])), limited(float(outputs[1])))
        if watch is not None and watch(number, seen, command):
            return DrivenTrial(
                EndReason.ABORTED, tuple(steps), f"aborted by the operator before step {number + 1}"
            )
        steps.append(Step(time, seen.raw, seen.readings, seen.stalled, *command))
        robot.drive(command)
    robot.stop()
    return DrivenTrial(EndReason.STEP_LIMIT, tuple(steps))


def check_network(network: Network) -> None:
    """Refuse a network that cannot drive a robot.

    Raises:
        ValueError: It has other inputs or outputs than the paper's.
    """
    if (network.n_inputs, network.n_outputs) != (3, 2):
        raise ValueError(
            f"The network has {network.n_inputs} inputs and {network.n_outputs} outputs, expected 3 (largest reading, "
            "stall, time) and 2 (move, turn)."
        )


def warm_up(network: Network) -> None:
    """Compile or load what a network needs before the robot moves: a watchdog would take that for silence."""
    network.activate([0.0] * network.n_inputs)
    network.reset()


def limited(output: float) -> float:
    """A network's output as a part of a command: within -1..1; what is no number is 0."""
    return min(1.0, max(-1.0, output)) if output == output else 0.0
