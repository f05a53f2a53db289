"""`realitygap export`: an individual, or species, innovations and lineage of a study, for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from realitygap.errors import RealityGapError, StudyError

if TYPE_CHECKING:
    from realitygap.records import DerivedFrame

_FRAMES = ("species", "innovations", "lineage")


def export(
    what: Annotated[
        str,
        typer.Argument(metavar="WHAT", help="A folder of results; or species, innovations or lineage."),
    ],
    name: Annotated[
        str | None,
        typer.Argument(metavar="NAME", help="After species, innovations and lineage, the folder."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Not one of a study's own files.")
    ] = None,
    format: Annotated[
        str | None,
        typer.Option(
            metavar="FORMAT",
            help="Of an individual: json, onnx, graphml, c or aseba. [default: by FILE's ending]",
        ),
    ] = None,
    condition: Annotated[
        str | None, typer.Option(help="Of which. [default: the first; of species and so on, all]")
    ] = None,
    replicate: Annotated[
        int | None, typer.Option(help="Which run. [default: the typical one; of species and so on, all]")
    ] = None,
    generation: Annotated[int | None, typer.Option(help="Of an individual. [default: the last]")] = None,
    individual: Annotated[int | None, typer.Option(help="Of the generation. [default: its best]")] = None,
) -> None:
    """Export a network as JSON, ONNX, C, Aseba, or a graph.

    It also exports the species, the innovations, or the lineage of a run.

    A folder alone gives one individual, which realitygap show network draws with the same options. json is the genome,
    which realitygap.Genome.load reads. c is the network as a header of C99, for robots that carry it. aseba is the
    network as a program for a Thymio II, which Aseba Studio opens. onnx is the network for any ONNX runtime, and
    graphml is the genome as a graph: both need the extra, pip install 'realitygap[export]'. Species, innovations and
    lineage are tables in Parquet: each species of each generation, when each innovation arose, and each individual with
    its parents. A file that is there gives way once the new one is complete.

    Example: realitygap export results/paper --condition novelty-50 --replicate 3 -o champion.json

    Example: realitygap export results/paper --generation 4 --individual 2 --format onnx -o network.onnx

    Example: realitygap export results/paper -o network.h

    Example: realitygap export results/paper -o network.aesl

    Example: realitygap export lineage results/paper --condition novelty-50 -o lineage.parquet

    In Python: realitygap.report.export_individual("results/paper", "champion.json", condition="novelty-50")

    In Python: realitygap.report.export_frame("results/paper", "lineage", "lineage.parquet")
    """
    if out is None:
        raise StudyError("Where to? Name a file with -o, such as -o champion.json.")
    from realitygap.report import export_frame, export_individual

    which = {"condition": condition, "replicate": replicate}
    numbers = {"generation": generation, "individual": individual, "format": format}
    try:
        if what in _FRAMES:
            path = export_frame(
                _folder(what, name, numbers), cast("DerivedFrame", what), out, **cast("Any", which)
            )
        elif name is not None:
            raise StudyError(
                f"Cannot export {what!r} of {name!r}. Expected species, innovations or lineage first, or only a folder."
            )
        else:
            path = export_individual(what, out, **cast("Any", which | numbers))
    except ValueError as error:
        raise RealityGapError(str(error)) from error
    typer.echo(f"Written: {path}")


def _folder(what: str, name: str | None, numbers: Mapping[str, object]) -> str:
    """The folder after a word, with which the options of an individual mean nothing."""
    if name is None:
        raise StudyError(
            f"Of which results? Name a folder: realitygap export {what} results/paper -o {what}.parquet"
        )
    surplus = [f"--{key}" for key, value in numbers.items() if value is not None]
    if surplus:
        raise StudyError(f"Of no meaning for {what}: {', '.join(surplus)}. Leave that out.")
    return name
