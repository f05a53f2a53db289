"""Tables of an audit for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from realitygap._wording import bracketed, significant

from ._tables import table_of

if TYPE_CHECKING:
    from realitygap.report import Audit

_PROBLEMS = {"impossible": "no k/{n}", "cut": "cut, not rounded", "raised": "raised, not rounded"}


def conditions_table(audit: Audit, title: str) -> Table:
    """Return a table with a row for each condition."""
    table = table_of(title)
    _columns(table, ["condition"], ["runs", "mean", "sd", "median", "its 95 % interval"])
    for each in audit.conditions:
        median = (
            "too few runs"
            if each.median_low is None or each.median_high is None
            else f"{significant(each.median_low, 3)} to {significant(each.median_high, 3)}"
        )
        deviation = "-" if each.deviation is None else significant(each.deviation, 3)
        _row(
            table,
            each.condition,
            f"{each.n:,}",
            significant(each.mean, 3),
            deviation,
            significant(each.median, 3),
            median,
        )
    return table


def doubtful_table(audit: Audit) -> Table:
    """Return a table with a row for each value that is not the rounded share that it should be."""
    n = audit.denominator or 1
    table = table_of(f"Values that are not k/{n}, rounded")
    _columns(table, ["line", "condition", "run", "value", "problem", "nearest"], [])
    for each in audit.doubtful:
        digits = len(each.text.partition(".")[2]) + 1
        _row(
            table,
            str(each.line),
            each.condition,
            each.run,
            each.text,
            _PROBLEMS[each.problem].format(n=n),
            f"{each.nearest}/{n} = {each.nearest / n:.{digits}f}",
        )
    return table


def pairs_table(audit: Audit) -> Table:
    """Return a table with a row for each pair of conditions."""
    table = table_of(
        "Each two conditions",
        "A12: how likely a run of the first is above one of the second, [95 % interval]; p by permutation, "
        "Holm's over all pairs; least p: the smallest that so many runs can give; finds: the smallest "
        "difference found in 80 of 100 studies, in standard deviations",
    )
    _columns(table, ["pair"], ["A12", "p", "Holm", "least p", "finds"])
    table.add_column("what may be said", min_width=14)
    for each in audit.pairs:
        _row(
            table,
            f"{each.one} -\n{each.other}",
            f"{each.a12.value:.2f}\n{bracketed(each.a12, 2, '[none]')}",
            f"{each.p:.2g}",
            f"{each.p_holm:.2g}",
            f"{each.smallest_p:.2g}",
            "-" if each.detectable is None else f"{each.detectable:.1f}",
            each.verdict,
        )
    return table


def _columns(table: Table, words: list[str], numbers: list[str]) -> None:
    for name in words:
        table.add_column(name)
    for name in numbers:
        table.add_column(name, justify="right", no_wrap=True)


def _row(table: Table, *cells: str) -> None:
    table.add_row(*cells)
