"""The error of a calibration on trials that a second fit does not see, next to that of the robot file's numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from realitygap.calibration import PREDICTED, Evidence, Fit, Floats, Vectors, evidence_of, prediction_errors
from realitygap.evolution import Genome
from realitygap.platforms import SimEnsemble
from realitygap.records import TrialRecord

from .hold_out import FITTED, NOMINAL, POSTERIOR, Compared

SHARE_OF_TRIALS = 0.2
"""Share of the trials that the second fit does not see."""

LEAST_TRIALS = 5
"""Trials below which none are held out."""

N_ROBOTS = 100
"""Simulated robots whose mean is a prediction."""

MOTION = ("ahead", "turn", "wheels")
"""Kinds of observation that show how the robot moves at each step."""

LEAST_ERROR = 1e-6
"""A smaller share of the variance counts as this one."""

Numbers = tuple[Mapping[str, float], Mapping[str, Sequence[float] | Floats]]
"""The estimate and draws of the robot's numbers, by dotted name."""


def is_held_out(n: int) -> list[bool]:
    """Return which of n trials are held out: evenly spread, so that all kinds of trials that take turns are among them.

    No trial is held out if there are fewer than `LEAST_TRIALS`.
    """
    n_held_out = round(SHARE_OF_TRIALS * n) if n >= LEAST_TRIALS else 0
    return [(2 * k + 1) * n_held_out // (2 * n) < (2 * k + 3) * n_held_out // (2 * n) for k in range(n)]


def compare_on_trials(
    parts: Fit,
    trials: Sequence[TrialRecord],
    fit: Callable[[Sequence[TrialRecord]], Numbers],
    ensemble: SimEnsemble,
    *,
    kinds: Sequence[str] = PREDICTED,
    seed: int = 0,
) -> Fit:
    """Return the parts of a fit with the errors on held-out trials, and with a recommendation.

    The numbers stay those of the fit to all trials. They are judged by a second fit, which does not see some trials
    and predicts them.

    Args:
        parts: The parts of the fit to all trials.
        trials: All trials.
        fit: The second fit: from some trials, the estimate and draws of the robot's numbers, by dotted name.
        ensemble: Simulates the robot on whose numbers the fits build.
        kinds: Kinds of observation that count.
        seed: Seed of the predictions.
    """
    held = is_held_out(len(trials))
    if not any(held):
        return parts
    unseen = [trial for trial, is_held in zip(trials, held, strict=True) if is_held]
    evidence, every = evidence_in(ensemble, unseen), evidence_in(ensemble, trials)
    try:
        estimate, draws = fit([trial for trial, is_held in zip(trials, held, strict=True) if not is_held])
    except ValueError as error:
        return replace(
            parts, notes=(f"No trials were held out: a fit to the others failed ({error}).", *parts.notes)
        )
    if not evidence or not estimate:
        return parts
    own = ensemble.platform.robot.centers()
    nominal = {name: own[name] for name in estimate}
    some = np.linspace(0, len(next(iter(draws.values()))) - 1, N_ROBOTS).astype(int)
    robots = {
        FITTED: {name: np.full(N_ROBOTS, value) for name, value in estimate.items()},
        NOMINAL: {name: np.full(N_ROBOTS, value) for name, value in nominal.items()},
        POSTERIOR: {name: np.asarray(values, np.float64)[some] for name, values in draws.items()},
    }

    simulate = partial(simulate_evidence, ensemble)
    by_kind = {
        name: prediction_errors(evidence, every, simulate, numbers, kinds=kinds, key=seed)
        for name, numbers in robots.items()
    }
    seen = list(by_kind[NOMINAL])
    if not seen:
        return parts
    compared = Compared(
        f"share of the variance of {len(unseen)} held-out trials of {len(trials)} that is not predicted, "
        f"geometric mean over {', '.join(seen)}",
        "",
        len(unseen),
        {name: _mean_error(errors.values()) for name, errors in by_kind.items()},
        {kind: {name: errors[kind] for name, errors in by_kind.items()} for kind in seen},
        # Whole trials without motion hardly tell good numbers from bad ones. On 24 fresh twins, the nominal numbers
        # had the smallest error on 5, and the gap was three times as large with them as with the fit.
        choices=(NOMINAL, FITTED, POSTERIOR)
        if parts.misspecified or set(MOTION) & set(seen)
        else (FITTED, POSTERIOR),
    )
    found = {**parts.evidence, "held_out": compared.to_dict()}
    reason, verdict = _advice(compared, len(trials))
    return replace(parts, verdict=verdict, reasons=(reason, *parts.reasons), evidence=found)


def _mean_error(errors: Iterable[float]) -> float:
    """Return the geometric mean over kinds of observation, to which each kind contributes by its ratios.

    In an arithmetic mean, a kind that nothing predicts well outweighs one that the numbers predict well.
    """
    return float(np.exp(np.mean(np.log(np.maximum(list(errors), LEAST_ERROR)))))


def evidence_in(ensemble: SimEnsemble, trials: Sequence[TrialRecord]) -> list[Evidence]:
    """Return the information in recorded trials."""
    genomes = [Genome.from_json(trial.genome) if trial.genome else None for trial in trials]
    return evidence_of(trials, genomes, ensemble.platform.robot, ensemble.arena)


def simulate_evidence(
    ensemble: SimEnsemble, one: Evidence, numbers: Mapping[str, Floats], key: int
) -> Vectors:
    """Return the observations (m, d) of m simulated robots in the trials of evidence."""
    return ensemble.summarize(one.play, numbers, key, one.of, keep=one.keep)


def _advice(compared: Compared, n: int) -> tuple[str, str]:
    """Return the errors and the recommendation in words."""
    errors = compared.errors
    text = (
        f"{compared.n} of {n} trials were held out. A fit to the others leaves {errors[FITTED]:.3g} of their variance "
        f"unexplained (geometric mean over kinds of observation), draws of its posterior {errors[POSTERIOR]:.3g}, and "
        f"the numbers that it started from {errors[NOMINAL]:.3g}."
    )
    advice = {
        FITTED: "Use this calibration.",
        POSTERIOR: "Use this calibration with draws of the posterior (`realitygap run --randomize posterior`).",
        NOMINAL: "The numbers that it started from predict best: use them instead, or record more trials.",
    }
    words = advice[compared.recommended]
    if compared.errors[NOMINAL] < compared.errors[compared.recommended]:
        words += (
            " Without poses or encoders, trials cannot show that the numbers that it started from are better."
        )
    return text, words
