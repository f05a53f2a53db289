"""A page for a gap: the verdict, its measures, figures, and results that do not count towards the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from realitygap._version import __version__
from realitygap._wording import bracketed, p_equation, p_in_words, platform_in_words, reproduces, signed
from realitygap.errors import RecordError
from realitygap.gap import SHOWN, GapResult
from realitygap.records import is_special, refuse_results, write_whole
from realitygap.report._divergence_figure import Side, draw_distance, draw_divergence
from realitygap.report._gap_figures import (
    draw_gap_differences,
    draw_gap_maps,
    draw_gap_pairs,
    draw_gap_replay,
    draw_gap_why,
)
from realitygap.report._motion_on_page import MotionOnPage, motion_content
from realitygap.report._page import LABELS
from realitygap.report._placed import FigureOnPage, hover_content, number_figures
from realitygap.report._table import Cell, Column, Part, Row, TableOnPage
from realitygap.report._template import render_page
from realitygap.report.charts.house import Drawing
from realitygap.stats import Estimate
from realitygap.study import ClosedGap, GapBetween, GapStudy

_APART = (
    (
        "reevolved",
        "Re-evolved gap",
        "champions evolved and tried on the target minus those of the simulator, there",
    ),
    ("luck", "Luck of selection", "what champions lose on fresh seeds where they were selected"),
)


_OBSERVED = {
    "readings": "the robot’s readings",
    "cells": "crossed cells",
    "encoders": "cells and encoders",
    "track": "all poses",
}


def refuse_gap_page(path: str | Path) -> None:
    """Refuse an invalid path for the page before trials are run.

    Raises:
        RecordError: It ends in something else than .html, is a file of results, or is to lie in a folder that is none.
    """
    path = Path(path)
    refuse_results(path)
    if path.suffix.lower() not in (".html", ".htm") and not is_special(path):
        raise RecordError(f"{path} does not end in .html: the report of a gap is a page.")
    if not path.absolute().parent.is_dir():
        raise RecordError(f"There is no folder {path.parent} for {path.name}. Make it, or name another file.")


def write_gap_report(gap: GapBetween, path: str | Path) -> Path:
    """Write a gap as one HTML file that needs no other file and no network.

    Args:
        gap: Result of `realitygap.study.gap_between`.
        path: Path that ends in .html. An existing file is replaced.

    Returns:
        The path.

    Raises:
        RecordError: The file cannot be written, or would take the place of a file of results.
    """
    return _write(path, _content(gap))


def write_closed_gap(closed: ClosedGap, path: str | Path) -> Path:
    """Write a gap before and after a calibration as one HTML file that needs no other file and no network.

    Args:
        closed: Result of `realitygap.study.close_gap`.
        path: Path that ends in .html. An existing file is replaced.

    Returns:
        The path.

    Raises:
        RecordError: The file cannot be written, or would take the place of a file of results.
    """
    return _write(path, _content(closed.after, closed))


def _write(path: str | Path, content: dict[str, Any]) -> Path:
    refuse_gap_page(path)
    write_whole(Path(path), render_page("gap.html.jinja", content).encode("utf-8", "replace"))
    return Path(path)


def _content(gap: GapBetween, closed: ClosedGap | None = None) -> dict[str, Any]:
    study, why = gap.study, gap.why
    before = None if closed is None else closed.before.study
    result = study.result
    labels = list(dict.fromkeys(result.labels))
    pairs = FigureOnPage("pairs", draw_gap_pairs(study, before))
    shown = _shown(study)
    shown_before = None if before is None else _shown(before)
    moving = [
        (title, *sides)
        for title, sides in (
            ("before the calibration", shown_before),
            ("" if before is None else "after the calibration", shown),
        )
        if sides is not None
    ]
    distance = FigureOnPage("distance", draw_distance(moving)) if moving else None
    figures = [
        FigureOnPage(anchor, drawing)
        for anchor, drawing in (
            ("paths", _draw_paths(study, *shown) if shown and len(shown[0].trials) > 1 else None),
            ("differences", draw_gap_differences(study)),
            ("maps", draw_gap_maps(study)),
            ("replay", draw_gap_replay(study)),
        )
        if drawing is not None
    ]
    figure_of_why = None if why is None else FigureOnPage("why", draw_gap_why(why, study))
    number_figures([distance, pairs, *figures, figure_of_why])
    content = {
        "version": __version__,
        "title": f"The gap: {result.title if closed is None else closed.title}",
        "labels": [(label, LABELS[label]) for label in labels],
        "n": result.basis,
        "verdict": result.verdict if closed is None else closed.verdict,
        "main": result.main_measures if closed is None else closed.main_measures,
        "is_closed": closed is not None,
        "score": result.score,
        "motions": [_motion(*sides) for sides in moving],
        "about_motion": _about(study, before),
        "distance": distance,
        "pairs": pairs,
        "facts": _facts(gap),
        "measures": [
            measures_table(
                name, caption, [measure_row(of, each.name, each.title, each.meaning) for each in SHOWN]
            )
            for name, caption, of in (
                ("before", "Measures before the calibration.", None if before is None else before.result),
                (
                    "transfer",
                    "Measures of the transfer gap." if before is None else "Measures after it.",
                    result,
                ),
            )
            if of is not None
        ],
        "apart": measures_table(
            "apart", "Re-evolved gap, and luck of selection.", [measure_row(result, *each) for each in _APART]
        ),
        "advice": None if why is None else why.advice,
        "figures": figures,
        "why": figure_of_why,
        "controllers": _controllers_table(gap),
        "order": _order(gap, closed),
    }
    return content | hover_content(content) | motion_content()


def _order(gap: GapBetween, closed: ClosedGap | None) -> str:
    order = gap.order if closed is None else closed.order
    return "" if order is None else order.to_toml()


def _shown(study: GapStudy) -> tuple[Side, Side] | None:
    """Return the trials that are shown in motion, by their platform in words."""
    if study.shown is None:
        return None
    sides = ((study.source, study.shown.source), (study.target, study.shown.target))
    one, other = (Side(platform_in_words(side.name, side.label), trials) for side, trials in sides)
    return one, other


def _motion(title: str, one: Side, other: Side) -> MotionOnPage:
    return MotionOnPage.of(
        title, [(f"{side.name} ({side.trials[0].label})", side.trials[0]) for side in (one, other)]
    )


def _about(study: GapStudy, before: GapStudy | None) -> str:
    """Return which controller moves, or why none does."""
    if study.shown is None:
        return (
            f"The poses of the robot on {study.target.name} are unknown, so no trial can be shown in motion. The "
            "observation level track records them."
        )
    k = study.shown.controller
    simulated = f"{study.source.means[k]:.3f}"
    if before is not None:
        simulated = f"{before.source.means[k]:.3f} before and {simulated} after the calibration"
    return (
        f"{study.controllers[k].name}, the best of {len(study.controllers)} controllers in simulation, on both "
        f"platforms from one start. Mean {study.result.score}: {simulated} in simulation ({study.source.label}), "
        f"{study.target.means[k]:.3f} on the target ({study.target.label})."
    )


def _draw_paths(study: GapStudy, one: Side, other: Side) -> Drawing:
    drawing = draw_divergence(one, other)
    n = len(one.trials)
    caption = (
        f"The same controller, n = {n} trials on {one.name} ({one.trials[0].label}) and on {other.name} "
        f"({other.trials[0].label}). Above: all paths; the first one has its robot and its cells. Below: distance and "
        "difference in heading after each step, mean and 10th to 90th percentile. Thin: repeats on one platform."
    )
    return replace(drawing, caption=caption)


def _facts(gap: GapBetween) -> list[tuple[str, str]]:
    study = gap.study
    result = study.result
    kinds = [each.kind for each in study.controllers]
    facts = [
        ("Simulator", f"{result.source} ({result.labels[0]}), {result.trials[0]} trials of each controller"),
        ("Target", f"{result.target} ({result.labels[1]}), {result.trials[1]} trials of each controller"),
        (
            "Controllers",
            f"{len(kinds)}: {kinds.count('random')} random networks and {kinds.count('champion')} champions",
        ),
        ("Arena", study.arena.name),
        ("Score", result.score),
        ("Observed", _OBSERVED[study.observe]),
    ]
    if result.misspecified is not None:
        facts.append(("Model", reproduces(result.misspecified)))
    return facts + [("Note", note) for note in result.notes]


def measure_row(result: GapResult, name: str, title: str, meaning: str) -> Row:
    """Return the row of a measure: its value, interval, n, p, and meaning, with the reason if one is missing."""
    estimate: Estimate = getattr(result, name)
    p = estimate.more.get("p")
    explained = meaning.format(score=result.score)
    return (
        title,
        "–" if estimate.value is None else f"{estimate.value:.3f}".replace("-", "−"),
        bracketed(estimate, missing="–"),
        str(estimate.n),
        "" if p is None else p_equation(p).removeprefix("p ").removeprefix("= "),
        Cell(f"{explained}. ", more=estimate.refused) if estimate.refused else explained,
    )


def measures_table(name: str, caption: str, rows: Sequence[Row]) -> TableOnPage:
    """Return a table of measures."""
    columns = (
        *(Column("Measure"), Column("estimate", kind="median"), Column("interval"), Column("n"), Column("p")),
        Column("meaning", kind="text prose", head_kind="text"),
    )
    return TableOnPage(name, caption, columns, (Part(rows),))


def _controllers_table(gap: GapBetween) -> TableOnPage:
    study, result = gap.study, gap.study.result
    sides = (study.source, study.target)
    rows: list[Row] = [
        (
            controller.name,
            *(f"{side.means[k]:.3f}" for side in sides),
            *expected_cells(result, k),
        )
        for k, controller in enumerate(study.controllers)
    ]
    columns = (
        Column("Controller"),
        *(Column(f"{side.label} {side.name}") for side in sides),
        *expected_columns(result),
    )
    caption = f"Mean {result.score} of each controller.{about_expected(result)}"
    return TableOnPage("controllers", caption, columns, (Part(rows),), kind="numbers")


def expected_columns(result: GapResult, *, with_p: bool = True) -> tuple[Column, ...]:
    """Return the columns of the expected difference of each controller; none without a model."""
    columns = (Column("expected difference"), *([Column("p")] if with_p else []))
    return columns if result.each else ()


def expected_cells(result: GapResult, k: int, *, with_p: bool = True) -> tuple[str, ...]:
    """Return the expected difference of controller k, and its p."""
    if not result.each:
        return ()
    one = result.each[k]
    p = [p_in_words(float(one.more["p"] or 0.0))] if with_p else []
    return f"{signed(float(one))} {bracketed(one, signs=True)}", *p


def about_expected(result: GapResult, *, with_p: bool = True) -> str:
    """Return the meaning of these columns for the caption; empty without them."""
    if not result.each:
        return ""
    return (
        " The expected difference, target minus simulator, is the controller’s own, drawn toward that of all "
        "controllers by as much as its trials are noisy (hierarchical model)."
        + " p is of no difference, corrected over all controllers (Holm)."
        * with_p
    )
