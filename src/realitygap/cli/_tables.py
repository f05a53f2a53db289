"""Tables for the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from realitygap._wording import FEW_RUNS, MISSING, number

if TYPE_CHECKING:
    import polars as pl
    from rich.table import Table

    from realitygap._console import PlainConsole
    from realitygap.world import Calibration

NARROWEST = 78
"""Width below which numbers of a table would be cut; on a narrower terminal, lines wrap."""


def wide_console() -> PlainConsole:
    """Return a console that is wide enough for tables."""
    from realitygap._console import PlainConsole

    console = PlainConsole()
    return console if console.width >= NARROWEST else PlainConsole(width=NARROWEST)


def summary_table(summary: pl.DataFrame, title: str) -> Table:
    """Return the best coverage of a run: one row a condition, along the line and at the ends of steps."""
    labels = ", ".join(sorted(set(summary["label"].to_list())))
    table = table_of(
        f"{title}\nBest coverage of a run, share of the reachable cells ({labels})",
        "median [its interval, at least 95 %] and quartiles; line: cells that the line crosses, "
        "ends: cells in which steps end",
    )
    table.pad_edge = False  # so that it fits into 80 columns
    table.add_column("condition", overflow="fold")
    table.add_column("runs", justify="right", no_wrap=True)
    table.add_column("line", no_wrap=True)
    table.add_column("ends", no_wrap=True)
    published = any(values is not None for values in summary["published"].to_list())
    if published:
        table.add_column("published", no_wrap=True)
    for row in summary.iter_rows(named=True):
        cells = [row["condition"], f"{row['n']:,}"]
        for measure in ("line", "ends"):
            median, q25, q75, low, high = (
                number(row[f"{measure}_{name}"]) for name in ("median", "q25", "q75", "low", "high")
            )
            is_unseen = median == MISSING and row["n"]
            cells.append("not seen" if is_unseen else _spread(median, (low, high), (q25, q75)))
        if published:
            cells.append(textwrap.fill(" ".join(number(value) for value in row["published"] or []), 11))
        table.add_row(*cells)
    return table


def task_table(summary: pl.DataFrame, title: str) -> Table:
    """Return the best fitness of a run by its task: one row a condition, and how far evolution brought it."""
    labels = ", ".join(sorted(set(summary["label"].to_list())))
    tasks = ", ".join(dict.fromkeys(summary["task"].to_list()))
    table = table_of(
        f"{title}\nFitness by the task {tasks} ({labels})",
        "first, last: median of the best in the first and in the last generation; run: median of the "
        "best of a whole run [its interval, at least 95 %] and quartiles",
    )
    table.add_column("condition", overflow="fold")
    for name in ("runs", "first", "last"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("run", no_wrap=True)
    for row in summary.iter_rows(named=True):
        first, last, median, q25, q75, low, high = (
            number(row[name]) for name in ("first", "last", "median", "q25", "q75", "low", "high")
        )
        spread = _spread(median, (low, high), (q25, q75))
        table.add_row(row["condition"], f"{row['n']:,}", first, last, spread)
    return table


def _spread(median: str, ends: tuple[str, str], middle: tuple[str, str]) -> str:
    """Return a median with its interval, and the quartiles below. Without an interval, they have their name."""
    if ends[0] != MISSING:
        return f"{median} [{ends[0]}, {ends[1]}]\n{middle[0]} to {middle[1]}"
    return f"{median} {FEW_RUNS}\nQ1–Q3 {middle[0]}–{middle[1]}" if median != MISSING else median


def calibration_table(calibration: Calibration) -> Table:
    """Return a table of fitted parameters, one per row, with interval and whether it is identified."""
    table = table_of(
        f"Calibration of {calibration.kind}, {calibration.target} ({calibration.label}), {calibration.trials} "
        f"trials, observed: {calibration.observe}"
    )
    table.add_column("parameter", overflow="fold")
    table.add_column("estimate", justify="right", no_wrap=True)
    table.add_column("90 % interval", no_wrap=True)
    table.add_column("identified", no_wrap=True)
    for each in calibration.fitted:
        estimate, interval = each.shown
        cells = [each.name, f"{estimate} {each.unit}".rstrip(), interval]
        table.add_row(*cells, "yes" if each.identified else "no")
    return table


def table_of(title: str, caption: str = "") -> Table:
    """Return a table without columns yet."""
    from rich import box
    from rich.table import Table

    return Table(
        title=title,
        caption=caption or None,
        title_justify="left",
        caption_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD,
    )


def held_out_table(held_out: dict[str, Any], label: str) -> Table:
    """Return errors on what a fit did not see: one row a prediction, the fit first."""
    unit = f" [{held_out['unit']}]" if held_out["unit"] else ""
    table = table_of(
        f"Not seen by the fit ({label}, n = {held_out['n']:,}){unit}", f"error: {held_out['measure']}"
    )
    table.add_column("prediction", no_wrap=True)
    table.add_column("error", justify="right", no_wrap=True)
    for name in held_out["more"]:
        table.add_column(name, justify="right")
    for name, error in held_out["errors"].items():
        more = [held_out["more"][key].get(name) for key in held_out["more"]]
        table.add_row(name, f"{error:.3g}", *(MISSING if x is None else f"{x:.3g}" for x in more))
    return table


def print_rows(heads: Sequence[str] | None, rows: Sequence[Sequence[object]]) -> None:
    """Print rows as columns, with heads above them if there are any; long cells are folded."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD if heads else None, show_header=heads is not None)
    for head in heads or rows[0]:
        table.add_column(str(head), overflow="fold")
    for row in rows:
        table.add_row(*(str(cell) for cell in row))
    wide_console().print(table)
