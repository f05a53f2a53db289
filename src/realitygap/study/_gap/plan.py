"""The numbers of controllers and trials that a question about the gap needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import StudyError, whole_number
from realitygap.orders import PlanOrder, takes_order
from realitygap.platforms import open_target
from realitygap.records import read_observations, those_that_count
from realitygap.stats import (
    Needed,
    PlannedPairs,
    SequentialTest,
    plan_correlation,
    plan_effect,
    plan_margin,
    plan_pairs,
    spread_of_differences,
    trial_reliability,
)
from realitygap.tasks import CoverageTask, Task, score_observed
from realitygap.world import Arena, load_arena

from .._code import task_named
from .._controllers import sample_controllers
from .._targets import check_task
from .study import MOST_CONTROLLERS, plans_of, side_of

TRIALS = (1, 2, 5, 10, 20, 50)
"""Trials of each controller on each platform that a plan goes through."""

PILOT = (30, 20)
"""Controllers and trials of each in a pilot in simulation."""


@dataclass(frozen=True)
class Spreads:
    """The spreads of trials that a plan needs.

    Attributes:
        noise: Standard deviation of trials about their controller's mean, in units of the score.
        controllers: Standard deviation of controllers' means without noise.
        origin: Origin of these numbers.
    """

    noise: float
    controllers: float
    origin: str


@dataclass(frozen=True)
class GapPlan:
    """A plan: the number of controllers needed for each number of trials.

    Attributes:
        order: The question and its settings.
        score: Name of the score, in whose units the numbers are.
        spread: Standard deviation of true differences over controllers that was assumed.
        spreads: Spreads of trials that were assumed.
        needed: A row for each number of trials; empty for a sequential plan.
        pairs: Number of pairs of two controllers; None unless the plan is sequential.
    """

    order: PlanOrder
    score: str
    spread: float
    spreads: Spreads
    needed: tuple[Needed, ...]
    pairs: PlannedPairs | None = None

    @property
    def best(self) -> Needed | None:
        """The row with the fewest trials on the target; None if no row can be measured."""
        measurable = [row for row in self.needed if row.controllers and row.controllers <= MOST_CONTROLLERS]
        return min(measurable, key=lambda row: row.on_target or 0) if measurable else None


def pilot_spreads(seed: int = 1, arena: str | Arena = "paper", task: Task | None = None) -> Spreads:
    """Return spreads of 30 random controllers on `sim`, tried 20 times each, and scored by a task or by coverage.

    Raises:
        TaskError: The task cannot be scored in the arena.
    """
    task = task or CoverageTask()
    place = arena if isinstance(arena, Arena) else load_arena(arena)
    n, r = PILOT
    chosen = sample_controllers("random", n, seed)
    check_task(task, place)
    plans = plans_of([each.genome for each in chosen], r, 0, sees_end=task.needs_trace)
    with open_target("sim", place, key=seed) as sim:
        side = side_of(sim, sim.carry_out(plans, task.observe), n, task)
    return _spreads(side.values, f"a pilot on sim (SIM): {n} random controllers, {r} trials each")


def recorded_spreads(path: str, task: Task | None = None) -> Spreads:
    """Return spreads of the controllers in a file of observed trials, scored by a task; by coverage if none is given.

    Raises:
        RecordError: The file cannot be read.
        StudyError: It has not two controllers with two trials each.
        TaskError: A trial has less than the task needs.
    """
    observations = read_observations(path)
    arena = Arena.from_dict(dict(observations.head.arena))
    trials = [trial for trial in those_that_count(observations.trials) if trial.genome]
    by_genome: dict[str, list[float]] = {}
    for trial in trials:
        score = score_observed(task or CoverageTask(), [trial], arena)[0]
        by_genome.setdefault(trial.genome, []).append(float(score))
    repeated = [values for values in by_genome.values() if len(values) > 1]
    if len(repeated) < 2:
        raise StudyError(
            f"{path} has {len(repeated)} controllers with more than one trial, expected at least 2."
        )
    r = min(len(values) for values in repeated)
    values = np.array([values[:r] for values in repeated])
    return _spreads(values, f"{path} ({observations.head.label}): {len(values)} controllers, {r} trials each")


def _spreads(values: NDArray[np.float64], origin: str) -> Spreads:
    noise = float(np.sqrt(values.var(axis=1, ddof=1).mean()))
    between = float(values.mean(axis=1).var(ddof=1)) - noise**2 / values.shape[1]
    return Spreads(noise, float(np.sqrt(max(between, 0.0))), origin)


@takes_order(PlanOrder)
def plan_gap(
    order: PlanOrder,
    *,
    task: Task | None = None,
    arena: Arena | None = None,
    spreads: Spreads | None = None,
    trials: Sequence[int] = TRIALS,
    allow_code: bool = False,
) -> GapPlan:
    """Find how many controllers a question takes, for several numbers of trials of each; as `realitygap plan`.

    The task may also be a `Task`, and the arena an `Arena`. `plan_gap("effect", 0.05)` is short for
    `plan_gap(effect=0.05)`.

    Args:
        spreads: Spreads of trials, instead of those of recorded trials or a pilot.
        trials: Number of trials of each controller on each platform.
        allow_code: True to run the Python file of a task that the user has not allowed before.

    Raises:
        StudyError: A number is out of range; no pilot is made then.
    """
    try:
        for r in trials:
            whole_number("trials", r, 1)
        scored_by = task or task_named(order.task, allow_code=allow_code)
        known = spreads or _spreads_of(order, scored_by, arena)
        apart = known.controllers / 2 if order.spread is None else order.spread
        if order.sequential:
            between = spread_of_differences(0.0, known.noise, 1)
            test = SequentialTest(order.alpha)
            pairs = plan_pairs(order.value, between, test=test, power=order.power, seed=order.seed)
            return GapPlan(order, scored_by.score_name, 0.0, known, (), pairs)
        rows = tuple(_needed(order, known, apart, r) for r in trials)
    except ValueError as error:
        raise StudyError(str(error)) from None
    return GapPlan(order, scored_by.score_name, apart, known, rows)


def _spreads_of(order: PlanOrder, task: Task, arena: Arena | None) -> Spreads:
    if order.data is not None:
        return recorded_spreads(str(order.data), task)
    return pilot_spreads(order.seed, arena or order.arena, task)


def _needed(order: PlanOrder, spreads: Spreads, apart: float, trials: int) -> Needed:
    value, power, seed = order.value, order.power, order.seed
    if order.question == "correlation":
        reliability = trial_reliability(spreads.controllers, spreads.noise, trials)
        return plan_correlation(
            value, least=order.least, reliability=reliability, trials=trials, power=power, seed=seed
        )
    planned = plan_effect if order.question == "effect" else plan_margin
    return planned(value, spread=apart, noise=spreads.noise, trials=trials, power=power, seed=seed)
