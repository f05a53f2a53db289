"""Export of the page's figures and tables as separate files."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import polars as pl

from realitygap.errors import RecordError
from realitygap.records import write_whole
from realitygap.report._comparisons import comparisons_frame
from realitygap.report._formats import drawing_bytes
from realitygap.report._latex import latex_table
from realitygap.report._placed import figures_in
from realitygap.report._species_figure import SpeciesCounts
from realitygap.report._structures import structures_frame
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


def export_page(folder: Path, tally: Tally, content: Mapping[str, Any], page: str) -> Exported:
    """Write every figure as SVG and PDF and every table as CSV, numbered ones also as LaTeX.

    Each file is written whole or not at all.

    Args:
        folder: Folder, which is made if it does not exist. Files of other names in it stay.
        tally: Tally of the study.
        content: Content of the page.
        page: Page as HTML. Its tables are written as shown.

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
    for name, caption, rows in tables_of(page):
        write_whole(folder / f"{name}.csv", _csv(rows), within=folder)
        tables.append(f"{name}.csv")
        names = f"{name}.csv"
        if name.startswith("table-"):
            latex = latex_table(caption, name.removeprefix("table-"), rows)
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
    species: SpeciesCounts = gallery["species_counts"]
    yield (
        "data-species",
        "The number of species in each generation of each run.",
        species.counts,
    )


def _csv(rows: list[list[str]]) -> bytes:
    buffer = io.StringIO()
    plain = csv.writer(buffer, lineterminator="\n")
    quoted = csv.writer(buffer, lineterminator="\n", quoting=csv.QUOTE_ALL)
    for row in rows:
        # the writer does not quote a lone carriage return, which ends a row for readers
        (quoted if any("\r" in cell for cell in row) else plain).writerow(row)
    return buffer.getvalue().encode("utf-8", "replace")


# tables of the page


def tables_of(page: str) -> list[tuple[str, str, list[list[str]]]]:
    """Name, caption and rows of each table of a page, as shown; one row of headings, cells over many repeated."""
    reader = _TableReader()
    reader.feed(page)
    reader.close()
    found = []
    for table in reader.tables:
        if not table.caption or table.n_head == 0:
            continue  # filled in by a script, and empty without
        name = table.id.removeprefix("caption-") or "table"
        name = {"common": "settings", "differ": "settings-by-condition"}.get(name, name)
        name = f"table-{name}" if table.caption.startswith("Table ") else name
        found.append((name, table.caption, table.rows()))
    return found


class _Table:
    """A table while it is read."""

    def __init__(self) -> None:
        self.id = ""
        self.caption = ""
        self.cells: dict[tuple[int, int], str] = {}
        self.n_head = 0
        self.row = -1
        self.column = 0

    def place(self, text: str, across: int, down: int) -> None:
        """Put a cell into the next free places of the row, as often as it spans."""
        while (self.row, self.column) in self.cells:
            self.column += 1
        for row in range(self.row, self.row + down):
            for column in range(self.column, self.column + across):
                self.cells[row, column] = text
        self.column += across

    def rows(self) -> list[list[str]]:
        """The rows, the first one holding the headings of each column from above to below."""
        n_columns = max((column for _, column in self.cells), default=-1) + 1
        lines = [
            [self.cells.get((row, column), "") for column in range(n_columns)] for row in range(self.row + 1)
        ]
        head = [
            ": ".join(dict.fromkeys(filter(None, parts))) for parts in zip(*lines[: self.n_head], strict=True)
        ]
        # several columns of one name, such as interval, belong to the column before them with a unique name
        own = [text for text in head if head.count(text) == 1]
        named, last = [], ""
        for text in head:
            last = text if text in own else last
            named.append(text if text == last else f"{last}: {text}")
        # a row that is one cell across the table is a heading within it
        body = [
            [line[0]] + [""] * (n_columns - 1) if n_columns > 1 and len(set(line)) == 1 else line
            for line in lines[self.n_head :]
        ]
        return [named, *body]


class _TableReader(HTMLParser):
    """The tables of a page whose tags close in order."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.tables: list[_Table] = []
        self._open: _Table | None = None
        self._text: list[str] | None = None
        self._span = (1, 1)
        self._in_head = False
        self._is_control = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if tag == "table":
            self._open = _Table()
            self.tables.append(self._open)
        if self._open is None:
            return
        if tag == "thead":
            self._in_head = True
        elif tag == "tr":
            self._open.row += 1
            self._open.column = 0
            self._open.n_head += self._in_head
        elif tag == "details":
            self._is_control = True
        elif tag in ("td", "th", "caption"):
            self._text = []
            self._span = (int(values.get("colspan") or 1), int(values.get("rowspan") or 1))
            if tag == "caption":
                self._open.id = values.get("id") or ""

    def handle_endtag(self, tag: str) -> None:
        table = self._open
        if table is None:
            return
        if tag == "table":
            self._open = None
        elif tag == "thead":
            self._in_head = False
        elif tag == "details":
            self._is_control = False
        elif tag in ("td", "th", "caption") and self._text is not None:
            text = " ".join("".join(self._text).split())
            self._text = None
            if tag == "caption":
                table.caption = text
            else:
                # a program reads the plain minus, and nothing where nothing is
                table.place("" if text == "–" else text.replace("−", "-"), *self._span)

    def handle_data(self, data: str) -> None:
        if self._text is not None and not self._is_control:
            self._text.append(data)
