"""`realitygap arena`."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import StudyError

_ONLY_FROM_MAP = "Only from a map"
_YAML = (".yaml", ".yml")


def arena(
    source: Annotated[
        str, typer.Argument(metavar="ARENA", help="Map of ROS (.yaml), or arena by name or file.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", metavar="FILE", help="Arena file (.toml) or map of ROS (.yaml) to write."
        ),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,DEG",
            help="Start in the frame of the map [m, m, degrees]. [default: the place furthest from all walls]",
            rich_help_panel=_ONLY_FROM_MAP,
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            min=1e-4,
            metavar="M",
            help="Largest distance of a wall from the border of free space [m]. [default: 1.5 pixels]",
            rich_help_panel=_ONLY_FROM_MAP,
        ),
    ] = None,
    resolution: Annotated[
        float | None,
        typer.Option(
            min=1e-4,
            metavar="M",
            help="Side of a pixel [m]. [default: 0.01]",
            rich_help_panel="Only to a map",
        ),
    ] = None,
) -> None:
    """Convert an arena from or to a map of ROS.

    A map is a YAML file and an image (PGM, PNG), as map_server, nav2, and SLAM programs write them. Free space around
    the start becomes an arena with straight walls. Unknown pixels count as occupied.

    An arena becomes a map with an image next to it. Lights, the floor, the goal, and the cells are in no map.

    It needs the extra 'ros'.

    Example: realitygap arena map.yaml -o room.toml

    Example: realitygap arena map.yaml --start 0.5,1.0,90 --tolerance 0.05 -o room.toml

    Example: realitygap arena maze-hard --resolution 0.02 -o maze.yaml

    In Python: realitygap.vision.arena_of_map("map.yaml")

    In Python: realitygap.vision.save_map(realitygap.world.load_arena("maze-hard"), "maze.yaml")
    """
    if out is None or out.suffix.lower() not in (".toml", *_YAML):
        raise StudyError("Name the file to write with -o: an arena file (.toml) or a map of ROS (.yaml).")
    if Path(source).resolve() == out.resolve():
        raise StudyError(f"{out} is the arena itself. Name another file.")
    is_map, is_to_map = source.lower().endswith(_YAML), out.suffix.lower() in _YAML
    wrong = [name for name, value in (("--start", start), ("--tolerance", tolerance)) if value is not None]
    if wrong and not is_map:
        raise StudyError(
            f"{wrong[0]} is only for a map of ROS (.yaml), but {source} is not one. Leave it out."
        )
    if resolution is not None and not is_to_map:
        raise StudyError(
            f"--resolution is only for a map of ROS (.yaml), but {out} is not one. Leave it out."
        )
    found = (
        realitygap.vision.arena_of_map(source, _pose(start), tolerance=tolerance)
        if is_map
        else realitygap.world.load_arena(source)
    )
    if is_to_map:
        image = realitygap.vision.save_map(
            found, out, **({} if resolution is None else {"resolution": resolution})
        )
        echo(f"Written: {out} and {image.name}")
        return
    try:
        text = found.to_toml()
    except ValueError as error:
        raise StudyError(str(error)) from None
    realitygap.records.write_whole(out, text.encode())
    x, y, heading = found.start
    echo(
        f"Written: {out} ({len(found.walls)} walls, start {x:.3g}, {y:.3g} m, {math.degrees(heading):.3g} degrees). "
        f"Draw it: realitygap show arena {shlex.quote(str(out))} -o {shlex.quote(str(out.with_suffix('.svg')))}"
    )


def _pose(text: str | None) -> tuple[float, float, float] | None:
    if text is None:
        return None
    try:
        x, y, degrees = (float(part) for part in text.split(","))
    except ValueError:
        raise StudyError(
            f"--start is {text!r}, expected three numbers: X,Y,DEG, such as 0.5,1.0,90."
        ) from None
    if not all(map(math.isfinite, (x, y, degrees))):
        raise StudyError(f"--start is {text!r}, expected three finite numbers.")
    return x, y, math.radians(degrees)
