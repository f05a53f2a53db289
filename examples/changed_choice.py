"""A study from Python: what does it change if the robot turns as far in a step as the real one does?

Shows how to build a study of two conditions that differ in one choice, carry it out, print its summary and the
difference of each pair of runs. Both conditions draw the same random numbers, so runs can be compared in pairs.

    uv run python examples/changed_choice.py
"""

import tempfile
from pathlib import Path

import polars as pl

from realitygap import Condition, Study, run_study, summarize
from realitygap.platforms import JyroPlatform
from realitygap.study import ConditionNotes, ReportSection, StudySection

RUNS = 200


def make_study() -> Study:
    """Selection by coverage at 50 % noise, with a turn of 0.1 and of 0.9 rad a step."""
    conditions = (
        Condition(name="turn-0.1", selection="coverage", noise=0.5),
        Condition(name="turn-0.9", selection="coverage", noise=0.5, jyro=JyroPlatform(turn_per_step=0.9)),
    )
    notes = (ConditionNotes(), ConditionNotes(baseline="turn-0.1", change="turn 0.9 rad per step"))
    about = StudySection(name="turn", title="How far the robot turns in a step", replicates=RUNS)
    return Study(about=about, report=ReportSection(), conditions=conditions, notes=notes)


def main() -> None:
    """Carry it out in a temporary folder."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = run_study(make_study(), Path(temporary) / "turn").folder
        for row in summarize(folder).iter_rows(named=True):
            print(
                f"{row['condition']}: median best coverage of a run {row['line_median']:.3f} "
                f"[{row['line_low']:.3f}, {row['line_high']:.3f}], {row['label']}, n = {row['n']}"
            )
        best = (
            folder.read(columns=["condition", "replicate", "coverage_line"])
            .group_by("condition", "replicate")
            .agg(pl.col("coverage_line").max())
            .pivot("condition", index="replicate", values="coverage_line")
        )
        higher = (best["turn-0.9"] > best["turn-0.1"]).sum()
        lower = (best["turn-0.9"] < best["turn-0.1"]).sum()
        print(
            f"Pairs of runs with the same random numbers: {higher} of {RUNS} cover more with 0.9 rad, {lower} less."
        )


if __name__ == "__main__":
    main()
