"""Figure 7: networks that evolved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import polars as pl

from realitygap._version import __version__
from realitygap._wording import counted
from realitygap.drawing import Picture
from realitygap.errors import RealityGapError
from realitygap.evolution import network_picture
from realitygap.report._structures import Example, Structures, count_structures
from realitygap.report._tally import Results, Tally, label_of, read_tally
from realitygap.report.charts.house import Drawing, draw_wide
from realitygap.report.charts.lines import head
from realitygap.report.charts.shapes import draw_picture
from realitygap.report.charts.sheet import IS_WIDE, Sheet, grid
from realitygap.runs import Condition, genome_of

_MARKS = "Width: size of the weight. Solid arrow: positive; dashed bar: negative; dotted: disabled. h: hidden node."

_N_COMMON = 3
"""Number of common structures drawn next to the first run's network."""


def draw_networks(
    folder: Results,
    structures: Sequence[Structures] | None = None,
    *,
    condition: str | None = None,
    name: str = "networks",
) -> Drawing:
    """Networks of the last generation: the first objective run's best, and the most common structures.

    Args:
        folder: Results of a study, or the path to them.
        structures: Result of `count_structures`. Default: computed.
        condition: Condition. Default: the first one that selects by coverage.
        name: First part of the ids in the drawing.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        RecordVersionError: the settings are not those of this version.
    """
    tally = read_tally(folder)
    structures = count_structures(tally) if structures is None else structures
    condition = tally.name_of(condition) if condition else _first_objective(tally)
    group = next((each for each in structures if condition in each.conditions), None)
    if group is None:
        raise ValueError(f"Condition {condition!r} has no networks yet.")
    replicate = int(tally.replicates(condition)[0])
    first = _best_of_last(tally, condition, replicate)
    pictures: list[tuple[str, str, Picture]] = [
        (
            f"run {replicate}, generation {first['generation']}",
            f"individual {first['individual']}, {first[tally.coverage_column]:.3f}",
            _picture(tally, first),
        )
    ]
    for letter, structure in zip("ABC", group.found[:_N_COMMON], strict=False):
        share = f"{100 * structure.n / group.n_networks:.1f} % of networks"
        pictures.append((f"structure {letter}", share, _picture(tally, _row_of(tally, structure.example))))
    caption = _caption(tally, condition, group)
    alt = "Networks. " + " ".join(f"{title}: {picture.description}" for title, _, picture in pictures)
    return draw_wide(lambda width: _draw(pictures, width), name, caption, alt)


def draw_network(condition: Condition, row: Mapping[str, Any], measure: str) -> Drawing:
    """The network of a row of results.

    Args:
        condition: Condition as resolved.
        row: Row of its results, with the genome.
        measure: Column of coverage that is shown.

    Raises:
        ValueError: the genome is not one of this version.
    """
    picture = picture_of(condition, row)
    caption = f"{picture.title}. {_MARKS} {condition.label}, n = 1 network."
    title = picture.title.removeprefix("Network of ")
    text = f"{condition.label}, coverage {row[measure]:.3f}"
    shown = [(title, text, picture)]
    return draw_wide(lambda width: _draw(shown, width), "network", caption, picture.description, width=5.9)


def _first_objective(tally: Tally) -> str:
    """Return the condition with runs that selects by coverage at the least noise; otherwise the first with runs."""
    return str((tally.selecting_by("coverage") or tally.with_runs)[0]["name"])


def _best_of_last(tally: Tally, condition: str, replicate: int) -> Mapping[str, Any]:
    rows = tally.folder.read(condition, [replicate])
    last = rows.filter(pl.col("generation") == rows["generation"].max())
    return last.row(int(last[tally.score_column(condition)].arg_max() or 0), named=True)


def _row_of(tally: Tally, of: Example) -> Mapping[str, Any]:
    rows = tally.folder.read(of.condition, [of.replicate])
    is_it = (rows["generation"] == of.generation) & (rows["individual"] == of.individual)
    return rows.row(int(is_it.arg_max() or 0), named=True)


def _picture(tally: Tally, row: Mapping[str, Any]) -> Picture:
    return picture_of(tally.resolved(row["condition"]), row)


def picture_of(condition: Condition, row: Mapping[str, Any]) -> Picture:
    """The network of a row of results, its inputs and outputs by name.

    Raises:
        ValueError: the genome is not one of this version.
    """
    genome = genome_of(condition, row)
    ids = {node.id for node in genome.nodes}
    strange = [gene for gene in genome.connections if not {gene.source, gene.target} <= ids]
    if strange:
        raise ValueError(
            f"The genome has a link from {strange[0].source} to {strange[0].target}, and no such node."
        )
    return network_picture(
        genome,
        condition.network_inputs,
        condition.output_names,
        title=f"Network of {row['condition']}, run {row['replicate']}, generation {row['generation']}, "
        f"individual {row['individual']}",
    )


def _draw(pictures: Sequence[tuple[str, str, Picture]], width: float) -> Sheet:
    sheet, panels = grid(width, len(pictures), 2 if width >= IS_WIDE else 1, None, gap=0.3, pad=0.16)
    for axes, (title, text, picture) in zip(panels, pictures, strict=True):
        draw_picture(axes, picture, scale=1.08 if sheet.is_wide else 0.95)
        head(axes, title, text)
    return sheet


def _caption(tally: Tally, condition: str, group: Structures) -> str:
    n_runs = sum(len(tally.replicates(name)) for name in group.conditions)
    label = label_of(tally.condition(condition))
    return (
        f"Networks of the last generation: the best one of the first run of {condition}, and the most common "
        f"structures of the {group.n_networks:,} networks with {len(group.inputs)} inputs and selection by "
        f"{group.selection}, each from the individual of highest coverage. {_MARKS} {label}, "
        f"n = {counted(n_runs, 'run')}."
    )


def content(tally: Tally) -> tuple[Drawing | str, list[Structures]]:
    """The figure, or why it is missing, and the structures counted."""
    structures = count_structures(tally)
    try:
        return draw_networks(tally, structures, name="figure-networks"), structures
    except (ValueError, RealityGapError):
        return (
            f"The figure of networks is missing: this realitygap ({__version__}) cannot read the genomes. Use the "
            "version that ran the study.",
            structures,
        )
