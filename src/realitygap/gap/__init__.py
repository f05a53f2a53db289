"""The gap between two platforms: arrays of trials in, measures with intervals out.

`measure_gap` returns all measures. Each measure can be computed alone. No platform is run here.
"""

from ._behavior import CoverageMaps, coverage_maps, energy_distances, energy_test, smallest_energy_p
from ._card import gap_card, pairs_picture
from ._level import mean_difference, rms_interval, rms_of, shares_above, square_differences
from ._measure import measure_gap
from ._order import (
    mean_maximum_rank_violation,
    rank_violation_floor,
    rank_violation_interval,
    reliability,
    trials_for_reliability,
)
from ._replay_error import ReplayError, replay_error
from ._resampling import bootstrap, shrunk_means
from ._result import COVERAGE, MEASURES, SHOWN, GapResult
from ._side import GapSide
from ._why import Why, coalitions, explain_gap, shapley_values

__all__ = [  # noqa: RUF022 - grouped by subject
    # all of it
    "measure_gap",
    "GapSide",
    "GapResult",
    "COVERAGE",
    "MEASURES",
    "SHOWN",
    # level
    "mean_difference",
    "square_differences",
    "rms_of",
    "rms_interval",
    "shares_above",
    # order
    "reliability",
    "trials_for_reliability",
    "mean_maximum_rank_violation",
    "rank_violation_floor",
    "rank_violation_interval",
    # behavior
    "energy_distances",
    "energy_test",
    "smallest_energy_p",
    "CoverageMaps",
    "coverage_maps",
    "ReplayError",
    "replay_error",
    # what notebooks show
    "gap_card",
    "pairs_picture",
    # resampling
    "bootstrap",
    "shrunk_means",
    # why
    "Why",
    "explain_gap",
    "coalitions",
    "shapley_values",
]
