"""The figures of the study, from the collected results.

Marks differ in lightness, in size, or in shape, because the page is also printed in black and white.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from realitygap.drawing import Ink
from realitygap.records import write_whole
from realitygap.report.charts.house import NARROW, Drawing, draw_wide
from realitygap.report.charts.lines import draw_dots, draw_line, draw_rings, head, hollow, line_key, mark_key
from realitygap.report.charts.rows import name_rows
from realitygap.report.charts.scatter import draw_equality
from realitygap.report.charts.sheet import Sheet, grid

from .analysis import evolved, fall_of, optimism, over_twins, square_gap
from .plan import FAMILIES, Plan
from .results import Results, Scores, read_collected

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from realitygap.stats import Estimate

KINDS = {"random": "random networks", "champion": "champions"}
SHOWN = {"plain": "not calibrated", "cells": "calibrated, cells", "track": "calibrated, track"}
"""Arms of the scatter, with their titles."""

BUDGETS = {0: "plain", 10: "track-10", 20: "track", 40: "track-40"}
"""Trials for calibrating, with the arms that had them."""

FAMILY_MARKERS = dict(zip(FAMILIES, "osD^", strict=True))


def draw(plan: Plan, folder: Path, out: Path) -> None:
    """Write all figures as SVG files.

    Args:
        plan: Plan of the study.
        folder: Folder of the collected results.
        out: Folder of the figures.
    """
    results = read_collected(plan, folder)
    out.mkdir(parents=True, exist_ok=True)
    for name, drawing in drawings(results).items():
        write_whole(out / f"{name}.svg", (drawing.svg + "\n").encode(), within=out)
        print(out / f"{name}.svg")


def drawings(results: Results) -> dict[str, Drawing]:
    """Return the figures by name."""
    return {
        "scatter": scatter(results),
        "falls": falls(results),
        "evolved": of_evolved(results),
        "budget": by_budget(results),
    }


def means_of(results: Results, arm: str, kind: str) -> Scores:
    """Return the (n, 2) mean scores of all held-out controllers of a kind in simulation and on their twins."""
    found = []
    for twin in results.twins():
        unit, judged = results.get(twin, "coverage", arm), results.get(twin, "coverage", "judged")
        if unit is not None and judged is not None:
            which = np.array(judged["kinds"]) == kind
            simulated, driven = np.mean(unit["scores"], axis=1), np.mean(judged["scores"][0], axis=1)
            found.append(np.column_stack([simulated[which], driven[which]]))
    return np.concatenate(found) if found else np.zeros((0, 2))


def scatter(results: Results) -> Drawing:
    """Draw the mean score of each held-out controller in simulation against that on its twin."""
    points = {arm: {kind: means_of(results, arm, kind) for kind in KINDS} for arm in SHOWN}

    def drawn(width: float) -> Sheet:
        sheet, panels = grid(width, len(SHOWN), len(SHOWN) if width > NARROW + 1 else 1, 2.4, gap=0.3)
        for axes, (arm, title) in zip(panels, SHOWN.items(), strict=True):
            draw_equality(axes, 0, 1, Ink.MUTED)
            _specks(axes, points[arm]["champion"], Ink.OURS, 3.2)
            _specks(axes, points[arm]["random"], Ink.BODY, 2.2)
            n = sum(map(len, points[arm].values()))
            head(axes, title, f"{n} controllers on {len(results.twins())} twins", stacked=True)
            axes.set_xlabel("coverage, SIM", labelpad=2)
        panels[0].set_ylabel("coverage, TWIN", labelpad=3)
        sheet.key(
            [
                mark_key(KINDS["random"], "o", 2.6, color=Ink.BODY),
                mark_key(KINDS["champion"], "o", 4.4, color=Ink.OURS),
            ],
            place="upper right",
        )
        return sheet

    return _figure(
        drawn, "scatter", "Coverage in simulation against coverage on the twin, for three simulators."
    )


def _specks(axes: Axes, points: Scores, color: str, size: float) -> None:
    """Draw points as pieces of a line without a length, which need a fifth of the bytes of marks."""
    xs, ys = (np.column_stack([at, at, np.full(len(at), np.nan)]).ravel() for at in points.T)
    draw_line(axes, xs, ys, color=color, alpha=0.7, linewidth=size, solid_capstyle="round")


def falls(results: Results) -> Drawing:
    """Draw the fall of the RMS gap with each arm, for both kinds of controllers."""
    arms = [arm.name for arm in results.plan.arms if arm.name != "plain"]
    found = {kind: {arm: fall_of(results, arm, kind, 0.0)[0] for arm in arms} for kind in KINDS}
    goals = results.plan.goals["fall"]
    ends = [
        100 * each for by_arm in found.values() for fall in by_arm.values() for each in (fall.value, *(fall.ends or ()))
        if each is not None
    ]  # fmt: skip
    lowest = min([0.0, *ends])

    def drawn(width: float) -> Sheet:
        sheet, panels = grid(width, 2, 2 if width > NARROW + 1 else 1, 0.22 * len(arms), gap=0.3)
        for axes, (kind, title) in zip(panels, KINDS.items(), strict=True):
            axes.set_xlim(1.05 * lowest, 100)
            is_named = axes is panels[0] or not sheet.is_wide
            name_rows(axes, arms if is_named else [""] * len(arms))
            draw_line(axes, [0, 0], [-0.5, len(arms) - 0.5], color=Ink.MUTED, linewidth=0.8)
            for place, arm in enumerate(arms):
                fall = found[kind][arm]
                if arm in goals:
                    goal = 100 * goals[arm]
                    draw_line(
                        axes, [goal, goal], [place - 0.4, place + 0.4], color=Ink.PUBLISHED, linewidth=2.0
                    )
                _with_interval(axes, fall, place, 100.0)
            head(axes, title, "fall of the RMS gap, SIM against TWIN", stacked=True)
            axes.set_xlabel("fall [%]", labelpad=2)
        sheet.key([line_key("goal", color=Ink.PUBLISHED, linewidth=2.0)], place="upper right")
        return sheet

    return _figure(drawn, "falls", "Fall of the RMS gap by simulator, for random networks and for champions.")


def _with_interval(axes: Axes, found: Estimate, place: float, scale: float = 1.0) -> None:
    if found.ends is not None:
        ends = [scale * each for each in found.ends]
        draw_line(axes, ends, [place, place], color=Ink.OURS, linewidth=2.2, solid_capstyle="butt")
    if found.value is not None:
        draw_dots(axes, scale * found.value, place, 5.0, color=Ink.OURS, zorder=5)


def of_evolved(results: Results) -> Drawing:
    """Draw the mean score of what evolved in each arm's simulator, there and on the twin."""
    arms = [arm.name for arm in results.plan.arms if arm.evolves]
    rows = {arm: (over_twins(results, evolved, arm), over_twins(results, optimism, arm)) for arm in arms}
    known = [each for target, off in rows.values() if target.value is not None
             for each in (*(target.ends or (target.value,)), target.value + (off.value or 0.0))]  # fmt: skip
    low, high = (min(known), max(known)) if known else (0.0, 1.0)

    def drawn(width: float) -> Sheet:
        sheet, (axes,) = grid(width, 1, 1, 0.24 * len(arms))
        axes.set_xlim(low - 0.02, high + 0.02)
        name_rows(axes, arms)
        for place, (target, off) in enumerate(rows.values()):
            if target.value is not None and off.value is not None:
                simulated = target.value + off.value
                draw_line(axes, [target.value, simulated], [place, place], color=Ink.BODY, linewidth=0.9)
                draw_rings(axes, simulated, place, 5.5, Ink.PEN0, zorder=4)
            _with_interval(axes, target, place)
        head(axes, "What evolved in each simulator", f"{len(results.twins())} twins", stacked=True)
        axes.set_xlabel("mean coverage", labelpad=2)
        keys = [
            mark_key("in that simulator (SIM)", "o", 5.5, **hollow(Ink.PEN0)),
            line_key("on the twin (TWIN), with its interval", color=Ink.OURS, marker="o", linewidth=2.2),
        ]
        sheet.key(keys, place="upper right")
        return sheet

    return _figure(drawn, "evolved", "Coverage of evolved controllers in their simulator and on the twin.")


def by_budget(results: Results) -> Drawing:
    """Draw the RMS gap of each family against the trials that calibrated."""
    gaps = {kind: {family: _gaps_of(results, family, kind) for family in FAMILIES} for kind in KINDS}
    top = 1.08 * max(
        [y for families in gaps.values() for each in families.values() for y in each.values()] or [1.0]
    )

    def drawn(width: float) -> Sheet:
        sheet, panels = grid(width, 2, 2 if width > NARROW + 1 else 1, 1.9, gap=0.3)
        for axes, (kind, title) in zip(panels, KINDS.items(), strict=True):
            axes.set_xlim(-1.5, max(BUDGETS) + 1.5)
            axes.set_ylim(0, top)
            axes.set_xticks(list(BUDGETS))
            for family, marker in FAMILY_MARKERS.items():
                if gaps[kind][family]:
                    xs, ys = zip(*gaps[kind][family].items(), strict=True)
                    draw_line(axes, xs, ys, color=Ink.OURS, linewidth=1.1, marker=marker, markersize=4.5)
            axes.set_xlabel("trials for calibrating, track", labelpad=2)
            head(axes, title)
        panels[0].set_ylabel("RMS gap, SIM against TWIN", labelpad=3)
        keys = [line_key(name, color=Ink.OURS, marker=mark) for name, mark in FAMILY_MARKERS.items()]
        sheet.key(keys, place="upper right")
        return sheet

    return _figure(
        drawn, "budget", "RMS gap by family of twins, against the number of trials for calibrating."
    )


def _gaps_of(results: Results, family: str, kind: str) -> Mapping[int, float]:
    """Return the RMS gap, pooled over the twins of a family, by budget; 0 for a negative mean square."""
    found = {}
    for budget, arm in BUDGETS.items():
        squares = [square_gap(results, twin, arm, kind) for twin in results.twins((family,))]
        known = [each for each in squares if each is not None]
        if known:
            found[budget] = float(np.sqrt(max(0.0, float(np.mean(known)))))
    return found


def _figure(drawn: Callable[[float], Sheet], name: str, alt: str) -> Drawing:
    return draw_wide(drawn, f"closing-{name}", alt, alt)
