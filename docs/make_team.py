"""Several robots in one arena: the table and the pictures of the page "Evolve several robots in one arena".

    uv run python docs/make_team.py            # some 20 seconds

Runs `realitygap run examples/several-robots.toml` in a temporary folder, and writes docs/data/team.csv and
docs/images/team/*.svg.
"""

from __future__ import annotations

import csv
import io
import tempfile
from pathlib import Path

from realitygap import run_study
from realitygap.report import draw_choices, draw_trial, summarize

HERE = Path(__file__).parent
STUDY = HERE.parent / "examples" / "several-robots.toml"
TABLE = HERE / "data" / "team.csv"
FIGURES = HERE / "images" / "team"
NETWORKS = {"alike": "one for all", "mixed": "one each", "robot": ""}


def make(folder: Path) -> tuple[str, dict[str, str]]:
    """Return the table and the figures by file name; the study is run below `folder`."""
    results = run_study(STUDY, folder / "several-robots").folder
    figures = {"coverage.svg": draw_choices(results), "trial.svg": draw_trial(results, "four-alike")}
    return table(results), {name: drawing.svg + "\n" for name, drawing in figures.items()}


def table(results: object) -> str:
    """Return the best coverage of a run, of each condition."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["Robots", "Networks", "Coverage", "Its interval"])
    for row in summarize(results).iter_rows(named=True):
        number, _, kind = row["condition"].partition("-")
        median, low, high = (f"{row[f'line_{name}']:.3f}" for name in ("median", "low", "high"))
        writer.writerow([number, NETWORKS[kind], median, f"{low} to {high}"])
    return text.getvalue()


def main() -> None:
    """Write the table and the pictures."""
    with tempfile.TemporaryDirectory() as folder:
        rows, figures = make(Path(folder))
    TABLE.write_text(rows, "utf-8")
    FIGURES.mkdir(exist_ok=True)
    for name, svg in figures.items():
        (FIGURES / name).write_text(svg, "utf-8")


if __name__ == "__main__":
    main()
