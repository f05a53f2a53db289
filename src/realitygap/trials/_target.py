"""The interface to run trials one by one with an observer: on a simulator, a twin, or a robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.errors import did_you_mean, whole_number
from realitygap.evolution import Genome
from realitygap.records import OBSERVATIONS, Observe, TrialRecord, sees
from realitygap.robots import Label
from realitygap.world import Arena, Pose


@dataclass(frozen=True)
class TrialPlan:
    """The plan of a trial: with a controller, or command by command.

    Attributes:
        start: Start of the robot. Default: the arena's start.
        genome: Controller; None if commands are given.
        commands: (t, 2) move and turn, -1..1; no rows if a controller drives.
        steps: Commands in the trial of a controller.
        number: Number of the trial. On simulated platforms, its random numbers are a function of it.
        purpose: Purpose, such as controller, path, sensors, motion, contact.
        sees_end: True to observe the robot once more after the last command.
    """

    start: Pose | None = None
    genome: Genome | None = None
    commands: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    steps: int = 100
    number: int = 0
    purpose: str = "controller"
    sees_end: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return the plan as JSON knows it, to be sent to another process."""
        return {
            **vars(self),
            "start": None if self.start is None else list(self.start),
            "genome": None if self.genome is None else self.genome.to_json(),
            "commands": np.asarray(self.commands, np.float64).tolist(),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the plan that `to_dict` described."""
        return cls(
            **{
                **values,
                "start": None if values["start"] is None else Pose(*values["start"]),
                "genome": None if values["genome"] is None else Genome.from_json(values["genome"]),
                "commands": np.array(values["commands"], np.float64).reshape(-1, 2),
            }
        )


TellTrial = Callable[[int, TrialRecord], None]
"""Called after each trial with the index of its plan."""


class Target(Protocol):
    """A platform on which trials are run and observed.

    Attributes:
        name: Name, as the user gave it, such as `twin:worn-1.toml`.
        identity: Identity that does not depend on the name: equal for the same twin or emulated robot. Empty if only
            the name identifies the target.
        label: Label of its trials in figures.
        arena: Arena of the trials.
        step_s: Duration of a command [s].
        n_sensors: Range sensors.
        observes: Highest observation level.
        inputs: Names of the inputs that networks can have; None if trials are only looked up.
        is_paced: True if a command lasts as long as a robot's, so that a simulator can use its duration.
    """

    name: str
    label: Label
    arena: Arena
    step_s: float
    n_sensors: int
    observes: Observe
    is_paced: bool

    @property
    def inputs(self) -> tuple[str, ...] | None:
        """Names of the inputs that networks can have; None if trials are only looked up."""
        ...

    @property
    def identity(self) -> str:
        """Identity that does not depend on the name; empty if only the name identifies the target."""
        ...

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial | None = None
    ) -> list[TrialRecord]:
        """Run trials; entry k of the result is the observation of plan k.

        Args:
            plans: Plans of the trials. They run in this order if the order can matter.
            observe: Observation level. The result has no other data of the platform.
            tell: Function that gets the plan's index and the trial after each trial, so that it can be stored. For a
                robot, it is also called when a trial begins, and when the robot has driven and a person is asked. The
                trial's `end` shows which.

        Raises:
            RobotError: The robot failed; what `tell` was given is not lost.
            ValueError: So much cannot be seen of it, or a controller of another kind.
        """
        ...

    def settle(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord | None:
        """Return the part that counts of a trial that was running when the program ended; None if it is void.

        Args:
            plan: The plan of the trial.
            trial: Last known state of the trial.
        """
        ...

    def close(self) -> None:
        """Let go of the platform; safe to call twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class RepeatableTarget(ClosedOnExit):
    """A target whose trials can be repeated exactly, so that an interrupted one is void."""

    def settle(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord | None:
        """Return None: the trial is void."""
        return None


def check_plans(
    plans: Sequence[TrialPlan],
    observe: Observe,
    target: Target,
    most_number: int = 2**32 - 1,
) -> None:
    """Raise an error if a target cannot run these plans.

    Args:
        plans: Plans of the trials.
        observe: Observation level of the trials.
        target: Target that runs the trials.
        most_number: The greatest number of a trial.

    Raises:
        ControllerError: A controller sees what is not there.
        ValueError: One of them cannot be, or so much of it cannot be seen.
    """
    if observe not in OBSERVATIONS:
        raise ValueError(f"observe is {observe!r}. {did_you_mean(observe, OBSERVATIONS)}")
    if not sees(target.observes, observe):
        raise ValueError(
            f"observe is {observe!r}, but {target.name} supports at most {target.observes!r}. Choose that, "
            "or name a witness that sees more."
        )
    for k, plan in enumerate(plans):
        shape = np.shape(plan.commands)
        if len(shape) != 2 or shape[1] != 2:
            raise ValueError(f"The commands of plan {k} have shape {shape}, expected (t, 2): move and turn.")
        if (plan.genome is None) == (len(plan.commands) == 0):
            raise ValueError(f"Plan {k} has to have a genome or commands, and not both.")
        if plan.genome is None:
            wrong = np.argwhere(~(np.abs(plan.commands) <= 1))  # also of NaN
            if len(wrong):
                row, part = wrong[0].tolist()
                raise ValueError(
                    f"commands[{row}, {part}] of plan {k} is {plan.commands[row, part]}, expected a number from "
                    "-1 to 1."
                )
        if plan.genome is not None and target.inputs is not None:
            plan.genome.interface.check(target.inputs, "The controller", target.name)
        whole_number(f"number of plan {k}", plan.number, 0, most_number)
        whole_number(f"steps of plan {k}", plan.steps, 1, 100_000)
