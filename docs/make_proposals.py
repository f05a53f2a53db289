"""The studies that the paper proposes: the tables and figures of the page "What the paper proposes".

    uv run python docs/make_proposals.py [NAME ...]      # all: some two minutes

Carries out each study in a temporary folder and writes docs/data/proposals/NAME.csv, in which every condition is
compared with the one that its study names as baseline, and docs/images/proposals/NAME.svg.
"""

from __future__ import annotations

import argparse
import csv
import io
import tempfile
from pathlib import Path

import polars as pl
from written import write_files

from realitygap import ResultsFolder, run_study
from realitygap.report import compare_choices, compare_conditions, draw_choices
from realitygap.stats import Ends

HERE = Path(__file__).parent
TABLES = HERE / "data" / "proposals"
FIGURES = HERE / "images" / "proposals"
STUDIES = ("bodies", "contact", "noise", "drift", "turn", "steps", "complexity")
HEAD = ["Condition", "change", "n", "median", "95 % interval", "mean less baseline’s", "95 % interval", "A12"]
HEAD += ["95 % interval", "nodes of the best"]


def table(folder: ResultsFolder) -> str:
    """One row for each condition: its best coverage of a run, that less its baseline's, and the networks' size."""
    compared = {(each.one, each.other): each for each in compare_conditions(folder)}
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(HEAD)
    for group in compare_choices(folder):
        for choice in group:
            row = [choice.condition, "" if choice.condition == choice.baseline else choice.change, choice.n]
            row += [f"{choice.median:.3f}", _span(choice.interval, ".3f")]
            each = compared.get((choice.condition, choice.baseline))
            if each is not None:
                row += [_signed(each.size), _span(each.difference.ends, "+.3f")]
                row += [f"{each.a12.value:.3f}", _span(each.a12.ends, ".3f")]
            writer.writerow([*row, *[""] * (9 - len(row)), f"{_nodes(folder, choice.condition):.2f}"])
    return file.getvalue()


def _nodes(folder: ResultsFolder, condition: str) -> float:
    """Nodes of the network that covered most in a run, the first one of equals, averaged over runs."""
    rows = folder.read(condition, columns=["replicate", "generation", "individual", "coverage_line", "nodes"])
    best = rows.sort("coverage_line", "generation", "individual", descending=[True, False, False])
    return float(best.group_by("replicate").agg(pl.col("nodes").first())["nodes"].mean())


def _signed(value: float) -> str:
    return f"{value:+.3f}".replace("-", "−")


def _span(interval: Ends | None, form: str) -> str:
    return " to ".join(f"{end:{form}}".replace("-", "−") for end in interval or ())


def main() -> None:
    """Run the studies and write their tables and figures."""
    parser = argparse.ArgumentParser(description="Tables and figures of the studies that the paper proposes.")
    parser.add_argument("studies", nargs="*", default=STUDIES, metavar="NAME", help=", ".join(STUDIES))
    for name in parser.parse_args().studies:
        with tempfile.TemporaryDirectory() as temporary:
            folder = run_study(name, Path(temporary) / name).folder
            write_files(
                {
                    TABLES / f"{name}.csv": table(folder),
                    FIGURES / f"{name}.svg": draw_choices(folder).svg + "\n",
                }
            )


if __name__ == "__main__":
    main()
