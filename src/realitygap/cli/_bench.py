"""`realitygap bench`: how fast this machine is."""

from __future__ import annotations

import json
from typing import Annotated

import typer


def bench(
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    seconds: Annotated[
        float, typer.Option(min=0.01, max=3600, help="How long each figure is measured.")
    ] = 2.0,
) -> None:
    """Measure robot-steps and whole paper runs a second, on one core and on all.

    A robot-step holds its noise and its line coverage; a paper run its NEAT; a recorded one the writing of
    its rows. Compilation is not counted.

    Example: realitygap bench --json

    In Python: realitygap.study.measure_speed()
    """
    from realitygap.study import measure_speed

    figures = measure_speed(seconds)
    if as_json:
        typer.echo(json.dumps(figures, indent=2))
        return
    names = {
        "robot_steps_per_second": "robot-steps/s",
        "paper_runs_per_second": "paper runs/s",
        "paper_runs_recorded_per_second": "paper runs/s with their rows written",
    }
    for key, name in names.items():
        one, all_cores = figures[key]["per_core"], figures[key]["all_cores"]
        typer.echo(
            f"{name:38} {one:14,.0f} a core {all_cores:14,.0f} on all {figures['machine']['processors']}"
        )
    typer.echo(
        f"{figures['machine']['processor']}; " + ", ".join(f"{k} {v}" for k, v in figures["versions"].items())
    )
