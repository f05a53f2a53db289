"""Distances of behaviors, written for the eye; a behavior is a list of cells, each once, in order of first visit."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence

from .novelty import Point, paper_distance, points_of

Cells = Sequence[int]
GAP = 1.0


def in_order(cells: Cells, columns: int) -> list[Point]:
    return [(cell % columns, cell // columns) for cell in dict.fromkeys(cells)]


def paper(one: Cells, other: Cells, columns: int, rows: int) -> float:
    return paper_distance(points_of(one, columns), points_of(other, columns), columns, rows)


def ordered(one: Cells, other: Cells, columns: int, rows: int) -> float:
    return paper_distance(in_order(one, columns), in_order(other, columns), columns, rows)


def hamming(one: Cells, other: Cells, columns: int, rows: int) -> float:
    return float(len(set(one) ^ set(other)))


def jaccard(one: Cells, other: Cells, columns: int, rows: int) -> float:
    either = set(one) | set(other)
    return hamming(one, other, columns, rows) / len(either) if either else 0.0


def least_cost(one: Sequence[Point], other: Sequence[Point], cost: Callable[[Point, Point], float]) -> float:
    """By the recursive definition."""

    @functools.cache
    def of(n: int, m: int) -> float:
        if n == 0 or m == 0:
            return GAP * (n + m)
        put = of(n - 1, m - 1) + cost(one[n - 1], other[m - 1])
        return min(put, of(n - 1, m) + GAP, of(n, m - 1) + GAP)

    return of(len(one), len(other))


def edit(one: Cells, other: Cells, columns: int, rows: int) -> float:
    return least_cost(in_order(one, columns), in_order(other, columns), lambda a, b: 0.0 if a == b else 1.0)


def alignment(one: Cells, other: Cells, columns: int, rows: int) -> float:
    a, b = in_order(one, columns), in_order(other, columns)
    cost = least_cost(a, b, math.dist)
    total = GAP * (len(a) + len(b)) + cost
    return 2 * cost / total if total else 0.0


BY_NAME: dict[str, Callable[[Cells, Cells, int, int], float]] = {
    "paper": paper,
    "ordered": ordered,
    "jaccard": jaccard,
    "hamming": hamming,
    "edit": edit,
    "alignment": alignment,
}
