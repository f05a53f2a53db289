"""`realitygap platforms` and `simulate`: what can run trials, and one case on the platform `jyro`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import StudyError

from ._code import AllowPlatforms
from ._options import Json, print_json


def platforms(
    check: Annotated[
        str | None,
        typer.Option(
            "--check", metavar="PLATFORM", help="Try a platform out and report whether it keeps the contract."
        ),
    ] = None,
    arena: Annotated[str, typer.Option(metavar="NAME", help="Arena for --check.")] = "paper",
    as_json: Json = False,
    allow_code: AllowPlatforms = False,
) -> None:
    """List the platforms that can run trials.

    The list has the platforms of realitygap and those that other packages add.

    Example: realitygap platforms

    Example: realitygap platforms --check python:mine.py:MyRobot --allow-code

    In Python: realitygap.platforms.known_specs()
    """
    if check is not None:
        from realitygap.testing import check_platform

        platform = realitygap.platforms.platform_of(check)
        check_platform(platform, realitygap.world.load_arena(arena))
        if as_json:
            print_json({"platform": check, "keeps_contract": True, "robot_driven": not platform.is_physical})
            return
        only = (
            " Its robot was not driven: realitygap.testing.check_robot does that."
            if platform.is_physical
            else ""
        )
        echo(f"{check} keeps the contract of a platform.{only}")
        return
    models, problems = [], []
    for name in realitygap.platforms.platform_names():
        try:
            models.append(realitygap.platforms.platform_class(name))
        except StudyError as error:
            problems.append(str(error))
    if as_json:
        listed = [{"name": each.name, "specs": each.specs(), "summary": each.summary} for each in models]
        print_json(listed)
    else:
        width = max(len(" or ".join(each.specs())) for each in models)
        for each in models:
            echo(f"{' or '.join(each.specs()):{width}}  {each.summary.partition(':')[0]}")
    for problem in problems:
        echo(f"realitygap: {problem}", err=True)


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
