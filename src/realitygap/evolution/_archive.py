"""The archive that settings of novelty describe, its members generation by generation, and the cards of archives."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.drawing import Card, ShownAsCard, Table, card_of
from realitygap.kernels.neat import distances
from realitygap.kernels.neat import novelty as novelty_kernels
from realitygap.kernels.neat.distances import Behaviors

from ._distances import Cells, measure_of, pack_behaviors
from ._novelty import NearestArchive, NoveltySettings, PaperArchive


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


Member = tuple[int, int]
"""Generation and individual."""


def archive_members(
    generations: Iterable[Sequence[Cells] | ArrayLike],
    settings: NoveltySettings | None = None,
    *,
    columns: int = 12,
    rows: int = 6,
) -> list[list[Member]]:
    """Return the members of the archive after each generation, in the order of their places in the archive.

    Args:
        generations: The behaviors of each, as `NoveltyArchive.update` takes them.
        settings: Settings of the archive. Default: the paper's.
        columns, rows: Size of the grid.

    Returns:
        The members of the archive for each generation. If individuals of a generation behave alike, the first is
        given.

    Raises:
        TypeError: A cell that is not a whole number.
        ValueError: A cell outside the grid, or positions that are not pairs of finite numbers.
    """
    archive = NoveltyArchive(settings, columns=columns, rows=rows)
    measure = measure_of(archive.settings.distance, columns, rows, archive.settings.sort)
    members: list[Member] = []
    contents: list[tuple[bytes, int, bytes]] = []
    memberships = []
    for generation, behaviors in enumerate(generations):
        packed = pack_behaviors(measure, behaviors, columns, rows)
        archive.update(behaviors)
        held = archive.packed
        width = min(packed.marks.shape[1], held.marks.shape[1])
        known = {_content(packed, row, width): row for row in reversed(range(len(packed.n_cells)))}
        for place in range(len(archive)):
            content = _content(held, place, width)
            if place < len(contents) and contents[place] == content:
                continue
            contents[place : place + 1] = [content]
            members[place : place + 1] = [(generation, known[content])]
        memberships.append(list(members))
    return memberships


def _content(behaviors: Behaviors, row: int, width: int) -> tuple[bytes, int, bytes]:
    """Return a key that identifies a behavior, from its first `width` marks, its number of cells and its points."""
    marks = np.ascontiguousarray(behaviors.marks[row][:width]).tobytes()
    return marks, int(behaviors.n_cells[row]), behaviors.points[row].tobytes()


@card_of.register(PaperArchive)
@card_of.register(NoveltyArchive)
def archive_card(archive: PaperArchive | NoveltyArchive) -> Card:
    """Return the number of archived behaviors, and the settings of the archive."""
    rows = [[name, f"{value}"] for name, value in archive.settings.model_dump(mode="json").items()]
    columns, n_rows = archive.grid_size
    return Card(
        repr(archive),
        lead=f"{len(archive)} behaviors on a grid of {columns} × {n_rows} cells.",
        parts=[Table(["setting", "value"], rows, "Settings", closed=True)],
    )


@card_of.register(NearestArchive)
def nearest_card(archive: NearestArchive) -> Card:
    """Return the number of archived behaviors, the threshold, and the range of each coordinate."""
    rows = []
    for k in range(len(archive.behaviors[0]) if len(archive) else 0):
        values = [float(behavior[k]) for behavior in archive.behaviors]
        rows.append([f"coordinate {k}", f"{min(values):.4g}", f"{max(values):.4g}"])
    lead = f"{len(archive)} behaviors; a new one enters with a novelty above {archive.threshold:.4g}."
    return Card(repr(archive), lead=lead, parts=[Table(["", "smallest", "largest"], rows)])
