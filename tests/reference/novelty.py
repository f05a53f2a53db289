"""Novelty of behaviors, as Rosenzweig & Remy (section 2.4) and Lehman & Stanley (2011) describe it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

Point = tuple[int, int]


def points_of(cells: Sequence[int], columns: int, *, x_first: bool = True) -> list[Point]:
    """The sorted cells of a behavior, each once."""
    points = {(cell % columns, cell // columns) for cell in cells}
    return sorted(points, key=lambda point: point if x_first else point[::-1])


def paper_distance(one: Sequence[Point], other: Sequence[Point], columns: int, rows: int) -> float:
    """Pointwise distances, and the largest distance of two cells for each without a counterpart."""
    largest = math.dist((0, 0), (columns - 1, rows - 1))
    paired = sum(math.dist(a, b) for a, b in zip(one, other, strict=False))
    return paired + largest * abs(len(one) - len(other))


def mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else 0.0


class PaperArchive:
    """The last behaviors that were novel; the oldest comes first."""

    def __init__(self, size: int, columns: int, rows: int, *, above_all: bool, x_first: bool) -> None:
        self.size = size
        self.columns, self.rows = columns, rows
        self.above_all, self.x_first = above_all, x_first
        self.behaviors: list[list[Point]] = []

    def distance(self, one: Sequence[Point], other: Sequence[Point]) -> float:
        return paper_distance(one, other, self.columns, self.rows)

    def novelty_of(self, behavior: list[Point]) -> float:
        """Mean distance to the archived behaviors, itself (this very object) left out."""
        return mean([self.distance(behavior, other) for other in self.behaviors if other is not behavior])

    def update(self, visited: Sequence[Sequence[int]]) -> list[float]:
        behaviors = [points_of(cells, self.columns, x_first=self.x_first) for cells in visited]
        room = self.size - len(self.behaviors)
        self.behaviors += behaviors[:room]
        novelty = [self.novelty_of(behavior) for behavior in behaviors]
        if len(self.behaviors) == self.size:
            for behavior, own in list(zip(behaviors, novelty, strict=True))[room:]:
                archived = [self.novelty_of(other) for other in self.behaviors]
                if own > (max(archived) if self.above_all else min(archived)):
                    self.behaviors = [*self.behaviors[1:], behavior]
        return novelty


class NearestArchive:
    """All behaviors that were novel enough when they came."""

    def __init__(
        self, distance: Callable[[Any, Any], float], k: int, threshold: float, patience: int
    ) -> None:
        self.distance = distance
        self.k, self.threshold, self.patience = k, threshold, patience
        self.behaviors: list[Any] = []
        self.without_entry = 0
        self.in_a_row = 0

    def update(self, behaviors: Sequence[Any]) -> list[float]:
        novelty = []
        for i, behavior in enumerate(behaviors):
            others = [*behaviors[:i], *behaviors[i + 1 :], *self.behaviors]
            distances = sorted(self.distance(behavior, other) for other in others)
            novelty.append(mean(distances[: self.k]))
        for behavior, own in zip(behaviors, novelty, strict=True):
            if own > self.threshold:
                self.behaviors.append(behavior)
                self.without_entry = 0
                self.in_a_row += 1
            else:
                self.without_entry += 1
                self.in_a_row = 0
            if self.in_a_row > 4:
                self.threshold *= 1.2
                self.in_a_row = 0
            if self.without_entry >= self.patience:
                self.threshold *= 0.95
                self.without_entry = 0
        return novelty
