"""The analysis of the study, written before its first run: the scores as a table, estimands, intervals, and tests.

The unit is the twin. Values of twins are means over their controllers or replicates. Means over twins weigh the four
families equally; their intervals are Student's with as many degrees of freedom as there are twins less families.
`docs/data/closing-2/plan.toml` has the rules.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import scipy
from numpy.typing import NDArray

from realitygap.gap import mean_maximum_rank_violation
from realitygap.stats import Estimate, holm

from .plan import FAMILIES, Plan, Twin, Unit
from .twin import read_unit

Scores = NDArray[np.float64]
RESAMPLES = 2_000
SEED = 39
OURS = ("cells", "track")
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Results:
    """All results of a study, by twin and unit."""

    plan: Plan
    units: Mapping[tuple[Twin, Unit], dict[str, Any]]

    @classmethod
    def read(cls, plan: Plan, folder: Path) -> Results:
        """Read the results in a folder.

        Raises:
            SystemExit: There are none, or one is of another plan.
        """
        found: dict[tuple[Twin, Unit], dict[str, Any]] = {}
        for twin in plan.names():
            for unit in plan.units(twin):
                path = folder / "units" / f"{twin}-{unit}.json"
                if path.exists():
                    found[twin, unit] = read_unit(path)
                    if found[twin, unit]["plan"] != plan.digest:
                        raise SystemExit(f"{path} is of another plan. Nothing was analyzed.")
        if not found:
            raise SystemExit(
                f"{folder} has no results. Compute them: python -m benchmarks.closing run {folder}"
            )
        codes = {unit["code"] for unit in found.values()}
        if len(codes) > 1:
            raise SystemExit(f"The results are of {len(codes)} states of the code. Nothing was analyzed.")
        return cls(plan, found)

    @property
    def lacks(self) -> list[str]:
        """Return the units of coverage that are missing, for twins that the goals are about."""
        return [
            f"{twin} {unit}"
            for twin in self.plan.names()
            for unit in self.plan.units(twin)
            if twin.family in FAMILIES and unit.task == "coverage" and (twin, unit) not in self.units
        ]

    def get(self, twin: Twin, task: str, what: str) -> dict[str, Any] | None:
        """Return the result of a unit, None if it is missing. An arm whose fit failed scores as `plain`."""
        found = self.units.get((twin, Unit(task, what)))
        if found is None or "failed" not in found:
            return found
        plain = self.units.get((twin, Unit(task, "plain")))
        if plain is None:
            return None
        champions = plain["champions"] if self.plan.arm[what].evolves else []
        return {**plain, "champions": champions, "calibration": None, "failed": found["failed"]}

    def twins(self, families: Sequence[str] = FAMILIES) -> list[Twin]:
        """Return the twins of families whose controllers were driven."""
        return [
            twin
            for twin in self.plan.names()
            if twin.family in families and self.get(twin, "coverage", "judged")
        ]

    def software(self) -> list[str]:
        """Return the versions of the software that computed them."""
        return sorted({unit["software"] for unit in self.units.values()})

    def table(self) -> pl.DataFrame:
        """Return each trial's score: a row for each."""
        rows: list[tuple[Any, ...]] = []
        for (twin, unit), result in self.units.items():
            head = (str(twin), twin.family, unit.task)
            if unit.what == "judged":
                for batch, scores in enumerate(result["scores"], start=1):
                    rows += _rows((*head, "target"), result["kinds"], scores, batch)
                continue
            if "failed" in result:
                continue
            kinds = self.units[twin, Unit(unit.task, "judged")]["kinds"]
            rows += _rows((*head, unit.what), kinds, result["scores"], 0)
            for k, champion in enumerate(result["champions"]):
                for side in ("simulated", "target"):
                    rows += _rows((*head, unit.what), [f"evolved, {side}"], [champion[side]], 0, first=k)
        return pl.DataFrame(
            rows, orient="row",
            schema={
                "twin": pl.String, "family": pl.String, "task": pl.String, "arm": pl.String, "kind": pl.String,
                "controller": pl.Int32, "batch": pl.Int8, "trial": pl.Int32, "score": pl.Float64,
            },
        )  # fmt: skip


def _rows(
    head: tuple[str, ...], kinds: Sequence[str], scores: Sequence[Sequence[float]], batch: int, first: int = 0
) -> Iterable[tuple[Any, ...]]:
    return [
        (*head, kind, first + c, batch, trial, score)
        for c, (kind, row) in enumerate(zip(kinds, scores, strict=True))
        for trial, score in enumerate(row)
    ]


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
    negative, because the variance of noise is taken out: then the upper end is 1. Squares have long tails, so limits at
    the truth were refuted in up to 9 % of simulated studies in place of 5 %.
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


def _absolute_optimism(results: Results, twin: Twin, arm: str) -> float | None:
    value = optimism(results, twin, arm)
    return None if value is None else -abs(value)


def primary(results: Results) -> list[dict[str, Any]]:
    """Return the eight primary tests: figure, interval, limit, p, corrected p, and verdict."""
    rows: list[dict[str, Any]] = []
    goals = results.plan.goals
    for arm in OURS:
        for name, value, other, limit in (
            ("P1 transfer", evolved, "prior", goals["transfer"]),
            ("P2 optimism", _absolute_optimism, "plain", goals["optimism"]),
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
        if results.lacks:
            row["verdict"] = f"none: {len(results.lacks)} units are missing"
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


def prediction(results: Results) -> list[dict[str, Any]]:
    """Return how well each arm's simulator predicts the held-out controllers: gap and order."""
    rows = []
    for arm in results.plan.arms:
        row: dict[str, Any] = {"arm": arm.name}
        for kind in ("random", "champion"):
            squares = [
                v for twin in results.twins() if (v := square_gap(results, twin, arm.name, kind)) is not None
            ]
            row[f"RMS gap, {kind}"] = f"{math.sqrt(max(0.0, float(np.mean(squares)))):.3f}" if squares else ""
        row["excess MMRV"] = _text(over_twins(results, excess_violation, arm.name))
        differences, families = contrast(results, excess_violation, arm.name, "plain")
        if arm.name != "plain" and differences:
            row["excess MMRV less plain's"] = _text(stratified_mean(differences, families))
        gaps, _ = contrast(results, _mean_square, arm.name, "track")
        if arm.name != "track" and gaps:
            row["twins on which track's gap is smaller"] = f"{int(np.sum(np.array(gaps) > 0))} of {len(gaps)}"
        rows.append(row)
    return rows


def transfer(results: Results) -> list[dict[str, Any]]:
    """Return what evolved in each arm's simulator: its score on the twin, its optimism, and `track` less it.

    The intervals of the differences hold together over all arms of others (Bonferroni).
    """
    rows = []
    level = 1 - (1 - CONFIDENCE) / max(1, len(results.plan.arms) - 1)
    for arm in results.plan.arms:
        if not arm.evolves:
            continue
        row: dict[str, Any] = {"arm": arm.name}
        for what, value in (("on the twin", evolved), ("optimism", optimism)):
            row[what] = _text(over_twins(results, value, arm.name))
        differences, families = contrast(results, evolved, "track", arm.name)
        if arm.name != "track" and differences:
            found = stratified_mean(differences, families, level)
            row["track less it, on the twin"] = _text(found)
            row["median twin"] = f"{np.median(differences):+.3f}"
            margin = results.plan.goals["equivalent"]
            inside = (
                found.low is not None
                and found.high is not None
                and -margin < found.low
                and found.high < margin
            )
            row["equal"] = "yes" if inside else ""
        rows.append(row)
    return rows


def over_twins(results: Results, value: Value, arm: str) -> Estimate:
    """Return the mean of a value over the twins that have it: see `stratified_mean`."""
    known = [(twin.family, v) for twin in results.twins() if (v := value(results, twin, arm)) is not None]
    return stratified_mean([v for _, v in known], [family for family, _ in known])


def identified(results: Results) -> list[dict[str, Any]]:
    """Return on how many twins each of our fits identified each parameter."""
    found: dict[str, dict[str, int]] = {}
    totals = dict.fromkeys(OURS, 0)
    for arm in OURS:
        for twin in results.twins():
            unit = results.get(twin, "coverage", arm)
            fits = [] if unit is None or unit["calibration"] is None else unit["calibration"]["fitted"]
            totals[arm] += bool(fits)
            for fit in fits:
                found.setdefault(fit["name"], dict.fromkeys(OURS, 0))[arm] += fit["identified"]
    return [
        {"parameter": name} | {f"identified, {arm}": f"{counts[arm]} of {totals[arm]}" for arm in OURS}
        for name, counts in found.items()
    ]


def _mean_square(results: Results, twin: Twin, arm: str) -> float | None:
    both = [square_gap(results, twin, arm, kind) for kind in ("random", "champion")]
    return None if None in both else float(np.mean([each for each in both if each is not None]))


def _text(found: Estimate) -> str:
    if found.value is None:
        return ""
    ends = "" if found.low is None or found.high is None else f" [{found.low:+.3f}, {found.high:+.3f}]"
    return f"{found.value:+.3f}{ends}"


def flagged(results: Results) -> list[dict[str, Any]]:
    """Return how many twins of each family each of our fits rejects, and how many fits failed."""
    rows = []
    for family in (*FAMILIES, "same", "alien"):
        for arm in OURS:
            units = [
                unit for twin in results.twins((family,)) if (unit := results.get(twin, "coverage", arm))
            ]
            fits = [unit["calibration"] for unit in units if unit["calibration"] is not None]
            rejected = sum(fit["misspecified"] for fit in fits)
            failed = sum("failed" in unit for unit in units)
            rows.append(
                {"family": family, "arm": arm, "rejected": rejected, "failed": failed, "twins": len(units)}
            )
    return rows


def apart(results: Results) -> list[dict[str, Any]]:
    """Return gap and optimism of the twins that no goal is about: `same`, which must show no gap, and `alien`."""
    rows = []
    for family in ("same", "alien"):
        for arm in ("plain", *OURS):
            row: dict[str, Any] = {"family": family, "arm": arm}
            for kind in ("random", "champion"):
                squares = [square_gap(results, twin, arm, kind) for twin in results.twins((family,))]
                known = [each for each in squares if each is not None]
                row[f"mean square gap, {kind}"] = f"{np.mean(known):+.5f}" if known else ""
            values = [optimism(results, twin, arm) for twin in results.twins((family,))]
            row["optimism"] = " ".join(f"{each:+.3f}" for each in values if each is not None)
            rows.append(row)
    return rows


def sensitivity(results: Results) -> list[dict[str, Any]]:
    """Return P1 and P2 by a cluster bootstrap, twins within families and then replicates, and by a mixed model.

    The mixed model needs statsmodels: score ~ arm + family, with a random level and a random arm of each twin.
    """
    rows = []
    rng = np.random.default_rng(SEED)
    for arm in OURS:
        for name, other, part in (("P1 transfer", "prior", "target"), ("P2 optimism", "plain", "optimism")):
            units = [
                (twin.family, *(_replicates(results, twin, each, part) for each in (arm, other)))
                for twin in results.twins()
                if results.get(twin, "coverage", arm) and results.get(twin, "coverage", other)
            ]
            sign = -1.0 if part == "optimism" else 1.0
            means = []
            for _ in range(RESAMPLES):
                by_family = []
                for family in sorted({unit[0] for unit in units}):
                    own = [unit for unit in units if unit[0] == family]
                    drawn = [own[k] for k in rng.integers(len(own), size=len(own))]
                    values = [[rng.choice(side, len(side)).mean() for side in unit[1:]] for unit in drawn]
                    kept = [abs(a) - abs(b) if part == "optimism" else a - b for a, b in values]
                    by_family.append(sign * float(np.mean(kept)))
                means.append(float(np.mean(by_family)))
            if units:
                low, high = np.quantile(means, [0.025, 0.975])
                value = evolved if part == "target" else _absolute_optimism
                figure = stratified_mean(*contrast(results, value, arm, other)).value
                rows.append(_other_way(name, arm, "cluster bootstrap", figure or 0.0, low, high, len(units)))
            if part == "target":
                rows += _mixed_model(units, name, arm)
    return rows


def _replicates(results: Results, twin: Twin, arm: str, part: str) -> Scores:
    unit = results.get(twin, "coverage", arm)
    champions = [] if unit is None else unit["champions"]
    if part == "target":
        return np.array([np.mean(each["target"]) for each in champions])
    return np.array([np.mean(each["simulated"]) - np.mean(each["target"]) for each in champions])


def _mixed_model(units: Sequence[tuple[str, Scores, Scores]], name: str, arm: str) -> list[dict[str, Any]]:
    try:
        import pandas as pd
        import statsmodels.formula.api as smf
    except ImportError:
        print("The mixed model was left out: statsmodels is not installed.")
        return []
    rows = [
        {"twin": k, "family": family, "arm": which, "score": score}
        for k, (family, *sides) in enumerate(units)
        for which, side in enumerate(sides[::-1])
        for score in side
    ]
    fit = smf.mixedlm("score ~ arm + C(family)", pd.DataFrame(rows), groups="twin", re_formula="~arm").fit()
    low, high = fit.conf_int().loc["arm"]
    return [_other_way(name, arm, "mixed model", fit.params["arm"], low, high, len(units))]


def _other_way(
    goal: str, arm: str, method: str, figure: float, low: float, high: float, n: int
) -> dict[str, Any]:
    interval = f"{low:+.3f} to {high:+.3f}"
    return {
        "goal": goal,
        "arm": arm,
        "method": method,
        "figure": f"{figure:+.3f}",
        "95 %": interval,
        "twins": n,
    }


def tasks(results: Results) -> list[dict[str, Any]]:
    """Return transfer and the fall of the gap in the other tasks."""
    rows = []
    for task in results.plan.tasks["names"]:

        def value(results: Results, twin: Twin, arm: str, task: str = task) -> float | None:
            return evolved(results, twin, arm, task)

        found = stratified_mean(*contrast(results, value, "track", "plain"))
        row: dict[str, Any] = {"task": task, "track less plain, on the twin": _text(found), "twins": found.n}
        for kind in ("random", "champion"):
            row[f"fall of the RMS gap, {kind}"] = _text(fall_of(results, "track", kind, 0.0, task)[0])
        rows.append(row)
    return rows


def analyze(plan: Plan, folder: Path, out: Path) -> None:
    """Write all scores, and the tables of the page."""
    results = Results.read(plan, folder)
    out.mkdir(parents=True, exist_ok=True)
    results.table().write_parquet(out / "scores.parquet", compression="zstd")
    done, whole = len(results.units), sum(1 for twin in plan.names() for _ in plan.units(twin))
    facts = {
        "plan": plan.digest,
        "commit": plan.commit,
        "software": results.software(),
        "units": done,
        "of": whole,
    }
    facts["failed"] = [
        f"{twin} {unit}: {each['failed']}" for (twin, unit), each in results.units.items() if "failed" in each
    ]
    facts["hours"] = round(sum(unit["seconds"] for unit in results.units.values()) / 3600, 2)
    (out / "facts.json").write_text(json.dumps(facts, indent=2) + "\n")
    print(json.dumps(facts))
    for name, rows in (
        ("goals", primary(results)),
        ("prediction", prediction(results)),
        ("transfer", transfer(results)),
        ("identified", identified(results)),
        ("flagged", flagged(results)),
        ("apart", apart(results)),
        ("sensitivity", sensitivity(results)),
        ("tasks", tasks(results)),
    ):
        columns = list(dict.fromkeys(column for row in rows for column in row))
        with (out / f"{name}.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, columns, restval="", lineterminator="\n")
            writer.writeheader()
            writer.writerows(
                {k: round(v, 4) if isinstance(v, float) else v for k, v in row.items()} for row in rows
            )
        print(f"\n{name}", (out / f"{name}.csv").read_text(), sep="\n", end="")
