"""The numbers and figures of the page "The paper, reproduced".

    uv run python docs/make_reproduced.py

Carries out `realitygap run paper` in a temporary folder, writes its report with all figures and tables, and keeps
those that the page shows: docs/data/reproduced/*.csv and docs/images/reproduced/*.svg.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from realitygap import run_study, write_report

HERE = Path(__file__).parent
TABLES = HERE / "data" / "reproduced"
FIGURES = HERE / "images" / "reproduced"
WANTED_TABLES = ("table-2", "table-3", "table-4", "table-5", "table-7", "table-8", "table-9", "structures")
WANTED_FIGURES = ("figure-4", "figure-5", "figure-8", "figure-7")


def make(folder: Path) -> tuple[dict[str, str], dict[str, str]]:
    """The wanted tables and figures of the paper's study, by file name; everything is written below `folder`."""
    result = run_study("paper", folder / "paper")
    write_report(result.folder, figures=folder / "figures")
    tables = {
        f"{name}.csv": (folder / "figures" / f"{name}.csv").read_text("utf-8") for name in WANTED_TABLES
    }
    figures = {
        f"{name}.svg": (folder / "figures" / f"{name}.svg").read_text("utf-8") for name in WANTED_FIGURES
    }
    return tables, figures


def main() -> None:
    """Make them and write both folders anew."""
    with tempfile.TemporaryDirectory() as temporary:
        for target, files in zip((TABLES, FIGURES), make(Path(temporary)), strict=True):
            shutil.rmtree(target, ignore_errors=True)
            target.mkdir(parents=True)
            for name, text in files.items():
                (target / name).write_text(text, "utf-8")
                print(f"Written: {target / name}")


if __name__ == "__main__":
    main()
