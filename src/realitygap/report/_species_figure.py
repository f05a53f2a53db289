"""Species over time: their shares in one run, and how many there are in all runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap._wording import counted
from realitygap.drawing import Ink
from realitygap.report._tally import Results, Tally, label_of, read_tally, selection_of
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import (
    SPECIES_PENS,
    Dash,
    LineStyle,
    TextStyle,
    draw_line,
    generation_axis,
    head,
    spread,
    write,
)
from realitygap.report.charts.marks import MOST_MARKS, Panel, Series
from realitygap.report.charts.sheet import IS_WIDE, Sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HEIGHT = 2.25
"""Height of a panel [in]."""

_LINES: dict[str, tuple[str, Dash, str]] = {
    "coverage": (Ink.PEN1, "solid", "o"),
    "novelty": (Ink.PEN2, (0, (5, 1.5)), "s"),
    "random": (Ink.RUN, (0, (1.2, 1.4)), "^"),
}
"""Color, dashes and mark by selection."""

_MOST_BARS = 12
"""Generations up to which each has a bar and each share its species' number."""

_LEAST_LABELED = 0.06
"""Share of the population from which on there is room for a number."""

_NUMBER_WIDTH, _NUMBER_HEIGHT = 22.0, 9.0
"""Room that a number of four digits takes [pt]."""


def count_species(tally: Tally) -> pl.DataFrame:
    """Return the number of species in each generation: condition, replicate, generation, species."""
    parts = [
        frame.group_by("condition", "replicate", "generation", maintain_order=True).agg(
            pl.col("species").n_unique()
        )
        for frame in tally.folder.frames(columns=["condition", "replicate", "generation", "species"])
    ]
    return pl.concat(parts)


def _mean_by_selection(tally: Tally, counts: pl.DataFrame) -> dict[str, npt.NDArray[np.float64]]:
    """Return the mean number of species in each generation, over all runs with a selection, (g,)."""
    selections = pl.DataFrame(
        {
            "condition": [each["name"] for each in tally.conditions],
            "selection": [selection_of(each) for each in tally.conditions],
        }
    )
    means = (
        counts.join(selections, on="condition")
        .group_by("selection", "generation")
        .agg(pl.col("species").mean())
        .sort("selection", "generation")
    )
    return {
        str(key[0]): frame["species"].to_numpy()
        for key, frame in means.group_by("selection", maintain_order=True)
    }


def draw_species(
    folder: Results,
    condition: str | None = None,
    replicate: int | None = None,
    *,
    species: pl.DataFrame | None = None,
    name: str = "species",
) -> Drawing:
    """The shares of the species in a run over its generations, and how many species all runs have.

    Args:
        folder: Results of a study, or the path to them.
        condition: Condition. Default: the first one with a selection.
        replicate: Run. Default: the one with most species, the first of several equal ones.
        species: Result of `count_species`. Default: computed.
        name: First part of the ids in the drawing.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        ValueError: there is no such condition or run.
    """
    tally = read_tally(folder)
    species = count_species(tally) if species is None else species
    condition = tally.name_of(condition)
    described = tally.condition(condition)
    of_runs = species.filter(pl.col("condition") == condition)
    is_chosen = replicate is None
    if replicate is None:
        most = of_runs.group_by("replicate", maintain_order=True).agg(pl.col("species").sum())
        if most.is_empty():
            raise ValueError(f"Condition {condition!r} has no runs yet.")
        replicate = int(most["replicate"][int(most["species"].arg_max() or 0)])
    rows = tally.rows_of(condition, replicate, ["generation", "species"])
    shares = _shares(rows)
    means = _mean_by_selection(tally, species)
    n_runs = tally.runs.height
    why = (
        "chosen because it has the most species (the first of several alike)"
        if is_chosen
        else "chosen by number"
    )
    numbered = (
        "with the species’ numbers"
        if len(next(iter(shares.values()))) <= _MOST_BARS
        else "with the numbers of larger species where there is room; colors repeat when there are more than eight"
    )
    labels = ", ".join(tally.labels)
    caption = (
        f"Left (on a phone, above), condition {condition}, run {replicate}, {why}: the share of each species in the "
        f"population of each generation, {numbered}. {label_of(described)}, n = 1 run. Right "
        f"(below), the mean number of species in each generation, over all runs with a selection. "
        f"{labels}, n = {counted(n_runs, 'run')}, no interval."
    )
    alt = (
        f"Species of run {replicate} of {condition}: {len(shares)} in all. Mean number of species in the last "
        "generation: " + ", ".join(f"{each} {values[-1]:.2f}" for each, values in means.items()) + "."
    )

    marks = (
        Panel("shares", _marks_of_shares(shares), (0, 3)),
        Panel("means", tuple(_marks_of_means(means)), (0, 2)),
    )

    def draw(width: float) -> Sheet:
        if width >= IS_WIDE:
            sheet = Sheet(width, [["shares", "means"]], [_HEIGHT], widths=[0.55, 0.45], gap=0.4)
        else:
            sheet = Sheet(width, [["shares"], ["means"]], [_HEIGHT, _HEIGHT], pad=0.16)
        for key, axes in sheet.panels.items():
            axes.set_gid(key)
        left, right = sheet.panels["shares"], sheet.panels["means"]
        generation_axis(left, "share of the population")
        generation_axis(right, "mean number of species")
        head(left, f"{shorten(condition, 28)}, run {replicate}", f"{label_of(described)}, n = 1")
        head(right, "all runs", f"{labels}, n = {counted(n_runs, 'run')}")
        _draw_means(right, means)
        sheet.settle()  # so that the panel has the size in which numbers have room
        _draw_shares(left, shares)
        return sheet

    return draw_wide(draw, name, caption, alt, marks=marks)


def _marks_of_shares(shares: Mapping[int, npt.NDArray[np.float64]]) -> tuple[Series, ...]:
    """Return a mark in the middle of each share; of very many, those of the largest species."""
    floors = np.cumsum([np.zeros(len(next(iter(shares.values())))), *shares.values()], axis=0)[:-1]
    series = []
    for (number, share), floor in zip(shares.items(), floors, strict=True):
        alive = np.flatnonzero(share)
        points = np.column_stack([alive, floor[alive] + share[alive] / 2])
        labels = tuple(f"{value:.3f}".rstrip("0").rstrip(".") for value in share[alive])
        series.append(Series("species {name}, generation {x}: share {label}", points, str(number), labels))
    sizes = [len(each.points) for each in sorted(series, key=lambda each: -len(each.points))]
    n_kept = int(np.searchsorted(np.cumsum(sizes), MOST_MARKS, side="right"))
    longest = sorted(range(len(series)), key=lambda k: -len(series[k].points))[: max(1, n_kept)]
    return tuple(series[k] for k in sorted(longest))


def _marks_of_means(means: Mapping[str, npt.NDArray[np.float64]]) -> Iterator[Series]:
    for selection, values in means.items():
        points = np.column_stack([np.arange(len(values)), values])
        yield Series("{name}, generation {x}: {y} species on average", points, selection)


def _shares(rows: pl.DataFrame) -> dict[int, npt.NDArray[np.float64]]:
    """Return the share of each species in each generation, by the species' number, (g,)."""
    numbers, species = np.unique(rows["species"].to_numpy(), return_inverse=True)
    generations = rows["generation"].to_numpy()
    counts = np.zeros((len(numbers), int(generations.max()) + 1))
    np.add.at(counts, (species, generations), 1)
    return dict(zip(numbers.tolist(), counts / counts.sum(axis=0), strict=True))


def _draw_shares(axes: Axes, shares: Mapping[int, npt.NDArray[np.float64]]) -> None:
    n = len(next(iter(shares.values())))
    axes.set_ylim(0, 1)
    axes.set_xlim(-0.55, n - 0.45)
    floors = np.cumsum([np.zeros(n), *shares.values()], axis=0)[:-1]
    draw = _draw_bars if n <= _MOST_BARS else _draw_bands
    draw(axes, shares, floors)


def _draw_bars(
    axes: Axes, shares: Mapping[int, npt.NDArray[np.float64]], floors: npt.NDArray[np.float64]
) -> None:
    """A bar for each generation, in which each share has its species' number."""
    for index, (number, share) in enumerate(shares.items()):
        at = np.arange(len(share))
        color = SPECIES_PENS[index % len(SPECIES_PENS)]
        axes.bar(at, share, 0.82, floors[index], color=color, alpha=0.42, linewidth=0.0)
        axes.bar(at, share, 0.82, floors[index], color="none", edgecolor=Ink.GROUND, linewidth=1.0)
        for generation in np.flatnonzero(share > _LEAST_LABELED):
            _write_number(axes, number, int(generation), floors[index, generation] + share[generation] / 2)


def _draw_bands(
    axes: Axes, shares: Mapping[int, npt.NDArray[np.float64]], floors: npt.NDArray[np.float64]
) -> None:
    """Draw a band for each species during its life, and the number of the larger ones if it fits."""
    for index, share in enumerate(shares.values()):
        alive = np.flatnonzero(share)
        life = slice(alive[0], alive[-1] + 1)
        edges = np.repeat(np.arange(alive[0], alive[-1] + 2) - 0.5, 2)[1:-1]
        below, above = (np.repeat(height[life], 2) for height in (floors[index], floors[index] + share))
        axes.fill_between(
            edges, below, above, color=SPECIES_PENS[index % len(SPECIES_PENS)], alpha=0.42, linewidth=0.0
        )
    for number, x, y in _numbers_with_room(axes, shares, floors):
        _write_number(axes, number, x, y)


def _numbers_with_room(
    axes: Axes, shares: Mapping[int, npt.NDArray[np.float64]], floors: npt.NDArray[np.float64]
) -> list[tuple[int, int, float]]:
    """Return species whose number fits at their largest size, the largest first, with the place of the number."""
    width, height = (side * 72.0 / axes.figure.dpi for side in axes.bbox.size)
    n = floors.shape[1]
    placed: list[tuple[int, int, float]] = []
    largest = sorted(enumerate(shares.items()), key=lambda each: -each[1][1].max())
    for index, (number, share) in largest:
        at_most = np.flatnonzero(share == share.max())
        x = int(at_most[len(at_most) // 2])
        y = floors[index, x] + share[x] / 2
        is_free = all(
            abs(x - other_x) * width / n > _NUMBER_WIDTH or abs(y - other_y) * height > _NUMBER_HEIGHT
            for _, other_x, other_y in placed
        )
        if share[x] > _LEAST_LABELED and is_free:
            placed.append((number, x, y))
    return placed


def _write_number(axes: Axes, number: int, x: float, y: float) -> None:
    write(axes, str(number), (x, y), (0, 0), 7.5, units=("data", "data"), ha="center", va="center")


def _draw_means(axes: Axes, means: Mapping[str, npt.NDArray[np.float64]]) -> None:
    n = max(len(values) for values in means.values())
    top = max(1.5, 1.08 * max(float(values.max()) for values in means.values()))
    axes.set_ylim(0, top)
    axes.set_xlim(-0.2, max(n - 1, 1))
    places = spread([float(values[-1]) for values in means.values()], 0.075 * top)
    for (selection, values), place in zip(means.items(), places, strict=True):
        color, dashes, mark = _LINES.get(selection, (Ink.PEN3, "solid", "D"))
        marker = mark if n <= _MOST_BARS else "none"
        line: LineStyle = {"color": color, "linestyle": dashes, "linewidth": 1.4, "clip_on": False}
        line |= {"marker": marker, "markersize": 4.0}
        draw_line(axes, np.arange(len(values)), values, **line)
        beside: TextStyle = {"va": "center", "color": color}
        write(
            axes, shorten(selection, 12), (1.03, place), (0, 0), 8, units=("axes fraction", "data"), **beside
        )
    axes.grid(axis="y", color=Ink.RULE, linewidth=0.5)
