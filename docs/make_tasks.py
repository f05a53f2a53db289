"""The tasks beside coverage: the numbers of the page "Tasks".

    uv run python docs/make_tasks.py

Carries out `realitygap run` of each named study of a task in a temporary folder and writes docs/data/tasks.csv, one row
a condition. Takes 3 minutes on 2 cores.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import polars as pl

from realitygap import run_study
from realitygap.report import summarize_tasks
from realitygap.study import load_study

DATA = Path(__file__).parent / "data" / "tasks.csv"
STUDIES = ("avoid", "light", "wall", "goal")


def main() -> None:
    """Carry out all studies and write their summaries."""
    parts = []
    for name in STUDIES:
        print(name, flush=True)
        study = load_study(name)
        with tempfile.TemporaryDirectory() as folder:
            summary = summarize_tasks(run_study(study, out=Path(folder) / "out").folder)
        seed = pl.lit(study.about.seed, pl.Int64).alias("seed")
        parts.append(summary.with_columns(pl.lit(name).alias("study"), seed))
    pl.concat(parts).write_csv(DATA, float_precision=4)
    print(f"Written: {DATA}")


if __name__ == "__main__":
    main()
