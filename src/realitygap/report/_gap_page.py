"""A page for a gap: the verdict, its measures, figures, and results that do not count towards the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from realitygap._version import __version__
from realitygap._wording import bracketed, p_equation, reproduces
from realitygap.errors import RecordError
from realitygap.gap import SHOWN, GapResult
from realitygap.records import is_special, refuse_results, write_whole
from realitygap.report._gap_figures import (
    draw_gap_differences,
    draw_gap_maps,
    draw_gap_pairs,
    draw_gap_replay,
    draw_gap_why,
)
from realitygap.report._page import LABELS
from realitygap.report._placed import FigureOnPage, hover_content, number_figures
from realitygap.report._table import Cell, Column, Part, Row, TableOnPage
from realitygap.report._template import render_page
from realitygap.stats import Estimate
from realitygap.study import GapBetween

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
    refuse_gap_page(path)
    page = render_page("gap.html.jinja", _content(gap))
    write_whole(Path(path), page.encode("utf-8", "replace"))
    return Path(path)


def _content(gap: GapBetween) -> dict[str, Any]:
    study, why = gap.study, gap.why
    result = study.result
    labels = list(dict.fromkeys(result.labels))
    figures = [
        FigureOnPage(anchor, drawing)
        for anchor, drawing in (
            ("pairs", draw_gap_pairs(study)),
            ("differences", draw_gap_differences(study)),
            ("maps", draw_gap_maps(study)),
            ("replay", draw_gap_replay(study)),
        )
        if drawing is not None
    ]
    figure_of_why = None if why is None else FigureOnPage("why", draw_gap_why(why, study))
    number_figures([*figures, figure_of_why])
    content = {
        "version": __version__,
        "title": f"The gap from {result.source} to {result.target}",
        "labels": [(label, LABELS[label]) for label in labels],
        "verdict": result.verdict,
        "score": result.score,
        "facts": _facts(gap),
        "measures": _measures_table(
            "transfer",
            "Measures of the transfer gap.",
            [_row(result, each.name, each.title, each.meaning) for each in SHOWN],
        ),
        "apart": _measures_table(
            "apart", "Re-evolved gap, and luck of selection.", [_row(result, *each) for each in _APART]
        ),
        "advice": None if why is None else why.advice,
        "figures": figures,
        "why": figure_of_why,
        "controllers": _controllers_table(gap),
        "order": "" if gap.order is None else gap.order.to_toml(),
    }
    return content | hover_content(content)


def _facts(gap: GapBetween) -> list[tuple[str, str]]:
    study = gap.study
    result = study.result
    kinds = [each.kind for each in study.controllers]
    facts = [
        ("Simulator", f"{result.source} ({result.labels[0]}), {result.trials[0]} trials of each controller"),
        ("Target", f"{result.target} ({result.labels[1]}), {result.trials[1]} trials of each controller"),
        (
            "Controllers",
            f"{len(kinds)}: {kinds.count('random')} unrelated networks and {kinds.count('champion')} champions",
        ),
        ("Arena", study.arena.name),
        ("Score", result.score),
        (
            "Observed",
            _OBSERVED[study.observe],
        ),
    ]
    if result.misspecified is not None:
        facts.append(("Model", reproduces(result.misspecified)))
    return facts + [("Note", note) for note in result.notes]


def _row(result: GapResult, name: str, title: str, meaning: str) -> Row:
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


def _measures_table(name: str, caption: str, rows: Sequence[Row]) -> TableOnPage:
    columns = (
        *(Column("Measure"), Column("estimate", kind="median"), Column("interval"), Column("n"), Column("p")),
        Column("meaning", kind="text prose", head_kind="text"),
    )
    return TableOnPage(name, caption, columns, (Part(rows),))


def _controllers_table(gap: GapBetween) -> TableOnPage:
    study = gap.study
    sides = (study.source, study.target)
    rows = [
        (controller.name, *(f"{side.means[k]:.3f}" for side in sides))
        for k, controller in enumerate(study.controllers)
    ]
    columns = (Column("Controller"), *(Column(f"{side.label} {side.name}") for side in sides))
    caption = f"Mean {study.result.score} of each controller."
    return TableOnPage("controllers", caption, columns, (Part(rows),), kind="numbers")
