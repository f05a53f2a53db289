"""`realitygap audit-distance`: what a distance of behaviors weighs."""

from __future__ import annotations

import shutil
import textwrap
from pathlib import Path
from typing import Annotated, Literal

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import RealityGapError

from ._json import print_json
from ._options import Json

WIDEST = 110
"""Letters of a line of prose, on a terminal that has more."""


def audit_distance(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME", help="Distance: paper, ordered, jaccard, hamming, final, edit or alignment."
        ),
    ],
    folder: Annotated[
        Path | None,
        typer.Argument(metavar="DIR", help="Folder of results whose trials to compare as well."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Figure to write (.svg, .pdf or .png).")
    ] = None,
    sort: Annotated[
        Literal["x-then-y", "y-then-x"],
        typer.Option(
            metavar="ORDER", help="Order of the cells in the paper's distance: x-then-y or y-then-x."
        ),
    ] = "x-then-y",
    straight: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=1.0,
            metavar="P",
            help="Probability that a step of a random walk keeps its direction.",
        ),
    ] = 0.6,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of the random walks and pairs.")] = 1,
    as_json: Json = False,
) -> None:
    """Report what a behavior distance weighs.

    The weight of a cell is the change in distance when the cell is added to a random walk, or removed from it. The
    relation with length is a rank correlation: the distance of two behaviors against their difference in visited cells.
    It is computed over random walks. If you name a folder, it is also computed over trials of different runs of each
    condition.

    Example: realitygap audit-distance paper -o paper.svg

    Example: realitygap audit-distance jaccard results/paper

    In Python: realitygap.report.audit_distance("jaccard", "results/paper")
    """
    try:
        if out is not None:
            realitygap.report.check_ending(out, (".pdf", ".png", ".svg"))
        audit = realitygap.report.audit_distance(name, folder, seed=seed, sort=sort, straight=straight)
        path = None if out is None else realitygap.report.save_distance(audit, out)
    except ValueError as error:
        raise RealityGapError(str(error)) from error
    if as_json:
        print_json(audit.to_dict() | {"notes": realitygap.report.distance_notes(audit), "file": path})
    else:
        width = min(shutil.get_terminal_size().columns, WIDEST)
        for note in realitygap.report.distance_notes(audit):
            echo(textwrap.fill(note, width, subsequent_indent="  ", break_on_hyphens=False))
        if path is not None:
            echo(f"Written: {path}")
