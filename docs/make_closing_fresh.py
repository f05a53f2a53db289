"""The study of fresh twins: tables, figure and sentences of its section on the page "Closing the gap".

    uv run python docs/make_closing_fresh.py results/closing-the-gap-fresh
    uv run python docs/make_closing_fresh.py    # without results: from the stored data
    uv run python docs/make_closing_fresh.py results/again --again    # beside the stored results of the same twins

With results of `realitygap closing-the-gap --plan fresh`, complete or not, it writes summary.json. Tables, sentences,
and the figure follow from it. The study takes an hour on two cores and is not run here.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from make_closing import csv_of, done_parts, results_in, table, verdicts
from written import write_files

from realitygap.report import draw_closing, goal_table, not_counted
from realitygap.stats import Estimate, median_interval
from realitygap.study._closing.summary import KINDS, pooled_fall

HERE = Path(__file__).parent
TABLES = HERE / "data" / "closing-fresh"
FIGURES = HERE / "images" / "closing-fresh"
FALL_HEAD = (
    "observed",
    "kind",
    "numbers",
    "RMS gap before",
    "after",
    "fall",
    "95 %, twins",
    "pooled fall",
    "95 %, seeds",
)
AGAIN_HEAD = (
    "numbers",
    "twins",
    "RMS gap, fit then",
    "fall",
    "95 %, twins",
    "RMS gap, fit now",
    "fall",
    "95 %, twins",
)
DRAWS, ESTIMATE, RECOMMENDED = "samples of the posterior", "estimate", "recommended"

Summary = dict[str, Any]


def words(summary: Summary) -> str:
    """Return how much of the study is done, and which goals are met, as paragraphs of Markdown."""
    plan = summary["plan"]
    size = (
        f"{plan['twins']} twins of each family, seeds from {plan['first_seed']} on. {done_parts(summary)} "
        f"{summary['n_counted']} of {len(summary['twins'])} twins count: they differ from the uncalibrated simulator "
        "by more than three standard errors."
    )
    return "\n\n".join([size, *verdicts(summary), *not_counted(summary)]) + "\n"


def fall_table(summary: Summary) -> Iterable[Sequence[str]]:
    """Yield the fall of the RMS gap by observation, kind of controller and numbers, as `FALL_HEAD`.

    The pooled fall is that of the root of the mean square over all twins. Its interval is over seeds: the twins of a
    seed share their controllers.
    """
    for observe in summary["plan"]["observations"]:
        twins = [(twin, after) for twin in summary["twins"] if (after := _after(summary, twin, observe))]
        rows = [
            ("all", numbers, [(twin["rms"], _gap_with(numbers, twin, after)) for twin, after in twins])
            for numbers in (DRAWS, ESTIMATE, RECOMMENDED)
        ]
        for kind in KINDS:
            pairs = [(twin["parts"][kind], after["parts"][kind]) for twin, after in twins]
            rows.append((kind, DRAWS, pairs))
        seeds = [twin["twin"].rpartition("-")[2] for twin, _ in twins]
        for kind, numbers, pairs in rows:
            figures = _fall([(a["estimate"], b["estimate"]) for a, b in pairs], seeds)
            yield (observe, kind, numbers, *figures)


def again_table(stored: Summary, again: Summary) -> Iterable[Sequence[str]]:
    """Yield `AGAIN_HEAD` for the twins that were measured again with crossed cells, with a later fit."""
    twins = {twin["twin"]: twin for twin in stored["twins"]}
    pairs = [
        (twin, before, after)
        for twin in again["twins"]
        if (after := _after(again, twin, "cells"))
        if (before := _after(stored, twins[twin["twin"]], "cells"))
    ]
    for numbers in (DRAWS, ESTIMATE, RECOMMENDED):
        figures = []
        for fit in (1, 2):
            gaps = [(pair[0]["rms"], _gap_with(numbers, pair[0], pair[fit])) for pair in pairs]
            falls = [1 - after["estimate"] / before["estimate"] for before, after in gaps]
            figures += [
                f"{median_interval([b['estimate'] for _, b in gaps]).value:.3f}",
                *_span(median_interval(falls)),
            ]
        yield (numbers, str(len(pairs)), *figures)


def _gap_with(numbers: str, twin: Summary, after: Summary) -> Summary:
    """Return the RMS gap of a calibrated simulator with some of its numbers."""
    found: Summary = {
        DRAWS: after["rms_draws"],
        ESTIMATE: after["rms_point"],
        RECOMMENDED: _recommended(twin, after),
    }[numbers]
    return found


def _recommended(twin: Summary, after: Summary) -> Summary:
    """Return the RMS gap with the numbers that a calibration recommends."""
    found: Summary = {
        "fitted": after["rms_point"],
        "draws of the posterior": after["rms_draws"],
        "nominal numbers": twin["rms"],
    }[after["recommended"]]
    return found


def _fall(pairs: Sequence[tuple[float, float]], seeds: Sequence[str]) -> Sequence[str]:
    """Return the medians before and after, the median fall, and the pooled fall, with their intervals."""
    before, after = zip(*pairs, strict=True)
    over_twins = median_interval([1 - b / a for a, b in pairs if a])
    squares: dict[str, list[tuple[float, float]]] = {}
    for seed, (a, b) in zip(seeds, pairs, strict=True):
        squares.setdefault(seed, []).append((a * a, b * b))
    roots = [
        [(sum(each) / len(rows)) ** 0.5 for each in zip(*rows, strict=True)] for rows in squares.values()
    ]
    pooled = pooled_fall([a for a, _ in roots], [b for _, b in roots])
    medians = [median_interval(values).value for values in (before, after)]
    spans = [_span(figure) for figure in (over_twins, pooled)]
    return (*(f"{value:.3f}" for value in medians), *spans[0], *spans[1])


def _span(figure: Estimate) -> tuple[str, str]:
    """Return a share and its interval in percent."""
    interval = "–" if figure.ends is None else f"{_percent(figure.low)} to {_percent(figure.high)} %"
    return f"{_percent(figure.value)} %", interval


def _percent(value: float) -> str:
    return f"{100 * value:.0f}".replace("-", "−")


def _after(summary: Summary, twin: Summary, observe: str) -> Summary | None:
    """Return the gap of a twin after the calibration by which goals are judged."""
    rows: list[Summary] = twin["calibrated"]
    return next(
        (row for row in rows if (row["observe"], row["budget"]) == (observe, summary["budget"])), None
    )


def texts(summary: Summary) -> dict[Path, str]:
    """Return the files that follow from a summary."""
    return {
        TABLES / "words.md": words(summary),
        TABLES / "goals.csv": csv_of(goal_table(summary)),
        TABLES / "falls.csv": table(FALL_HEAD, fall_table(summary)),
        FIGURES / "scatter.svg": draw_closing(summary)["scatter"].svg + "\n",
    }


def stored_summary() -> Summary:
    """Return the summary that the section was last made from."""
    found: Summary = json.loads((TABLES / "summary.json").read_text("utf-8"))
    return found


def main() -> None:
    """Write the data, tables, sentences and figure of the section."""
    parser = argparse.ArgumentParser(description="Tables, figure and sentences of the study of fresh twins.")
    parser.add_argument(
        "folder", type=Path, nargs="?", help="results of `realitygap closing-the-gap --plan fresh`"
    )
    parser.add_argument(
        "--again", action="store_true", help="compare them with the stored results; keep these"
    )
    options = parser.parse_args()
    if options.again:
        if options.folder is None:
            parser.error("--again needs a folder of results")
        again = results_in(options.folder)
        tables = {
            "again.csv": table(AGAIN_HEAD, again_table(stored_summary(), again)),
            "again-goals.csv": csv_of(goal_table(again)),
        }
        write_files({TABLES / name: text for name, text in tables.items()})
        return
    folder = options.folder
    summary = stored_summary() if folder is None else results_in(folder)
    files = {TABLES / "summary.json": json.dumps(summary, separators=(",", ":")) + "\n", **texts(summary)}
    write_files(files)


if __name__ == "__main__":
    main()
