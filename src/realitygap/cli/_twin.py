"""`realitygap twin`: sample, show, and film twins."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import RealityGapError
from realitygap.robot_families import load, robot_families

from ._options import Json, print_json

twin = typer.Typer(
    name="twin",
    help="Sample and inspect MuJoCo twins (pseudo-reality).\n\n"
    "A twin is a simulated robot with modeled wheels, motors, and sensors. It is drawn from a family.\n\n"
    'In Python: realitygap.robots.twin.sample_twin("worn", 1)',
    epilog="Example: realitygap twin sample --family worn --seed 1 -o worn-1.toml",
    no_args_is_help=True,
    rich_markup_mode=None,
)

File = Annotated[Path, typer.Argument(metavar="FILE", help="Twin file from `realitygap twin sample`.")]


@twin.command("families")
def families(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="FAMILY", help="Family to describe; or every, for the numbers that all twins draw."
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """List the families of twins.

    With FAMILY, list the numbers that the family draws and their limits.

    Example: realitygap twin families worn

    In Python: realitygap.robots.twin.family_rows("worn")
    """
    if name is None:
        rows = [
            {"family": key, "meaning": family.meaning}
            for key, family in realitygap.robots.twin.FAMILIES.items()
        ]
    else:
        try:
            rows = [row._asdict() for row in realitygap.robots.twin.family_rows(name)]
        except ValueError as error:
            raise RealityGapError(str(error)) from error
    if as_json:
        print_json(rows)
    elif not rows:
        echo(f"{name} draws what every twin does: realitygap twin families every")
    else:
        _print_rows([{key: _text(value) for key, value in row.items()} for row in rows])


def _text(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _print_rows(rows: list[dict[str, str]]) -> None:
    """Print columns as wide as they must be."""
    widths = {key: max(len(key), *(len(row[key]) for row in rows)) for key in rows[0]}
    for row in [{key: key for key in widths}, *rows]:
        echo("  ".join(row[key].ljust(width) for key, width in widths.items()).rstrip())


def _add_builder(name: str, build: Callable[[], Path]) -> None:
    """Add the command that compiles a program of a family of robots."""

    @twin.command(f"build-{name}", help=inspect.getdoc(build))
    def command() -> None:
        echo(f"Built: {build()}")


for _family in robot_families():
    for _name, _reference in _family.builds.items():
        _add_builder(_name, load(_reference))


@twin.command("sample")
def sample(
    family: Annotated[
        str, typer.Option(metavar="FAMILY", help="Family of the twin. `realitygap twin families` lists them.")
    ],
    seed: Annotated[int, typer.Option(min=0, help="Seed of the twin and of its noise.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="FILE", help="Twin file to write. [default: print the twin]"),
    ] = None,
) -> None:
    """Sample a twin from a family.

    A twin is a TOML file. A comment above each number explains it.

    Example: realitygap twin sample --family worn --seed 1 -o worn-1.toml

    In Python: realitygap.robots.twin.sample_twin("worn", 1).to_toml()
    """
    try:
        text = realitygap.robots.twin.sample_twin(family, seed).to_toml()
    except ValueError as error:
        raise RealityGapError(str(error)) from error
    if out is None:
        echo(text, nl=False)
        return
    realitygap.records.write_whole(out, text.encode("utf-8"))
    echo(f"Written: {out}")


@twin.command("show")
def show_twin(
    file: File,
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="PICTURE", help="Picture to write (.svg, .pdf or .png).")
    ],
) -> None:
    """Draw a twin from above, to scale, with its dimensions.

    Example: realitygap twin show worn-1.toml -o worn-1.svg

    In Python: realitygap.report.save_twin("worn-1.svg", "worn-1.toml")
    """
    try:
        path = realitygap.report.save_twin(out, file)
    except ValueError as error:
        raise RealityGapError(str(error)) from error
    echo(f"Written: {path}")


@twin.command("render")
def render(
    file: File,
    out: Annotated[
        Path,
        typer.Option(
            "-o", "--out", metavar="PICTURE", help="Film (.gif or .mp4) or last picture (.png) to write."
        ),
    ],
    arena: Annotated[
        str, typer.Option(metavar="NAME", help="Arena by name, or a TOML or SVG file.")
    ] = "paper",
    steps: Annotated[int, typer.Option(min=1, max=10_000, help="Number of commands.")] = 60,
    number: Annotated[int, typer.Option(min=0, help="Number of the trial. It determines the noise.")] = 0,
    view: Annotated[
        str | None,
        typer.Option(
            metavar="mujoco|above",
            help="mujoco: in three dimensions. above: from above, with rays and cells. [default: mujoco if possible]",
        ),
    ] = None,
    speed: Annotated[
        float, typer.Option(help="Speed of the film; 4 is four times the speed of the robot.")
    ] = 4.0,
) -> None:
    """Film a twin that wanders through an arena.

    A .png shows the end of the trial.

    Example: realitygap twin render worn-1.toml -o worn-1.mp4

    Example: realitygap twin render worn-1.toml --view above --speed 2 -o worn-1.gif

    In Python: realitygap.playback.save_twin_trial(realitygap.playback.TwinDrive(model, arena), "worn-1.mp4")
    """
    try:
        trial = realitygap.playback.TwinDrive(
            realitygap.robots.twin.load_twin(file), realitygap.world.load_arena(arena), steps, number
        )
        path = realitygap.playback.save_twin_trial(trial, out, view=view, speed=speed)  # type: ignore[arg-type]  # checked there
    except ValueError as error:
        raise RealityGapError(str(error)) from error
    echo(f"Written: {path}")
