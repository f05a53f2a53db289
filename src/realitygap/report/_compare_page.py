"""A page for the gap in a table of scores: an overview of tasks, and the gap of each."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

from markupsafe import Markup

from realitygap._version import __version__
from realitygap._wording import bracketed, counted, number, p_in_words, signed, with_interval
from realitygap.gap import SHOWN, ScoreGap
from realitygap.records import write_whole
from realitygap.report._gap_figures import draw_gap_differences, draw_gap_pairs
from realitygap.report._gap_page import (
    about_expected,
    expected_cells,
    expected_columns,
    measure_row,
    measures_table,
    refuse_gap_page,
)
from realitygap.report._page import LABELS
from realitygap.report._placed import FigureOnPage, hover_content, number_figures
from realitygap.report._table import Column, Part, Row, TableOnPage
from realitygap.report._template import render_page, template_text
from realitygap.study import ComparedScores

_OF_TABLES = tuple(each for each in SHOWN if not each.name.startswith("energy"))
"""Measures of tables, which have no paths."""

_OVERVIEW = (
    ("level", "Level"),
    ("rms", "RMS gap"),
    ("raw_rms", "RMS, with noise"),
    ("srcc", "rank correlation"),
    ("pearson", "linear correlation"),
    ("mmrv", "MMRV"),
)


def write_compared_scores(compared: ComparedScores, path: str | Path) -> Path:
    """Write the gap in a table of scores as one HTML file that needs no other file and no network.

    Args:
        compared: Result of `realitygap.study.compare_scores`.
        path: Path that ends in .html. An existing file is replaced.

    Returns:
        The path.

    Raises:
        RecordError: The file cannot be written, or would take the place of a file of results.
    """
    refuse_gap_page(path)
    write_whole(Path(path), render_page("compare.html.jinja", _content(compared)).encode("utf-8", "replace"))
    return Path(path)


def _content(compared: ComparedScores) -> dict[str, Any]:
    first = compared.gaps[0].result
    is_single = len(compared.gaps) == 1
    common = () if is_single else compared.common_reasons
    tasks = [_task(gap, k, common) for k, gap in enumerate(compared.gaps, 1)]
    number_figures(figure for task in tasks for figure in (task["pairs"], task["differences"]))
    n = f", {first.basis}"
    content = {
        "version": __version__,
        "title": f"The gap: {compared.title}",
        "labels": [(label, LABELS[label]) for label in dict.fromkeys(first.labels)],
        "score": first.score,
        "n": n if is_single else f", {counted(len(tasks), 'task')}",
        "overview": None if is_single else _overview(compared),
        "common": list(common),
        "tasks": tasks,
        "facts": _facts(compared),
        "order": compared.order.to_toml(),
        "halves_css": Markup(template_text("motion.css")),
    }
    return content | hover_content(content)


def _task(gap: ScoreGap, k: int, common: Collection[str]) -> dict[str, Any]:
    result = gap.result
    return {
        "anchor": f"task-{k}",
        "name": gap.task or result.title,
        "verdict": result.verdict,
        "main": gap.main_measures,
        "reasons": [reason for reason in gap.reasons if reason not in common],
        "pairs": FigureOnPage(f"pairs-{k}", draw_gap_pairs(gap, name=f"gap-pairs-{k}")),
        "differences": FigureOnPage(
            f"differences-{k}", draw_gap_differences(gap, name=f"gap-differences-{k}")
        ),
        "measures": measures_table(
            f"measures-{k}",
            "Measures of the gap.",
            [measure_row(result, each.name, each.title, each.meaning) for each in _OF_TABLES],
        ),
        "controllers": _controllers_table(gap, k),
    }


def _overview(compared: ComparedScores) -> TableOnPage:
    shown = [
        (name, head)
        for name, head in _OVERVIEW
        if any(getattr(gap.result, name).value is not None for gap in compared.gaps)
    ]
    rows: list[Row] = [
        (gap.task, str(gap.result.level.n), *(number(getattr(gap.result, name).value) for name, _ in shown))
        for gap in compared.gaps
    ]
    columns = (Column("Task"), Column("controllers"), *(Column(head) for _, head in shown))
    caption = "The gap of each task. The sections below have the intervals."
    return TableOnPage("overview", caption, columns, (Part(rows),), kind="numbers")


def _controllers_table(gap: ScoreGap, k: int) -> TableOnPage:
    sides = (gap.source, gap.target)
    has_p = any("p" in each.more for each in gap.differences)
    rows: list[Row] = []
    estimates = (gap.source.estimates, gap.target.estimates, gap.differences)
    for row, (controller, sim, real, difference) in enumerate(zip(gap.controllers, *estimates, strict=True)):
        p = difference.more.get("p")
        rows.append(
            (
                controller.name,
                *(cell for mean in (sim, real) for cell in (with_interval(mean), str(mean.n or "–"))),
                f"{signed(float(difference))} {bracketed(difference, signs=True)}".rstrip(),
                *([""] if has_p and p is None else [p_in_words(p)] if p is not None else []),
                *expected_cells(gap.result, row, with_p=not has_p),
            )
        )
    columns = (
        Column("Controller"),
        *(column for side in sides for column in (Column(f"{side.label} {side.in_words}"), Column("n"))),
        Column("difference"),
        *([Column("p")] if has_p else []),
        *expected_columns(gap.result, with_p=not has_p),
    )
    has_ends = any(each.ends is not None for each in gap.differences)
    caption = f"Mean {gap.result.score} of each controller, and the difference{' with its 95 % interval' * has_ends}."
    caption += about_expected(gap.result, with_p=not has_p)
    return TableOnPage(f"controllers-{k}", caption, columns, (Part(rows),), kind="numbers")


def _facts(compared: ComparedScores) -> list[tuple[str, str]]:
    first, order = compared.gaps[0], compared.order
    low, high = order.ends
    facts = [
        ("Table", ", ".join(order.table)),
        ("Simulator", f"{first.source.in_words} ({first.source.label})"),
        ("Target", f"{first.target.in_words} ({first.target.label})"),
        ("Score", f"{first.result.score}, {low:g} to {high:g}"),
    ]
    return facts + [
        ("Note", note) for note in dict.fromkeys(n for gap in compared.gaps for n in gap.result.notes)
    ]
