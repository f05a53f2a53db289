"""Fields that several orders have, each with its type, range, and help."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator
from pydantic_core import PydanticKnownError

from realitygap.robot_families import port_platforms

from ._field import argument, option
from ._order import Order

ONLY_ROBOTS = "Only for robots"
ONLY_TWINS = "Only for twins"
ONLY_LOCKED = "Lock the design"
ONLY_TABLES = "Only for tables of scores"

ALPHA = 0.05
"""Default error rate of a sequential test."""

_MOST_SEED = 2**63 - 1
"""Integers of kernels and of TOML have 64 bits. No help text shows this limit, because it has 19 digits."""


def _refuse_long(seed: int) -> int:
    if seed > _MOST_SEED:
        raise PydanticKnownError("less_than_equal", {"le": _MOST_SEED})
    return seed


Seed = Annotated[int, AfterValidator(_refuse_long)]

Witness = Annotated[
    str | None,
    option(
        help="Witness of an emulator in another program. It places the robot and observes its path.",
        metavar="HOST:PORT",
        panel=ONLY_ROBOTS,
        label="Witness",
    ),
]

Processes = Annotated[
    int | None,
    option(
        help="Number of twin trials to run in parallel.",
        default_is="all processors",
        at_least=1,
        panel=ONLY_TWINS,
    ),
]

Lock = Annotated[
    bool,
    option(
        help="Lock the design before trial 1: hash, random order, and rules. Reports then list deviations from it.",
        panel=ONLY_LOCKED,
        label="Lock the design",
    ),
]

Blind = Annotated[
    bool,
    option(
        help="Lock the design, and show no result by arm until `realitygap trials unblind`.",
        panel=ONLY_LOCKED,
        label="Blind",
    ),
]


def arena_option(default: str | None = "paper", *, default_is: str = "") -> Any:
    """Return the field of an arena."""
    return option(
        default,
        help="Arena by name or file.",
        default_is=default_is,
        metavar="ARENA",
        label="Arena",
        refers="file",
    )


def seed_option(
    default: int | None = 1, *, default_is: str = "", help: str = "Seed of all random numbers."
) -> Any:
    """Return the field of a seed."""
    return option(default, help=help, default_is=default_is, at_least=0, label="Seed")


def folder_option(default_is: str) -> Any:
    """Return the field of a folder for results."""
    return option(
        None,
        help="Folder for the results.",
        default_is=default_is,
        metavar="DIR",
        names=("-o", "--out"),
        is_output=True,
    )


def task_option(default: str | None = "coverage", *, default_is: str = "") -> Any:
    """Return the field of the task that scores trials."""
    return option(
        default,
        help="Task that scores trials: coverage, avoid, light, wall, goal or python:FILE.py:function.",
        default_is=default_is,
        metavar="KIND",
        label="Task",
        refers="file",
    )


def margin_option() -> Any:
    """Return the field of a margin of equivalence."""
    return option(
        None,
        help="Largest difference in score that counts as equivalent, such as 0.05.",
        above=0,
        metavar="M",
        label="Margin of equivalence",
    )


def score_option(**face: str) -> Any:
    """Return the field of the column with the scores of a table."""
    return option(
        None,
        help="Column with the scores.",
        default_is="score, or success",
        metavar="COLUMN",
        **face,  # type: ignore[arg-type]  # mypy takes them for limits
    )


def alpha_option(**face: str) -> Any:
    """Return the field of the error rate of a sequential test."""
    return option(
        ALPHA,
        help="Error rate: probability to claim a difference if there is none, at any number of looks.",
        above=0,
        at_most=0.5,
        metavar="A",
        **face,  # type: ignore[arg-type]
    )


def controller_option(**face: str) -> Any:
    """Return the field of the only controller of a table."""
    return option(
        None,
        help="Name of the only controller, if the table has no column for it.",
        default_is="a column",
        metavar="NAME",
        **face,  # type: ignore[arg-type]
    )


class PairOrder(Order):
    """The fields of every order that runs the same controllers on two platforms."""

    sim: str = argument("SIM", help="Simulator: sim, sim:FILE or jyro.", label="Simulator", refers="platform")
    target: str = argument(
        "TARGET",
        help=f"Target: twin:FILE, {port_platforms()}, recorded:FILE, sim, sim:FILE or jyro.",
        label="Target",
        refers="platform",
    )
    controllers: str = option(
        "random",
        help="random for random networks; or a study or a folder of results, for its champions.",
        metavar="WHICH",
        label="Controllers from",
        refers="file",
    )
    n_controllers: int = option(
        30, help="Number of controllers.", at_least=2, at_most=1024, label="Controllers"
    )
    task: str | None = task_option(None, default_is="the task of the controllers; coverage for random ones")
    trials: int = option(
        10,
        help="Trials per controller and platform.",
        at_least=1,
        at_most=4096,
        label="Trials per controller",
    )


class MeasureOrder(PairOrder):
    """The fields of every order that measures with any target, and saves its trials in a file."""

    observe: Literal["readings", "cells", "encoders", "track"] | None = option(
        None, help="Data recorded on the target.", default_is="what the task needs", label="Observation level"
    )
    arena: str | None = arena_option(None, default_is="that of the controllers")
    noise: float | None = option(
        None,
        help="Noise level a of the paper, on simulators.",
        default_is="0.1 on jyro, 0 on others",
        at_least=0,
        at_most=10,
        label="Noise",
    )
    results: Path | None = option(
        None,
        help="File to save the target's trials in (.sqlite). Run the command again to resume.",
        metavar="FILE",
        names=("-o", "--out"),
        is_output=True,
    )
    lock: Lock = False
    blind: Blind = False
    processes: Processes = None
    witness: Witness = None
    seed: Seed = seed_option()
