"""`realitygap try`: a genome from a file, driven on any platform."""

from __future__ import annotations

import shlex
import statistics
from pathlib import Path
from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import StudyError, did_you_mean
from realitygap.robot_families import port_platforms

from ._code import AllowPlatforms
from ._json import print_json
from ._target import attending_observer


def try_genome(
    genome: Annotated[
        Path,
        typer.Argument(metavar="GENOME", help="Genome from `realitygap export` or `realitygap transfer`."),
    ],
    on: Annotated[
        str,
        typer.Option(
            "--on",
            metavar="PLATFORM",
            help=f"Platform: jyro, sim, sim:FILE, twin:FILE, {port_platforms()}.",
        ),
    ],
    trials: Annotated[int, typer.Option(min=1, max=9999, help="Number of trials.")] = 1,
    steps: Annotated[int, typer.Option(min=1, help="Number of commands per trial.")] = 100,
    observe: Annotated[str, typer.Option(help="Observation level: cells, encoders or track.")] = "cells",
    inputs: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Names of the controller's inputs, such as range.0,range.1,bias, if its file has none.",
        ),
    ] = None,
    outputs: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Names of the controller's outputs: move,turn or left,right."),
    ] = None,
    arena: Annotated[str, typer.Option(metavar="NAME", help="Name or file of an arena.")] = "paper",
    witness: Annotated[
        str | None, typer.Option(metavar="HOST:PORT", help="Witness of an emulator in another program.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the simulator's noise.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            metavar="FILE",
            help="File to save the trials in, one per line. Run the command again to resume.",
        ),
    ] = None,
    allow_code: AllowPlatforms = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the coverage as JSON.")] = False,
) -> None:
    """Drive one exported controller on any platform.

    The command prints how much of the arena the controller covers. A controller can drive in simulation, on a twin, and
    on a real or emulated robot, if the platform has its inputs.

    Example: realitygap try champion.json --on twin:worn-1.toml --trials 20

    In Python: realitygap.study.try_on(target, realitygap.Genome.load("champion.json"), trials=20)
    """
    if observe not in realitygap.records.OBSERVATIONS:
        raise StudyError(
            f"Unknown observation {observe!r}. {did_you_mean(observe, realitygap.records.OBSERVATIONS)}"
        )
    if genome.is_dir():
        raise StudyError(
            f"{genome} is a folder, expected a genome. Export one: realitygap export {shlex.quote(str(genome))} -o "
            "champion.json"
        )
    controller = realitygap.evolution.Genome.load(genome)
    if inputs is not None or outputs is not None:
        seen = controller.interface.inputs if inputs is None else _names(inputs)
        answered = realitygap.evolution.OUTPUTS if outputs is None else _names(outputs)
        controller = controller.with_interface(realitygap.evolution.ControllerInterface(seen, answered))
    observer = attending_observer(on, witness)
    with realitygap.platforms.open_target(
        on, realitygap.world.load_arena(arena), witness=witness, observer=observer, key=seed
    ) as target:
        tried = realitygap.study.try_on(
            target, controller, trials=trials, steps=steps, observe=observe, out=out
        )
        n_cells = target.arena.grid.n_cells
        coverage = [len(trial.cells) / n_cells for trial in tried]
        mean = statistics.fmean(coverage)
        if as_json:
            about = {"target": target.name, "label": target.label, "n_cells": n_cells}
            print_json(about | {"mean": mean, "coverage": coverage})
            return
        echo(
            f"{target.name} ({target.label}): {len(coverage)} trial{'s' if len(coverage) > 1 else ''}, mean coverage "
            f"{mean:.3f} of {n_cells} cells: {' '.join(f'{value:.3f}' for value in coverage)}"
        )


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(","))
