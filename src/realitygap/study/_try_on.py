"""Repeated trials of one controller on a target, which can be stored as they end."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from realitygap.errors import StudyError
from realitygap.evolution import OUTPUTS, ControllerInterface, Genome
from realitygap.gap import COVERAGE
from realitygap.orders import TryOrder, takes_order
from realitygap.platforms import open_target
from realitygap.records import Ledger, Observe, TrialRecord
from realitygap.trials import PortObserver, Target, TrialPlan
from realitygap.world import load_arena

from ._design import design_of, hold_to_design, refuse_lock_without_file
from ._kept_target import KeptTarget
from ._targets import open_trials, refuse_more_than_is_seen


def try_on(
    target: Target,
    genome: Genome,
    *,
    trials: int = 1,
    steps: int = 100,
    observe: Observe = "cells",
    out: str | Path | None = None,
    hold: Callable[[Ledger], object] | None = None,
) -> list[TrialRecord]:
    """Drive a controller on a target.

    Args:
        target: Target of the trials.
        genome: The controller.
        trials: Number of trials. Trial k has the number k.
        steps: Commands in each.
        observe: Observation level of the trials.
        out: File for the trials, as they end. Trials in it are not driven again.
        hold: Called with the open file before the first trial, such as to lock a design in it.

    Raises:
        StudyError: So much cannot be seen of it.
        RecordError: The file is of another controller or target, or cannot be written.
        RobotError: The robot failed; what is in the file is safe.
    """
    refuse_more_than_is_seen(target, observe)
    plans = [TrialPlan(genome=genome, steps=steps, number=k) for k in range(trials)]
    file = None if out is None else open_trials(out, target, observe)
    with KeptTarget(target, file, is_exclusive=True) as kept:
        if file is not None and hold is not None:
            hold(file)
        return kept.carry_out(plans, observe)


@dataclass(frozen=True)
class TriedGenome:
    """Trials of one controller on a platform.

    Attributes:
        target: Name of the target.
        label: Label of its trials.
        n_cells: Number of cells of the arena.
        trials: The trials.
    """

    target: str
    label: str
    n_cells: int
    trials: list[TrialRecord]

    @property
    def coverage(self) -> list[float]:
        """Covered share of the cells in each trial [0..1]."""
        return [len(trial.cells) / self.n_cells for trial in self.trials]


@takes_order(TryOrder)
def try_genome(order: TryOrder, *, observer: PortObserver | None = None) -> TriedGenome:
    """Drive a controller from a file on a platform, as `realitygap try`.

    Args:
        observer: Observer of a robot without a witness: it places the robot and reports what it drew.

    Raises:
        StudyError: There is no such file, arena, or platform, or so much cannot be seen of it.
        ControllerError: The platform lacks what the controller sees.
        RecordError: The file is of another controller or target, or cannot be written.
        RobotError: The robot failed; what is in the file is safe.
    """
    genome = genome_of(order.genome, order)
    refuse_lock_without_file(order, order.out)
    arms = [(order.genome.stem, genome.to_json())]
    arena = load_arena(order.arena)
    with open_target(order.on, arena, witness=order.witness, observer=observer, key=order.seed) as target:
        trials = try_on(
            target,
            genome,
            trials=order.trials,
            steps=order.steps,
            observe=order.observe,
            out=order.out,
            hold=lambda file: hold_to_design(
                file, design_of(order, target, score=COVERAGE, arms=arms), lock=order.lock
            ),
        )
        return TriedGenome(target.name, target.label, target.arena.grid.n_cells, trials)


def genome_of(path: Path, order: TryOrder) -> Genome:
    """Return the controller in a file, with the inputs and outputs of the order.

    Raises:
        StudyError: It is a folder, or no controller.
    """
    if path.is_dir():
        raise StudyError(
            f"{path} is a folder, expected a genome. Export one: realitygap export {shlex.quote(str(path))} -o "
            "champion.json"
        )
    genome = Genome.load(path)
    if order.inputs is None and order.outputs is None:
        return genome
    inputs = genome.interface.inputs if order.inputs is None else _names(order.inputs)
    outputs = OUTPUTS if order.outputs is None else _names(order.outputs)
    return genome.with_interface(ControllerInterface(inputs, outputs))


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(","))
