"""The archive that settings of novelty describe, whichever kind and distance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.drawing import ShownAsCard
from realitygap.kernels.neat import distances
from realitygap.kernels.neat import novelty as novelty_kernels

from ._distances import Cells, measure_of, pack_behaviors
from ._novelty import NoveltySettings, PaperArchive


class NoveltyArchive(ShownAsCard):
    """Behaviors remembered by novelty search, as `[novelty]` of a study file says.

    The same as `PaperArchive` for kind `paper`; for kind `lehman-stanley` the same as `NearestArchive`, compiled, with
    one of the distances of `DISTANCES`.
    """

    def __init__(self, settings: NoveltySettings | None = None, *, columns: int = 12, rows: int = 6) -> None:
        """Make an empty archive.

        Args:
            settings: Kind, distance, and all other settings. Default: the paper's.
            columns, rows: Size of the grid.
        """
        self.settings = settings or NoveltySettings()
        self._columns = columns
        self._rows = rows
        is_paper = self.settings.kind == "paper"
        self._paper = PaperArchive(self.settings, columns=columns, rows=rows) if is_paper else None
        self._archived: distances.Behaviors = distances.make_behaviors(0, columns * rows)
        self._state = np.zeros(1, np.int64)
        self._counters = np.zeros(2, np.int64)
        self._threshold = np.array([self.settings.threshold], np.float64)

    def __len__(self) -> int:
        return int(self._state[0]) if self._paper is None else len(self._paper)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.settings.kind!r}, {len(self)} behaviors)"

    @property
    def grid_size(self) -> tuple[int, int]:
        """Columns and rows of the grid."""
        return self._columns, self._rows

    @property
    def packed(self) -> distances.Behaviors:
        """The behaviors as kernels read them; the first `len(self)` of them count."""
        return self._archived if self._paper is None else self._paper._archive.behaviors

    def update(self, behaviors: Sequence[Cells] | ArrayLike) -> NDArray[np.float64]:
        """Return the novelty of one generation, which the archive then takes in.

        Args:
            behaviors: n behaviors in the order of individuals, in the form that the distance compares
                (`BehaviorDistance.distances`).

        Returns:
            (n,) float64, in the unit of the distance; 0 if there is nothing to compare with.

        Raises:
            TypeError: A cell that is not a whole number.
            ValueError: A cell outside the grid, or positions that are not pairs of finite numbers.
        """
        if self._paper is not None:
            return self._paper.update(behaviors)
        settings = self.settings
        measure = measure_of(settings.distance, self._columns, self._rows, settings.sort)
        packed = pack_behaviors(measure, behaviors, self._columns, self._rows)
        n = len(packed.n_cells)
        self._make_room(n)
        room = novelty_kernels.NearestRoom(
            np.empty(n + len(self._archived.n_cells)), np.empty(settings.neighbors), np.empty(n, np.bool_)
        )
        novelty = np.empty(n)
        novelty_kernels.nearest_archive_step(
            packed,
            measure,
            settings.patience,
            self._archived,
            self._state,
            self._counters,
            self._threshold,
            room,
            novelty,
        )
        return novelty

    def _make_room(self, n: int) -> None:
        """Let all of n individuals enter, should they be novel; room grows by half at least."""
        held = len(self._archived.n_cells)
        if self._state[0] + n > held:
            more = distances.make_behaviors(max(n, held // 2), self._columns * self._rows)
            self._archived = distances.Behaviors(
                *(np.concatenate([old, new]) for old, new in zip(self._archived, more, strict=True))
            )
