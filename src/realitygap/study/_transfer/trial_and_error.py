"""Strategies that find out by trial and error what of a repertoire works on the target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from realitygap.gap import PriorProcess
from realitygap.runs import Condition
from realitygap.world import RobotModel

from .attempt import Attempt
from .calibrated import fitted
from .noise import changed_condition, needs_sim
from .repertoire import Repertoire, finalists, joined, tried_under
from .simulated import Champion
from .transferability import distances


class SearchRules(NamedTuple):
    """The numbers of a search, for scores from 0 to 1.

    They are among those that did best on damaged robots on `sim`: `python benchmarks/recovery.py parameters`.

    Attributes:
        spread: Standard deviation of the difference to the simulation from one behavior to another.
        offset: Standard deviation of a difference that all behaviors share.
        kappa: Weight of the standard deviation in the choice of the next trial. With 0.05, as in the source, the search
            tries the same elite again and again.
        unlikely: Generalized Jaccard distance between visited cells that makes a damage less likely by the factor e;
            infinite to compare scores alone.
        least_variance: Least variance of a trial (Cully and others 2015).
    """

    spread: float = 0.1
    offset: float = 0.1
    kappa: float = 1.0
    unlikely: float = 0.1
    least_variance: float = 0.001


RULES = SearchRules()

WEAK = (0.01, 0.3, 0.6)
"""Shares of the gain of one wheel under suspected damages; a gain of 0 is refused."""
LOADED = (0.5, 0.75)
"""Shares of the gains of both wheels."""
PULLS = (-1.0, 1.0)
"""Drift to a side [rad/m]."""
BLIND = {
    "ir": ("amplitude", 0.0),
    "pulses": ("amplitude", 0.0),
    "lorentz": ("amplitude", 0.0),
    "linear": ("reach", 1e-3),
}
"""Number of a range sensor that sees nothing, by its response; none makes one with a table blind."""


def trial_and_error(attempt: Attempt) -> Champion:
    """Try what a Gaussian process over the descriptors expects most of, one trial after the other.

    A repertoire evolves by MAP-Elites, with as many trials in simulation as the runs of the other strategies. Its mean
    scores in fresh trials are the prior mean. The elite with the highest upper confidence bound is tried next. In the
    end the elite of the highest expected score is chosen.

    Source: Cully, Clune, Tarapore & Mouret (2015), Nature 521. Differs: the archive is corrected by fresh trials, the
    variance of a trial is that of the elite in simulation, a difference that all elites share has a term of its own,
    the spread is smaller and the weight of the deviation greater, the choice at the end is by expected score, and all
    of the budget is used.
    """
    return search(attempt, attempt.repertoire())


def trial_and_error_recalibrated(attempt: Attempt) -> Champion:
    """As `trial_and_error`, with the scores of the repertoire in the calibrated simulator, averaged over the posterior.

    Half of the budget calibrates. Nothing evolves after it.
    """
    posterior = fitted(attempt, "posterior")
    return search(attempt, tried_under(attempt.repertoire(), [posterior], attempt.replicate))


def trial_and_error_posterior(attempt: Attempt) -> Champion:
    """As `trial_and_error`, with a repertoire from the calibrated simulator, whose trials draw robots of the posterior.

    The scores are averages over the draws. Half of the budget calibrates.
    """
    return search(attempt, attempt.repertoire(fitted(attempt, "posterior")))


def trial_and_error_damage(attempt: Attempt) -> Champion:
    """As `trial_and_error`, with a repertoire for the intact robot and for each suspected damage.

    The repertoires share the trials in simulation. Further trials try their best elites under each damage. The trials
    on the target weigh the damages, by the likelihood of the score and, where cells are observed, by the distance of
    the visited cells to those in simulation.
    """
    conditions = damaged_conditions(attempt.condition)
    each = [finalists(attempt.repertoire(one, len(conditions))) for one in conditions]
    return search(attempt, tried_under(joined(each), conditions, attempt.replicate))


def trial_and_error_combined(attempt: Attempt) -> Champion:
    """As `trial_and_error_posterior`, with the repertoires of `trial_and_error_damage` in addition.

    Half of the budget calibrates. The calibrated simulator gets half of the trials in simulation, and is as probable
    beforehand as all damages together.
    """
    posterior, damages = fitted(attempt, "posterior"), damaged_conditions(attempt.condition)
    each = [attempt.repertoire(posterior, 2)]
    each += [finalists(attempt.repertoire(one, 2 * len(damages))) for one in damages]
    repertoire = tried_under(joined(each), [posterior, *damages], attempt.replicate)
    return search(attempt, repertoire, expected=[len(damages), *[1] * len(damages)])


def damaged_conditions(condition: Condition) -> list[Condition]:
    """Return the condition with the intact robot, and with each suspected damage of it.

    Raises:
        StudyError: It is not on platform `sim`, which alone has numbers to change.
    """
    sim = needs_sim(condition, "trial-and-error-damage")
    return [
        changed_condition(condition, name, set={**sim.set, **numbers}) if numbers else condition
        for name, numbers in suspected_damages(sim.model).items()
    ]


def suspected_damages(model: RobotModel) -> dict[str, dict[str, float]]:
    """Return the numbers of an intact robot that each suspected damage changes.

    A wheel is weak or dead, both are weak, such as under a load, a sensor is blind, or the robot pulls to a side.
    """
    numbers = model.centers()
    left, right = (f"drive.gain_{side}" for side in ("left", "right"))
    damages: dict[str, dict[str, float]] = {"intact": {}}
    for share in WEAK:
        damages |= {f"{wheel}-x-{share:g}": {wheel: share * numbers[wheel]} for wheel in (left, right)}
    for share in LOADED:
        damages[f"drive.gains-x-{share:g}"] = {wheel: share * numbers[wheel] for wheel in (left, right)}
    damages |= {f"drive.drift_per_m-{drift:g}": {"drive.drift_per_m": drift} for drift in PULLS}
    for k, sensor in enumerate(model.range):
        if sensor.response in BLIND:
            name, value = BLIND[sensor.response]
            damages[f"range.{k}-blind"] = {f"range.{k}.{name}": value}
    return damages


def search(
    attempt: Attempt,
    repertoire: Repertoire,
    rules: SearchRules = RULES,
    expected: Sequence[float] | None = None,
) -> Champion:
    """Spend the rest of the budget on elites of a repertoire, and return the one of the highest expected score.

    Its score in simulation is the mean over the simulations, as the trials weigh them.

    Args:
        attempt: The attempt.
        repertoire: The repertoire, with scores in h simulations.
        rules: Numbers of the search.
        expected: (h,) how probable each simulation is before a trial, up to a factor; all alike if not given.
    """
    simulated = repertoire.simulated
    low, high = attempt.condition.task_of_trials.score_range
    if not np.isfinite(
        high - low
    ):  # a score without range has that of most elites: one may be far worse than all
        low, high = np.quantile(simulated, (0.1, 1.0)).tolist()
    scale = high - low or 1.0
    process = PriorProcess(
        repertoire.descriptors,
        (simulated - low) / scale,
        spread=rules.spread,
        offset=rules.offset,
        noise=np.maximum(repertoire.variances / scale**2, rules.least_variance),
    )
    if expected is not None:
        process.weigh(np.log(expected))
    while attempt.left and (attempt.stop_at is None or not process.is_enough(attempt.stop_at)):
        k = process.choose(rules.kappa)
        (score,), (cells,) = attempt.try_on_target([repertoire.champions[k].genome])
        process.tell(k, (score - low) / scale)
        if cells and len(repertoire.visits) > 1:
            visits = repertoire.visits[:, k]
            on_target = np.zeros((1, visits.shape[1]))
            on_target[0, list(cells)] = 1.0
            process.weigh(-distances(visits, on_target)[:, 0] / rules.unlikely)
    best = int(process.predict().mean.argmax())
    worth = float(process.weights @ simulated[:, best])
    return replace(repertoire.champions[best], simulated=worth)
