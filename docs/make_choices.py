"""What each choice that the paper leaves open changes: the numbers and the figure of the page "Choices".

    uv run python docs/make_choices.py

Carries out `realitygap run paper-choices` in a temporary folder and writes docs/data/choices.csv, from which the
page's table is made, and docs/images/choices.svg, the figure of its report.
"""

from __future__ import annotations

import csv
import io
import tempfile
from pathlib import Path

from written import write_files

from realitygap import ResultsFolder, run_study
from realitygap.report import compare_choices, draw_choices

HERE = Path(__file__).parent
DATA = HERE / "data" / "choices.csv"
FIGURE = HERE / "images" / "choices.svg"
COLUMNS = ["condition", "baseline", "change", "n", "median", "low", "high", "effect"]


def table(folder: ResultsFolder) -> str:
    """One row for each condition that is compared, and for each it is compared with."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    for group in compare_choices(folder):
        for choice in group:
            low, high = choice.interval or ("", "")
            numbers = [f"{value:.3f}" for value in (choice.median, low, high)]
            effect = f"{choice.effect:+.3f}".replace("-", "−")
            writer.writerow([choice.condition, choice.baseline, choice.change, choice.n, *numbers, effect])
    return file.getvalue()


def main() -> None:
    """Run the study and write both."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = run_study("paper-choices", Path(temporary) / "paper-choices").folder
        write_files({DATA: table(folder), FIGURE: draw_choices(folder).svg + "\n"})


if __name__ == "__main__":
    main()
