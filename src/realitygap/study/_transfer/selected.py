"""Strategies that spend trials on choosing among champions of the simulation: plain, select and halving."""

from __future__ import annotations

from collections.abc import Sequence

from .attempt import Attempt
from .simulated import Champion


def plain(attempt: Attempt) -> Champion:
    """Return the best champion in simulation, without a trial on the target."""
    return attempt.champions()[0]


def select(attempt: Attempt) -> Champion:
    """Try each of the N best champions in simulation once on the target, and return the first of the best."""
    return best_on_target(attempt, attempt.champions())


def halving(attempt: Attempt) -> Champion:
    """Try champions in rounds, and give half of the trials that are left to those that were best so far.

    Source: successive halving (Karnin, Koren & Somekh, 2013). Differs: one trial each in a round, so that rounds halve
    the trials as well; means are over all rounds.
    """
    contenders = attempt.champions()
    sums = [0.0] * len(contenders)
    places = list(range(len(contenders)))
    rounds = 0
    while attempt.left:
        places = places[: max(1, -(-attempt.left // 2))]
        places = places[: attempt.left]
        tried = attempt.score_on_target([contenders[k] for k in places])
        rounds += 1
        for k, score in zip(places, tried, strict=True):
            sums[k] += score
        places.sort(key=lambda k: (-sums[k], k))
    return contenders[places[0]]


def best_on_target(attempt: Attempt, champions: Sequence[Champion]) -> Champion:
    """Spend the rest of the budget on the first champions, once each. Return the best, or the first without budget."""
    tried = champions[: attempt.left]
    if not tried:
        return champions[0]
    scores = attempt.score_on_target(tried)
    return tried[max(range(len(tried)), key=lambda k: (scores[k], -k))]
