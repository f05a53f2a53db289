"""The numbers of controllers and trials that a question about the gap needs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import StudyError, whole_number
from realitygap.platforms import open_target
from realitygap.records import read_observations, those_that_count
from realitygap.stats import Needed, check_plan, plan_correlation, plan_effect, plan_margin, trial_reliability
from realitygap.tasks import CoverageTask, Task, score_observed
from realitygap.world import Arena, load_arena

from .._controllers import sample_controllers
from .._targets import check_task
from .study import MOST_CONTROLLERS, plans_of, side_of

TRIALS = (1, 2, 5, 10, 20, 50)
"""Trials of each controller on each platform that a plan goes through."""

PILOT = (30, 20)
"""Controllers and trials of each in a pilot in simulation."""

Question = Literal["effect", "margin", "correlation"]


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
        question: effect, margin or correlation.
        value: Value of the effect, the margin, or the correlation.
        spread: Standard deviation of true differences over controllers that was assumed.
        spreads: Spreads of trials that were assumed.
        needed: A row for each number of trials.
    """

    question: Question
    value: float
    spread: float
    spreads: Spreads
    needed: tuple[Needed, ...]

    @property
    def best(self) -> Needed | None:
        """The row with the fewest trials on the target; None if no row can be measured."""
        there = [row for row in self.needed if row.controllers and row.controllers <= MOST_CONTROLLERS]
        return min(there, key=lambda row: row.on_target or 0) if there else None


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
    found = read_observations(path)
    arena = Arena.from_dict(dict(found.head.arena))
    trials = [trial for trial in those_that_count(found.trials) if trial.genome]
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
    return _spreads(values, f"{path} ({found.head.label}): {len(values)} controllers, {r} trials each")


def _spreads(values: NDArray[np.float64], origin: str) -> Spreads:
    noise = float(np.sqrt(values.var(axis=1, ddof=1).mean()))
    between = float(values.mean(axis=1).var(ddof=1)) - noise**2 / values.shape[1]
    return Spreads(noise, float(np.sqrt(max(between, 0.0))), origin)


def plan_gap(
    question: Question,
    value: float,
    *,
    spreads: Spreads | None = None,
    task: Task | None = None,
    arena: str | Arena = "paper",
    spread: float | None = None,
    least: float = 0.5,
    power: float = 0.8,
    trials: Sequence[int] = TRIALS,
    seed: int = 1,
) -> GapPlan:
    """Find how many controllers a question takes, for several numbers of trials of each.

    Args:
        question: `effect`: to find a mean difference; `margin`: to show equivalence within it; `correlation`: to show
            that the correlation over controllers, which is `value`, is above `least`.
        value: Value in units of the score; a correlation has no unit.
        spreads: Spreads of trials. Default: those of a pilot on `sim`.
        task: Scores the trials of the pilot; coverage if not given.
        arena: Arena of the pilot.
        spread: Standard deviation of true differences over controllers, in units of the score; half the spread of
            controllers when not given.
        least: Correlation that is to be exceeded.
        power: Statistical power: the probability of detecting the effect.
        trials: Number of trials of each controller on each platform.
        seed: Seed of simulated studies.

    Raises:
        StudyError: A number is out of range; no pilot is made then.
    """
    _refuse_unanswerable(question, value, spread, least, power, trials)
    known = spreads or pilot_spreads(seed, arena, task)
    apart = known.controllers / 2 if spread is None else spread
    rows = []
    try:
        for r in trials:
            if question == "correlation":
                reliability = trial_reliability(known.controllers, known.noise, r)
                rows.append(
                    plan_correlation(
                        value, least=least, reliability=reliability, trials=r, power=power, seed=seed
                    )
                )
            else:
                planned = plan_effect if question == "effect" else plan_margin
                rows.append(planned(value, spread=apart, noise=known.noise, trials=r, power=power, seed=seed))
    except ValueError as error:
        raise StudyError(str(error)) from None
    return GapPlan(question, value, apart, known, tuple(rows))


def _refuse_unanswerable(
    question: Question, value: float, spread: float | None, least: float, power: float, trials: Sequence[int]
) -> None:
    """Refuse a question before a pilot is made for it."""
    if question not in get_args(Question):
        raise StudyError(f"question is {question!r}, expected one of {', '.join(get_args(Question))}.")
    if spread is not None and not 0 <= spread < math.inf:
        raise StudyError(f"spread is {spread}, expected a number from 0 on, in units of the score.")
    try:
        check_plan(power, **{question: value}, least=least)
        for r in trials:
            whole_number("trials", r, 1)
    except ValueError as error:
        raise StudyError(str(error)) from None
