"""The gap between two platforms: arrays of trials in, measures with intervals out.

`measure_gap` returns all measures. Each measure can be computed alone. No platform is run here.
"""

from ._behavior import CoverageMaps, coverage_maps
from ._card import gap_card, pairs_picture
from ._change import GapChange, measure_change
from ._level import difference_ends, rms_interval, square_differences
from ._measure import measure_gap
from ._prior_process import Predicted, PriorProcess
from ._ranks import (
    Ties,
    WorstPair,
    mean_maximum_rank_violation,
    mean_violation,
    rank_violation_interval,
    ties_on_one_side,
    worst_pair,
)
from ._replay_error import ReplayError, replay_error
from ._resampling import bootstrap
from ._result import COVERAGE, SHOWN, GapResult
from ._scores import Comparison, ScoredController, ScoreGap, compare_scores
from ._side import GapSide
from ._why import Why, coalitions, explain_gap

__all__ = [  # noqa: RUF022 - grouped by subject
    # all of it
    "measure_gap",
    "GapSide",
    "GapResult",
    "COVERAGE",
    "SHOWN",
    # tables of scores
    "compare_scores",
    "Comparison",
    "ScoreGap",
    "ScoredController",
    # another simulator
    "measure_change",
    "GapChange",
    # level
    "square_differences",
    "rms_interval",
    "difference_ends",
    # order
    "mean_maximum_rank_violation",
    "rank_violation_interval",
    "mean_violation",
    "worst_pair",
    "WorstPair",
    "ties_on_one_side",
    "Ties",
    # behavior
    "CoverageMaps",
    "coverage_maps",
    "ReplayError",
    "replay_error",
    # prediction from a simulation, trial by trial
    "PriorProcess",
    "Predicted",
    # what notebooks show
    "gap_card",
    "pairs_picture",
    # resampling
    "bootstrap",
    # why
    "Why",
    "explain_gap",
    "coalitions",
]
