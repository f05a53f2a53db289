"""The page of `closing-the-gap`, and its tables: goals, families, and reasons for missed goals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from realitygap._version import __version__
from realitygap._wording import GOAL_VERDICTS, number
from realitygap.records import write_whole
from realitygap.report._closing_figures import draw_closing, words_of
from realitygap.report._placed import FigureOnPage, hover_content, number_figures
from realitygap.report._table import Column, Part, Row, TableOnPage
from realitygap.report._template import render_page
from realitygap.study import ClosingSummary, GoalRow

_RATIOS = ("SRCC", "MMRV")

SELECTION_NOTE = (
    "These twins were selected by their gap before calibration, so luck is part of its fall. The table of families has "
    "the median RMS gap over all twins. The smallest fall of a family is the smallest of several, so luck is part of "
    "it too."
)
"""Limit of goals whose twins a measured gap selected."""


def write_closing_page(summary: ClosingSummary, out: str | Path) -> Path:
    """Write the page: one HTML file that needs no other file and no network.

    Args:
        summary: Result of `summarize_closing`.
        out: The file.

    Raises:
        RecordError: It cannot be written.
    """
    figures = [FigureOnPage(f"figure-{name}", drawing) for name, drawing in draw_closing(summary).items()]
    number_figures(figures)
    content = {
        "version": __version__,
        "n_done": summary["n_done"],
        "n_units": summary["n_units"],
        "n_counted": summary["n_counted"],
        "n_twins": len(summary["twins"]),
        "words": words_of(summary),
        "selection_note": SELECTION_NOTE,
        "is_of_twins": not summary["plan"].get("platforms"),
        "goals": goal_table(summary),
        "not_counted": not_counted(summary),
        "why": why_table(summary),
        "families": family_table(summary),
        "figures": figures,
    }
    page = render_page("closing.html.jinja", content | hover_content(content))
    path = Path(out)
    write_whole(path, page.encode())
    return path


def goal_table(summary: ClosingSummary) -> TableOnPage:
    """Return a table with one row per goal; a goal that the interval does not decide is open."""
    heads = ("goal", "wanted", "figure", "95 % interval", "twins", "verdict")
    rows = [
        (
            goal["name"],
            f"{goal['sense']} {_plain(goal, goal['goal'])}",
            _plain(goal, goal["figure"]),
            _span(goal["low"], goal["high"], partial(_plain, goal)),
            _counted(goal),
            GOAL_VERDICTS[goal["met"]] if goal["n"] else "–",
        )
        for goal in summary["goals"]
    ]
    return _table("goals", "Goals and verdicts.", heads, rows)


def not_counted(summary: ClosingSummary) -> list[str]:
    """A sentence for each goal that not all twins are judged by: how many are, and why the others are not."""
    sentences = []
    for goal in summary["goals"]:
        reasons = [f"{each['twin']} is not: {each['why']}" for each in goal["unknown"]]
        if reasons:
            sentences.append(f"{goal['name']}: {_counted(goal)} twins are judged. {'; '.join(reasons)}.")
    return sentences


def why_table(summary: ClosingSummary) -> TableOnPage:
    """Return a table of the twins that miss a goal."""
    rows: list[tuple[str, ...]] = []
    for goal in summary["goals"]:
        if goal["met"] is False:
            for each in goal["why"]:
                p = each.get("misspecification_p")
                rows.append(
                    (
                        goal["name"],
                        each["twin"],
                        _plain(goal, each["figure"]),
                        "–" if p is None else "< 0.001" if p < 0.001 else f"{p:.3f}",
                        ", ".join(each.get("at_prior_end", [])) or "–",
                    )
                )
    heads = ("goal", "twin", "figure", "p", "at an end")
    return _table("why", "Twins that miss a goal.", heads, rows, kind="text")


def family_table(summary: ClosingSummary) -> TableOnPage:
    """Return a table of the RMS gap by family, observation, and budget."""
    heads = (
        *("family", "observed", "trials", "twins", "RMS gap", "95 % interval"),
        *("twins that count", "fall"),
    )
    rows = [
        (
            row["family"],
            "–" if row["observe"] == "none" else row["observe"],
            str(row["budget"]),
            str(row["n"]),
            number(row["rms"]["estimate"]),
            _span(row["rms"]["low"], row["rms"]["high"], number),
            str(row["n_counted"]),
            "–" if row["observe"] == "none" else _percent(row["fall"]["estimate"]),
        )
        for row in summary["families"]
    ]
    return _table("families", "RMS gap by family, observation, and budget.", heads, rows)


def twin_table(summary: ClosingSummary) -> TableOnPage:
    """Return a table of the twins, and whether they count."""
    rows = [
        (
            row["twin"],
            number(row["rms"]["estimate"]),
            number(row["standard_error"]),
            "yes" if row["counts"] else "no",
        )
        for row in summary["twins"]
    ]
    heads = ("twin", "RMS gap as it is", "standard error", "counts")
    return _table("twins", "Twins, and whether they count.", heads, rows)


def strategy_table(summary: ClosingSummary) -> TableOnPage:
    """Return a table of coverage on the twins by strategy."""
    rows = [
        (row["strategy"], str(row["n"]), number(row["estimate"]), _span(row["low"], row["high"], number))
        for row in summary["strategies"]
    ]
    heads = ("strategy", "twins", "coverage on the twin", "95 % interval")
    return _table("strategies", "Coverage on the twins by strategy.", heads, rows)


def _table(name: str, caption: str, heads: Sequence[str], rows: Sequence[Row], kind: str = "") -> TableOnPage:
    columns = (Column(heads[0]), *(Column(head, kind=kind) for head in heads[1:]))
    return TableOnPage(name, caption, columns, (Part(rows),), kind="numbers")


def _counted(goal: GoalRow) -> str:
    """Return the number of twins that a goal is judged by, and their total if some are unknown."""
    n, n_unknown = goal["n"], len(goal["unknown"])
    return f"{n} of {n + n_unknown}" if n_unknown else str(n)


def _plain(goal: GoalRow, value: float | None) -> str:
    """A figure of a goal: a share in percent, but correlations and ratios as they are."""
    if any(word in goal["name"] for word in _RATIOS):
        return "–" if value is None else f"{value:.2f}"
    return _percent(value)


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.0f} %".replace("-", "−")


def _span(low: float | None, high: float | None, form: Callable[[float], str]) -> str:
    return "–" if low is None or high is None else f"{form(low)} to {form(high)}"
