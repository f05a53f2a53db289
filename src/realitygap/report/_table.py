"""A table as data, from which its markup and its files are made."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        head: Its heading.
        group: Heading above it and its neighbors with the same group; empty for none.
        kind: Classes of its cells in a style sheet.
        head_kind: Classes of its heading.
        is_code: True if its heading is code.
    """

    head: str
    group: str = ""
    kind: str = ""
    head_kind: str = ""
    is_code: bool = False


@dataclass(frozen=True)
class Cell:
    """A cell that does not look as its column does.

    Attributes:
        text: Its text.
        kind: Classes of the cell in a style sheet. Default: that of its column.
        element: What encloses the text: code, a mark, or a span for a missing value.
        more: Less important text behind it.
    """

    text: str
    kind: str | None = None
    element: Literal["", "code", "mark", "none"] = ""
    more: str = ""


Row = Sequence[str | Cell]


@dataclass(frozen=True)
class Part:
    """Rows of a table that belong together.

    Attributes:
        rows: The rows, with a cell for each column. The first cell names its row.
        title: Heading of the rows across the table; empty for none.
    """

    rows: Sequence[Row]
    title: str = ""


@dataclass(frozen=True)
class TableOnPage:
    """A table of a page.

    Attributes:
        name: Name, from which its address on the page and its files are named.
        caption: What it shows.
        columns: Its columns.
        parts: Its rows.
        kind: Classes of the table in a style sheet.
        separates_parts: True if each part is a body of its own.
        number: Number on the page, from 1; 0 for a table without one.
    """

    name: str
    caption: str
    columns: tuple[Column, ...]
    parts: tuple[Part, ...]
    kind: str = "numbers statistics"
    separates_parts: bool = False
    number: int = 0

    @property
    def title(self) -> str:
        """Its name for people, such as Table 1; empty without a number."""
        return f"Table {self.number}" if self.number else ""

    @property
    def file(self) -> str:
        """Name of its files without ending."""
        return f"table-{self.name}" if self.number else self.name

    @property
    def groups(self) -> list[tuple[str, tuple[Column, ...]]]:
        """Neighboring columns with the same group; one item without a heading if there are no groups."""
        return [
            (name, tuple(columns)) for name, columns in itertools.groupby(self.columns, lambda c: c.group)
        ]

    @property
    def cells(self) -> list[tuple[str, list[tuple[Cell, ...]]]]:
        """The rows of each part with its title; kinds of columns are filled in."""
        return [(part.title, [self._cells(row) for row in part.rows]) for part in self.parts]

    def _cells(self, row: Row) -> tuple[Cell, ...]:
        return tuple(
            Cell(cell, column.kind)
            if isinstance(cell, str)
            else replace(cell, kind=column.kind if cell.kind is None else cell.kind)
            for cell, column in zip(row, self.columns, strict=True)
        )

    @property
    def heads(self) -> list[str]:
        """A heading for each column that none other has."""
        heads = [": ".join(filter(None, (column.group, column.head))) for column in self.columns]
        named, last = [], ""
        for head in heads:
            # several columns of one name, such as interval, belong to the column before them with a unique name
            last = head if heads.count(head) == 1 else last
            named.append(head if head == last else f"{last}: {head}")
        return named

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """The texts of its rows as shown, without titles of parts."""
        return [tuple(map(_text, row)) for part in self.parts for row in part.rows]

    @property
    def texts(self) -> list[list[str]]:
        """The texts of its rows for a program: a plain minus, and nothing for a missing value."""
        rows = []
        for part in self.parts:
            rows += [[part.title, *[""] * (len(self.columns) - 1)]] if part.title else []
            rows += [[_plain(_text(cell)) for cell in row] for row in part.rows]
        return rows


def _text(cell: str | Cell) -> str:
    return cell if isinstance(cell, str) else cell.text + cell.more


def _plain(text: str) -> str:
    text = " ".join(text.split())
    return "" if text == "–" else text.replace("−", "-")


_UNNUMBERED = frozenset({"structures", "settings-by-condition", "settings", "columns"})
"""Names of the long tables of a report, which have no number."""


def numbered(tables: Iterable[TableOnPage]) -> list[TableOnPage]:
    """Return tables with their numbers, in the order given."""
    numbers = itertools.count(1)
    return [table if table.name in _UNNUMBERED else replace(table, number=next(numbers)) for table in tables]


_ESCAPES = {
    **{letter: f"\\{letter}" for letter in "&%$#_{}"},
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\N{EN DASH}": "--",
    "\N{EM DASH}": "---", "\N{RIGHT SINGLE QUOTATION MARK}": "'", "\N{LEFT DOUBLE QUOTATION MARK}": "``",
    "\N{RIGHT DOUBLE QUOTATION MARK}": "''", "…": r"\ldots{}", "±": r"$\pm$", "\N{MULTIPLICATION SIGN}": r"$\times$",
    "≥": r"$\ge$", "≤": r"$\le$",
}  # fmt: skip
_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_POWER = re.compile("·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_NUMBER = re.compile(r"\[[^]]*\].*|[<>=]? ?[+-]?[\d.,]+(?:·10[^\d\s]+)?(?: ?%)?(?:[\N{EN DASH}\s].*)?|")


def latex_table(caption: str, label: str, rows: Sequence[Sequence[str]]) -> str:
    r"""Return a table as LaTeX for the package booktabs.

    Args:
        caption: Its caption without a number, because LaTeX numbers tables.
        label: For `\ref`, without `tab:`.
        rows: Cells; the first row has the heads. A row with a first cell alone is a heading across the table.
    """
    head, *body = rows
    columns = zip(*(row for row in body if any(row[1:])), strict=True)
    kinds = "".join("r" if all(map(_NUMBER.fullmatch, column)) else "l" for column in columns) or "l" * len(
        head
    )
    lines = [
        r"\begin{table}",
        r"\centering",
        rf"\caption{{{_escaped(caption)}}}",
        rf"\label{{tab:{label}}}",
        rf"\begin{{tabular}}{{{kinds}}}",
        r"\toprule",
        _row(head),
        r"\midrule",
        *(_row(row) if any(row[1:]) or len(row) == 1 else _across(row) for row in body),
        r"\bottomrule",
        r"\end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def _row(cells: Sequence[str]) -> str:
    return " & ".join(map(_escaped, cells)) + r" \\"


def _across(row: Sequence[str]) -> str:
    return rf"\multicolumn{{{len(row)}}}{{l}}{{\textit{{{_escaped(row[0])}}}}} \\"


def _escaped(text: str) -> str:
    plain = "".join(_ESCAPES.get(letter, letter) for letter in text)
    plain = re.sub(r"(?<![\w-])-(?=[\d.])", "$-$", plain)
    return _POWER.sub(lambda match: rf"$\cdot10^{{{match[1].translate(_SUPERSCRIPTS)}}}$", plain)
