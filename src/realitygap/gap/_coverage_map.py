"""Coverage maps of both sides: the share of trials that cross each cell."""

from __future__ import annotations

from dataclasses import dataclass

from ._side import GapSide, Values


@dataclass(frozen=True)
class CoverageMaps:
    """Shares of trials that cross each cell.

    Attributes:
        source: (n_cells,) share of trials in simulation that visit a cell [0..1].
        target: (n_cells,) on the target.
    """

    source: Values
    target: Values

    @property
    def difference(self) -> Values:
        """Difference of the maps, target minus simulator, (n_cells,) [-1..1]."""
        return self.target - self.source


def coverage_maps(source: GapSide, target: GapSide) -> CoverageMaps | None:
    """Return the maps of both sides with equal weights of controllers; None if the cells of a side are unknown."""
    if not (len(source.cells) and len(target.cells)):
        return None
    one, other = (side.cells.mean(axis=(0, 1)) for side in (source, target))
    return CoverageMaps(one, other)
