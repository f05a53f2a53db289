"""A table as LaTeX."""

from __future__ import annotations

import re
from collections.abc import Sequence

_ESCAPES = {
    **{letter: f"\\{letter}" for letter in "&%$#_{}"},
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\N{EN DASH}": "--",
    "\N{EM DASH}": "---", "\N{RIGHT SINGLE QUOTATION MARK}": "'", "\N{LEFT DOUBLE QUOTATION MARK}": "``",
    "\N{RIGHT DOUBLE QUOTATION MARK}": "''", "…": r"\ldots{}", "±": r"$\pm$", "\N{MULTIPLICATION SIGN}": r"$\times$",
    "≥": r"$\ge$", "≤": r"$\le$",
}  # fmt: skip
_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_POWER = re.compile("·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_NUMBER = re.compile(r"[<>=]? ?[+-]?[\d.,]+(?:·10[^\d\s]+)?(?: ?%)?(?:[\N{EN DASH}\s].*)?|")


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
