"""Species over time: their shares in one run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.drawing import Ink
from realitygap.report._tally import Results, Tally, label_of, read_tally, selection_of
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import SPECIES_PENS, generation_axis, head, write
from realitygap.report.charts.marks import MOST_MARKS, Panel, Series
from realitygap.report.charts.sheet import Sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH, _HEIGHT = 5.2, 2.25
"""Width of the figure and height of its panel [in]."""

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


def _mean_by_selection(tally: Tally, counts: pl.DataFrame) -> dict[str, float]:
    """Return the mean number of species in the last generation, over all runs with a selection."""
    selections = pl.DataFrame(
        {
            "condition": [each["name"] for each in tally.conditions],
            "selection": [selection_of(each) for each in tally.conditions],
        }
    )
    means = (
        counts.join(selections, on="condition")
        .filter(pl.col("generation") == pl.col("generation").max().over("selection"))
        .group_by("selection")
        .agg(pl.col("species").mean())
        .sort("selection")
    )
    return dict(means.iter_rows())


def draw_species(
    folder: Results,
    condition: str | None = None,
    replicate: int | None = None,
    *,
    species: pl.DataFrame | None = None,
    name: str = "species",
) -> Drawing:
    """The shares of the species in a run over its generations.

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
    label = label_of(tally.condition(condition))
    of_runs = species.filter(pl.col("condition") == condition)
    which = ""
    if replicate is None:
        most = of_runs.group_by("replicate", maintain_order=True).agg(pl.col("species").sum())
        if most.is_empty():
            raise ValueError(f"Condition {condition!r} has no runs yet.")
        replicate = int(most["replicate"][int(most["species"].arg_max() or 0)])
        which = ", the run with the most species"
    shares = _shares(tally.rows_of(condition, replicate, ["generation", "species"]))
    numbers = (
        "Numbers name species."
        if len(next(iter(shares.values()))) <= _MOST_BARS
        else "Numbers name the larger species. Colors repeat after eight."
    )
    means = _mean_by_selection(tally, species)
    last = ", ".join(f"{each} {values:.2f}" for each, values in means.items())
    caption = (
        f"Share of each species in the population by generation, {condition}, run {replicate}{which}. {numbers} "
        f"{label}, n = 1 run. Mean number of species in the last generation over all runs, by selection: {last}."
    )
    alt = f"Species of run {replicate} of {condition}: {len(shares)} in all. Mean number in all runs: {last}."

    def draw(width: float) -> Sheet:
        sheet = Sheet(width, [["shares"]], [_HEIGHT])
        axes = sheet.panels["shares"]
        axes.set_gid("shares")
        generation_axis(axes, "share of the population")
        head(axes, f"{shorten(condition, 28)}, run {replicate}", f"{label}, n = 1")
        sheet.settle()  # so that the panel has the size in which numbers have room
        _draw_shares(axes, shares)
        return sheet

    return draw_wide(
        draw, name, caption, alt, marks=(Panel("shares", _marks_of_shares(shares), (0, 3)),), width=_WIDTH
    )


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
