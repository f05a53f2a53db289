"""`realitygap export` and `export-trials`: individuals, tables of a study, and driven trials for other programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

import realitygap
from realitygap._terminal import echo
from realitygap._wording import counted
from realitygap.errors import RealityGapError, StudyError

from ._options import export_option

if TYPE_CHECKING:
    from realitygap.records import DerivedFrame

_FRAMES = ("species", "innovations", "lineage")


def export(
    what: Annotated[
        str,
        typer.Argument(metavar="WHAT", help="Folder of results; or species, innovations or lineage."),
    ],
    name: Annotated[
        str | None,
        typer.Argument(metavar="NAME", help="Folder of results, after species, innovations or lineage."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="FILE", help="File to write, except a study's own files."),
    ] = None,
    format: Annotated[
        str | None,
        typer.Option(
            metavar="FORMAT",
            help="json, onnx, graphml, c or aseba. Only for an individual. [default: by FILE's ending]",
        ),
    ] = None,
    condition: Annotated[
        str | None, typer.Option(help="Name of the condition. [default: the first; for tables, all]")
    ] = None,
    replicate: Annotated[
        int | None, typer.Option(help="Number of the run. [default: the typical one; for tables, all]")
    ] = None,
    generation: Annotated[
        int | None, typer.Option(help="Generation of the individual. [default: the last]")
    ] = None,
    individual: Annotated[
        int | None, typer.Option(help="Individual of the generation. [default: the best]")
    ] = None,
) -> None:
    """Export a network as JSON, ONNX, C, Aseba, or a graph.

    It also exports the species, the innovations, or the lineage of a run.

    A folder alone gives one individual, the one that `realitygap show network` draws with the same options. The format
    json is the genome, which realitygap.Genome.load reads. The format c is the network as a header of C99, for robots
    that carry it. Robots may add a format: aseba is the network as a program that Aseba Studio opens. The formats
    onnx, for any ONNX runtime, and graphml, a graph, need the extra 'export'.

    Species, innovations and lineage are tables in Parquet. They list each species of each generation, the origin of
    each innovation, and the parents of each individual. An existing FILE is replaced when the new one is complete.

    Example: realitygap export results/paper --condition novelty-50 --replicate 3 -o champion.json

    Example: realitygap export results/paper --generation 4 --individual 2 --format onnx -o network.onnx

    Example: realitygap export results/paper -o network.h

    Example: realitygap export results/paper -o network.aesl

    Example: realitygap export lineage results/paper --condition novelty-50 -o lineage.parquet

    In Python: realitygap.report.export_individual("results/paper", "champion.json", condition="novelty-50")

    In Python: realitygap.report.export_frame("results/paper", "lineage", "lineage.parquet")
    """
    if out is None:
        raise StudyError("No output file. Name one with -o, such as -o champion.json.")

    which = {"condition": condition, "replicate": replicate}
    numbers = {"generation": generation, "individual": individual, "format": format}
    try:
        if what in _FRAMES:
            path = realitygap.report.export_frame(
                _folder(what, name, numbers), cast("DerivedFrame", what), out, **cast("Any", which)
            )
        elif name is not None:
            raise StudyError(
                f"Cannot export {what!r} of {name!r}. Expected species, innovations or lineage first, or only a folder."
            )
        else:
            path = realitygap.report.export_individual(what, out, **cast("Any", which | numbers))
    except ValueError as error:
        raise RealityGapError(str(error)) from error
    echo(f"Written: {path}")


def _folder(what: str, name: str | None, numbers: Mapping[str, object]) -> str:
    """Return the folder after a word, with which the options of an individual mean nothing."""
    if name is None:
        raise StudyError(
            f"No results folder. Name one: realitygap export {what} results/paper -o {what}.parquet"
        )
    surplus = [f"--{key}" for key, value in numbers.items() if value is not None]
    if surplus:
        raise StudyError(f"Not for {what}: {', '.join(surplus)}. Leave that out.")
    return name


def export_trials(
    source: Annotated[
        Path,
        typer.Argument(metavar="TRIALS", help="File of trials, or folder of results with a ledger."),
    ],
    out: Annotated[Path | None, export_option()] = None,
    trial: Annotated[
        list[int] | None,
        typer.Option(
            "--trial", metavar="N", help="Number of a trial; may be repeated. [default: all driven]"
        ),
    ] = None,
    wheel_diameter_mm: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            metavar="MM",
            help="Diameter of the wheels, which converts distances to angles. [default: 65]",
        ),
    ] = None,
) -> None:
    """Write driven trials as JSON, Parquet, MCAP, or bags.

    A file that ends in .jsonl has a line for each trial, and one that ends in .parquet a row for each command.

    In bags, commands are TwistStamped on /cmd_vel, poses Odometry on /odom, wheels JointState on /joint_states, and
    range sensors Range on /range_0 and so on. A mapping is written next to each bag, so that `realitygap import` reads
    it. Several trials go to separate bags, such as drive-7.mcap. They need the extra 'ros'.

    Example: realitygap export-trials trials.sqlite -o drive.mcap

    Example: realitygap export-trials results/robot -o steps.parquet

    Example: realitygap export-trials results/robot --trial 3 -o bag

    In Python: realitygap.study.export_trials("trials.sqlite", "drive.mcap")
    """
    write_trials(source, out, trial or (), wheel_diameter_mm)


def write_trials(
    source: Path, out: Path | None, trials: Sequence[int] = (), wheel_diameter_mm: float | None = None
) -> None:
    """Write trials in the format that the name of the output has, and print what was written."""
    if out is None or out.suffix not in ("", ".jsonl", ".parquet", ".mcap"):
        wrong = "" if out is None else f"{out} ends in {out.suffix}. "
        raise StudyError(
            f"{wrong}Name the output with -o: a file that ends in .jsonl, .parquet, or .mcap, or a new folder for a "
            "bag."
        )
    if out.suffix in (".jsonl", ".parquet"):
        if wheel_diameter_mm is not None:
            raise StudyError(f"--wheel-diameter-mm is only for bags, not for {out}. Leave it out.")
        echo(f"Written: {out} ({counted(realitygap.study.write_trials(source, out, trials), 'trial')})")
        return
    diameter = realitygap.logs.WHEEL_DIAMETER_MM if wheel_diameter_mm is None else wheel_diameter_mm
    for report in realitygap.study.export_trials(source, out, trials, wheel_diameter_mm=diameter):
        topics = ", ".join(f"{topic} {n}" for topic, n in report.n_messages.items())
        echo(f"Written: {report.bag} ({topics}); mapping: {report.mapping}")
