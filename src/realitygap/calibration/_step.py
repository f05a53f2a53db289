"""The duration of the commands of trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from realitygap.records import TrialRecord

ALIKE = 0.1
"""Share by which commands of trials may differ in length and are taken for equally long: over a radio link none are."""


def of_one_length(trials: Sequence[TrialRecord]) -> tuple[list[TrialRecord], str]:
    """Return the largest group of trials with commands of about the same length, and a text on the others, or ""."""
    lengths = sorted(trial.step_s for trial in trials)
    if not lengths or lengths[-1] <= (1 + ALIKE) * lengths[0]:
        return list(trials), ""
    least = max(lengths, key=lambda length: sum(length <= each <= (1 + ALIKE) * length for each in lengths))
    kept = [trial for trial in trials if least <= trial.step_s <= (1 + ALIKE) * least]
    others = [length for length in lengths if not least <= length <= (1 + ALIKE) * least]
    return kept, (
        f"{len(others)} of {len(trials)} trials were left out: their commands lasted {others[0]:.3g} to "
        f"{others[-1]:.3g} s. Those of the {len(kept)} that count lasted {least:.3g} to "
        f"{max(trial.step_s for trial in kept):.3g} s."
    )


def step_of(trials: Sequence[TrialRecord]) -> float:
    """Return the median duration of a command in these trials [s].

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
