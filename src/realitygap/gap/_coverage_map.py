"""Coverage maps of both sides: the share of trials that cross each cell."""

from __future__ import annotations

from dataclasses import dataclass

from ._side import GapSide, Values


@dataclass(frozen=True)
class CoverageMaps:
    """Shares of trials that cross each cell.

    Attributes:
        source: (n_cells,) in simulation [0..1].
        target: (n_cells,) on the target.
    """

    source: Values
    target: Values

    @property
    def difference(self) -> Values:
        """(n_cells,) target less simulator [-1..1]."""
        return self.target - self.source


def coverage_maps(source: GapSide, target: GapSide) -> CoverageMaps | None:
    """The maps of both sides, all controllers counting alike; None where cells are not known on both."""
    if not (len(source.cells) and len(target.cells)):
        return None
    one, other = (side.cells.mean(axis=(0, 1)) for side in (source, target))
    return CoverageMaps(one, other)
