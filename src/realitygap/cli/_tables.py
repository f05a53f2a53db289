"""Tables for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

if TYPE_CHECKING:
    import polars as pl


def summary_table(summary: pl.DataFrame, title: str) -> Table:
    """Best coverage of a run: one row a condition, by line and by the ends of steps."""
    published = any(values is not None for values in summary["published"].to_list())
    table = Table(
        title=f"{title}: best coverage of a run (share of the reachable cells)",
        caption="median, quartiles, [interval of the median, at least 95 %]; "
        "line: cells the line crosses, ends: cells in which steps end",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("condition", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("n", justify="right")
    for kind in ("line", "ends"):
        table.add_column(kind, justify="right", no_wrap=True)
        table.add_column("quartiles", no_wrap=True)
        table.add_column("interval", no_wrap=True)
    if published:
        table.add_column("published", no_wrap=True)
    for row in summary.iter_rows(named=True):
        cells = [row["condition"], row["label"], f"{row['n']:,}"]
        for kind in ("line", "ends"):
            cells += [
                _number(row[f"{kind}_median"]),
                f"{_number(row[f'{kind}_q25'])}-{_number(row[f'{kind}_q75'])}",
                "n too small"
                if row[f"{kind}_low"] is None
                else f"[{_number(row[f'{kind}_low'])}, {_number(row[f'{kind}_high'])}]",
            ]
        if published:
            cells.append(" ".join(_number(value) for value in row["published"] or []))
        table.add_row(*cells)
    return table


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}".replace("0.", ".", 1)
