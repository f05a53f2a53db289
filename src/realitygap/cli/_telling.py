"""Progress of trials without an operator, as lines on standard error."""

from __future__ import annotations

import time
from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from realitygap._terminal import echo
from realitygap.trials import Card, Operator, Preflight

if TYPE_CHECKING:
    from realitygap.records import Score, Trial, TrialRecord

_SILENCE_S = 10.0
"""Time without a message after which the next trial is reported, too."""


class TellingOperator(Operator):
    """An operator that reports each closed generation, and each trial if that takes long."""

    _told = 0.0

    def accept(self, preflight: Preflight) -> bool:
        """Report what speaks against driving if it drives all the same."""
        accepts = super().accept(preflight)
        for problem in preflight.problems if accepts else ():
            self._say(f"Against driving: {problem}. The robot drives anyway (--despite-preflight).")
        return accepts

    def place(self, card: Card) -> None:
        """Put the robot at the start."""
        self._told = self._told or time.monotonic()
        super().place(card)

    def drawn(self, card: Card, record: TrialRecord) -> Score | None:
        """Return the cells along the driven line."""
        score = super().drawn(card, record)
        if score is not None and time.monotonic() - self._told > _SILENCE_S:
            self._say(f"Trial {card.trial.trial}, {card.title}: {len(set(score.cells))} cells.")
        return score

    def close(self, cards: Sequence[Card]) -> Sequence[int]:
        """Close it."""
        trials = sorted((card.trial for card in cards), key=_run)
        for (condition, replicate, generation), group in groupby(trials, key=_run):
            counts = [len(trial.cells or ()) for trial in group]
            self._say(
                f"{condition}, run {replicate}, generation {generation}: {len(counts)} trials, at most {max(counts)} "
                "cells."
            )
        return super().close(cards)

    def _say(self, text: str) -> None:
        echo(text, err=True)
        self._told = time.monotonic()


def _run(trial: Trial) -> tuple[str, int, int]:
    return trial.condition, trial.replicate, trial.generation
