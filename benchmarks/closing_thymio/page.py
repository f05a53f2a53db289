"""The data of the page "Closing the gap to a Thymio": tables, sentences, and figures."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from realitygap._wording import number
from realitygap.records import write_whole

from .figures import drawings
from .summary import Row, after_of, summarize

DOCS = Path(__file__).parents[2] / "docs"
TABLES = DOCS / "data" / "closing-thymio"
FIGURES = DOCS / "images" / "closing-thymio"
NOTHING = "–"
VERDICTS = {True: "met", False: "missed", None: "open"}

Texts = Iterable[Sequence[str]]


def write_page(folder: Path | None, *, is_of_playground: bool) -> None:
    """Write the data of the page.

    Args:
        folder: Results of the study; None for the stored summary.
        is_of_playground: Whether they are of the plan `playground`, which two tables are about.
    """
    place = TABLES / "playground" if is_of_playground else TABLES
    summary = stored(place) if folder is None else summarize(folder)
    files = {place / name: text for name, text in tables(summary, is_of_playground=is_of_playground).items()}
    if not is_of_playground:
        files |= {FIGURES / f"{name}.svg": each.svg + "\n" for name, each in drawings(summary).items()}
    for path, text in files.items():
        write_whole(path, text.encode())
        print(path)


def stored(place: Path) -> Row:
    """Return the summary that the page was last made from."""
    found: Row = json.loads((place / "summary.json").read_text("utf-8"))
    return found


def tables(summary: Row, *, is_of_playground: bool) -> dict[str, str]:
    """Return the tables and sentences by file name."""
    found = {
        "goals.csv": _csv(goals(summary)),
        "sittings.csv": _csv(sittings(summary)),
        "summary.json": json.dumps(summary, separators=(",", ":")) + "\n",
    }
    if not is_of_playground:
        found |= {
            "budgets.csv": _csv(budgets(summary)),
            "residuals.csv": _csv(residuals(summary)),
            "words.md": words(summary),
        }
    return found


def _csv(rows: Texts) -> str:
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows(rows)
    return file.getvalue()


def goals(summary: Row) -> Texts:
    """Yield a table with a row for each goal; a goal that the interval does not decide is open."""
    yield "goal", "wanted", "figure", "95 % interval", "sittings", "verdict"
    for goal in summary["goals"]:
        form = partial(number, digits=2) if "SRCC" in goal["name"] else _percent
        verdict = VERDICTS[goal["met"]] if goal["n"] else NOTHING
        wanted = f"{goal['sense']} {form(goal['goal'])}"
        yield goal["name"], wanted, form(goal["figure"]), _span(goal, form), str(goal["n"]), verdict


def budgets(summary: Row) -> Texts:
    """Yield a table of the RMS gap by robot, observation level, and budget."""
    yield "robot", "observed", "trials", "sittings", "RMS gap", "95 % interval"
    for row in summary["families"]:
        yield (
            row["family"],
            NOTHING if row["observe"] == "none" else row["observe"],
            str(row["budget"]),
            str(row["n"]),
            number(row["rms"]["estimate"]),
            _span(row["rms"], number),
        )


def _calibrated(summary: Row) -> Iterable[tuple[Row, Row]]:
    """Yield each sitting with each calibration at the budget of the goals."""
    for sitting in summary["twins"]:
        for after in sitting["calibrated"]:
            if after["budget"] == summary["budget"]:
                yield sitting, after


def sittings(summary: Row) -> Texts:
    """Yield a table of each sitting and calibration at the budget of the goals."""
    yield (
        *("sitting", "RMS gap before", "observed", "recommended", "RMS gap calibrated", "fall", "p"),
        "at an end of the prior",
    )
    for sitting, after in _calibrated(summary):
        yield (
            sitting["twin"],
            number(sitting["rms"]["estimate"]),
            after["observe"],
            after["recommended"] or NOTHING,
            number(after["rms"]["estimate"]),
            _percent(after["fall"]),
            number(after["misspecification_p"]),
            ", ".join(after["at_prior_end"]) or NOTHING,
        )


def residuals(summary: Row) -> Texts:
    """Yield a table of errors of predicted mean coverage by kind of controller and by how much it touches walls.

    A controller touches more if its share of stalled steps is above the median over the sittings of its robot.
    """
    yield "robot", "simulator", "controllers", "touching", "n", "mean error", "RMS error"
    n_random = summary["plan"]["controllers"] // 2
    for family in summary["plan"]["families"]:
        own = [each for each in summary["twins"] if each["family"] == family]
        if not own:
            continue
        stalled = np.concatenate([each["stalled"] for each in own])
        is_random = np.concatenate([np.arange(len(each["stalled"])) < n_random for each in own])
        touches = stalled > np.median(stalled)
        for name, errors in _errors(summary, own).items():
            for kind, of_kind in (("random", is_random), ("champions", ~is_random)):
                for amount, of_amount in (("less", ~touches), ("more", touches)):
                    part = errors[of_kind & of_amount]
                    if len(part):
                        figures = (float(np.mean(part)), float(np.sqrt(np.mean(part**2))))
                        yield family, name, kind, amount, str(len(part)), *map(number, figures)


def _errors(summary: Row, own: Sequence[Row]) -> dict[str, NDArray[np.float64]]:
    """Return simulated less true mean coverage of all controllers, as it is and by each calibration of all sittings."""
    means = {"as it is": [each["means"] for each in own]}
    for observe in summary["plan"]["observations"]:
        rows = [after_of(each, observe, summary["budget"]) for each in own]
        if None not in rows:
            means[f"calibrated, {observe}"] = [row["means"] for row in rows if row is not None]
    return {
        name: np.concatenate([np.subtract(each["source"], each["target"]) for each in rows])
        for name, rows in means.items()
    }


def words(summary: Row) -> str:
    """Return how much of the study is done, and which goals are met, as paragraphs of Markdown."""
    plan = summary["plan"]
    sizes = ", ".join(
        f"{plan['fewer'].get(family, plan['twins'])} with `{family}`" for family in plan["families"]
    )
    parts = [f"Sittings: {sizes}. {done_parts(summary)}"]
    for met, word in ((True, "Met"), (None, "Open"), (False, "Missed")):
        names = [goal["name"] for goal in summary["goals"] if goal["met"] is met]
        parts.append("\n".join([f"{word}:", "", *(f"* {name}" for name in names or ["none"])]))
    for observe in plan["observations"]:
        found = [after for _, after in _calibrated(summary) if after["observe"] == observe]
        flagged = sum(after["misspecified"] for after in found)
        rare = sum((after["misspecification_p"] or 0) < 0.05 for after in found)
        parts.append(
            f"The posterior predictive check flags {flagged} of {len(found)} calibrations by {summary['budget']} "
            f"trials with `{observe}`. Its p is below 0.05 for {rare} of them."
        )
    return "\n\n".join(parts) + "\n"


def done_parts(summary: Row) -> str:
    """Return how much of the study is done, as a sentence."""
    if summary["n_done"] == summary["n_units"]:
        return "All parts of the study are done."
    return f"**{summary['n_done']} of {summary['n_units']} parts of the study are done**; all figures are of these."


def _percent(value: float | None) -> str:
    return NOTHING if value is None else f"{100 * value:.0f} %".replace("-", "−")


def _span(row: Row, form: Callable[[float], str]) -> str:
    return NOTHING if row["low"] is None else f"{form(row['low'])} to {form(row['high'])}"
