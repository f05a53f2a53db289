"""`realitygap drive`: drive the conditions of a study that are on a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.robot_families import ports_by_family

from ._code import AllowTasks, code_permission
from ._designs import print_deviations
from ._observer import Camera, operated_under_camera
from ._options import Json, OpenPage, Replicates, StudyFolder, StudySeed, who_option
from ._progress import resumable
from ._results import show_page, written_report
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
            help=f"{ports_by_family()} A port emulator://HOST is an emulated robot in this program.",
        ),
    ],
    replicates: Replicates = None,
    out: StudyFolder = None,
    seed: StudySeed = None,
    randomize: Annotated[
        str | None, typer.Option(metavar="HOW", help="Value of --randomize in `realitygap run`, if any.")
    ] = None,
    witness: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT",
            help="Witness of an emulator in another program. It places the robot and observes its line.",
        ),
    ] = None,
    camera: Camera = None,
    in_flight: Annotated[
        str | None,
        typer.Option(
            metavar="VERDICT", help="Verdict on an interrupted trial: void or driven. [default: ask]"
        ),
    ] = None,
    score: Annotated[
        str, typer.Option(metavar="WHEN", help="When to ask for the cells: trial, sheet or later.")
    ] = "sheet",
    no_wait: Annotated[
        bool, typer.Option("--no-wait", help="Drive each trial without waiting for Enter.")
    ] = False,
    despite_preflight: Annotated[
        bool, typer.Option("--despite-preflight", help="Drive even if the pre-flight check fails.")
    ] = False,
    who: Annotated[str | None, who_option()] = None,
    lock: Annotated[
        bool,
        typer.Option(
            "--lock",
            help="Lock the design before trial 1. `trials show` and the report list deviations from it.",
        ),
    ] = False,
    allow_code: AllowTasks = False,
    as_json: Json = False,
    open_page: OpenPage = False,
) -> None:
    """Drive the conditions of a study that are on a robot.

    The command leads you through the trials. Each trial is saved when it ends, so you can interrupt the command at any
    time. Run the same command again to resume. `realitygap run` computes the other conditions of the study.

    Example: realitygap drive paper-robot --port /dev/rfcomm0

    Example: realitygap drive paper-robot --port "emulator://s2?fluke=2&speed=off"

    In Python: realitygap.drive_study("paper-robot", "/dev/rfcomm0", operator=operator)
    """
    from ._operator import Answers, choose_operator

    answers = Answers(who, in_flight, score, wait=not no_wait, despite_preflight=despite_preflight)
    resolved = realitygap.study.load_study(study, seed=seed, replicates=replicates, randomize=randomize)
    realitygap.study.check_has_robot(resolved)
    path = out or Path("results") / resolved.about.name
    operator = choose_operator(port, witness, answers, path, quiet=as_json)
    with resumable("Scored trials are saved."), operated_under_camera(camera, resolved, operator) as looking:
        result = realitygap.study.drive_study(
            resolved,
            port,
            path,
            operator=looking,
            allow_code=code_permission(allow_code),
            lock=lock,
            who=who,
        )
    print_result(result, as_json=as_json)
    if not as_json:
        print_deviations(path)
    is_compared = len(realitygap.study.physical_conditions(resolved)) > 1
    if is_compared and not as_json and not resolved.trials.blind:
        echo(f"Looks after each run: {realitygap.study.advise(path).summary}")
    if open_page:
        show_page(written_report(path, to_stderr=as_json))
