"""The order of trials of one controller."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, Literal

from realitygap.robot_families import port_platforms

from ._field import argument, option
from ._order import Order
from ._shared import Seed, Witness, arena_option, seed_option


class TryOrder(Order):
    """Drive one exported controller on any platform.

    The command prints how much of the arena the controller covers. A controller can drive in simulation, on a twin, and
    on a real or emulated robot, if the platform has its inputs.

    Example: realitygap try champion.json --on twin:worn-1.toml --trials 20

    In Python: realitygap.study.try_genome("champion.json", on="twin:worn-1.toml", trials=20)
    """

    command: ClassVar[str] = "try"

    genome: Path = argument(
        "GENOME", help="Genome from `realitygap export` or `realitygap transfer`.", refers="file"
    )
    on: str = option(
        help=f"Platform: jyro, sim, sim:FILE, twin:FILE, {port_platforms()}.",
        metavar="PLATFORM",
        refers="platform",
    )
    trials: int = option(1, help="Number of trials.", at_least=1, at_most=9999)
    steps: int = option(100, help="Number of commands per trial.", at_least=1)
    observe: Literal["readings", "cells", "encoders", "track"] = option(
        "cells", help="Observation level: cells, encoders or track.", metavar="HOW"
    )
    inputs: str | None = option(
        None,
        help="Names of the controller's inputs, such as range.0,range.1,bias, if its file has none.",
        metavar="NAMES",
    )
    outputs: str | None = option(
        None, help="Names of the controller's outputs: move,turn or left,right.", metavar="NAMES"
    )
    arena: str = arena_option()
    witness: Witness = None
    seed: Seed = seed_option(0)
    out: Path | None = option(
        None,
        help="File to save the trials in, one per line. Run the command again to resume.",
        metavar="FILE",
        names=("-o", "--out"),
        is_output=True,
    )
