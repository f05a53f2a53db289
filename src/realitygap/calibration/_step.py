"""How long the commands of trials lasted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from realitygap.records import ObservedTrial

ALIKE = 0.1
"""Share by which commands of trials may differ in length and are taken for equally long: over a radio link none are."""


def of_one_length(trials: Sequence[ObservedTrial]) -> tuple[list[ObservedTrial], str]:
    """Trials whose commands lasted as long as most did, and in words which were left out; empty where none was."""
    lengths = sorted(trial.step_s for trial in trials)
    if not lengths or lengths[-1] <= (1 + ALIKE) * lengths[0]:
        return list(trials), ""
    middle, most = lengths[(len(lengths) - 1) // 2], 0.999 * (1 + ALIKE) ** 0.5
    kept = [trial for trial in trials if middle / most <= trial.step_s <= middle * most]
    others = [trial.step_s for trial in trials if not middle / most <= trial.step_s <= middle * most]
    return kept, (
        f"{len(others)} of {len(trials)} trials were left out: their commands lasted {min(others):.3g} to "
        f"{max(others):.3g} s, and most {middle:.3g} s."
    )


def step_of(trials: Sequence[ObservedTrial]) -> float:
    """How long one command of these trials lasted, their median [s].

    Raises:
        ValueError: No trial, or such different lengths that they are no robot's with one step.
    """
    if not trials:
        raise ValueError("There are no trials to fit to, expected at least one.")
    lengths = [trial.step_s for trial in trials]
    if max(lengths) > (1 + ALIKE) * min(lengths):
        raise ValueError(
            f"The trials' commands last {min(lengths):.3g} to {max(lengths):.3g} s, expected one length of time. Fit "
            "them apart."
        )
    return float(np.median(lengths))
