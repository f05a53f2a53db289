"""The order, the sheets, the pens, and the codes of physical trials."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from realitygap.records import Turn
from realitygap.runs import Condition

from ._study import TrialsSection

Run = tuple[Condition, int]
"""A condition and the number of a replicate."""

Block = tuple[tuple[Condition, int, int], ...]
"""Generations (condition, replicate, generation) whose trials are driven together."""

_LETTERS = "BCDFGHJKLMNPQRSTVWXZ"
"""Letters of codes, without vowels, so that none is a word."""


def blocks_of(conditions: Sequence[Condition], replicates: int, trials: TrialsSection) -> Iterator[Block]:
    """Yield all generations in the order in which they are driven.

    In order: a generation at a time, run by run, condition by condition. Shuffled: the same generation of the same
    replicate of all conditions together, so that what changes from day to day meets all conditions alike.
    """
    if trials.order == "in-order":
        for condition, replicate in itertools.product(conditions, range(replicates)):
            for generation in range(condition.neat.generations):
                yield ((condition, replicate, generation),)
        return
    most = max((condition.neat.generations for condition in conditions), default=0)
    for replicate, generation in itertools.product(range(replicates), range(most)):
        yield tuple(
            (condition, replicate, generation)
            for condition in conditions
            if generation < condition.neat.generations
        )


def turns_of(
    generations: Block, trials: TrialsSection, *, first_sheet: int, used_codes: set[str]
) -> list[Turn]:
    """Return the turns of all individuals of these generations."""
    places = [
        (condition, replicate, generation, individual)
        for condition, replicate, generation in generations
        for individual in range(condition.neat.population)
    ]
    if trials.order == "shuffled":
        places = [places[k] for k in _shuffled(len(places), generations)]
    turns, used = [], set(used_codes)
    for number, (condition, replicate, generation, individual) in enumerate(places):
        which = f"{condition.key}:{condition.name}:{replicate}:{generation}:{individual}"
        code = _code(which, used)
        used.add(code)
        sheet, pen = divmod(number, len(trials.pens))
        turns.append(Turn(condition.name, replicate, generation, individual, first_sheet + sheet, pen, code))
    return turns


def _shuffled(n: int, generations: Block) -> list[int]:
    """Return 0 to n - 1 in an order that follows from the study's seed and the block."""
    condition, replicate, generation = generations[0]
    words = f"{condition.seed}:order:{replicate}:{generation}"
    seed = int.from_bytes(hashlib.blake2b(words.encode(), digest_size=16).digest(), "little")
    return [int(k) for k in np.random.Generator(np.random.Philox(seed)).permutation(n)]


def _code(which: str, used: set[str]) -> str:
    """Return four letters without a meaning; the next ones if these are taken."""
    for attempt in itertools.count():
        number = int.from_bytes(
            hashlib.blake2b(f"{which}:{attempt}".encode(), digest_size=8).digest(), "little"
        )
        code = "".join(_LETTERS[number // len(_LETTERS) ** k % len(_LETTERS)] for k in range(4))
        if code not in used:
            return code
    raise AssertionError("unreachable")
