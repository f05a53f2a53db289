"""The best coverage of each run by condition: the figure on the first screen of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from realitygap.drawing import Ink
from realitygap.report._drawing import (
    Drawing,
    draw_line,
    draw_wide,
    mark_key,
    new_figure,
    place_axes,
    shorten,
    write,
)
from realitygap.report._marks import MOST_MARKS, Panel, Series
from realitygap.report._tally import Results, Tally, label_of, read_tally
from realitygap.stats import MEDIAN_SMALLEST_N, Ends, median_interval, quartiles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HALF = 6.2
"""Width of the figure [in], which shares the first screen with the replay."""

_ROW = 0.3  # height of a condition [in]
_SMALLEST_ROW = 0.13  # of many conditions [in]
_ROWS = 3.6  # height that more conditions share [in]
_BINS = 120  # places along the axis within which dots are stacked
_STEP = 0.13  # between dots of a stack [rows]
_REACH = 0.36  # of a stack, above and below the middle of its row [rows]


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


def draw_bests(folder: Results, *, links: Mapping[tuple[str, int], str] | None = None) -> Drawing:
    """The best coverage of each run by condition, with medians and intervals.

    Args:
        folder: The results of a study, or the path to them.
        links: Target of a click on a run, by condition and replicate.

    Raises:
        RecordError: There is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    tally = read_tally(folder)
    n_drawn = max(5, MOST_MARKS // max(1, len(tally.conditions)))
    rows = [_row(tally, condition, n_drawn) for condition in tally.conditions]
    positions = [_positions(row.values[: row.n_drawn], _top(rows)) for row in rows]
    alt = (
        f"Best coverage of each run in {len(rows)} rows, one per condition: a dot for each run, and the median with "
        "its interval. Their numbers are in the table of results."
    )
    return draw_wide(
        lambda width: _draw(rows, positions, width),
        "bests",
        _caption(tally, rows),
        alt,
        marks=(Panel("bests", tuple(_series(rows, positions, links or {})), (3, 2)),),
        width=HALF,
    )


def _row(tally: Tally, condition: Mapping[str, Any], n_drawn: int) -> _Row:
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


def _positions(values: npt.NDArray[np.float64], top: float) -> npt.NDArray[np.float64]:
    """Return (n,) how far each dot is from the middle of its row [rows], so that equal values are stacked."""
    positions = np.zeros(len(values))
    bins = np.floor(values / top * _BINS + 1e-9)
    for each in np.unique(bins):
        stack = np.flatnonzero(bins == each)
        step = min(_STEP, 2 * _REACH / max(1, len(stack) - 1))
        # from the middle outwards, so that the first runs are next to the median's mark
        offsets = (np.arange(len(stack)) - (len(stack) - 1) / 2) * step
        positions[stack] = offsets[np.argsort(np.abs(offsets), kind="stable")]
    return positions


def _series(
    rows: Sequence[_Row],
    positions: Sequence[npt.NDArray[np.float64]],
    links: Mapping[tuple[str, int], str],
) -> list[Series]:
    series = []
    for index, (row, offsets) in enumerate(zip(rows, positions, strict=True)):
        if not len(row.values):
            continue
        interval = row.interval
        within = "" if interval is None else f" [{interval[0]:.3f}, {interval[1]:.3f}]"
        text = f"{{name}}: median {{x}}{within}, n = {len(row.values):,}, {row.label}"
        series.append(Series(text, np.array([[row.median, float(index)]]), row.name))
        runs = row.replicates[: row.n_drawn]
        linked = next((k for k, run in enumerate(runs) if (row.name, run) in links), 0)
        points = np.column_stack([row.values[: row.n_drawn], index + offsets])
        link = links.get((row.name, runs[linked]), "")
        series.append(
            Series(
                "{name}, run {label}: best coverage {x}",
                points,
                row.name,
                tuple(map(str, runs)),
                link,
                linked,
            )
        )
    return series


# drawing


def _draw(rows: Sequence[_Row], positions: Sequence[npt.NDArray[np.float64]], width: float) -> Figure:
    letters = 26 if width >= 6 else 13
    names = [shorten(row.name, letters) for row in rows]
    left = 0.16 + 0.074 * max(map(len, names))
    bottom, legend, top = 0.42, 0.24 if width >= 6 else 0.44, 0.06
    row_height = min(_ROW, max(_SMALLEST_ROW, _ROWS / len(rows)))
    height = top + row_height * len(rows) + bottom + legend
    figure = new_figure(width, height)
    axes = place_axes(figure, left, top, width - left - 0.12, row_height * len(rows))
    axes.set_gid("bests")
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlim(0.0, _top(rows))
    axes.set_yticks(range(len(rows)), names)
    axes.tick_params(axis="y", length=0, pad=4)
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x", color=Ink.RULE, linewidth=0.5)
    axes.set_xlabel("best coverage of a run", labelpad=2)
    for index, (row, offsets) in enumerate(zip(rows, positions, strict=True)):
        _draw_row(axes, row, index, offsets, row_height / _ROW)
    _draw_legend(figure, rows, width, legend - 0.04)
    return figure


def _draw_row(axes: Axes, row: _Row, index: int, offsets: npt.NDArray[np.float64], scale: float) -> None:
    if index:
        draw_line(axes, [0.0, 1.0], [index - 0.5] * 2, color=Ink.RULE, linewidth=0.4)
    if not len(row.values):
        write(
            axes, "no runs yet", (0.02, index), (0, 0), 7.5, xycoords=("axes fraction", "data"), va="center"
        )
        return
    values = row.values[: row.n_drawn]
    # a piece of no length with a round end is a dot, in a fifth of the bytes of a marker
    xs = np.column_stack([values, values, np.full(len(values), np.nan)]).ravel()
    ys = np.column_stack([index + offsets, index + offsets, np.full(len(values), np.nan)]).ravel()
    draw_line(
        axes, xs, ys, color=Ink.RUN, alpha=0.55, linewidth=1.6 + scale, solid_capstyle="round", zorder=2
    )
    if row.interval is not None:
        ends = list(row.interval)
        draw_line(
            axes,
            ends,
            [index] * 2,
            color=Ink.BAND,
            linewidth=5 * scale,
            alpha=0.85,
            solid_capstyle="butt",
            zorder=3,
        )
    style = {"marker": "o", "linestyle": "", "markersize": 2 + 3 * scale, "color": Ink.OURS, "zorder": 5}
    draw_line(axes, [row.median], [index], **style)
    if row.published:
        style |= {"marker": "D", "markersize": 4.0, "color": Ink.PUBLISHED, "zorder": 4}
        rim = {"markerfacecolor": Ink.GROUND, "markeredgewidth": 1.1}
        draw_line(axes, row.published, [index + 0.3] * len(row.published), **style, **rim)


def _draw_legend(figure: Figure, rows: Sequence[_Row], width: float, height: float) -> None:
    from matplotlib.lines import Line2D

    handles: list[Any] = [
        mark_key("one run", "o", 2.6, Ink.RUN, alpha=0.7),
        mark_key("median", "o", 5.0, Ink.OURS),
    ]
    if any(row.interval for row in rows):
        handles.append(Line2D([], [], color=Ink.BAND, linewidth=5, label="its 95 % interval"))
    if any(row.published for row in rows):
        handles.append(
            mark_key("the paper’s runs", "D", 4.0, Ink.PUBLISHED, markeredgewidth=1.1, hollow=True)
        )
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.1 / width, height / float(figure.get_size_inches()[1])),
        ncols=len(handles) if width >= 6 else 2,
        frameon=False,
        fontsize=8.0,
        borderaxespad=0.0,
        borderpad=0.0,
        handlelength=1.4,
        columnspacing=1.4,
    )


# words


def _caption(tally: Tally, rows: Sequence[_Row]) -> str:
    counted = "along the line driven" if tally.measure == "line" else "at the ends of steps"
    labels = " and ".join(sorted({row.label for row in rows}))
    counts = sorted({len(row.values) for row in rows if len(row.values)})
    n = f"n = {counts[0]:,}" if len(counts) == 1 else f"n = {counts[0]:,} to {counts[-1]:,}"
    parts = [f"Best coverage of each run by condition, counted {counted}. {labels}, {n} runs per condition."]
    if any(row.n_drawn < len(row.values) for row in rows):
        most = max(row.n_drawn for row in rows)
        parts.append(f"Dots: the first {most:,} runs of a condition; medians and intervals are of all runs.")
    if counts[-1] < MEDIAN_SMALLEST_N:
        parts.append(f"Fewer than {MEDIAN_SMALLEST_N} runs give no interval of 95 %.")
    return " ".join(parts)
