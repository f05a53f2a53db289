"""The tables of the page, from the collected results."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from realitygap._wording import counted
from realitygap.records import write_whole
from realitygap.stats import Estimate, median_interval

from .analysis import (
    CONFIDENCE,
    OURS,
    contrast,
    evolved,
    excess_violation,
    fall_of,
    less_absolute_optimism,
    optimism,
    over_twins,
    primary,
    square_gap,
    stratified_mean,
    violations_over_floors,
)
from .plan import FAMILIES, Plan, Twin
from .results import Results, Scores, read_collected

RESAMPLES = 2_000
SEED = 39
NONE = "–"
KINDS = {"random": "random", "champion": "champions"}
Rows = Sequence[Mapping[str, Any]]


def _number(value: float, sign: str = "+") -> str:
    text = f"{value:{sign}.3f}"
    return text.replace("-", "−") if float(text) else f"{0:.3f}"


def _level(value: float) -> str:
    return _number(value, "")


def _percent(value: float) -> str:
    return f"{100 * value:.0f} %".replace("-", "−")


def _text(found: Estimate, number: Callable[[float], str] = _number) -> str:
    if found.value is None:
        return NONE
    ends = "" if found.ends is None else f" [{number(found.ends[0])}, {number(found.ends[1])}]"
    return f"{number(found.value)}{ends}"


def _root(found: Estimate) -> Estimate:
    """Return the root of a mean square, 0 if it is negative."""
    value, low, high = (
        None if each is None else math.sqrt(max(0.0, each)) for each in (found.value, found.low, found.high)
    )
    return Estimate(value, low, high, found.n, level=found.level, method=found.method)


def goals(results: Results) -> Rows:
    """Return the eight primary tests."""
    rows = []
    for row in primary(results):
        number = _percent if row["goal"][:2] in ("P3", "P4") else _number
        has_ends = row["low"] is not None and row["high"] is not None
        rows.append({
            "goal": row["goal"],
            "simulator": row["arm"],
            "figure": NONE if row["figure"] is None else number(row["figure"]),
            "95 % interval": f"{number(row['low'])} to {number(row['high'])}" if has_ends else NONE,
            "limit": number(row["limit"]),
            "corrected p": "< 0.0001" if row["p_holm"] < 1e-4 else f"{row['p_holm']:.4f}",
            "twins": row["n"],
            "verdict": row["verdict"],
        })  # fmt: skip
    return rows


def prediction(results: Results) -> Rows:
    """Return the RMS gap of the held-out controllers with each simulator, and its fall from that of `plain`."""
    rows = []
    for arm in results.plan.arms:
        row = {"simulator": arm.name}
        for kind, name in KINDS.items():
            squares = [square_gap(results, twin, arm.name, kind) for twin in results.twins()]
            known = [each for each in squares if each is not None]
            row[f"RMS gap, {name}"] = _level(math.sqrt(max(0.0, float(np.mean(known))))) if known else NONE
            fall, _ = fall_of(results, arm.name, kind, 0.0)
            row[f"fall, {name}"] = NONE if arm.name == "plain" else _text(fall, _percent)
        gaps, _ = contrast(results, _mean_square, arm.name, "track")
        row["twins on which track is nearer"] = (
            NONE if arm.name == "track" or not gaps else f"{int(np.sum(np.array(gaps) > 0))} of {len(gaps)}"
        )
        row["failed fits"] = str(_n_failed(results, arm.name))
        rows.append(row)
    return rows


def _n_failed(results: Results, arm: str) -> int:
    units = [results.get(twin, "coverage", arm) for twin in results.twins()]
    return sum(unit is not None and "failed" in unit for unit in units)


def order(results: Results) -> Rows:
    """Return how well each simulator orders the held-out controllers."""
    rows = []
    for arm in results.plan.arms:
        differences = stratified_mean(*contrast(results, excess_violation, arm.name, "plain"))
        ratios = [violations_over_floors(results, twin, arm.name) for twin in results.twins()]
        over_second, over_half = (
            _text(
                median_interval([each[k] for each in ratios if each is not None]),
                lambda ratio: f"{ratio:.1f}",
            )
            for k in range(2)
        )
        rows.append({
            "simulator": arm.name,
            "excess MMRV": _text(over_twins(results, excess_violation, arm.name)),
            "minus that of plain": NONE if arm.name == "plain" else _text(differences),
            "MMRV over that of the second batch, median": over_second,
            "MMRV over its split-half floor, median": over_half,
        })  # fmt: skip
    return rows


def _mean_square(results: Results, twin: Twin, arm: str) -> float | None:
    both = [square_gap(results, twin, arm, kind) for kind in KINDS]
    return None if None in both else float(np.mean([each for each in both if each is not None]))


def transfer(results: Results) -> Rows:
    """Return the scores of the controllers that evolved in each arm's simulator, and those of `track` minus them.

    The intervals of the differences hold together over all other arms (Bonferroni).
    """
    rows = []
    level = 1 - (1 - CONFIDENCE) / max(1, len(results.plan.arms) - 1)
    margin = results.plan.goals["equivalent"]
    for arm in results.plan.arms:
        if not arm.evolves:
            continue
        differences, families = contrast(results, evolved, "track", arm.name)
        found = stratified_mean(differences, families, level)
        is_other = arm.name != "track" and bool(differences)
        rows.append({
            "simulator": arm.name,
            "on the twin": _text(over_twins(results, evolved, arm.name), _level),
            "optimism": _text(over_twins(results, optimism, arm.name)),
            f"track minus it, {100 * level:.1f} %": _text(found) if is_other else NONE,
            "median difference": _number(float(np.median(differences))) if is_other else NONE,
            "track is": _verdict(found, margin) if is_other else NONE,
        })  # fmt: skip
    return rows


def _verdict(difference: Estimate, margin: float) -> str:
    """Return what the interval of a difference shows."""
    if difference.ends is None:
        return NONE
    low, high = difference.ends
    if -margin < low and high < margin:
        return "equal"
    return "better" if low > 0 else "worse" if high < 0 else "open"


def identified(results: Results) -> Rows:
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


def flagged(results: Results) -> Rows:
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
                {
                    "family": family,
                    "simulator": arm,
                    "rejected": rejected,
                    "failed": failed,
                    "twins": len(units),
                }
            )
    return rows


def apart(results: Results) -> Rows:
    """Return the gap and the optimism of the twins that no goal is about: `same`, without a gap, and `alien`."""
    rows = []
    for family in ("same", "alien"):
        twins = results.twins((family,))

        def mean(values: Sequence[float | None], family: str = family) -> Estimate:
            known = [each for each in values if each is not None]
            return stratified_mean(known, [family] * len(known))

        for arm in ("plain", *OURS):
            row = {"family": family, "simulator": arm}
            for kind, name in KINDS.items():
                squares = mean([square_gap(results, twin, arm, kind) for twin in twins])
                row[f"RMS gap, {name}"] = _text(_root(squares), _level)
            row["on the twin"] = _text(mean([evolved(results, twin, arm) for twin in twins]), _level)
            row["optimism"] = _text(mean([optimism(results, twin, arm) for twin in twins]))
            rows.append(row)
    return rows


def tasks(results: Results) -> Rows:
    """Return transfer and the fall of the gap in the other tasks."""
    rows = []
    for task in results.plan.tasks["names"]:

        def value(results: Results, twin: Twin, arm: str, task: str = task) -> float | None:
            return evolved(results, twin, arm, task)

        found = stratified_mean(*contrast(results, value, "track", "plain"))
        row: dict[str, Any] = {"task": task, "track minus plain, on the twin": _text(found), "twins": found.n}
        for kind, name in KINDS.items():
            row[f"fall of the RMS gap, {name}"] = _text(
                fall_of(results, "track", kind, 0.0, task)[0], _percent
            )
        rows.append(row)
    return rows


def sensitivity(results: Results) -> Rows:
    """Return all primary tests by a cluster bootstrap, and P1 by a mixed model.

    The bootstrap draws twins within families. For P1, it then draws replicates, the same ones for both arms, because
    replicates of a number share their seeds. For P2, it keeps them: resampled replicates would be noisier than those
    observed, and noise makes the amount of the optimism larger.

    The mixed model needs statsmodels: score ~ arm + family, with a random level and a random arm of each twin. Its
    interval has normal quantiles.
    """
    rows: list[dict[str, Any]] = []
    rng, rng_of_falls = np.random.default_rng(SEED), np.random.default_rng([SEED, 1])
    for arm in OURS:
        for name, other, value in (
            ("P1 transfer", "prior", evolved),
            ("P2 optimism", "plain", less_absolute_optimism),
        ):
            figure = stratified_mean(*contrast(results, value, arm, other)).value
            if figure is None:
                continue
            pairs = [
                (twin.family, _of_replicates(results, twin, arm) - _of_replicates(results, twin, other))
                if value is evolved
                else (twin.family, np.array([a - b]))
                for twin in results.twins()
                if (a := value(results, twin, arm)) is not None
                and (b := value(results, twin, other)) is not None
            ]
            low, high = _bootstrap(pairs, rng)
            rows.append(_other_way(name, arm, "cluster bootstrap", figure, low, high, len(pairs)))
            if value is evolved:
                rows.append(_mixed_model(results, name, arm, other))
        for name, kind in (("P3 prediction, random", "random"), ("P4 prediction, champions", "champion")):
            figure = fall_of(results, arm, kind, 0.0)[0].value
            if figure is None:
                continue
            squares = [
                (twin.family, np.array([a, b]))
                for twin in results.twins()
                if (a := square_gap(results, twin, "plain", kind)) is not None
                and (b := square_gap(results, twin, arm, kind)) is not None
            ]
            low, high = _bootstrap_of_falls(squares, rng_of_falls)
            rows.append(_other_way(name, arm, "cluster bootstrap", figure, low, high, len(squares), _percent))
    return rows


def _bootstrap_of_falls(
    squares: Sequence[tuple[str, Scores]], rng: np.random.Generator
) -> tuple[float, float]:
    """Return the 95 % interval of the fall of the RMS gap, from (2,) mean squares of twins before and after."""
    families = sorted({family for family, _ in squares})
    means = np.zeros((RESAMPLES, 2))
    for family in families:
        own = np.array([values for name, values in squares if name == family])
        means += own[rng.integers(len(own), size=(RESAMPLES, len(own)))].mean(axis=1) / len(families)
    before, after = np.maximum(means, 0.0).T
    low, high = np.quantile(1 - np.sqrt(after / before), [0.025, 0.975])
    return float(low), float(high)


def _bootstrap(pairs: Sequence[tuple[str, Scores]], rng: np.random.Generator) -> tuple[float, float]:
    """Return the 95 % interval of the mean over twins, families weighing equally, of means over replicates."""
    families = sorted({family for family, _ in pairs})
    means = np.zeros(RESAMPLES)
    for family in families:
        own = np.array([values for name, values in pairs if name == family])
        n, replicates = own.shape
        drawn = own[rng.integers(n, size=(RESAMPLES, n))]
        which = rng.integers(replicates, size=(RESAMPLES, n, replicates))
        means += np.take_along_axis(drawn, which, axis=2).mean(axis=(1, 2)) / len(families)
    low, high = np.quantile(means, [0.025, 0.975])
    return float(low), float(high)


def _of_replicates(results: Results, twin: Twin, arm: str) -> Scores:
    unit = results.get(twin, "coverage", arm)
    return np.array([np.mean(each["target"]) for each in unit["champions"]] if unit else [])


def _mixed_model(results: Results, name: str, arm: str, other: str) -> dict[str, Any]:
    import pandas as pd
    import statsmodels.formula.api as smf

    rows = [
        {"twin": str(twin), "family": twin.family, "arm": which, "score": score}
        for twin in results.twins()
        for which, side in enumerate((other, arm))
        for score in _of_replicates(results, twin, side)
    ]
    fit = smf.mixedlm("score ~ arm + C(family)", pd.DataFrame(rows), groups="twin", re_formula="~arm").fit()
    low, high = fit.conf_int().loc["arm"]
    method = "mixed model" if fit.converged else "mixed model (it did not converge)"
    return _other_way(name, arm, method, fit.params["arm"], low, high, len({row["twin"] for row in rows}))


def _other_way(
    goal: str,
    arm: str,
    method: str,
    figure: float,
    low: float,
    high: float,
    n: int,
    number: Callable[[float], str] = _number,
) -> dict[str, Any]:
    return {
        "goal": goal,
        "simulator": arm,
        "method": method,
        "figure": number(figure),
        "95 % interval": f"{number(low)} to {number(high)}",
        "twins": n,
    }


TABLES: dict[str, Callable[[Results], Rows]] = {
    "goals": goals,
    "prediction": prediction,
    "order": order,
    "transfer": transfer,
    "tasks": tasks,
    "identified": identified,
    "flagged": flagged,
    "apart": apart,
    "sensitivity": sensitivity,
}
"""The tables by name. Only `sensitivity` needs more than realitygap."""


def as_csv(rows: Rows) -> str:
    """Return rows as the text of a CSV file."""
    text = io.StringIO()
    columns = list(dict.fromkeys(column for row in rows for column in row))
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def analyze(plan: Plan, folder: Path) -> None:
    """Write the tables of the page into the folder of the collected results."""
    results = read_collected(plan, folder)
    for task in ("coverage", *plan.tasks["names"]):
        if missing := results.missing(task, tuple(plan.twins)):
            print(f"Missing: {counted(len(missing), 'unit')} of the task {task}, such as {missing[0]}.")
    for name, rows in TABLES.items():
        text = as_csv(rows(results))
        write_whole(folder / f"{name}.csv", text.encode(), within=folder)
        print(f"\n{name}", text, sep="\n", end="")
