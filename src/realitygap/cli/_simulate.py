"""`realitygap simulate`: one case on the platform `jyro`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo


def simulate(
    case: Annotated[
        Path,
        typer.Argument(
            metavar="CASE.json", help="Scene, and the commands or networks that drive its robots."
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="OUT.csv", help="Track to write.")],
) -> None:
    """Run one case file as the Jyro simulator does.

    The case is a JSON file with walls, lights, robots with their devices, and commands or a network. The track is a CSV
    file with the columns step, robot, time, x, y, heading, stall, cmd_v, cmd_w, energy and the readings s0, s1, ...
    Stall flags equal Jyro's at every step. So do poses under given commands. Numbers are float64.

    Example: realitygap simulate tests/data/jyro/s15_net_linear_a.json --out track.csv

    In Python: realitygap.trials.simulate_file(case, out)
    """
    described, track = realitygap.trials.simulate_file(case, out)
    for i, robot in enumerate(described.robots):
        blocked = int(track.stalls[:, i].sum())
        echo(f"SIM jyro, {robot.name}: {described.steps} steps, {blocked} of them blocked.")
    echo(f"Written: {out}")
