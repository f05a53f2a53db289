"""The results of `closing-the-gap`: each goal with its figure, its interval, and its verdict."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from realitygap._version import __version__
from realitygap.records import read_object
from realitygap.stats import Estimate, Range, mean_interval, median_interval, share_interval
from realitygap.world import Fitted

from .plan import ClosingPlan, TwinName, read_plan
from .rows import (
    CalibratedRow,
    ClosingSummary,
    FamilyGapRow,
    GoalRow,
    MissRow,
    NumberRow,
    OrderRow,
    StrategyRow,
    TwinRow,
    UnknownRow,
)

STANDARD_ERRORS = 3.0
"""A twin counts where the simulator as it is differs from it by more than so many standard errors."""

NORMAL_95 = 1.959963984540054
FALLS = {"track": 0.6, "cells": 0.4, "encoders": 0.4}
"""Least median fall of the RMS gap, by what calibrating sees."""

STRETCH = 0.8
"""The same with `track`, where all goes well."""

KINDS = ("random", "champions")
"""The kinds of held-out controllers."""

LEAST_SRCC = 0.95
MOST_MMRV = 2.0
LEAST_OVER_DIRECT = 0.8
Unit = dict[str, Any]
"""The result of one unit, as its file has it."""


def summarize_closing(folder: str | Path) -> ClosingSummary:
    """Summarize the existing parts of the study in a folder, and list the missing ones.

    Returns:
        `plan`; `twins`: of each one the RMS gap before and after by observation and budget, whether it counts, and
        what its calibrations found; `families`; `strategies`; `goals`: each with `name`, `figure`, `low`, `high` (95 %
        interval, over twins), `n`, `goal`, `met` (as `is_met` returns it), `why` for those twins that miss it, and
        `unknown`: twins of which the figure is not known, and why; `n_done` and `n_units`.

    Raises:
        RecordError: There is no such study.
    """
    folder = Path(folder)
    plan = read_plan(folder)
    units = _read_units(folder, plan)
    twins = [row for name in plan.names if (row := _twin(name, plan, units.get(str(name), {}))) is not None]
    budget = _goal_budget(plan)
    return {
        "study": "closing-the-gap",
        "software": __version__,
        "plan": plan.to_dict(),
        "label": next((found["judged"]["label"] for found in units.values() if "judged" in found), "TWIN"),
        "budget": budget,
        "n_done": sum(len(found) for found in units.values()),
        "n_units": plan.n_units,
        "n_counted": sum(twin["counts"] for twin in twins),
        "twins": twins,
        "families": _families(plan, twins),
        "strategies": _strategies(twins),
        "goals": list(_goals(plan, twins, budget)),
    }


def _read_units(folder: Path, plan: ClosingPlan) -> dict[str, dict[str, Unit]]:
    """Read the existing results, by twin and unit."""
    found: dict[str, dict[str, Unit]] = {}
    for name in plan.names:
        for unit in plan.units(name):
            path = folder / "units" / f"{name}-{unit}.json"
            if path.exists():
                found.setdefault(str(name), {})[unit] = read_object(path)
    return found


def _goal_budget(plan: ClosingPlan) -> int:
    """Return the budget by which goals are judged."""
    return plan.transfer_budget if plan.transfer_budget in plan.budgets else max(plan.budgets)


# a twin


def _twin(name: TwinName, plan: ClosingPlan, units: dict[str, Unit]) -> TwinRow | None:
    """Return the results of a twin, None before its gap to the uncalibrated simulator is measured."""
    before = units.get("gap-none-0")
    if before is None:
        return None
    rms = before["gap"]["rms"]
    error = standard_error(rms)
    after = [_calibrated(units[unit], rms) for unit in plan.units(name) if unit in units and _is_after(unit)]
    row: TwinRow = {
        "twin": str(name),
        "family": name.family,
        "rms": rms,
        "standard_error": error,
        "counts": bool(rms["estimate"] is not None and error and rms["estimate"] > STANDARD_ERRORS * error),
        "gap": _measures(before),
        "means": before["means"],
        "parts": before.get("parts", {}),
        "stalled": units.get("judged", {}).get("stalled", []),
        "calibrated": after,
    }
    if "transfer" in units:
        row["transfer"] = units["transfer"]["strategies"]
    row["seconds"] = sum(unit["seconds"] for unit in units.values())
    return row


def _is_after(unit: str) -> bool:
    return unit.startswith("gap-") and unit != "gap-none-0"


def standard_error(estimate: NumberRow) -> float | None:
    """Return the standard error of a figure by its 95 % interval, as of a normal one; None without an interval."""
    if estimate["low"] is None or estimate["high"] is None:
        return None
    return float(estimate["high"] - estimate["low"]) / (2 * NORMAL_95)


def _calibrated(unit: Unit, before: NumberRow) -> CalibratedRow:
    """Return the fall of the gap with one calibration, and the checks of the fit."""
    after, fit = unit["gap"]["rms"], unit["calibration"]
    known = after["estimate"] is not None and before["estimate"]
    return {
        "observe": unit["observe"],
        "budget": unit["budget"],
        "rms": after,
        "rms_point": unit["point"],
        "rms_draws": unit.get("draws"),
        "recommended": unit.get("recommended", ""),
        "fall": 1 - after["estimate"] / before["estimate"] if known else None,
        "gap": _measures(unit),
        "means": unit["means"],
        "parts": unit.get("parts", {}),
        "misspecified": fit["misspecified"],
        "misspecification_p": fit["misspecification_p"],
        "at_prior_end": sorted(each["name"] for each in fit["fitted"] if Fitted(**each).is_at_end),
    }


def _measures(unit: Unit) -> OrderRow:
    """Return the numbers of a gap that figures need."""
    gap = unit["gap"]
    mmrv, floor = gap["mmrv"]["estimate"], gap["mmrv_floor"]["estimate"]
    return {
        "srcc": gap["srcc"]["estimate"],
        "srcc_disattenuated": gap["srcc_disattenuated"]["estimate"],
        "mmrv": mmrv,
        "mmrv_floor": floor,
        "level": gap["level"]["estimate"],
        "mmrv_ratio": mmrv / floor if mmrv is not None and floor else None,
    }


# families and strategies


def _families(plan: ClosingPlan, twins: Sequence[TwinRow]) -> list[FamilyGapRow]:
    """Return the RMS gap by family, observation and budget: medians over all twins, and over those that count."""
    rows: list[FamilyGapRow] = []
    for family in plan.families:
        of_family = [twin for twin in twins if twin["family"] == family]
        rows.append(_family(family, "none", 0, of_family, lambda twin: (twin["rms"], 0.0)))
        for observe in plan.observations:
            for budget in sorted(each for each in plan.budgets if each):

                def after(
                    twin: TwinRow, observe: str = observe, budget: int = budget
                ) -> tuple[NumberRow, float | None] | None:
                    found = _after(twin, observe, budget)
                    return None if found is None else (found["rms"], found["fall"])

                rows.append(_family(family, observe, budget, of_family, after))
    return rows


def _family(
    family: str,
    observe: str,
    budget: int,
    twins: Sequence[TwinRow],
    read: Callable[[TwinRow], tuple[NumberRow, float | None] | None],
) -> FamilyGapRow:
    units = [(twin, each) for twin in twins if (each := read(twin)) is not None]
    values = [each[0]["estimate"] for _, each in units if each[0]["estimate"] is not None]
    falls = [each[1] for twin, each in units if twin["counts"] and each[1] is not None]
    return {
        "family": family,
        "observe": observe,
        "budget": budget,
        "n": len(values),
        "rms": _row(median_interval(values)),
        "n_counted": len(falls),
        "fall": _row(median_interval(falls)),
    }


def _after(twin: TwinRow, observe: str, budget: int) -> CalibratedRow | None:
    return next(
        (each for each in twin["calibrated"] if (each["observe"], each["budget"]) == (observe, budget)), None
    )


def _strategies(twins: Sequence[TwinRow]) -> list[StrategyRow]:
    """Return the quality on the twins by strategy: mean over twins, with an interval over twins."""
    found: dict[str, list[float]] = {}
    for twin in twins:
        for row in twin.get("transfer", []):
            found.setdefault(row["strategy"], []).append(row["quality"]["estimate"])
    return [
        {"strategy": name, "n": len(values), **_row(_mean(values, (0.0, 1.0)))}
        for name, values in found.items()
    ]


# goals


def _goals(plan: ClosingPlan, twins: Sequence[TwinRow], budget: int) -> Iterable[GoalRow]:
    if plan.platforms:
        for family in plan.families:
            yield from _goals_of_platform(plan, family, twins, budget)
        return
    counted = [twin for twin in twins if twin["counts"]]
    for observe in plan.observations:
        pairs = [(twin, after) for twin in counted if (after := _after(twin, observe, budget)) is not None]
        falls = [(twin, after, after["fall"]) for twin, after in pairs if after["fall"] is not None]
        least = FALLS[observe]
        yield _median_goal(f"fall of the RMS gap, {observe}", falls, least, above=True)
        if observe == "track":
            yield _median_goal(f"fall of the RMS gap, {observe} (stretch)", falls, STRETCH, above=True)
        yield _no_family_worse(plan, observe, falls)
        order = [(twin, after, after["gap"]["srcc_disattenuated"]) for twin, after in pairs]
        yield _median_goal(f"disattenuated SRCC, {observe}", order, LEAST_SRCC, above=True)
        ratio = [(twin, after, after["gap"]["mmrv_ratio"]) for twin, after in pairs]
        yield _median_goal(f"MMRV over its split-half floor, {observe}", ratio, MOST_MMRV, above=False)
        if not plan.transfers:
            continue
        for other, least in (("plain", 0.5), ("select", 0.5), ("direct", LEAST_OVER_DIRECT)):
            yield _wins(counted, observe, other, least)


def _goals_of_platform(
    plan: ClosingPlan, family: str, twins: Sequence[TwinRow], budget: int
) -> Iterable[GoalRow]:
    """Yield goals of one robot over all its sittings: of all controllers, and of each kind."""
    pairs = [(twin, after) for twin in twins if twin["family"] == family for after in twin["calibrated"]]
    for observe in plan.observations:
        if (family, observe) in plan.unseen:
            continue
        at = [pair for pair in pairs if (pair[1]["observe"], pair[1]["budget"]) == (observe, budget)]
        title = f"{family}, {observe}"
        for part in ("", *KINDS):
            gaps = [[(row["parts"][part] if part else row["rms"])["estimate"] for row in pair] for pair in at]
            both = [(before, after) for before, after in gaps if before is not None and after is not None]
            figure = pooled_fall([before for before, _ in both], [after for _, after in both])
            name = f"fall of the RMS gap, {title}" + (f", {part}" if part else "")
            yield _goal(name, figure, len(both), FALLS[observe], "at least", [])
        order = [after["gap"]["srcc_disattenuated"] for _, after in at]
        known = [value for value in order if value is not None]
        figure = _mean(known, (-1.0, 1.0))
        yield _goal(f"disattenuated SRCC, {title}", figure, len(known), LEAST_SRCC, "at least", [])


def is_met(low: float | None, high: float | None, goal: float, sense: str) -> bool | None:
    """Return whether a figure's whole interval meets a goal.

    Args:
        low: Lower end of the interval; None if there is no interval.
        high: Upper end.
        goal: The value wanted.
        sense: `at least`, `more than` or `at most`.

    Returns:
        True if the whole interval meets the goal, False if none of it does, and None if the interval contains values of
        both kinds or if there is none: such data do not decide.
    """
    if low is None or high is None:
        return None
    meets = {"at least": operator.ge, "more than": operator.gt, "at most": operator.le}[sense]
    ends = {bool(meets(low, goal)), bool(meets(high, goal))}
    return ends.pop() if len(ends) == 1 else None


def _median_goal(
    name: str, found: Sequence[tuple[TwinRow, CalibratedRow, float | None]], goal: float, *, above: bool
) -> GoalRow:
    """Return a goal for a median over twins; twins without the figure are listed and not counted."""
    known = [(twin, after, value) for twin, after, value in found if value is not None]
    figure = median_interval([value for _, _, value in known])
    sense = "at least" if above else "at most"
    missing = [
        (twin, after, value) for twin, after, value in known if (value < goal) == above and value != goal
    ]
    return _goal(
        name,
        figure,
        len(known),
        goal,
        sense,
        [_why(twin, after, value) for twin, after, value in missing],
        [
            {"twin": row["twin"], "why": _why_unknown(name, after)}
            for row, after, value in found
            if value is None
        ],
    )


def _goal(
    name: str,
    figure: Estimate,
    n: int,
    goal: float,
    sense: str,
    why: list[MissRow],
    unknown: Sequence[UnknownRow] = (),
) -> GoalRow:
    return {
        "name": name,
        "figure": figure.value,
        "low": figure.low,
        "high": figure.high,
        "n": n,
        "unknown": list(unknown),
        "goal": goal,
        "sense": sense,
        "met": is_met(figure.low, figure.high, goal, sense),
        "why": why,
    }


def _no_family_worse(
    plan: ClosingPlan, observe: str, falls: Sequence[tuple[TwinRow, CalibratedRow, float]]
) -> GoalRow:
    """Return the smallest median fall of a family."""
    by_family = {
        family: [value for twin, _, value in falls if twin["family"] == family] for family in plan.families
    }
    medians = {family: median_interval(values) for family, values in by_family.items() if values}
    worst = min(medians, key=lambda family: medians[family].value or 0.0, default=None)
    figure = medians[worst] if worst is not None else median_interval([])
    worse = [each for each in falls if (medians[each[0]["family"]].value or 0.0) < 0 and each[2] < 0]
    return _goal(
        f"smallest fall of a family, {observe}" + (f" ({worst})" if worst else ""),
        figure,
        len(by_family[worst]) if worst is not None else 0,
        0.0,
        "at least",
        [_why(twin, after, value) for twin, after, value in worse],
    )


def _wins(counted: Sequence[TwinRow], observe: str, other: str, least: float) -> GoalRow:
    """Return the share of twins on which `posterior` does better than another strategy; a draw is half a win."""
    pairs = []
    for twin in counted:
        quality = {row["strategy"]: row["quality"]["estimate"] for row in twin.get("transfer", [])}
        if f"posterior, {observe}" in quality and other in quality:
            pairs.append((twin, quality[f"posterior, {observe}"] - quality[other]))
    wins = [1.0 if difference > 0 else 0.5 if difference == 0 else 0.0 for _, difference in pairs]
    sense = "at least" if other == "direct" else "more than"
    return _goal(
        f"posterior, {observe}, better than {other}",
        share_interval(sum(wins), len(wins)),
        len(pairs),
        least,
        sense,
        [
            {"twin": row["twin"], "family": row["family"], "figure": difference}
            for row, difference in pairs
            if difference < 0
        ],
        [
            {"twin": row["twin"], "why": "its transfer is not done"}
            for row in counted
            if row not in [other for other, _ in pairs]
        ],
    )


def _why_unknown(name: str, after: CalibratedRow) -> str:
    """Return the reason why a twin has no such figure."""
    gap = after["gap"]
    if name.startswith("MMRV") and gap["mmrv_floor"] == 0 and gap["mmrv"] is not None:
        return f"its floor is 0, the same order in both halves of its trials; MMRV is {gap['mmrv']:.3f}"
    return "it has too few trials to decide"


def _why(row: TwinRow, after: CalibratedRow, value: float) -> MissRow:
    """Return the facts about a twin that misses a goal."""
    return {
        "twin": row["twin"],
        "family": row["family"],
        "figure": value,
        "rms_before": row["rms"]["estimate"],
        "rms_after": after["rms"]["estimate"],
        "misspecified": after["misspecified"],
        "misspecification_p": after["misspecification_p"],
        "at_prior_end": after["at_prior_end"],
    }


# intervals


def _row(estimate: Estimate) -> NumberRow:
    """Return the number and the ends of its interval, as they are in a file."""
    return {"estimate": estimate.value, "low": estimate.low, "high": estimate.high}


def pooled_fall(before: Sequence[float], after: Sequence[float]) -> Estimate:
    """Return by which share the RMS gap over all sittings falls, with a 95 % interval over sittings.

    The gap is the root of the mean square over sittings. The interval is Student's for the logarithm of the ratio, by
    the delta method: each sitting counts with the difference of its shares in both mean squares.

    Args:
        before: RMS gap of each sitting with the simulator as it is.
        after: The same after calibration.

    Returns:
        The share, None without a gap before; without an interval if there are too few sittings.
    """
    n = len(before)
    squares = np.square([before, after], dtype=float)
    if not n or not squares[0].any():
        return Estimate.refusal(n, "There is no gap before calibration.")
    of_before, of_after = squares.mean(axis=1)
    fall = float(1 - np.sqrt(of_after / of_before))
    if n < 2 or of_after <= 0:
        return Estimate.of_few(fall, n, 2, "sittings")
    shares = squares[1] / of_after - squares[0] / of_before
    reach = float(scipy.special.stdtrit(n - 1, 0.975)) * float(np.std(shares, ddof=1)) / (2 * math.sqrt(n))
    return Estimate(fall, 1 - (1 - fall) * math.exp(reach), 1 - (1 - fall) * math.exp(-reach), n, method="t")


def _mean(values: Sequence[float], within: Range) -> Estimate:
    if not values:
        return Estimate.refusal(0, "There are no values.")
    return mean_interval(values, within, smallest=2)
