"""`realitygap platforms`: what can run trials."""

from __future__ import annotations

from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import StudyError

from ._code import AllowPlatforms
from ._json import print_json
from ._options import Json


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
