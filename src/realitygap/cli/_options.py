"""Options that several commands have in the same words, and results as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from typer.models import OptionInfo

from realitygap._terminal import echo

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
OpenPage = Annotated[
    bool, typer.Option("--open", help="When done, write the report and show it in the browser.")
]
ShowPage = Annotated[bool, typer.Option("--open", help="When done, show the page in the browser.")]
Replicates = Annotated[int | None, typer.Option(min=1, help="Runs per condition. [default: from the study]")]
StudyFolder = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder for the results. [default: results/NAME]")
]
StudySeed = Annotated[int | None, typer.Option(min=0, help="Seed of the study. [default: from the study]")]


def who_option(panel: str | None = None) -> OptionInfo:
    """Return the option of the person who counts cells."""
    option: OptionInfo = typer.Option(
        metavar="NAME",
        help="Name to record with each entry. [default: your account's name]",
        rich_help_panel=panel,
    )
    return option


def second_option(panel: str) -> OptionInfo:
    """Return the option of a second count."""
    option: OptionInfo = typer.Option(
        "--second", help="Enter the cells as a second count, only for the agreement.", rich_help_panel=panel
    )
    return option


def correct_option(panel: str) -> OptionInfo:
    """Return the option of a correction."""
    option: OptionInfo = typer.Option(
        "--correct",
        help="Enter the cells as a correction, after the generation was closed. Only reports use it.",
        rich_help_panel=panel,
    )
    return option


def print_json(values: object) -> None:
    """Print plain values as JSON that any program reads: null stands for nan and infinities, and text for paths."""
    echo(json.dumps(_plain(values), indent=2, allow_nan=False))


def _plain(value: object) -> object:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {key: _plain(part) for key, part in value.items()}
    return [_plain(part) for part in value] if isinstance(value, list | tuple) else value


def export_option(panel: str | None = None) -> OptionInfo:
    """Return the option of the file to which trials are exported."""
    option: OptionInfo = typer.Option(
        "-o",
        "--out",
        metavar="NAME",
        help="File that ends in .jsonl, .parquet, or .mcap, or folder of a new bag.",
        rich_help_panel=panel,
    )
    return option
