"""The numbers and figures of the page "The paper, reproduced".

    uv run python docs/make_reproduced.py

Carries out `realitygap run paper` and `realitygap run examples/constant-input.toml` in a temporary folder and writes
docs/data/reproduced/*.csv and docs/images/reproduced/*.svg: tables and figures of the paper's report, figures of single
runs, the place of each value that the paper prints among our runs, the mistakes in these values, and the effect of the
constant input. The last also with more runs, and with the NEAT settings of an old neat-python.
"""

from __future__ import annotations

import csv
import io
import shutil
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import polars as pl
from paper_audit import audit_paper, spread_of_three
from written import write_files

from realitygap import ResultsFolder, run_study, write_report
from realitygap._wording import bracketed
from realitygap.report import compare_conditions, draw_individuals, draw_paths, save_drawing
from realitygap.report._comparisons import MARGIN, is_within, paired_values
from realitygap.report._tally import Tally, read_tally
from realitygap.stats import bca_interval, difference_of_means, holm

HERE = Path(__file__).parent
TABLES = HERE / "data" / "reproduced"
FIGURES = HERE / "images" / "reproduced"
INPUTS_STUDY = HERE.parent / "examples" / "constant-input.toml"
WANTED_TABLES = (
    "table-results",
    "table-fresh",
    "table-comparisons",
    "table-plateaus",
    "table-champions",
    "table-spread",
    "table-variety",
    "table-chance",
    "structures",
)
WANTED_FIGURES = {
    "figure-4": "figure-coverage",
    "figure-5": "figure-individuals-coverage",
    "figure-7": "figure-networks",
}
"""Names of the page's figures, which are the paper's numbers, and those of the report's files."""
RUNS = {"figure-6a": (draw_paths, "coverage-10"), "figure-8": (draw_individuals, "novelty-50")}
"""Figures of single runs, each with its condition."""

CELLS = 72
NEAT_SETS = ("rosenzweig-remy", "rosenzweig-remy-neat-python")
RUNS_OF_SETS = 1000
INPUTS = {
    "novelty only, as in the paper": ("with", "without"),
    "neither search": ("without", "without"),
    "both searches": ("with", "with"),
}
"""Which search has the constant input: endings of the names of the conditions of novelty and coverage."""


def make(folder: Path) -> tuple[dict[str, str], dict[str, str]]:
    """The tables and figures of the page, by file name; everything is written below `folder`."""
    result = run_study("paper", folder / "paper")
    write_report(result.folder, figures=folder / "figures")
    for number, (draw, condition) in RUNS.items():
        save_drawing(draw(result.folder, condition), folder / "figures" / f"{number}.svg")
    inputs = run_study(INPUTS_STUDY, folder / "inputs")
    tables = {
        f"{name}.csv": (folder / "figures" / f"{name}.csv").read_text("utf-8") for name in WANTED_TABLES
    }
    tables |= {"published.csv": published(result.folder), "constant-input.csv": comparisons(inputs.folder)}
    tables["neat-sets.csv"] = neat_sets({name: _with_settings(name, folder) for name in NEAT_SETS})
    tables |= {"table-audit.csv": audit(), "robot-spread.csv": robot_spread(result.folder)}
    figures = {
        f"{number}.svg": (folder / "figures" / f"{name}.svg").read_text("utf-8")
        for number, name in (WANTED_FIGURES | {name: name for name in RUNS}).items()
    }
    return tables, figures


def published(folder: ResultsFolder) -> str:
    """Where each value that the paper prints lies among our runs of that noise, selection and count of cells."""
    rows = []
    for condition in folder.description["conditions"]:
        frame = folder.read(condition["name"], columns=["replicate", "coverage_line", "coverage_ends"])
        best = frame.group_by("replicate").agg(pl.col("coverage_line", "coverage_ends").max())
        for value in condition.get("published") or ():
            cells = round(value * CELLS)
            counts = [
                int((np.rint(best[column].to_numpy() * CELLS) <= cells).sum())
                for column in ("coverage_line", "coverage_ends")
            ]
            rows.append([condition["name"], f"{value:.3f}", cells, best.height, *counts])
    return _csv(
        [
            "Condition",
            "The paper",
            f"nearest k of {CELLS}",
            "n",
            "our runs at or below it: along the line",
            "our runs at or below it: ends of steps",
        ],
        rows,
    )


def audit() -> str:
    """The inconsistencies of the numbers that the paper prints."""
    rows = [[each.section, each.printed, each.found, each.bearing] for each in audit_paper()]
    return _csv(["Section", "Printed", "Computed", "Consequence"], rows)


def robot_spread(folder: ResultsFolder) -> str:
    """How often three of our runs spread as far as the robot's three, by chance."""
    head = [
        "Condition",
        "three runs spread as far as the robot's",
        "of two threes, one spreads 3.5 times as far",
    ]
    return _csv(head, map(list, spread_of_three(read_tally(folder))))


def comparisons(folder: ResultsFolder) -> str:
    """Differences between conditions in selection or input alone, corrected over all comparisons of the study."""
    rows = [
        [
            each.one,
            each.other,
            each.n,
            _signed(each.size),
            bracketed(each.difference, signs=True),
            f"{each.p_holm:.2g}" if each.p_holm >= 1e-4 else "< 0.0001",
            each.difference_verdict.partition(":")[0],
            "" if each.is_shown else each.equivalence,
        ]
        for each in compare_conditions(folder)
        if each.reason in ("selection", "baseline")
    ]
    head = [
        "First",
        "Second",
        "n",
        "difference",
        "95 % interval",
        "p (Holm)",
        "Conclusion",
        "Equivalence",
    ]
    return _csv(head, rows)


def _with_settings(name: str, folder: Path) -> Tally:
    """Both searches with and without the constant input, by a named set of NEAT settings."""
    file = folder / f"{name}.toml"
    file.write_text(f'{INPUTS_STUDY.read_text("utf-8")}\n[neat]\nsettings = "{name}"\n', "utf-8")
    return read_tally(run_study(file, folder / name, replicates=RUNS_OF_SETS).folder)


def neat_sets(tallies: dict[str, Tally]) -> str:
    """Difference of novelty and coverage by NEAT settings, inputs, and noise; p corrected over all rows."""
    rows, chances = [], []
    for settings, tally in tallies.items():
        for inputs, (novelty, coverage) in INPUTS.items():
            for level in (10, 50, 80):
                pair = paired_values(tally, f"novelty-{level}-{novelty}", f"coverage-{level}-{coverage}")
                interval = bca_interval(difference_of_means, pair.one, pair.other, paired=True)
                within = pair.equivalence_interval()
                difference = float((pair.one - pair.other).mean())
                chances.append(pair.p())
                row = [
                    settings,
                    inputs,
                    f"{level} %",
                    len(pair.one),
                    _signed(difference),
                    bracketed(interval, signs=True),
                ]
                rows.append(
                    [*row, bracketed(within, signs=True), "yes" if is_within(within) else "not shown"]
                )
    corrected = [f"{p:.2g}" if p >= 1e-4 else "< 0.0001" for p in holm(np.array(chances))]
    lines = [[*row[:6], p, *row[6:]] for row, p in zip(rows, corrected, strict=True)]
    head = [
        "NEAT settings",
        "constant input",
        "noise",
        "n",
        "novelty − coverage",
        "95 % interval",
        "p (Holm)",
    ]
    return _csv([*head, "90 % interval", f"equivalent within ±{MARGIN:g}"], lines)


def _signed(value: float) -> str:
    return f"{value:+.3f}".replace("-", "−")


def _csv(head: list[str], rows: Iterable[list[object]]) -> str:
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows([head, *rows])
    return file.getvalue()


def main() -> None:
    """Make them and write both folders anew."""
    with tempfile.TemporaryDirectory() as temporary:
        for target, files in zip((TABLES, FIGURES), make(Path(temporary)), strict=True):
            shutil.rmtree(target, ignore_errors=True)
            write_files({target / name: text for name, text in files.items()})


if __name__ == "__main__":
    main()
