"""The lineage of an individual: all its ancestors, the origin of each, and the structure that each added."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.drawing import Ink
from realitygap.records import has_far_parents
from realitygap.report._tally import Results, largest, read_tally
from realitygap.report._trial_figure import ChosenTrial, choose_trial
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import (
    SPECIES_PENS,
    Dash,
    LineStyle,
    TextStyle,
    draw_dots,
    draw_line,
    draw_rings,
    generation_axis,
    head,
    write,
)
from realitygap.report.charts.sheet import IS_WIDE, Sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_LABELED = 12
"""Generations up to which each ancestor has its numbers, and all individuals are shown; half of it on a phone."""

_MOST_ROWS = 16
"""Maximum number of individuals of a generation that are all shown, each at its own height."""

_ORIGINS = {
    "first": "drawn at random",
    "copy": "copied unchanged",
    "mutation": "mutated from one parent",
    "crossover": "crossed from two parents",
}


@dataclass(frozen=True)
class Ancestor:
    """An individual from which the chosen one descends, or that one itself.

    Attributes:
        generation, individual, species: Identity of the ancestor.
        parents: Generation and individual of each parent.
        origin: first, copy, mutation or crossover.
        coverage: Coverage of its trial [0..1].
        brought: Structure that no parent has, in words.
    """

    generation: int
    individual: int
    species: int
    parents: tuple[tuple[int, int], ...]
    origin: str
    coverage: float
    brought: str


def draw_lineage(
    folder: Results,
    condition: str | None = None,
    replicate: int | None = None,
    generation: int | None = None,
    individual: int | None = None,
    *,
    name: str = "lineage",
) -> Drawing:
    """The ancestors of an individual, from the first generation on, and their coverage.

    Args:
        folder: Results of a study, or the path to them.
        condition: Condition. Default: the first one.
        replicate: Run. Default: the typical one.
        generation: Generation of the run. Default: that of its best trial, the champion.
        individual: Individual of the generation. Default: the best one by the task.
        name: First part of the ids in the drawing.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        ValueError: there is no such individual.
    """
    tally = read_tally(folder)
    trial = choose_trial(tally, condition, replicate, generation, individual)
    row = trial.row
    rows = tally.folder.read(row["condition"], [row["replicate"]])
    lineage = tally.folder.derive("lineage", row["condition"], [row["replicate"]])
    ancestors = _ancestors(trial, rows, lineage)
    counts = {
        word: sum(each.origin == origin for each in ancestors[:-1]) for origin, word in _ORIGINS.items()
    }
    counted = ", ".join(f"{n} {word}" for word, n in counts.items() if n) or "none"
    champion = ancestors[-1]
    beside = (
        "Each dot has the number of its species, its coverage, and the structure that no parent has"
        if largest(rows, "generation") < _MOST_LABELED
        else "Colors identify species and repeat after eight"
    )
    caption = (
        f"Ancestors of {trial.title} (ringed; itself {_ORIGINS[champion.origin]}): {len(ancestors) - 1} in all, "
        f"{counted}. "
        "Solid lines lead from the first parent, dashed ones from the second, broad ones to a copy. "
        f"{beside}. Below, coverage of the ancestors, and the best of each generation (line). {trial.label}, "
        "n = 1 run."
    )
    brought = [f"generation {each.generation}: {each.brought}" for each in ancestors if each.brought]
    alt = (
        f"Lineage of {trial.title}, coverage {champion.coverage:.3f}, with {len(ancestors) - 1} ancestors. "
        f"New structure: {'; '.join(brought) or 'none'}."
    )
    return draw_wide(lambda width: _draw(trial, rows, ancestors, width), name, caption, alt)


# who they are


def _ancestors(trial: ChosenTrial, rows: pl.DataFrame, lineage: pl.DataFrame) -> list[Ancestor]:
    """All ancestors and, last, the chosen individual; by generation and individual."""
    chosen = trial.row["generation"]
    by_key = {(each["generation"], each["individual"]): each for each in rows.iter_rows(named=True)}
    origins = {
        (each["generation"], each["individual"]): each
        for each in lineage.filter(pl.col("generation") <= chosen).iter_rows(named=True)
    }
    found: list[Ancestor] = []
    n = largest(rows, "individual") + 1
    is_far = has_far_parents(rows)
    wanted: dict[int, set[int]] = {chosen: {int(trial.row["individual"])}}
    for generation in range(chosen, -1, -1):
        for individual in sorted(wanted.get(generation, ()), reverse=True):
            row, origin = by_key[generation, individual], origins[generation, individual]
            parents = tuple(divmod(one, n) if is_far else (generation - 1, one) for one in row["parents"])
            before = [by_key[parent] for parent in parents]
            found.append(
                Ancestor(
                    generation,
                    individual,
                    row["species"],
                    parents,
                    origin["origin"],
                    row[trial.measure],
                    _brought(trial, row, origin["new"], before) if before else "",
                )
            )
            for parent_generation, parent in parents:
                wanted.setdefault(parent_generation, set()).add(parent)
    return found[::-1]


def _brought(
    trial: ChosenTrial, row: Mapping[str, Any], new: Sequence[int], parents: Sequence[Mapping[str, Any]]
) -> str:
    """The structure of an individual that no parent has: nodes and links."""
    known = {node for parent in parents for node in parent["genome"]["hidden"]}
    nodes = [node for node in row["genome"]["hidden"] if node not in known]
    names = dict(enumerate([*trial.condition.network_inputs, *trial.condition.output_names]))
    genes = row["genome"]
    links = [
        f"{names.get(source, f'h{source}')} → {names.get(target, f'h{target}')}"
        for number, source, target in zip(genes["innovation"], genes["source"], genes["target"], strict=True)
        if number in new and source not in nodes and target not in nodes
    ]
    return ", ".join([*(f"node h{node}" for node in nodes), *links])


# drawing


def _draw(trial: ChosenTrial, rows: pl.DataFrame, ancestors: list[Ancestor], width: float) -> Sheet:
    n = largest(rows, "generation") + 1
    n_individuals = largest(rows, "individual") + 1
    is_wide = width >= IS_WIDE
    is_few = n <= (_MOST_LABELED if is_wide else _MOST_LABELED // 2)
    shows_all = is_few and n_individuals <= _MOST_ROWS
    places = _places(ancestors, shows_all)
    most = n_individuals if shows_all else max(max(places.values()) - min(places.values()) + 1, 4.0)
    sheet = Sheet(width, [["tree"], ["coverage"]], [min(max(0.33 * most, 1.6), 4.6), 1.05], gap=0.2, pad=0.2)
    axes, below = sheet.panels["tree"], sheet.panels["coverage"]
    if shows_all:
        axes.set_ylim(n_individuals - 0.4, -0.6)
        axes.set_yticks(range(n_individuals))
        axes.set_ylabel("individual")
        others = [(g, k) for g in range(n) for k in range(n_individuals) if (g, k) not in places]
        xs, ys = np.array(others, float).reshape(-1, 2).T
        draw_dots(axes, xs, ys, 3.0, color=Ink.RULE, clip_on=False)
    else:
        middle = (min(places.values()) + max(places.values())) / 2
        axes.set_ylim(middle + most / 2 + 0.2, middle - most / 2 - 0.2)
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
    _draw_links(axes, ancestors, places, is_few=is_few)
    _draw_dots(axes, ancestors, places, is_few=is_few, is_wide=is_wide)
    _draw_coverage(below, trial, rows, ancestors)
    for each in (axes, below):
        each.set_xlim(-0.2 if is_few else -0.5, n - (0.35 if is_few else 0.5))
    axes.set_xticks([])
    axes.spines["bottom"].set_visible(False)
    row = trial.row
    which = "generation {}, individual {}" if is_wide else "{}/{}"
    title = which.format(row["generation"], row["individual"])
    label = f"{shorten(trial.label, 12)}, coverage {row[trial.measure]:.3f}"
    head(axes, f"{shorten(row['condition'], 24)}, run {row['replicate']}: {title}", label)
    return sheet


def _places(ancestors: list[Ancestor], shows_all: bool) -> dict[tuple[int, int], float]:
    """Return the height of each: its number if all are shown, otherwise near its descendants and apart from others."""
    if shows_all:
        return {(each.generation, each.individual): float(each.individual) for each in ancestors}
    places: dict[tuple[int, int], float] = {}
    of_children: dict[tuple[int, int], list[float]] = {}
    for generation, members in itertools.groupby(reversed(ancestors), lambda each: each.generation):
        here = list(members)[::-1]
        wanted = [float(np.mean(of_children.get((generation, each.individual), 0.0))) for each in here]
        for each, height in zip(here, _apart(np.array(wanted)), strict=True):
            places[generation, each.individual] = float(height)
            for parent in set(each.parents):
                of_children.setdefault(parent, []).append(float(height))
    return places


def _apart(wanted: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Heights at least 1 apart, in the order of those wanted and about their mean."""
    order = np.argsort(wanted, kind="stable")
    heights = wanted[order]
    for k in range(1, len(heights)):
        heights[k] = max(heights[k], heights[k - 1] + 1)
    heights += wanted.mean() - heights.mean()
    placed = np.empty_like(heights)
    placed[order] = heights
    return placed


def _draw_links(
    axes: Axes, ancestors: list[Ancestor], places: Mapping[tuple[int, int], float], *, is_few: bool
) -> None:
    links: dict[tuple[bool, int], list[tuple[tuple[int, float], tuple[int, float]]]] = {}
    for each in ancestors:
        for rank, parent in enumerate(each.parents):
            before = (parent[0], places[parent])
            here = (each.generation, places[each.generation, each.individual])
            links.setdefault((each.origin == "copy", rank), []).append((before, here))
    for (is_copy, rank), ends in links.items():
        gaps = np.full((len(ends), 1, 2), np.nan)
        points = np.concatenate([np.array(ends), gaps], axis=1).reshape(-1, 2)
        dashes: Dash = "solid" if rank == 0 else (0, (3, 2))
        linewidth = (3.0 if is_copy else 1.1) * (1.0 if is_few else 0.6)
        line: LineStyle = {"color": Ink.RUN, "linewidth": linewidth, "linestyle": dashes, "zorder": 1.5}
        line["clip_on"] = False
        draw_line(axes, *points.T, **line)


def _draw_dots(
    axes: Axes,
    ancestors: list[Ancestor],
    places: Mapping[tuple[int, int], float],
    *,
    is_few: bool,
    is_wide: bool,
) -> None:
    champion = ancestors[-1]
    x, y = champion.generation, places[champion.generation, champion.individual]
    ring: LineStyle = {"color": Ink.TEXT, "markerfacecolor": "none", "markeredgewidth": 1.1, "zorder": 2}
    ring["clip_on"] = False
    draw_dots(axes, x, y, 18.0 if is_few else 9.0, **ring)
    size, rim = (13.0, 1.6) if is_few else (4.5, 1.2)
    for color, members in _by_color(ancestors).items():
        xs = [member.generation for member in members]
        ys = [places[member.generation, member.individual] for member in members]
        draw_rings(axes, xs, ys, size, color, markeredgewidth=rim, zorder=2.5, clip_on=False)
        if is_few:
            _draw_numbers(axes, members, places, color, champion=champion, is_wide=is_wide)


def _by_color(ancestors: list[Ancestor]) -> dict[str, list[Ancestor]]:
    """The ancestors by the color of their species."""
    numbers = sorted({each.species for each in ancestors})
    colors = {number: str(SPECIES_PENS[k % len(SPECIES_PENS)]) for k, number in enumerate(numbers)}
    members: dict[str, list[Ancestor]] = {}
    for each in ancestors:
        members.setdefault(colors[each.species], []).append(each)
    return members


def _draw_numbers(
    axes: Axes,
    members: list[Ancestor],
    places: Mapping[tuple[int, int], float],
    color: str,
    *,
    champion: Ancestor,
    is_wide: bool,
) -> None:
    """Write the species into each dot, and coverage and new structure next to it."""
    for each in members:
        at = (each.generation, places[each.generation, each.individual])
        middle: TextStyle = {"ha": "center", "va": "center", "color": color, "zorder": 3}
        write(axes, str(each.species), at, (0, 0), 7.0, units=("data", "data"), **middle)
        right = 12.5 if each is champion else 9.5
        text = f"{each.coverage:.3f}" if is_wide else f"{each.coverage:.2f}".removeprefix("0")
        _label(axes, at, (right, 4.5 if each.brought else 0.0), text, Ink.MUTED)
        if each.brought:
            brought = shorten(each.brought, 24) if is_wide else _in_short(each.brought)
            _label(axes, at, (right, -4.5), f"+ {brought}", color)


def _in_short(brought: str) -> str:
    """Return the kinds of the new structure."""
    kinds = ["node" if each.startswith("node ") else "link" for each in brought.split(", ")]
    return ", ".join(dict.fromkeys(kinds))


def _label(axes: Axes, at: tuple[float, float], shift: tuple[float, float], text: str, color: str) -> None:
    style: TextStyle = {"va": "center", "color": color, "zorder": 3, "annotation_clip": False}
    style["bbox"] = {"facecolor": Ink.GROUND, "edgecolor": "none", "pad": 0.6, "alpha": 0.85}
    write(axes, text, at, shift, 7.0, units=("data", "data"), **style)


def _draw_coverage(axes: Axes, trial: ChosenTrial, rows: pl.DataFrame, ancestors: list[Ancestor]) -> None:
    from matplotlib.ticker import MaxNLocator

    best = rows.group_by("generation", maintain_order=True).agg(pl.col(trial.measure).max())
    axes.plot(best["generation"], best[trial.measure], color=Ink.RUN, linewidth=1.1)
    for color, members in _by_color(ancestors).items():
        xs, ys = zip(*((each.generation, each.coverage) for each in members), strict=True)
        draw_dots(axes, xs, ys, 4.0, color=color, clip_on=False)
    axes.set_ylim(0, None)
    axes.grid(axis="y", color=Ink.RULE, linewidth=0.5)
    generation_axis(axes, "coverage", 12)
    axes.yaxis.set_major_locator(MaxNLocator(3))
