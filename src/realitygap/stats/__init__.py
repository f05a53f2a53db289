"""Numbers with their intervals, tests, and the number of values that an effect needs.

Arrays in, values out; nothing here reads a file or names a robot. SciPy supplies the special functions, which it loads
when the first is used.
"""

from ._assisted import FEW_UNITS, Assisted, assisted_mean, least_correlation
from ._correlation import pearson, rank_correlation, spearman
from ._equivalence import prove_equivalence
from ._estimate import CONFIDENCE, Ends, Estimate, Method
from ._hierarchical import SMALLEST_GROUPS, RandomEffects, random_effects
from ._means import (
    SMALLEST_N,
    Range,
    difference_interval,
    mean_interval,
    range_of_differences,
    t_interval,
)
from ._medians import MEDIAN_SMALLEST_N, IntervalRanks, interval_ranks, median_interval, quartiles
from ._permutation import (
    ALPHA,
    SEED,
    holm,
    lattice,
    permutation_p,
    runs_for_a_claim,
    sign_flip_p,
    smallest_p,
)
from ._planning import (
    POWER,
    Needed,
    check_plan,
    controllers_for_margin,
    detectable_difference,
    detectable_effect,
    plan_correlation,
    plan_effect,
    plan_margin,
    runs_needed,
    spread_of_differences,
    trial_reliability,
)
from ._resampling import (
    BCA_SMALLEST_N,
    RESAMPLES,
    bca_interval,
    bca_intervals,
    bca_mean,
    difference_of_means,
    percentile_interval,
    ratio_of_robust_spreads,
    ratio_of_spreads,
    resampled_means,
    robust_spread,
    share_above,
)
from ._sequential import (
    BINARY_LAMBDAS,
    LAMBDAS,
    Look,
    Null,
    SequentialTest,
    SequentialVerdict,
    betting_mean,
    e_holm,
    mean_e,
)
from ._sequential_plan import (
    FORECAST_FROM,
    MOST_PAIRS,
    Forecast,
    PlannedPairs,
    forecast_pairs,
    plan_pairs,
)
from ._shares import (
    USUAL_EFFECTS,
    a12,
    a12_of_effect,
    effect_of_a12,
    exact_share_interval,
    newcombe_interval,
    share_interval,
)
from ._successes import (
    MOST_CELLS,
    boschloo_p,
    mcnemar_p,
    paired_success_difference,
    success_difference,
)

__all__ = [  # noqa: RUF022 - grouped by subject
    # a number with its interval
    "Estimate",
    "Ends",
    "Method",
    "CONFIDENCE",
    # means
    "mean_interval",
    "difference_interval",
    "t_interval",
    "Range",
    "range_of_differences",
    "SMALLEST_N",
    # means on the target, assisted by a simulator
    "assisted_mean",
    "Assisted",
    "least_correlation",
    "FEW_UNITS",
    # values with noise of their own: a hierarchical model
    "random_effects",
    "RandomEffects",
    "SMALLEST_GROUPS",
    # medians
    "median_interval",
    "interval_ranks",
    "IntervalRanks",
    "quartiles",
    "MEDIAN_SMALLEST_N",
    # shares, and sizes of effects
    "share_interval",
    "exact_share_interval",
    "a12",
    "newcombe_interval",
    "effect_of_a12",
    "a12_of_effect",
    "USUAL_EFFECTS",
    # successes on two sides
    "success_difference",
    "paired_success_difference",
    "boschloo_p",
    "mcnemar_p",
    "MOST_CELLS",
    # correlation
    "pearson",
    "rank_correlation",
    "spearman",
    # resampling
    "bca_interval",
    "bca_intervals",
    "bca_mean",
    "difference_of_means",
    "share_above",
    "ratio_of_spreads",
    "ratio_of_robust_spreads",
    "robust_spread",
    "percentile_interval",
    "resampled_means",
    "BCA_SMALLEST_N",
    "RESAMPLES",
    "SEED",
    # tests
    "permutation_p",
    "sign_flip_p",
    "smallest_p",
    "runs_for_a_claim",
    "holm",
    "lattice",
    "ALPHA",
    "prove_equivalence",
    # looks at any time
    "SequentialTest",
    "Look",
    "Null",
    "SequentialVerdict",
    "LAMBDAS",
    "BINARY_LAMBDAS",
    "betting_mean",
    "e_holm",
    "mean_e",
    "Forecast",
    "forecast_pairs",
    "FORECAST_FROM",
    "MOST_PAIRS",
    "PlannedPairs",
    "plan_pairs",
    # planning
    "Needed",
    "check_plan",
    "plan_effect",
    "plan_margin",
    "plan_correlation",
    "detectable_difference",
    "detectable_effect",
    "runs_needed",
    "controllers_for_margin",
    "spread_of_differences",
    "trial_reliability",
    "POWER",
]
