"""The individuals whose behaviors an archive holds, generation by generation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from realitygap.kernels.neat.distances import Behaviors

from ._archive import NoveltyArchive
from ._distances import Cells, measure_of, pack_behaviors
from ._novelty import NoveltySettings

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
    found = []
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
        found.append(list(members))
    return found


def _content(behaviors: Behaviors, row: int, width: int) -> tuple[bytes, int, bytes]:
    """Return a key that identifies a behavior, from its first `width` marks, its number of cells and its points."""
    marks = np.ascontiguousarray(behaviors.marks[row][:width]).tobytes()
    return marks, int(behaviors.n_cells[row]), behaviors.points[row].tobytes()
