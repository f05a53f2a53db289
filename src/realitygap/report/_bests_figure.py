"""The best coverage of each run by condition: the figure on the first screen of a report."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import quote

import numpy as np
import numpy.typing as npt

from realitygap._wording import count_range, within
from realitygap.drawing import Ink
from realitygap.report._tally import DescribedCondition, Results, Tally, label_of, read_tally
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import draw_line, draw_rings, hollow, line_key, mark_key, write
from realitygap.report.charts.marks import MOST_MARKS, Panel, Series
from realitygap.report.charts.rows import Row, draw_row, name_rows, stacked
from realitygap.report.charts.sheet import Sheet, grid
from realitygap.stats import MEDIAN_SMALLEST_N, Ends, median_interval, quartiles

HALF = 6.2
"""Width of the figure [in], which shares the first screen with the replay."""

_ROW = 0.3  # height of a condition [in]
_SMALLEST_ROW = 0.13  # of many conditions [in]
_ROWS = 3.6  # height that more conditions share [in]


@dataclass(frozen=True)
class _Row:
    """A condition: its runs, of which the first are drawn, and their median."""

    name: str
    label: str
    values: npt.NDArray[np.float64]
    replicates: tuple[int, ...]
    n_drawn: int
    median: float
    interval: Ends | None
    published: tuple[float, ...]


def draw_bests(folder: Results, *, replayed: Mapping[str, Collection[int]] | None = None) -> Drawing:
    """The best coverage of each run by condition, with medians and intervals.

    Args:
        folder: The results of a study, or the path to them.
        replayed: Runs that the page can play, by condition: a click on one of them plays its best trial.

    Raises:
        RecordError: There is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    tally = read_tally(folder)
    n_drawn = max(5, MOST_MARKS // max(1, len(tally.conditions)))
    rows = [_row(tally, condition, n_drawn) for condition in tally.conditions]
    positions = [stacked(row.values[: row.n_drawn], _top(rows)) for row in rows]
    alt = (
        f"Best coverage of each run in {len(rows)} rows, one per condition: a dot for each run, and the median with "
        "its interval. Their numbers are in the table of results."
    )
    return draw_wide(
        lambda width: _draw(rows, positions, width),
        "bests",
        _caption(tally, rows),
        alt,
        marks=(Panel("bests", tuple(_series(rows, positions, replayed or {})), (3, 2)),),
        width=HALF,
    )


def _row(tally: Tally, condition: DescribedCondition, n_drawn: int) -> _Row:
    name = condition["name"]
    values = tally.run_bests(name, tally.measure)
    return _Row(
        name,
        label_of(condition),
        values,
        tuple(int(run) for run in tally.replicates(name)),
        min(len(values), n_drawn),
        quartiles(values).median if len(values) else float("nan"),
        median_interval(values).ends,
        tuple(condition.get("published") or ()),
    )


def _top(rows: Sequence[_Row]) -> float:
    """Return the right end of the axis: the next twentieth above everything shown."""
    shown = [0.05, *(value for row in rows for value in (*row.values, *row.published))]
    return min(1.0, float(np.ceil(max(shown) * 20 + 0.1)) / 20)


def _series(
    rows: Sequence[_Row],
    positions: Sequence[npt.NDArray[np.float64]],
    replayed: Mapping[str, Collection[int]],
) -> list[Series]:
    series = []
    for index, (row, offsets) in enumerate(zip(rows, positions, strict=True)):
        if not len(row.values):
            continue
        text = f"{{name}}: median {{x}}{within(row.interval)}, n = {len(row.values):,}, {row.label}"
        series.append(Series(text, np.array([[row.median, float(index)]]), row.name))
        runs = row.replicates[: row.n_drawn]
        known = replayed.get(row.name, ())
        n_linked = next((k for k, run in enumerate(runs) if run not in known), len(runs))
        series.append(
            Series(
                "{name}, run {label}: best coverage {x}",
                np.column_stack([row.values[: row.n_drawn], index + offsets]),
                row.name,
                tuple(map(str, runs)),
                f"#replay={quote(row.name, safe='')}/" if n_linked else "",
                n_linked,
            )
        )
    return series


# drawing


def _draw(rows: Sequence[_Row], positions: Sequence[npt.NDArray[np.float64]], width: float) -> Sheet:
    row_height = min(_ROW, max(_SMALLEST_ROW, _ROWS / len(rows)))
    sheet, (axes,) = grid(width, 1, 1, row_height * len(rows))
    axes.set_gid("bests")
    name_rows(axes, [shorten(row.name, 26 if sheet.is_wide else 13) for row in rows])
    axes.set_xlim(0.0, _top(rows))
    axes.set_xlabel("best coverage of a run", labelpad=2)
    for index, (row, offsets) in enumerate(zip(rows, positions, strict=True)):
        if index:
            draw_line(axes, [0.0, 1.0], [index - 0.5] * 2, color=Ink.RULE, linewidth=0.4)
        if not len(row.values):
            write(
                axes, "no runs yet", (0.02, index), (0, 0), 7.5, units=("axes fraction", "data"), va="center"
            )
            continue
        ends = row.interval
        dots = row.values[: row.n_drawn]
        draw_row(axes, index, Row(row.median, ends, dots, offsets, band=True, scale=row_height / _ROW))
        if row.published:
            ys = [index + 0.3] * len(row.published)
            draw_rings(axes, row.published, ys, 4.0, Ink.PUBLISHED, marker="D", zorder=4)
    handles = [
        mark_key("one run", "o", 2.6, color=Ink.RUN, alpha=0.7),
        mark_key("median", "o", 5.0, color=Ink.OURS),
    ]
    if any(row.interval for row in rows):
        handles.append(line_key("its 95 % interval", color=Ink.BAND, linewidth=5))
    if any(row.published for row in rows):
        handles.append(mark_key("the paper’s runs", "D", 4.0, **hollow(Ink.PUBLISHED)))
    sheet.key(handles)
    return sheet


# words


def _caption(tally: Tally, rows: Sequence[_Row]) -> str:
    labels = " and ".join(sorted({row.label for row in rows}))
    counts = sorted({len(row.values) for row in rows if len(row.values)})
    parts = [
        f"Best coverage of each run by condition (cells {tally.counted}). {labels}, "
        f"n = {count_range(counts)} runs per condition."
    ]
    if any(row.n_drawn < len(row.values) for row in rows):
        most = max(row.n_drawn for row in rows)
        parts.append(f"Dots show the first {most:,} runs of a condition; medians and intervals use all runs.")
    if counts[-1] < MEDIAN_SMALLEST_N:
        parts.append(f"Fewer than {MEDIAN_SMALLEST_N} runs give no interval of 95 %.")
    return " ".join(parts)
