"""`realitygap report` and `realitygap digest`."""

from __future__ import annotations

import time
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

import realitygap
from realitygap._terminal import echo

from ._code import AllowFiles
from ._options import ShowPage

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of results, such as results/paper.")]


def report(
    folder: Folder,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Page to write. [default: DIR/report.html]")
    ] = None,
    figures: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR2", help="Folder for every figure as SVG and PDF, and every table as CSV and LaTeX."
        ),
    ] = None,
    open_page: ShowPage = False,
    allow_code: AllowFiles = False,
) -> None:
    """Write the HTML report of a study.

    The report is one page of settings, tables, and figures. It needs no network.

    Example: realitygap report results/paper

    Example: realitygap report results/paper --figures figures

    In Python: realitygap.write_report("results/paper", figures="figures")
    """
    path = written_report(folder, out, figures=figures, allow_code=allow_code)
    if figures is not None:
        echo(f"Figures and tables: {figures}")
    if open_page:
        show_page(path)


def written_report(
    folder: Path,
    out: Path | None = None,
    *,
    figures: Path | None = None,
    allow_code: bool = False,
    to_stderr: bool = False,
) -> Path:
    """Write a report; print its path and the seconds that it took."""
    started = time.perf_counter()

    path = realitygap.report.write_report(folder, out, figures=figures, allow_code=allow_code)
    echo(f"Written: {path} ({time.perf_counter() - started:.1f} s)", err=to_stderr)
    return path


def digest(folder: Folder) -> None:
    """Print the hash of a study's results.

    The digest does not depend on threads, chunks or interruptions. A different digest means different results. If runs
    are missing, a note on standard error says so.

    Example: realitygap digest results/paper

    In Python: realitygap.ResultsFolder.open("results/paper").digest()
    """
    results = realitygap.records.ResultsFolder.open(folder)
    echo(results.digest())
    if results.missing_note is not None:
        echo(f"realitygap: note: {results.missing_note}", err=True)


def print_finding(title: str, verdict: str, rows: Sequence[tuple[str, str]], *about: str) -> None:
    """Print a title, a verdict, named numbers in words, and lines about them."""
    echo(title)
    echo(verdict)
    width = max(len(name) for name, _ in rows) + 2
    for name, words in rows:
        echo(f"  {name:{width}}{words}")
    for line in about:
        echo(line)


def show_page(path: Path) -> None:
    """Open a page in the user's browser; if there is no browser, print the page's address on standard error."""
    address = path.resolve().as_uri()
    try:
        opened = webbrowser.open(address)
    except (webbrowser.Error, OSError):
        opened = False
    if not opened:
        echo(f"realitygap: note: no browser could be opened here. The page is at {address}", err=True)
