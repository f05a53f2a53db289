"""The published chunks of a folder, listed in memory while it is locked."""

from __future__ import annotations

import bisect
from collections.abc import Iterable

from realitygap.records._chunk import ChunkName


class PublishedNames:
    """The names of published chunks; asking and adding do not grow with their number, as listing a folder does."""

    def __init__(self, names: Iterable[ChunkName]) -> None:
        self._of: dict[str, list[ChunkName]] = {}
        for name in names:
            self.add(name)

    def first(self, condition: str) -> ChunkName | None:
        """Return the first chunk of a condition, or None."""
        names = self._of.get(condition)
        return names[0] if names else None

    def overlapping(self, name: ChunkName) -> ChunkName | None:
        """Return a published chunk that shares a replicate with `name`, or None."""
        names = self._of.get(name.condition, [])
        place = bisect.bisect_right(names, name.last, key=_first)
        return names[place - 1] if place and names[place - 1].last >= name.first else None

    def add(self, name: ChunkName) -> None:
        """Take in a chunk that overlaps with none."""
        bisect.insort(self._of.setdefault(name.condition, []), name, key=_first)


def _first(name: ChunkName) -> int:
    return name.first
