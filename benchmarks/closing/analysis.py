"""The analysis of the study, written before its first run: estimands, intervals, and tests.

The unit is the twin. Values of twins are means over their controllers or replicates. Means over twins weigh the four
families equally; their intervals are Student's with as many degrees of freedom as there are twins less families.
`docs/data/closing-2/plan.toml` has the rules.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy

from realitygap._wording import counted
from realitygap.gap import mean_maximum_rank_violation
from realitygap.stats import Estimate, holm

from .plan import Twin
from .results import Results

OURS = ("cells", "track")
CONFIDENCE = 0.95

# values of a twin; None where a unit is missing


def evolved(results: Results, twin: Twin, arm: str, task: str = "coverage") -> float | None:
    """Return the mean score on the twin of what evolved in an arm's simulator, over replicates."""
    unit = results.get(twin, task, arm)
    if unit is None or not unit["champions"]:
        return None
    return float(np.mean([np.mean(each["target"]) for each in unit["champions"]]))


def optimism(results: Results, twin: Twin, arm: str, task: str = "coverage") -> float | None:
    """Return the champions' mean score on fresh noise in their own simulator, less that on the twin."""
    unit = results.get(twin, task, arm)
    if unit is None or not unit["champions"]:
        return None
    return float(
        np.mean([np.mean(each["simulated"]) - np.mean(each["target"]) for each in unit["champions"]])
    )


def square_gap(results: Results, twin: Twin, arm: str, kind: str, task: str = "coverage") -> float | None:
    """Return the mean square gap over the held-out controllers of a kind, less the variance of noise."""
    unit, judged = results.get(twin, task, arm), results.get(twin, task, "judged")
    if unit is None or judged is None:
        return None
    which = np.array(judged["kinds"]) == kind
    simulated, driven = np.array(unit["scores"])[which], np.array(judged["scores"][0])[which]
    noise = simulated.var(axis=1, ddof=1) / simulated.shape[1] + driven.var(axis=1, ddof=1) / driven.shape[1]
    return float(np.mean((simulated.mean(axis=1) - driven.mean(axis=1)) ** 2 - noise))


def excess_violation(results: Results, twin: Twin, arm: str, task: str = "coverage") -> float | None:
    """Return the MMRV of an arm's simulator less that of the twin's second batch, both against the first batch."""
    unit, judged = results.get(twin, task, arm), results.get(twin, task, "judged")
    if unit is None or judged is None:
        return None
    first, second = (np.mean(batch, axis=1)[None] for batch in judged["scores"])
    simulated = np.mean(unit["scores"], axis=1)[None]
    return float(
        (mean_maximum_rank_violation(simulated, first) - mean_maximum_rank_violation(second, first))[0]
    )


def violations_over_floors(results: Results, twin: Twin, arm: str) -> tuple[float, float] | None:
    """Return the MMRV of an arm's simulator over that of the twin's second batch, and over its split-half floor.

    The split-half floor is the measure of the runs before this study: the MMRV of one half of the first batch by the
    other half, in the mean of 100 random halvings. Halves have fewer trials, so it is larger than the other floor.
    """
    unit, judged = results.get(twin, "coverage", arm), results.get(twin, "coverage", "judged")
    if unit is None or judged is None:
        return None
    batch = np.array(judged["scores"][0])
    rng = np.random.default_rng(0)  # the same halves for all arms
    half = batch.shape[1] // 2
    orders = [rng.permutation(batch.shape[1]) for _ in range(100)]
    one = np.array([batch[:, order[:half]].mean(axis=1) for order in orders])
    other = np.array([batch[:, order[half : 2 * half]].mean(axis=1) for order in orders])
    simulated, first, second = (np.mean(each, axis=1)[None] for each in (unit["scores"], *judged["scores"]))
    floors = mean_maximum_rank_violation(second, first)[0], mean_maximum_rank_violation(one, other).mean()
    violation = mean_maximum_rank_violation(simulated, first)[0]
    return None if 0 in floors else (float(violation / floors[0]), float(violation / floors[1]))


# estimates over twins


def stratified_mean(values: Sequence[float], families: Sequence[str], level: float = CONFIDENCE) -> Estimate:
    """Return the mean over twins, families weighing equally, with Student's interval.

    Args:
        values: (n,) value of each twin.
        families: Family of each.
        level: Probability that the interval covers the mean.
    """
    groups = [
        np.array([v for v, f in zip(values, families, strict=True) if f == name])
        for name in sorted(set(families))
    ]
    n, freedom = len(values), len(values) - len(groups)
    if not n:
        return Estimate.refusal(0, "No twin has the value.")
    mean = float(np.mean([group.mean() for group in groups]))
    if min(map(len, groups)) < 2:
        return Estimate.of_few(mean, n, 2, "twins of each family")
    error = math.sqrt(sum(group.var(ddof=1) / len(group) for group in groups)) / len(groups)
    reach = float(scipy.special.stdtrit(freedom, (1 + level) / 2)) * error
    return Estimate(mean, mean - reach, mean + reach, n, level=level, method="t")


def p_of_mean(values: Sequence[float], families: Sequence[str], limit: float) -> float:
    """Return the two-sided p of the hypothesis that the mean of `stratified_mean` is at the limit."""
    found = stratified_mean(values, families)
    if found.value is None or found.low is None or found.high is None:
        return 1.0
    freedom = len(values) - len(set(families))
    error = (found.high - found.low) / 2 / float(scipy.special.stdtrit(freedom, 0.975))
    if error == 0:
        return float(found.value == limit)
    return float(2 * scipy.special.stdtr(freedom, -abs(found.value - limit) / error))


def pooled_fall(
    before: Sequence[float], after: Sequence[float], families: Sequence[str], limit: float
) -> tuple[Estimate, float]:
    """Return 1 - RMS after / RMS before, pooled over twins, with an interval of 95 %, and the two-sided p of a limit.

    A fall is at the limit if the mean over twins of `after - (1 - limit)² before` is 0, which Student's t tests as any
    other mean over twins. The interval has all limits that are not refuted (Fieller 1954). A mean square may be
    negative, because the variance of noise is taken out: then the upper end is 1. `benchmarks.closing.intervals` shows
    how often the interval holds the fall.
    """
    squares = np.array([before, after], float)
    n = squares.shape[1]
    groups = [squares[:, np.array(families) == name] for name in sorted(set(families))]
    if not n:
        return Estimate.refusal(n, "No twin has both."), 1.0
    was, now = np.mean([group.mean(axis=1) for group in groups], axis=0)
    if was <= 0:
        return Estimate.refusal(n, "There is no gap before."), 1.0
    fall = 1 - math.sqrt(max(0.0, now) / was)
    if min(group.shape[1] for group in groups) < 2:
        return Estimate.of_few(fall, n, 2, "twins of each family"), 1.0
    contrast = squares[1] - (1 - limit) ** 2 * squares[0]
    p = p_of_mean(contrast.tolist(), families, 0.0)
    covariance = sum(np.cov(group) / group.shape[1] for group in groups) / len(groups) ** 2
    square = float(scipy.special.stdtrit(n - len(groups), (1 + CONFIDENCE) / 2)) ** 2
    of_squares = was**2 - square * covariance[0, 0]
    if of_squares <= 0:
        return Estimate(fall, None, None, n, "The gap before is not shown, so its fall has no interval."), p
    middle = was * now - square * covariance[0, 1]
    root = math.sqrt(max(0.0, middle**2 - of_squares * (now**2 - square * covariance[1, 1])))
    high, low = (1 - math.sqrt(max(0.0, end / of_squares)) for end in (middle - root, middle + root))
    return Estimate(fall, low, high, n, method="t"), p


Value = Callable[[Results, Twin, str], float | None]


def contrast(results: Results, value: Value, one: str, other: str) -> tuple[list[float], list[str]]:
    """Return the value with one arm less that with another for each twin that has both, and the twins' families."""
    pairs = [(twin, value(results, twin, one), value(results, twin, other)) for twin in results.twins()]
    known = [(twin, a - b) for twin, a, b in pairs if a is not None and b is not None]
    return [difference for _, difference in known], [twin.family for twin, _ in known]


def less_absolute_optimism(results: Results, twin: Twin, arm: str) -> float | None:
    """Return minus the amount of the optimism, which the noise of few replicates makes larger."""
    value = optimism(results, twin, arm)
    return None if value is None else -abs(value)


def primary(results: Results) -> list[dict[str, Any]]:
    """Return the eight primary tests: figure, interval, limit, p, corrected p, and verdict."""
    rows: list[dict[str, Any]] = []
    goals = results.plan.goals
    for arm in OURS:
        for name, value, other, limit in (
            ("P1 transfer", evolved, "prior", goals["transfer"]),
            ("P2 optimism", less_absolute_optimism, "plain", goals["optimism"]),
        ):
            values, families = contrast(results, value, arm, other)
            rows.append(
                _row(name, arm, stratified_mean(values, families), limit, p_of_mean(values, families, limit))
            )
        for name, kind in (("P3 prediction, random", "random"), ("P4 prediction, champions", "champion")):
            found, p, limit = *fall_of(results, arm, kind, goals["fall"][arm]), goals["fall"][arm]
            rows.append(_row(name, arm, found, limit, p))
    for row, p in zip(rows, holm(np.array([row["p"] for row in rows])).tolist(), strict=True):
        row["p_holm"] = p
        is_above = row["low"] is not None and row["low"] > row["limit"]
        is_below = row["high"] is not None and row["high"] < row["limit"]
        decided = p < goals["alpha"]
        row["verdict"] = "met" if is_above and decided else "missed" if is_below and decided else "open"
        if missing := results.missing("coverage"):
            row["verdict"] = f"none: {counted(len(missing), 'unit')} missing"
    return rows


def fall_of(
    results: Results, arm: str, kind: str, limit: float, task: str = "coverage"
) -> tuple[Estimate, float]:
    """Return the fall of the pooled RMS gap from that of `plain`, and the p of a limit: see `pooled_fall`."""
    pairs = [
        (twin, square_gap(results, twin, "plain", kind, task), square_gap(results, twin, arm, kind, task))
        for twin in results.twins()
    ]
    known = [(twin, a, b) for twin, a, b in pairs if a is not None and b is not None]
    return pooled_fall(
        [a for _, a, _ in known], [b for _, _, b in known], [twin.family for twin, _, _ in known], limit
    )


def _row(name: str, arm: str, found: Estimate, limit: float, p: float) -> dict[str, Any]:
    return {"goal": name, "arm": arm, "figure": found.value, "low": found.low, "high": found.high, "n": found.n,
            "limit": limit, "p": p}  # fmt: skip


def over_twins(results: Results, value: Value, arm: str) -> Estimate:
    """Return the mean of a value over the twins that have it: see `stratified_mean`."""
    known = [(twin.family, v) for twin in results.twins() if (v := value(results, twin, arm)) is not None]
    return stratified_mean([v for _, v in known], [family for family, _ in known])
