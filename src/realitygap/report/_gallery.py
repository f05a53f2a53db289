"""The figures that show a study rather than measure it: arena, individuals, networks, species."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from realitygap._version import __version__
from realitygap.errors import RecordVersionError
from realitygap.report import _networks_figure
from realitygap.report._arena_figure import draw_arena_and_robot
from realitygap.report._elites_figure import draw_elites
from realitygap.report._individuals_figure import draw_individuals
from realitygap.report._placed import FigureOnPage
from realitygap.report._species_figure import count_species, draw_species
from realitygap.report._structures import Structures
from realitygap.report._table import Cell, Column, Part, Row, TableOnPage
from realitygap.report._tally import Tally
from realitygap.report.charts.house import Drawing


def content(tally: Tally, played: Mapping[str, Collection[tuple[int, int]]]) -> dict[str, Any]:
    """Return the figures of the page, or the reason why one is missing.

    Args:
        tally: Tally of the study.
        played: Trials that the page can play, by condition, as `draw_elites` takes them.
    """

    def draw(
        what: str, condition: str, figure: Callable[..., Drawing], counterpart: str = "", **more: Any
    ) -> FigureOnPage | str:
        anchor = f"figure-{what}"
        try:
            return FigureOnPage(anchor, figure(tally, condition, name=anchor, **more), counterpart)
        except RecordVersionError:
            return (
                f"A figure of condition {condition} is missing: this realitygap ({__version__}) cannot read its "
                "settings. Use the version that ran the study."
            )

    networks, structures = _networks_figure.content(tally)
    found: dict[str, Any] = {
        "arena": draw("arena", tally.runs["condition"][0], draw_arena_and_robot, "Figure 2"),
        "networks": networks
        if isinstance(networks, str)
        else FigureOnPage("figure-networks", networks, "Figure 7"),
        "structures": _structures_table(structures, tally),
        "structure_groups": structures,
    }
    # the replay shows paths, except those that a robot drove
    found["individuals"] = [
        draw(f"individuals-{search}", driven[0], draw_individuals, counterpart)
        for search, counterpart in (("coverage", "Figure 5"), ("novelty", "Figure 8"))
        if (driven := [each["name"] for each in tally.selecting_by(search) if each["name"] in tally.driven])
    ] or [draw("individuals-coverage", _first(tally), draw_individuals, "Figure 5")]
    found["elites"] = [
        draw(f"elites-{k}", each["name"], draw_elites, played=played.get(each["name"], ()))
        for k, each in enumerate(tally.selecting_by("map-elites"))
    ]
    species = count_species(tally)
    drawing = draw_species(tally, _first(tally), species=species, name="figure-species")
    found["species"] = FigureOnPage("figure-species", drawing)
    found["species_counts"] = species
    return found


def _first(tally: Tally) -> str:
    """The first condition with runs, if possible one that selects by coverage and that no robot drove."""
    candidates = tally.selecting_by("coverage") or tally.with_runs
    return str(([each for each in candidates if each["name"] not in tally.driven] or candidates)[0]["name"])


def _structures_table(structures: Sequence[Structures], tally: Tally) -> TableOnPage:
    columns = (
        Column("Structure"),
        Column("Links", kind="prose"),
        *(
            Column(head, kind="right", head_kind="right")
            for head in ("Hidden nodes", "Enabled links", "Networks", "Share")
        ),
    )
    caption = (
        "Structures of the networks in the last generation of each run. Two networks have the same structure if the "
        "same links are enabled; weights and the numbers of hidden nodes do not count."
    )
    parts = tuple(_part_of(group, tally) for group in structures)
    return TableOnPage("structures", caption, columns, parts, kind="settings", separates_parts=True)


def _part_of(group: Structures, tally: Tally) -> Part:
    """Return the structures of one kind of selection."""
    rows: list[Row] = [
        (
            chr(ord("A") + rank),
            structure.words,
            str(structure.n_hidden),
            str(len(structure.links)),
            f"{structure.n:,}",
            f"{100 * structure.n / group.n_networks:.1f} %",
        )
        for rank, structure in enumerate(group.listed)
    ]
    others = group.found[len(group.listed) :]
    if others:
        n = sum(structure.n for structure in others)
        share = f"{100 * n / group.n_networks:.1f} %"
        empty = Cell("", kind="")
        rows.append(("others", f"{len(others)} rarer structures", empty, empty, f"{n:,}", share))
    n_runs = sum(len(tally.replicates(name)) for name in group.conditions)
    return Part(
        rows,
        f"Selection by {group.selection}, {len(group.inputs)} inputs: n = {group.n_networks:,} networks of "
        f"{n_runs:,} runs",
    )
