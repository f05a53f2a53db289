"""Numbers and choices by chance, and whether a number is odd."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

from ._mistakes import MyroError, whole

_LARGEST = 2**53
"""Largest whole number up to which a float is exact."""


def randomNumber() -> float:
    """Return a number by chance, from 0 up to but not including 1."""
    return random.random()


def flipCoin() -> str:
    """Return heads or tails, as "heads" or "tails", each half of the time."""
    return random.choice(("heads", "tails"))


def heads() -> bool:
    """Flip a coin: whether it shows heads."""
    return flipCoin() == "heads"


def tails() -> bool:
    """Flip a coin: whether it shows tails."""
    return flipCoin() == "tails"


def pickOne(*items: Any) -> Any:
    """Return one of several things at random, `pickOne("left", "right")`, or a whole number below one, `pickOne(6)`.

    Args:
        items: Two or more things; or a whole number n for one of 0 to n - 1; or one list.

    Raises:
        MyroError: There is nothing to pick from.
    """
    if len(items) == 1 and isinstance(items[0], Sequence) and not isinstance(items[0], str):
        items = tuple(items[0])
    elif len(items) == 1:
        return random.randrange(whole("pickOne: the number", items[0], 1, _LARGEST))
    if not items:
        raise MyroError('pickOne() has nothing to pick from, expected things like pickOne("left", "right").')
    return random.choice(items)


def pickOneInRange(start: int, stop: int) -> int:
    """Return a whole number by chance, from `start` up to but not including `stop`.

    Raises:
        MyroError: There is none between them.
    """
    low = whole("pickOneInRange: start", start, -_LARGEST, _LARGEST)
    high = whole("pickOneInRange: stop", stop, -_LARGEST, _LARGEST)
    if high <= low:
        raise MyroError(f"pickOneInRange: stop is {stop!r}, expected more than start, which is {start!r}.")
    return random.randrange(low, high)


def odd(n: float) -> bool:
    """Return whether a number is odd."""
    return n % 2 == 1


def even(n: float) -> bool:
    """Return whether a number is even."""
    return n % 2 == 0
