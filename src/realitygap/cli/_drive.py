"""`realitygap drive`: the conditions of a study that are on a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ._browser import show_page
from ._camera import CAMERA_HELP, operated_under_camera
from ._code import ALLOW_CODE_HELP, code_permission
from ._operator import Answers, choose_operator
from ._results import written_report
from ._study import print_result


def drive(
    study: Annotated[
        str,
        typer.Argument(
            metavar="STUDY", help="Name of a study, such as paper-robot; or a study file (.toml)."
        ),
    ],
    port: Annotated[
        str,
        typer.Option(
            metavar="PORT",
            help="Port of the robot: /dev/rfcomm0, COM3, socket://HOST:PORT, thymio:/dev/ttyACM0, or an emulated robot "
            "in this program, emulator://s2?speed=off or thymio:emulator://playground?speed=8.",
        ),
    ],
    replicates: Annotated[int | None, typer.Option(min=1, help="Number of runs of each condition.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the results. [default: results/NAME]")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed that replaces the study's.")] = None,
    randomize: Annotated[
        str | None, typer.Option(metavar="HOW", help="Value that `realitygap run` was given, if any.")
    ] = None,
    witness: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT",
            help="Witness of an emulator in another program. It places the robot and sees what it drew.",
        ),
    ] = None,
    camera: Annotated[str | None, typer.Option(metavar="CAMERA", help=CAMERA_HELP)] = None,
    in_flight: Annotated[
        str | None,
        typer.Option(
            metavar="VERDICT", help="Verdict on a trial that was cut off: void or driven. [default: asks]"
        ),
    ] = None,
    score: Annotated[
        str, typer.Option(metavar="WHEN", help="When to ask for cells: after each trial or sheet, or later.")
    ] = "sheet",
    no_wait: Annotated[
        bool, typer.Option("--no-wait", help="Drive each trial without waiting for Enter.")
    ] = False,
    despite_preflight: Annotated[
        bool, typer.Option("--despite-preflight", help="Drive whatever the pre-flight finds.")
    ] = False,
    who: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Name to record with each score. [default: your account's name]"),
    ] = None,
    allow_code: Annotated[bool, typer.Option("--allow-code", help=ALLOW_CODE_HELP)] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    open_page: Annotated[
        bool, typer.Option("--open", help="When done, write the report and show it in the browser.")
    ] = False,
) -> None:
    """Drive the conditions of a study that are on a robot.

    You are led through the trials. Each one is saved when it ends, so you can interrupt the command at any moment: the
    same command resumes. `realitygap run` computes the other conditions of the study.

    Example: realitygap drive paper-robot --port /dev/rfcomm0

    Example: realitygap drive paper-robot --port "emulator://s2?fluke=2&speed=off"

    In Python: realitygap.drive_study("paper-robot", "/dev/rfcomm0", operator=operator)
    """
    from realitygap.study import check_has_robot, drive_study, load_study

    answers = Answers(who, in_flight, score, wait=not no_wait, despite_preflight=despite_preflight)
    resolved = load_study(study, seed=seed, replicates=replicates, randomize=randomize)
    check_has_robot(resolved)
    path = out or Path("results") / resolved.about.name
    operator = choose_operator(port, witness, answers, path, quiet=as_json)
    try:
        with operated_under_camera(camera, resolved, operator) as looking:
            result = drive_study(
                resolved, port, path, operator=looking, allow_code=code_permission(allow_code)
            )
    except KeyboardInterrupt:
        typer.echo("Interrupted. What was scored is safe; the same command resumes.", err=True)
        raise typer.Exit(130) from None
    print_result(result, as_json=as_json)
    if open_page:
        show_page(written_report(path, to_stderr=as_json))
