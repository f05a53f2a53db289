"""`realitygap report` and `realitygap digest`: what looks at results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A folder of results, such as results/paper.")]


def report(
    folder: Folder,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The page. [default: DIR/report.html]")
    ] = None,
) -> None:
    """Write the report of a study: one page with settings, tables and figures, that needs no network.

    Example: realitygap report results/paper

    In Python: realitygap.write_report("results/paper")
    """
    from realitygap.report import write_report

    typer.echo(f"Written: {write_report(folder, out)}")


def digest(folder: Folder) -> None:
    """Print the digest of a study's rows.

    It is equal for any number of threads, any chunks and any interruption; another digest means other
    results.

    Example: realitygap digest results/paper

    In Python: realitygap.ResultsFolder.open("results/paper").digest()
    """
    from realitygap.records import ResultsFolder

    typer.echo(ResultsFolder.open(folder).digest())
