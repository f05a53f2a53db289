"""Distances of behaviors by name: what each compares, what it costs, and whether it is a metric."""

from __future__ import annotations

import functools
import reprlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import did_you_mean, finite_numbers
from realitygap.kernels.neat import distances as distances_kernels
from realitygap.kernels.neat.distances import Behaviors, Measure

Cells = Sequence[int] | NDArray[np.integer]
CellOrder = Literal["x-then-y", "y-then-x"]
DistanceName = Literal["paper", "ordered", "jaccard", "hamming", "final", "edit", "alignment"]


@dataclass(frozen=True)
class BehaviorDistance:
    """A distance of two behaviors.

    Attributes:
        name: Name in study files.
        compares: Part of a trial that it compares: the visited cells, or the final position.
        unit: Unit: cells, m, or 1 for a share.
        cost: Number of steps to compute one distance between behaviors of n and m cells in a grid of c cells.
        description: Definition in a sentence.
        source: Publication that describes it.
        needs_order: True if the order of first visits matters. A drawing on squared paper, scored by hand, does not
            show this order.
        is_metric: True if it is a metric: 0 only for equal behaviors, symmetric, and never longer than the path over
            a third behavior.
    """

    name: DistanceName
    compares: Literal["cells", "position"]
    unit: Literal["cells", "m", "1"]
    cost: str
    description: str
    source: str
    needs_order: bool = False
    is_metric: bool = True

    def distances(
        self,
        behaviors: Sequence[Cells] | ArrayLike,
        others: Sequence[Cells] | ArrayLike | None = None,
        *,
        columns: int = 12,
        rows: int = 6,
        sort: CellOrder = "x-then-y",
    ) -> NDArray[np.float64]:
        """Return the distance of each behavior to each of the others.

        Args:
            behaviors: n lists of cells, numbered columns * row + column, in the order of visits. Only the first visit
                of a cell counts. For a distance of positions: (n, 2) [m].
            others: m behaviors of the same form. Default: `behaviors`.
            columns, rows: Size of the grid.
            sort: Order in which `paper` sorts cells.

        Returns:
            (n, m) float64, in the distance's unit. Two behaviors without cells are equal.

        Raises:
            TypeError: A cell that is not a whole number.
            ValueError: A cell outside the grid, or positions that are not pairs of finite numbers.
        """
        measure = measure_of(self.name, columns, rows, sort)
        first = pack_behaviors(measure, behaviors, columns, rows)
        second = first if others is None else pack_behaviors(measure, others, columns, rows)
        distances = np.empty((len(first.n_cells), len(second.n_cells)))
        distances_kernels.distances_between(measure, first, second, distances)
        return distances


DISTANCES: dict[str, BehaviorDistance] = {
    distance.name: distance
    for distance in (
        BehaviorDistance(
            "paper",
            compares="cells",
            unit="cells",
            cost="n + m + c",
            description="Sum of the distances between the cells at equal places of the two sorted lists. Each "
            "surplus cell of the longer list counts with the largest distance in the grid.",
            source="Rosenzweig & Remy, section 2.4.",
        ),
        BehaviorDistance(
            "ordered",
            compares="cells",
            needs_order=True,
            unit="cells",
            cost="n + m",
            description="As `paper`, but with the cells in the order of first visits.",
            source="Rosenzweig & Remy, section 5: “by not sorting the behaviors”.",
        ),
        BehaviorDistance(
            "jaccard",
            compares="cells",
            unit="1",
            cost="c / 31",
            description="Number of cells that only one of the two visited, divided by the number that either visited.",
            source="Jaccard (1912), New Phytologist 11(2), 37-50; a metric: Levandowsky & Winter (1971), Nature "
            "234, 34-35.",
        ),
        BehaviorDistance(
            "hamming",
            compares="cells",
            unit="cells",
            cost="c / 31",
            description="Number of cells that only one of the two visited.",
            source="Hamming (1950), Bell System Technical Journal 29(2), 147-160.",
        ),
        BehaviorDistance(
            "final",
            compares="position",
            unit="m",
            cost="1",
            description="Straight distance between the two final positions.",
            source="Lehman & Stanley (2011): where a trial in a maze ends.",
        ),
        BehaviorDistance(
            "edit",
            compares="cells",
            needs_order=True,
            unit="cells",
            cost="n m",
            description="Smallest number of cells to insert, delete, or replace that turns one list, in the order of "
            "first visits, into the other.",
            source="Levenshtein (1966), Soviet Physics Doklady 10(8), 707-710.",
        ),
        BehaviorDistance(
            "alignment",
            compares="cells",
            needs_order=True,
            unit="1",
            cost="n m",
            description="Normalized cost of aligning the two lists, in the order of first visits. A pair of cells "
            "costs their distance in cells, and a cell without a partner costs 1. With the smallest total cost d, "
            "the distance is 2 d / (n + m + d): 0 for equal lists, 1 if no cells are paired.",
            source="Needleman & Wunsch (1970), J. Mol. Biol. 48(3), 443-453, with costs in place of scores; the share, "
            "a metric: Li & Liu (2007), IEEE TPAMI 29(6), 1091-1095. Proposed by Rosenzweig & Remy, section 5.",
        ),
    )
}
"""The distances that `novelty.distance` names."""

_KINDS = {
    "paper": distances_kernels.PAPER,
    "ordered": distances_kernels.ORDERED,
    "jaccard": distances_kernels.JACCARD,
    "hamming": distances_kernels.HAMMING,
    "final": distances_kernels.FINAL,
    "edit": distances_kernels.EDIT,
    "alignment": distances_kernels.ALIGNMENT,
}


def behavior_distance(name: str) -> BehaviorDistance:
    """Return the distance of this name.

    Raises:
        ValueError: There is no such distance.
    """
    if name not in DISTANCES:
        raise ValueError(f"Unknown distance {name!r}. {did_you_mean(name, DISTANCES)}")
    return DISTANCES[name]


def distance_kind(name: str) -> int:
    """Return its number in kernels."""
    return _KINDS[name]


@functools.cache
def _made(name: str, columns: int, rows: int, sort: CellOrder) -> Measure:
    measure: Measure = distances_kernels.make_measure(_KINDS[name], columns, rows, sort == "x-then-y")
    return measure


def measure_of(name: str, columns: int, rows: int, sort: CellOrder) -> Measure:
    """Return the distance in the form that kernels read, with a separate work array for each thread."""
    return _made(name, columns, rows, sort)._replace(room=np.zeros(columns * rows + 1))


def pack_behaviors(
    measure: Measure, behaviors: Sequence[Cells] | ArrayLike, columns: int, rows: int
) -> Behaviors:
    """Return behaviors in the form that a measure reads.

    Raises:
        TypeError: A cell that is not a whole number.
        ValueError: A cell outside the grid, or positions that are not pairs of finite numbers.
    """
    if measure.kind == distances_kernels.FINAL:
        return _pack_positions(behaviors)
    lists: list[Any] = list(behaviors)  # type: ignore[arg-type]  # one number alone is no list, as Python says
    packed: Behaviors = distances_kernels.make_behaviors(len(lists), columns * rows)
    for row, cells in enumerate(lists):
        visited = first_visits(cells, columns, rows)
        distances_kernels.describe(measure, visited, len(visited), 0.0, 0.0, packed, row)
    return packed


def first_visits(cells: Any, columns: int, rows: int) -> NDArray[np.int64]:
    """Return the cells of a behavior, each once, in the order of first visits.

    Raises:
        TypeError: A cell that is not a whole number.
        ValueError: A cell outside the grid.
    """
    given = np.asarray(cells)
    if given.size and given.dtype.kind not in "iu":
        raise TypeError(f"A behavior is {reprlib.repr(cells)}, expected whole numbers: those of its cells.")
    numbers, first = np.unique(given.astype(np.int64), return_index=True)
    if numbers.size and (numbers[0] < 0 or numbers[-1] >= columns * rows):
        raise ValueError(
            f"A behavior names cell {numbers[0] if numbers[0] < 0 else numbers[-1]}, "
            f"expected 0 to {columns * rows - 1}: the grid has {columns} columns and {rows} rows."
        )
    return numbers[np.argsort(first)]


def _pack_positions(positions: Sequence[Cells] | ArrayLike) -> Behaviors:
    points = np.ascontiguousarray(finite_numbers("behaviors", np.asarray(positions, np.float64)))
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"behaviors has shape {points.shape}, expected (n, 2): where each trial ended [m].")
    n = len(points)
    return Behaviors(np.zeros((n, 1), np.int32), np.zeros(n, np.int32), points)
