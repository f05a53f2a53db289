"""How far two platforms are apart: arrays of trials in, measures with intervals out."""

from ._estimate import CONFIDENCE, Estimate
from ._measure import measure_gap
from ._result import MEASURES, GapResult
from ._side import GapSide

__all__ = ["CONFIDENCE", "MEASURES", "Estimate", "GapResult", "GapSide", "measure_gap"]
