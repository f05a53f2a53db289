"""What can be asked to carry out trials one by one and shows what an observer sees: a simulator, a twin, a robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import TracebackType
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import Genome
from realitygap.records import Observe, ObservedTrial
from realitygap.robots import Label
from realitygap.world import Arena, Pose


@dataclass(frozen=True)
class TrialPlan:
    """A trial to carry out: by a controller, or command after command.

    Attributes:
        start: Where the robot is put; the arena's start when None.
        genome: The controller; None where commands are given.
        commands: (t, 2) move and turn, -1..1; no rows where a controller drives.
        steps: Commands in the trial of a controller.
        number: Of the trial: on simulated platforms its random numbers are a function of it.
        purpose: What it is for, such as controller, path, sensors, motion, contact.
    """

    start: Pose | None = None
    genome: Genome | None = None
    commands: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    steps: int = 100
    number: int = 0
    purpose: str = "controller"


class Target(Protocol):
    """A platform on which trials are carried out and observed.

    Attributes:
        name: As the user named it, such as `twin:worn-1.toml`.
        label: What figures of its trials say.
        arena: Where.
        step_s: How long one command lasts [s].
        n_sensors: Range sensors.
        observes: The most that can be seen of it.
    """

    name: str
    label: Label
    arena: Arena
    step_s: float
    n_sensors: int
    observes: Observe

    def carry_out(
        self,
        plans: Sequence[TrialPlan],
        observe: Observe,
        tell: Callable[[int, ObservedTrial], None] | None = None,
    ) -> list[ObservedTrial]:
        """Carry out trials; what is seen of plan k is entry k.

        Args:
            plans: In this order, where the order can matter.
            observe: How much to look at; nothing else of the platform comes out.
            tell: Called with the plan's index after each trial, so that it can be kept at once.

        Raises:
            RobotError: The robot failed; what `tell` was given is not lost.
            ValueError: So much cannot be seen of it, or a controller of another kind.
        """
        ...

    def close(self) -> None:
        """Let go of the platform; safe to call twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...
