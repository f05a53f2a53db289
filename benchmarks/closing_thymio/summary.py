"""The results of the study: each goal with its figure, its interval, and its verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from realitygap import __version__
from realitygap.records import read_object
from realitygap.stats import Estimate, mean_interval, median_interval
from realitygap.world import Fitted

from .plan import Plan, Sitting, read_plan
from .sitting import SittingOfStudy

Row = dict[str, Any]
FALLS = {"track": 0.6, "encoders": 0.4}
"""Goals: least fall of the pooled RMS gap, by what calibrating sees."""

LEAST_SRCC = 0.95
KINDS = ("random", "champions")


def summarize(folder: Path) -> Row:
    """Return the results in a folder, complete or not.

    Raises:
        SystemExit: There are none.
    """
    plan = read_plan(folder)
    units = {sitting: _read_units(folder, plan, sitting) for sitting in plan.sittings}
    sittings = [_sitting(sitting, found) for sitting, found in units.items() if "gap-none-0" in found]
    return {
        "study": "closing_thymio",
        "software": __version__,
        "plan": plan.to_dict(),
        "label": next((found["judged"]["label"] for found in units.values() if "judged" in found), ""),
        "budget": plan.judged_at,
        "n_done": sum(map(len, units.values())),
        "n_units": sum(1 for sitting in plan.sittings for _ in plan.units(sitting)),
        "twins": sittings,
        "families": list(_families(plan, sittings)),
        "goals": list(_goals(plan, sittings)),
    }


def _read_units(folder: Path, plan: Plan, sitting: Sitting) -> dict[str, Row]:
    paths = {unit: SittingOfStudy(plan, sitting, folder).path(unit) for unit in plan.units(sitting)}
    return {unit: read_object(path) for unit, path in paths.items() if path.exists()}


def _sitting(sitting: Sitting, units: dict[str, Row]) -> Row:
    """Return the results of a sitting: its gap before calibrating, and after each calibration."""
    before = units["gap-none-0"]
    rms = before["gap"]["rms"]
    return {
        "twin": str(sitting),
        "family": sitting.family,
        "rms": rms,
        "gap": _measures(before),
        "means": before["means"],
        "parts": before["parts"],
        "stalled": units["judged"]["stalled"],
        "calibrated": [_calibrated(unit, rms) for unit in units.values() if unit.get("calibration")],
        "seconds": sum(unit["seconds"] for unit in units.values()),
    }


def _calibrated(unit: Row, before: Row) -> Row:
    """Return the fall of the gap with one calibration, and the checks of the fit."""
    after, fit = unit["gap"]["rms"], unit["calibration"]
    known = after["estimate"] is not None and before["estimate"]
    return {
        "observe": unit["observe"],
        "budget": unit["budget"],
        "rms": after,
        "rms_point": unit["point"],
        "rms_draws": unit["draws"],
        "recommended": unit["recommended"],
        "fall": 1 - after["estimate"] / before["estimate"] if known else None,
        "gap": _measures(unit),
        "means": unit["means"],
        "parts": unit["parts"],
        "misspecified": fit["misspecified"],
        "misspecification_p": fit["misspecification_p"],
        "at_prior_end": sorted(each["name"] for each in fit["fitted"] if Fitted(**each).is_at_end),
    }


def _measures(unit: Row) -> Row:
    """Return the numbers of a gap that tables and figures need."""
    measures = ("srcc", "srcc_disattenuated", "mmrv", "mmrv_floor", "level")
    found: Row = {name: unit["gap"][name]["estimate"] for name in measures}
    mmrv, floor = found["mmrv"], found["mmrv_floor"]
    return {**found, "mmrv_ratio": mmrv / floor if mmrv is not None and floor else None}


def _families(plan: Plan, sittings: Sequence[Row]) -> Iterable[Row]:
    """Yield the median RMS gap of each robot, before and by calibration."""
    for family in plan.families:
        own = [each for each in sittings if each["family"] == family]
        yield _family(family, "none", 0, [each["rms"] for each in own])
        for observe in plan.observations:
            for budget in filter(None, plan.budgets):
                found = [after["rms"] for each in own if (after := after_of(each, observe, budget))]
                yield _family(family, observe, budget, found)


def _family(family: str, observe: str, budget: int, found: Sequence[Row]) -> Row:
    values = [rms["estimate"] for rms in found if rms["estimate"] is not None]
    rms = _row(median_interval(values))
    return {"family": family, "observe": observe, "budget": budget, "n": len(values), "rms": rms}


def after_of(sitting: Row, observe: str, budget: int) -> Row | None:
    """Return the results of a sitting after a calibration."""
    found: list[Row] = sitting["calibrated"]
    return next((each for each in found if (each["observe"], each["budget"]) == (observe, budget)), None)


def _goals(plan: Plan, sittings: Sequence[Row]) -> Iterable[Row]:
    """Yield the goals of each robot over its sittings: of all controllers, and of each kind."""
    for family in plan.families:
        own = [each for each in sittings if each["family"] == family]
        for observe in plan.observations:
            if (family, observe) in plan.unseen:
                continue
            pairs = [(each, after) for each in own if (after := after_of(each, observe, plan.judged_at))]
            title = f"{family}, {observe}"
            for part in ("", *KINDS):
                gaps = [
                    [(row["parts"][part] if part else row["rms"])["estimate"] for row in p] for p in pairs
                ]
                known = [gap for gap in gaps if None not in gap]
                figure = pooled_fall([before for before, _ in known], [after for _, after in known])
                name = f"fall of the RMS gap, {title}" + (f", {part}" if part else "")
                yield _goal(name, figure, len(known), FALLS[observe])
            order = [value for _, a in pairs if (value := a["gap"]["srcc_disattenuated"]) is not None]
            figure = (
                mean_interval(order, (-1.0, 1.0), smallest=2) if order else Estimate.refusal(0, "No value.")
            )
            yield _goal(f"disattenuated SRCC, {title}", figure, len(order), LEAST_SRCC)


def _goal(name: str, figure: Estimate, n: int, goal: float) -> Row:
    met = is_met(figure.low, figure.high, goal)
    return {"name": name, "figure": figure.value, "low": figure.low, "high": figure.high, "n": n, "goal": goal,
            "sense": "at least", "met": met}  # fmt: skip


def is_met(low: float | None, high: float | None, goal: float) -> bool | None:
    """Return whether a figure's whole interval is at least a goal; None if the interval does not decide."""
    if low is None or high is None:
        return None
    ends = {low >= goal, high >= goal}
    return ends.pop() if len(ends) == 1 else None


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


def _row(estimate: Estimate) -> Row:
    return {"estimate": estimate.value, "low": estimate.low, "high": estimate.high}
