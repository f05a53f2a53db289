"""`realitygap show`: one run, trial, network, lineage, arena or robot as a picture."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import RealityGapError, StudyError

from ._code import AllowFiles

if TYPE_CHECKING:
    from realitygap.report import Each, Subject


_ONLY_MOVIES = "Only for a movie"
_ONLY_DIVERGENCE = "Only for a divergence"


def show(
    what: Annotated[
        str,
        typer.Argument(
            metavar="WHAT",
            help="Folder of results; or network, species, lineage, archive, divergence, movie, arena or robot.",
        ),
    ],
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAME",
            help="Folder of results after network, species, lineage, archive or divergence; one or more folders after "
            "movie; arena or robot, by name or file, after arena or robot.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            metavar="FILE",
            help="Picture to write (.svg, .pdf, .png; for trials also .gif or .mp4).",
        ),
    ] = None,
    condition: Annotated[str | None, typer.Option(help="Name of the condition. [default: the first]")] = None,
    replicate: Annotated[
        int | None, typer.Option(help="Number of the run. [default: the typical one]")
    ] = None,
    generation: Annotated[
        int | None, typer.Option(help="Generation of the trial, network or lineage.")
    ] = None,
    individual: Annotated[
        int | None, typer.Option(help="Individual of the generation. [default: the best]")
    ] = None,
    each: Annotated[
        str | None,
        typer.Option(
            metavar="WHAT",
            help="Trials to show: each individual of a generation, or the best trial of each generation or condition.",
            rich_help_panel=_ONLY_MOVIES,
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            help="Speed of the movie; 2 is twice the speed of the robot. [default: 1]",
            rich_help_panel=_ONLY_MOVIES,
        ),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Condition or platform (twin:FILE) to try the network on as well; or two of them, A,B.",
            rich_help_panel=_ONLY_DIVERGENCE,
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Robot, by name or file, to draw at the start.",
            rich_help_panel="Only for an arena",
        ),
    ] = None,
    repeats: Annotated[
        int | None,
        typer.Option(
            help="Number of trials on each platform. [default: 30]", rich_help_panel=_ONLY_DIVERGENCE
        ),
    ] = None,
    allow_code: AllowFiles = False,
) -> None:
    """Draw a run, trial, network, arena, or robot.

    A folder alone gives the best path of each generation of a run. With --generation, the picture shows one trial with
    its readings and commands. A FILE in .gif or .mp4 shows a trial in motion: without --generation, the best of the
    run. Use movie for several trials in motion. Use divergence to try a network on two or three platforms and compare
    its paths. Trials are recomputed from their rows. An existing FILE is replaced when the new one is complete.

    Example: realitygap show results/paper --condition coverage-50 --replicate 3 -o run.svg

    Example: realitygap show results/paper --generation 4 --individual 2 -o trial.gif

    Example: realitygap show movie results/paper --each individual --generation 4 -o eight.gif

    Example: realitygap show network results/paper --condition novelty-50 -o network.pdf

    Example: realitygap show species results/paper -o species.png

    Example: realitygap show lineage results/paper --condition novelty-50 -o lineage.svg

    Example: realitygap show archive results/maps -o archive.svg

    Example: realitygap show divergence results/paper --condition novelty-50 --against novelty-10 -o divergence.svg

    Example: realitygap show divergence results/paper --against sim,twin:worn.toml -o divergence.svg

    Example: realitygap show arena maze-hard --robot khepera -o arena.svg

    Example: realitygap show robot khepera -o robot.svg

    In Python: realitygap.report.save_view("results/paper", "run.svg", condition="coverage-50", replicate=3)

    In Python: realitygap.report.save_view("results/paper", "network.pdf", subject="network")

    In Python: realitygap.write_movie("results/paper", "eight.gif", each="individual", generation=4)

    In Python: realitygap.report.save_divergence("results/paper", "divergence.svg", against="novelty-10")

    In Python: realitygap.report.save_arena("arena.svg", "maze-hard", robot="khepera")

    In Python: realitygap.report.save_robot("robot.svg", "khepera")
    """
    if out is None:
        raise StudyError("No output file. Name one with -o, such as -o run.svg.")

    numbers: dict[str, Any] = {
        "condition": condition,
        "replicate": replicate,
        "generation": generation,
        "individual": individual,
    }
    try:
        if what != "movie":
            _refuse(what, ("--each", "--speed"), each, speed)
        if what != "divergence":
            _refuse(what, ("--against", "--repeats"), against, repeats)
        if what != "arena":
            _refuse(what, ("--robot",), robot)
        if what == "movie":
            echo(f"Written: {_movie(names, out, each, speed, numbers)}")
            return
        name = _one_name(what, names)
        if what == "divergence":
            echo(f"Written: {_divergence(name, out, against, repeats, numbers)}")
            return
        if what in ("arena", "robot"):
            _refuse(what, [f"--{key}" for key in numbers], *numbers.values())
            is_arena = what == "arena"
            path = (
                realitygap.report.save_arena(out, name or "paper", robot=robot)
                if is_arena
                else realitygap.report.save_robot(out, name or "jyro")
            )
        else:
            subject, folder = _subject(what, name, out)
            path = realitygap.report.save_view(folder, out, subject=subject, allow_code=allow_code, **numbers)
    except ValueError as error:
        raise RealityGapError(str(error)) from error
    echo(f"Written: {path}")


def _subject(what: str, name: str | None, out: Path) -> tuple[Subject, str]:
    """Return the subject to show, and its folder."""
    subjects: dict[str, Subject] = {each: each for each in ("network", "species", "lineage", "archive")}
    if what in subjects:
        if name is None:
            raise StudyError(
                f"No results folder. Name one: realitygap show {what} results/paper -o {shlex.quote(str(out))}"
            )
        return subjects[what], name
    if name is not None:
        raise StudyError(
            f"Cannot show {what!r} of {name!r}. Expected network, species, lineage, archive, divergence, movie, arena "
            "or robot first, or only a folder."
        )
    return "run", what


def _movie(
    names: list[str] | None,
    out: Path,
    each: str | None,
    speed: float | None,
    numbers: dict[str, Any],
) -> Path:
    if not names:
        raise StudyError(
            f"No results folder. Name one: realitygap show movie results/paper -o {shlex.quote(str(out))}"
        )
    chosen = cast("Each | None", each)
    return realitygap.report.write_movie(
        names, out, each=chosen, speed=1.0 if speed is None else speed, **numbers
    )


def _divergence(
    name: str | None,
    out: Path,
    against: str | None,
    repeats: int | None,
    numbers: dict[str, Any],
) -> Path:
    if name is None or against is None:
        raise StudyError(
            "No results folder, or no second condition or platform. For example: realitygap show divergence "
            f"results/paper --against novelty-10 -o {shlex.quote(str(out))}"
        )
    return realitygap.report.save_divergence(
        name, out, against=against, repeats=30 if repeats is None else repeats, **numbers
    )


def _one_name(what: str, names: list[str] | None) -> str | None:
    if names and len(names) > 1:
        raise StudyError(
            f"Cannot show {what!r} of {len(names)} together, expected one name after it. Only a movie shows "
            "several."
        )
    return names[0] if names else None


def _refuse(what: str, options: Sequence[str], *given: object) -> None:
    surplus = [name for name, value in zip(options, given, strict=True) if value is not None]
    if surplus:
        raise StudyError(f"Not for {what}: {', '.join(surplus)}. Leave that out.")
