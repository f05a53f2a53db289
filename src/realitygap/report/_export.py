"""Export of the page's figures and tables as separate files."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from realitygap.errors import RecordError
from realitygap.records import write_whole
from realitygap.report._comparisons import comparisons_frame
from realitygap.report._formats import drawing_bytes
from realitygap.report._placed import figures_in
from realitygap.report._structures import structures_frame
from realitygap.report._table import latex_table
from realitygap.report._tally import Tally

_NOTES = "figures.txt"
"""Content of each file."""


@dataclass(frozen=True)
class Exported:
    """The names of the files that were written.

    Attributes:
        folder: Folder of the export.
        figures: Names of the figures without ending. Each is written as SVG and as PDF.
        tables: Names of the CSV files with the page's tables as shown. Numbered ones are also written as .tex.
        data: Names of the CSV files with the numbers of figures, in full precision.
    """

    folder: Path
    figures: tuple[str, ...]
    tables: tuple[str, ...]
    data: tuple[str, ...]


def export_page(folder: Path, tally: Tally, content: Mapping[str, Any]) -> Exported:
    """Write every figure as SVG and PDF and every table as CSV, numbered ones also as LaTeX.

    Each file is written whole or not at all.

    Args:
        folder: Folder, which is made if it does not exist. Files of other names in it stay.
        tally: Tally of the study.
        content: Content of the page.

    Raises:
        RecordError: the folder or a file cannot be written.
    """
    if folder.resolve() == (tally.folder.path / "trials").resolve():
        raise RecordError(f"{folder} holds the rows of the study and nothing else. Name another folder.")
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise RecordError(
            f"Could not make the folder {folder}: {error.strerror or error}. Name another one."
        ) from error
    notes = []
    figures = []
    for figure in sorted(figures_in(content), key=lambda each: each.number):
        name = figure.anchor
        for ending in (".svg", ".pdf"):
            write_whole(
                folder / (name + ending), drawing_bytes(figure.drawing, ending, figure.title), within=folder
            )
        figures.append(name)
        notes.append(f"{name}.svg, {name}.pdf\n    {figure.title}. {figure.caption}")
    tables = []
    for table in content["tables"].values():
        name = table.file
        rows = [[head.replace("−", "-") for head in table.heads], *table.texts]
        caption = f"{table.title}. {table.caption}" if table.number else table.caption
        write_whole(folder / f"{name}.csv", _csv(rows), within=folder)
        tables.append(f"{name}.csv")
        names = f"{name}.csv"
        if table.number:
            latex = latex_table(table.caption, table.name, rows)
            write_whole(folder / f"{name}.tex", latex.encode("utf-8", "replace"), within=folder)
            names += f", {name}.tex"
        notes.append(f"{names}\n    {caption}")
    data = []
    for name, caption, frame in _frames(tally, content):
        write_whole(folder / f"{name}.csv", frame.write_csv().encode("utf-8"), within=folder)
        data.append(f"{name}.csv")
        notes.append(f"{name}.csv\n    {caption}")
    about = f"Figures and tables of {content['title']}, digest {content['digest']}, realitygap {content['version']}."
    text = "\n\n".join([about, *notes]) + "\n"
    write_whole(folder / _NOTES, text.encode("utf-8", "replace"), within=folder)
    return Exported(folder, tuple(figures), tuple(tables), tuple(data))


def _frames(tally: Tally, content: Mapping[str, Any]) -> Iterator[tuple[str, str, pl.DataFrame]]:
    yield (
        "data-coverage-by-generation",
        "The highest coverage of each generation of each run, along the line and by ends of steps.",
        tally.best,
    )
    yield "data-coverage-by-run", "The highest coverage of each run.", tally.runs
    for basis, name, of in (
        ("recorded", "data-comparisons", "recorded best coverages"),
        ("fresh", "data-fresh", "the best networks on fresh noise"),
    ):
        if content["compared"][basis]:
            frame = comparisons_frame(content["compared"][basis])
            yield name, f"Differences of {of} between conditions, in full precision.", frame
    gallery = content["gallery"]
    structures = structures_frame(gallery["structure_groups"])
    yield "data-structures", "All structures of the networks in the last generations.", structures
    yield (
        "data-species",
        "The number of species in each generation of each run.",
        gallery["species_counts"],
    )


def _csv(rows: list[list[str]]) -> bytes:
    buffer = io.StringIO()
    plain = csv.writer(buffer, lineterminator="\n")
    quoted = csv.writer(buffer, lineterminator="\n", quoting=csv.QUOTE_ALL)
    for row in rows:
        # the writer does not quote a lone carriage return, which ends a row for readers
        (quoted if any("\r" in cell for cell in row) else plain).writerow(row)
    return buffer.getvalue().encode("utf-8", "replace")
