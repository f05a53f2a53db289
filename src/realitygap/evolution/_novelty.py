"""Novelty: distances between behaviors, and the archives that remember them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from realitygap.drawing import ShownAsCard
from realitygap.errors import finite_numbers, real_number
from realitygap.kernels.neat import novelty as novelty_kernels
from realitygap.settings import Settings

from ._distances import DISTANCES, CellOrder, Cells, DistanceName, measure_of, pack_behaviors


class NoveltySettings(Settings):
    """The settings of novelty: its measure and its archive.

    `paper` (Rosenzweig & Remy, section 2.4) has a short archive, whose oldest behavior is replaced. Novelty is the
    mean distance to the archive. With `lehman-stanley` (Lehman & Stanley, 2011), novelty is the mean distance to the
    k nearest behaviors in population and archive. A behavior enters this archive if its novelty exceeds a moving
    threshold. Both work with any distance of behaviors.
    """

    kind: Literal["paper", "lehman-stanley"] = Field("paper", description="Kind of novelty search.")
    distance: DistanceName = Field(
        "paper",
        description="Distance between two behaviors: the paper's distance of sorted cells, or another one that "
        "realitygap audit-distance draws. ordered, edit and alignment need the order of visits.",
    )
    sort: CellOrder = Field(
        "x-then-y",
        description="Order of the cells in the distance 'paper'. The paper does not state it. It names cells (0,0) and "
        "(11,5), pairs that Python sorts by x first.",
    )
    archive_size: int = Field(
        8,
        ge=1,
        le=100_000,
        description="paper: number of behaviors in the archive. The archive is filled before any is replaced. The "
        "paper does not state the number.",
    )
    enter: Literal["above-all", "above-least"] = Field(
        "above-all",
        description="paper: condition for a behavior to replace the oldest one. above-all: it is more novel than all "
        "in the archive ('more novel than the other behaviors in the archive'). above-least: it is more novel than the "
        "least novel one.",
    )
    neighbors: int = Field(
        15, ge=1, le=100_000, description="lehman-stanley: number k of nearest behaviors (2011: 15)."
    )
    threshold: float = Field(
        6.0,
        ge=0,
        description="lehman-stanley: novelty above which a behavior enters at first, in the unit of the distance. "
        "Required with any distance other than the paper's.",
    )
    patience: int = Field(
        2500,
        ge=1,
        description="lehman-stanley: number of evaluations without an entry after which the threshold falls by 5 %.",
    )

    @model_validator(mode="after")
    def _threshold_is_in_the_unit_of_the_distance(self) -> Self:
        chosen = self.kind == "lehman-stanley" and self.distance != "paper"
        if chosen and "threshold" not in self.model_fields_set:
            unit = {"cells": "in cells", "m": "in meters", "1": "0 to 1"}[DISTANCES[self.distance].unit]
            raise ValueError(
                f"threshold is not given, expected one with distance {self.distance!r} ({unit}): the default of 6 is "
                "for the paper's distance"
            )
        return self

    @model_serializer(mode="wrap")
    def _leave_out_what_was_not_there(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the paper's distance, so that conditions from before there was another keep their hash."""
        values: dict[str, Any] = handler(self)
        return {key: value for key, value in values.items() if (key, value) != ("distance", "paper")}


def largest_cell_distance(columns: int, rows: int) -> float:
    """Return the largest distance between two cells of a grid [cells], the paper's padding."""
    return math.hypot(columns - 1, rows - 1)


def sorted_cells_distance(
    first: Cells,
    second: Cells,
    *,
    columns: int = 12,
    rows: int = 6,
    sort: CellOrder = "x-then-y",
) -> float:
    """Return the paper's distance between two behaviors [cells].

    It is the sum of the distances between the cells at equal places of the two sorted lists. Each surplus cell of the
    longer list counts with the largest distance in the grid.

    Args:
        first, second: Cells, numbered columns * row + column; order and repeats do not matter.
        columns, rows: Size of the grid.
        sort: Order of the cells: by x first, or by y first.

    Raises:
        TypeError: A cell that is not a whole number.
        ValueError: A cell outside the grid.

    Source: Rosenzweig & Remy, section 2.4.
    """
    return float(DISTANCES["paper"].distances([first], [second], columns=columns, rows=rows, sort=sort)[0, 0])


class PaperArchive(ShownAsCard):
    """The paper's novelty: mean distance to a short archive whose oldest behavior is replaced.

    While there is room, the behaviors of a generation first enter the archive, in order. Then each individual is
    compared with all archived behaviors except its own. The novelty of an archived behavior is its mean distance to
    the others. In the order of individuals, each one that is more novel than the archived ones replaces the oldest.

    Source: Rosenzweig & Remy, section 2.4; size, filling and formula are not printed there and are ours.
    """

    def __init__(self, settings: NoveltySettings | None = None, *, columns: int = 12, rows: int = 6) -> None:
        self.settings = settings or NoveltySettings()
        self._columns = columns
        self._rows = rows
        self._archive = novelty_kernels.make_archive(0, self.settings.archive_size, columns * rows)

    def __len__(self) -> int:
        return int(self._archive.state[0])

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} of {self.settings.archive_size} behaviors)"

    @property
    def grid_size(self) -> tuple[int, int]:
        """Columns and rows of the grid."""
        return self._columns, self._rows

    def update(self, behaviors: Sequence[Cells] | ArrayLike) -> NDArray[np.float64]:
        """Return the novelty of each individual of a generation, and update the archive.

        Args:
            behaviors: n behaviors in the order of individuals: lists of visited cells, or positions if the distance
                of the settings compares them (`BehaviorDistance.distances`).

        Returns:
            (n,) float64, in the unit of the distance; 0 if there is nothing to compare with.

        Raises:
            TypeError: A cell that is not a whole number.
            ValueError: A cell outside the grid, or positions that are not pairs of finite numbers.
        """
        measure = measure_of(self.settings.distance, self._columns, self._rows, self.settings.sort)
        packed = pack_behaviors(measure, behaviors, self._columns, self._rows)
        n = len(packed.n_cells)
        novelty = np.empty(n)
        room = {"place_of": np.zeros(n, np.int64), "distance": np.zeros((n, self.settings.archive_size))}
        novelty_kernels.paper_archive_step(
            packed, measure, self._archive._replace(**room), self.settings.enter == "above-all", novelty
        )
        return novelty


def _euclidean(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Return the straight distance between two behaviors that are points."""
    return float(np.linalg.norm(first - second))


class NearestArchive(ShownAsCard):
    """Lehman & Stanley's novelty: mean distance to the k nearest in population and archive.

    A behavior enters the archive when its novelty exceeds a threshold, which falls by 5 % after `patience`
    evaluations without an entry and rises by 20 % when more than four enter in a row.

    Source: Lehman & Stanley (2011). Differs: by generation rather than steady state; the individuals of a
    generation are compared with each other first and then enter in order.
    """

    def __init__(
        self,
        distance: Callable[[NDArray[np.float64], NDArray[np.float64]], float] = _euclidean,
        *,
        k: int = 15,
        threshold: float = 6.0,
        patience: int = 2500,
    ) -> None:
        """Make an empty archive.

        Args:
            distance: Function that returns the distance between two behaviors, (d,) each.
            k: Number of neighbors to average over, at least 1; all of them while there are fewer.
            threshold: Novelty above which a behavior enters at first.
            patience: Number of evaluations without an entry after which the threshold falls.

        Raises:
            ValueError: k < 1, or a threshold that is infinite or NaN.
        """
        if k < 1:
            raise ValueError(f"k is {k}, expected at least 1.")
        real_number("threshold", threshold)
        self._distance = distance
        self._k = k
        self._patience = patience
        self._threshold = np.array([threshold], np.float64)
        self._counters = np.zeros(2, np.int64)
        self.behaviors: list[NDArray[np.float64]] = []

    def __len__(self) -> int:
        return len(self.behaviors)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} behaviors, k={self._k}, threshold={self.threshold:.4g})"

    @property
    def threshold(self) -> float:
        """The novelty above which a behavior enters now."""
        return float(self._threshold[0])

    def update(self, behaviors: ArrayLike) -> NDArray[np.float64]:
        """Return the novelty of each individual of a generation, and add the novel ones to the archive.

        Args:
            behaviors: (n, d), one row per individual, in order.

        Returns:
            (n,) float64, in the unit of the distance; 0 if there is nothing to compare with.

        Raises:
            ValueError: The array is not two-dimensional, a value or a distance is not finite, or d differs from the
                archive's.
        """
        rows = finite_numbers("behaviors", behaviors)
        if rows.ndim != 2:
            raise ValueError(f"behaviors has shape {rows.shape}, expected (n, d).")
        if self.behaviors and self.behaviors[0].shape != rows.shape[1:]:
            raise ValueError(
                f"behaviors has {rows.shape[1]} columns, expected {self.behaviors[0].size}: as in the archive."
            )
        n = len(rows)
        others = [*rows, *self.behaviors]
        distances = np.empty((n, len(others)))
        for i in range(n):
            for j, other in enumerate(others):
                distances[i, j] = -1.0 if i == j else self._distance(rows[i], other)
        finite_numbers("distance", distances)
        nearest = np.empty(self._k)
        novelty = np.array([novelty_kernels.mean_of_nearest(row, len(others), nearest) for row in distances])
        entered = np.empty(n, np.bool_)
        novelty_kernels.admit(novelty, self._counters, self._threshold, self._patience, entered)
        self.behaviors.extend(rows[k].copy() for k in np.flatnonzero(entered))
        return novelty
