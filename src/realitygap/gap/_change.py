"""The change of a gap when the simulator changes, over the same controllers and the same trials on the target."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from realitygap.stats import Estimate, percentile_interval

from ._level import rms_of, square_differences
from ._resampling import over_controllers
from ._side import GapSide, Values

RESAMPLES = 2_000


@dataclass(frozen=True)
class GapChange:
    """Two gaps to the same trials on a target: after minus before.

    Attributes:
        rms: Change of the RMS gap.
        level: Change of the size of the level, whatever its sign.
    """

    rms: Estimate
    level: Estimate

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {"rms": self.rms.to_dict(), "level": self.level.to_dict()}


def measure_change(before: GapSide, after: GapSide, target: GapSide, *, seed: int = 7) -> GapChange:
    """Measure by how much a gap differs between two simulators.

    Controllers are resampled with all their trials, so the intervals are those of paired differences.

    Args:
        before, after: Trials of the same controllers in both simulators.
        target: Trials on the target.
        seed: Seed of the resamples.
    """
    n = target.n
    who = np.random.default_rng(seed).integers(0, n, (RESAMPLES, n))
    differences = [side.means - target.means for side in (before, after)]
    level = _change(differences[0], differences[1], who, np.abs)
    if min(side.trials for side in (before, after, target)) < 2:
        needs = "The RMS gap needs at least 2 trials of each controller on both sides."
        return GapChange(Estimate.refusal(n, needs), level)
    squares = [square_differences(side.values[None], target.values[None])[0] for side in (before, after)]
    return GapChange(_change(squares[0], squares[1], who, rms_of), level)


def _change(before: Values, after: Values, who: Any, size: Callable[[Values], Values]) -> Estimate:
    """Return by how much the size of a mean over controllers, (c,), differs."""
    resamples = size(after[who].mean(axis=1)) - size(before[who].mean(axis=1))
    value = float(size(after.mean()[None])[0] - size(before.mean()[None])[0])
    return over_controllers(value, percentile_interval(resamples, len(before)), len(before))
