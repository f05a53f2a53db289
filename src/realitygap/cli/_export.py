"""`realitygap export`: an individual of a study as a file for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from realitygap.errors import RealityGapError, StudyError

if TYPE_CHECKING:
    from realitygap.report._individual_file import Format


def export(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="A folder of results, such as results/paper.")
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Not in a folder of results.")
    ] = None,
    format: Annotated[
        str | None,
        typer.Option(metavar="FORMAT", help="json, onnx or graphml. [default: by the ending of FILE]"),
    ] = None,
    condition: Annotated[str | None, typer.Option(help="Of which. [default: the first]")] = None,
    replicate: Annotated[int | None, typer.Option(help="Which run. [default: the typical one]")] = None,
    generation: Annotated[int | None, typer.Option(help="Of the run. [default: the last]")] = None,
    individual: Annotated[int | None, typer.Option(help="Of the generation. [default: its best]")] = None,
) -> None:
    """Write an individual of a study to a file for other programs.

    The same options draw it with realitygap show network. json is the genome, which realitygap.Genome.load reads; onnx
    is its network, for any ONNX runtime; graphml is the genome as a graph. onnx and graphml need the extra: pip install
    'realitygap[export]'. A file that is there gives way once the new one is complete.

    Example: realitygap export results/paper --condition novelty-50 --replicate 3 -o champion.json

    Example: realitygap export results/paper --generation 4 --individual 2 --format onnx -o network.onnx

    In Python: realitygap.report.export_individual("results/paper", "champion.json", condition="novelty-50")
    """
    if out is None:
        raise StudyError("Where to? Name a file with -o, such as -o champion.json.")
    from realitygap.report import export_individual

    try:
        path = export_individual(
            folder,
            out,
            format=cast("Format | None", format),
            condition=condition,
            replicate=replicate,
            generation=generation,
            individual=individual,
        )
    except ValueError as error:
        raise RealityGapError(str(error)) from error
    typer.echo(f"Written: {path}")
