"""The gap between two platforms: arrays of trials in, measures with intervals out.

`measure_gap` returns all measures. Each measure has its own file and can be computed alone. No platform is run here.
"""

from ._bootstrap import SMALLEST_N, bootstrap, interval, resampled, shrunk_means
from ._bounded import bounded_interval, range_of_differences
from ._card import gap_card, pairs_picture
from ._correlation import attenuated, reliability, spearman, trials_for_reliability
from ._coverage_map import CoverageMaps, coverage_maps
from ._energy import energy_distances, energy_test, smallest_energy_p
from ._equivalence import Equivalence, controllers_for_margin, equivalence_power, fewest, prove_equivalence
from ._estimate import CONFIDENCE, Estimate
from ._level import mean_difference, rms_of, shares_above, square_differences
from ._means import difference_of_groups, mean_of
from ._measure import measure_gap
from ._plan import (
    Needed,
    check_plan,
    detectable_difference,
    plan_correlation,
    plan_effect,
    plan_margin,
    spread_of_differences,
    trial_reliability,
)
from ._rank_violation import mean_maximum_rank_violation, rank_violation_floor, rank_violation_interval
from ._replay_error import ReplayError, replay_error
from ._result import COVERAGE, MEASURES, SHOWN, GapResult, Measure
from ._rms_interval import rms_interval
from ._shapley import coalitions, shapley_values
from ._side import GapSide
from ._why import Why, explain_gap

__all__ = [  # noqa: RUF022 - grouped by subject
    # all of it
    "measure_gap",
    "GapSide",
    "GapResult",
    "Estimate",
    "COVERAGE",
    "MEASURES",
    "SHOWN",
    "Measure",
    "CONFIDENCE",
    # level
    "mean_difference",
    "square_differences",
    "rms_of",
    "rms_interval",
    "shares_above",
    # order
    "spearman",
    "reliability",
    "attenuated",
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
    # equivalence, and what n can carry
    "Equivalence",
    "prove_equivalence",
    "equivalence_power",
    "controllers_for_margin",
    "fewest",
    "Needed",
    "check_plan",
    "detectable_difference",
    "plan_effect",
    "plan_margin",
    "plan_correlation",
    "spread_of_differences",
    "trial_reliability",
    # what notebooks show
    "gap_card",
    "pairs_picture",
    # means of a few
    "mean_of",
    "difference_of_groups",
    "bounded_interval",
    "range_of_differences",
    # resampling
    "SMALLEST_N",
    "resampled",
    "shrunk_means",
    "bootstrap",
    "interval",
    # why
    "Why",
    "explain_gap",
    "coalitions",
    "shapley_values",
]
