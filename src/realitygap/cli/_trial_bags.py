"""`realitygap export-trials`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import StudyError


def export_trials(
    source: Annotated[
        Path,
        typer.Argument(metavar="TRIALS", help="File of trials (.jsonl), or folder of results with a ledger."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            metavar="NAME",
            help="File that ends in .mcap, or folder of a new bag. Numbers are added.",
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
    """Write driven trials as bags of ROS 2 or as MCAP.

    Commands are TwistStamped on /cmd_vel, poses Odometry on /odom, wheels JointState on /joint_states, and range
    sensors Range on /range_0 and so on. A mapping is written next to each bag, so that `realitygap import` reads it.

    Several trials go to separate files, such as drive-7.mcap. It needs the extra 'ros'.

    Example: realitygap export-trials trials.jsonl -o drive.mcap

    Example: realitygap export-trials results/robot --trial 3 -o bag

    In Python: realitygap.study.export_trials("trials.jsonl", "drive.mcap")
    """
    if out is None:
        raise StudyError("Name the bag to write with -o: a file that ends in .mcap, or a new folder.")
    diameter = realitygap.logs.WHEEL_DIAMETER_MM if wheel_diameter_mm is None else wheel_diameter_mm
    for report in realitygap.study.export_trials(source, out, trial or (), wheel_diameter_mm=diameter):
        topics = ", ".join(f"{topic} {n}" for topic, n in report.n_messages.items())
        echo(f"Written: {report.bag} ({topics}); mapping: {report.mapping}")
