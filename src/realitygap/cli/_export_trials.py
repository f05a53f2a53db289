"""`realitygap export-trials`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap._wording import counted
from realitygap.errors import StudyError


def export_trials(
    source: Annotated[
        Path,
        typer.Argument(metavar="TRIALS", help="File of trials, or folder of results with a ledger."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            metavar="NAME",
            help="File that ends in .jsonl, .parquet, or .mcap, or folder of a new bag.",
        ),
    ] = None,
    trial: Annotated[
        list[int] | None,
        typer.Option(
            "--trial", metavar="N", help="Number of a trial; may be repeated. [default: all driven]"
        ),
    ] = None,
    wheel_diameter_mm: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            metavar="MM",
            help="Diameter of the wheels, which converts distances to angles. [default: 65]",
        ),
    ] = None,
) -> None:
    """Write driven trials as JSON, Parquet, MCAP, or bags.

    A file that ends in .jsonl has a line for each trial, and one that ends in .parquet a row for each command.

    In bags, commands are TwistStamped on /cmd_vel, poses Odometry on /odom, wheels JointState on /joint_states, and
    range sensors Range on /range_0 and so on. A mapping is written next to each bag, so that `realitygap import` reads
    it. Several trials go to separate bags, such as drive-7.mcap. They need the extra 'ros'.

    Example: realitygap export-trials trials.sqlite -o drive.mcap

    Example: realitygap export-trials results/robot -o steps.parquet

    Example: realitygap export-trials results/robot --trial 3 -o bag

    In Python: realitygap.study.export_trials("trials.sqlite", "drive.mcap")
    """
    export(source, out, trial or (), wheel_diameter_mm)


def export(
    source: Path, out: Path | None, trials: Sequence[int] = (), wheel_diameter_mm: float | None = None
) -> None:
    """Write trials in the format that the name of the output has, and print what was written."""
    if out is None:
        raise StudyError(
            "Name the output with -o: a file that ends in .jsonl, .parquet, or .mcap, or a new folder for a bag."
        )
    if out.suffix in (".jsonl", ".parquet"):
        if wheel_diameter_mm is not None:
            raise StudyError(f"--wheel-diameter-mm is only for bags, not for {out}. Leave it out.")
        echo(f"Written: {out} ({counted(realitygap.study.write_trials(source, out, trials), 'trial')})")
        return
    diameter = realitygap.logs.WHEEL_DIAMETER_MM if wheel_diameter_mm is None else wheel_diameter_mm
    for report in realitygap.study.export_trials(source, out, trials, wheel_diameter_mm=diameter):
        topics = ", ".join(f"{topic} {n}" for topic, n in report.n_messages.items())
        echo(f"Written: {report.bag} ({topics}); mapping: {report.mapping}")
