"""The study of a Thymio in other simulators: tables, figures and sentences of the page "Closing the gap to a Thymio".

    uv run python docs/make_closing_thymio.py results/closing-the-gap-thymio
    uv run python docs/make_closing_thymio.py results/closing-the-gap-playground --playground
    uv run python docs/make_closing_thymio.py    # without results: tables and sentences from the stored data

With results of `realitygap closing-the-gap --plan thymio`, complete or not, it writes the data of the page:
summary.json, with the mean coverage of each held-out controller. Tables, sentences, and figures follow from it. With
--playground, the results are those of the plan `playground`, and two tables follow. Each study takes an hour and is not
run here.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from make_closing import csv_of, done_parts, results_in, table, verdicts
from numpy.typing import NDArray
from written import write_files

from realitygap.report import draw_closing, family_table, goal_table

HERE = Path(__file__).parent
TABLES = HERE / "data" / "closing-thymio"
FIGURES = HERE / "images" / "closing-thymio"
SITTING_HEAD = (
    "sitting",
    "RMS gap as it is",
    "observed",
    "recommended",
    "RMS gap calibrated",
    "fall",
    "p",
    "at an end of the prior",
)
RESIDUAL_HEAD = ("robot", "simulator", "controllers", "touching", "n", "mean error", "RMS error")

Summary = Mapping[str, Any]
Values = NDArray[np.float64]


def words(summary: Summary) -> str:
    """Return how much of the study is done, and which goals are met, as paragraphs of Markdown."""
    plan = summary["plan"]
    sizes = ", ".join(
        f"{plan['fewer'].get(family, plan['twins'])} with `{family}`" for family in plan["families"]
    )
    return (
        "\n\n".join([f"Sittings: {sizes}. {done_parts(summary)}", *verdicts(summary), *_flagged(summary)])
        + "\n"
    )


def _flagged(summary: Summary) -> Iterable[str]:
    """Yield how many calibrations at the budget of the goals the posterior predictive check flags."""
    for observe in summary["plan"]["observations"]:
        found = [
            after
            for sitting in summary["twins"]
            for after in _at_goal(summary, sitting)
            if after["observe"] == observe
        ]
        flagged = sum(after["misspecified"] for after in found)
        rare = sum((after["misspecification_p"] or 0) < 0.05 for after in found)
        yield (
            f"The posterior predictive check flags {flagged} of {len(found)} calibrations by {summary['budget']} "
            f"trials with `{observe}`. Its p is below .05 for {rare} of them; their misfit is too small to be flagged."
        )


def sitting_table(summary: Summary) -> Iterable[Sequence[str]]:
    """Yield each sitting and calibration at the budget of the goals, in the columns of `SITTING_HEAD`."""
    for sitting in summary["twins"]:
        for after in _at_goal(summary, sitting):
            p = after["misspecification_p"]
            yield (
                sitting["twin"],
                _number(sitting["rms"]["estimate"]),
                after["observe"],
                after["recommended"] or "–",
                _number(after["rms"]["estimate"]),
                "–" if after["fall"] is None else f"{100 * after['fall']:.0f} %".replace("-", "−"),
                "–" if p is None else f"{p:.3f}",
                ", ".join(after["at_prior_end"]) or "–",
            )


def residual_table(summary: Summary) -> Iterable[Sequence[str]]:
    """Yield errors of predicted mean coverage by kind of controller and by how much it touches, as `RESIDUAL_HEAD`.

    A controller touches more if its share of stalled steps is above the median over the sittings of its robot.
    """
    n_random = summary["plan"]["controllers"] // 2
    for family in summary["plan"]["families"]:
        sittings = [each for each in summary["twins"] if each["family"] == family]
        if not sittings:
            continue
        stalled = np.concatenate([each["stalled"] for each in sittings])
        is_random = np.concatenate([np.arange(len(each["stalled"])) < n_random for each in sittings])
        touches = stalled > np.median(stalled)
        for name, errors in _errors(summary, sittings).items():
            for kind, of_kind in (("random", is_random), ("champions", ~is_random)):
                for amount, of_amount in (("less", ~touches), ("more", touches)):
                    part = errors[of_kind & of_amount]
                    if len(part):
                        figures = (np.mean(part), np.sqrt(np.mean(part**2)))
                        yield (family, name, kind, amount, str(len(part)), *map(_number, figures))


def _errors(summary: Summary, sittings: Sequence[Summary]) -> dict[str, Values]:
    """Return simulated less true mean coverage of all controllers, as it is and by each calibration."""
    means = {"as it is": [each["means"] for each in sittings]}
    for sitting in sittings:
        for after in _at_goal(summary, sitting):
            means.setdefault(f"calibrated, {after['observe']}", []).append(after["means"])
    return {
        name: np.concatenate([np.subtract(each["source"], each["target"]) for each in rows])
        for name, rows in means.items()
        if len(rows) == len(sittings)
    }


def _at_goal(summary: Summary, sitting: Summary) -> list[Summary]:
    return [each for each in sitting["calibrated"] if each["budget"] == summary["budget"]]


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}".replace("-", "−")


def main() -> None:
    """Write the data, tables, sentences and figures of the page."""
    parser = argparse.ArgumentParser(description="Tables, figures and sentences of the study of a Thymio.")
    parser.add_argument(
        "folder", type=Path, nargs="?", help="results of `realitygap closing-the-gap --plan thymio`"
    )
    parser.add_argument("--playground", action="store_true", help="results of the plan `playground`")
    options = parser.parse_args()
    place = TABLES / "playground" if options.playground else TABLES
    summary = (
        json.loads((place / "summary.json").read_text("utf-8"))
        if options.folder is None
        else results_in(options.folder)
    )
    files = {
        place / "goals.csv": csv_of(goal_table(summary)),
        place / "sittings.csv": table(SITTING_HEAD, sitting_table(summary)),
        place / "summary.json": json.dumps(summary, separators=(",", ":")) + "\n",
    }
    if not options.playground:
        files |= {
            place / "budgets.csv": csv_of(family_table(summary)),
            place / "residuals.csv": table(RESIDUAL_HEAD, residual_table(summary)),
            place / "words.md": words(summary),
        }
        files |= {
            FIGURES / f"{name}.svg": drawing.svg + "\n" for name, drawing in draw_closing(summary).items()
        }
    write_files(files)


if __name__ == "__main__":
    main()
