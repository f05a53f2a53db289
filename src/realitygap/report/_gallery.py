"""The figures that show a study rather than measure it: arena, individuals, networks, species, a lineage."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from realitygap._version import __version__
from realitygap.errors import RecordVersionError
from realitygap.report import _networks_figure
from realitygap.report._arena_figure import draw_arena_and_robot
from realitygap.report._drawing import Drawing
from realitygap.report._individuals_figure import draw_better, draw_individuals
from realitygap.report._lineage_figure import draw_lineage
from realitygap.report._species_figure import count_species, draw_species
from realitygap.report._structures import Structures
from realitygap.report._tally import Tally, settings_of


def content(tally: Tally, on_page: Callable[[str, str, Drawing], Any]) -> dict[str, Any]:
    """What the page shows of these figures, or why one is missing.

    Args:
        tally: the study.
        on_page: makes of anchor, title and drawing what the template shows.
    """

    def placed(number: str, drawn: Drawing | str) -> Any:
        return drawn if isinstance(drawn, str) else on_page(f"figure-{number}", f"Figure {number}", drawn)

    def draw(number: str, condition: str, figure: Callable[..., Drawing]) -> Any:
        try:
            return placed(number, figure(tally, condition, name=f"figure-{number}"))
        except RecordVersionError:
            return (
                f"Figure {number} is missing: this realitygap ({__version__}) cannot read the settings of condition "
                f"{condition}. Use the version that ran the study."
            )

    networks, structures = _networks_figure.content(tally)
    found: dict[str, Any] = {
        "arena": draw("2", tally.runs["condition"][0], draw_arena_and_robot),
        "networks": placed("7", networks),
        "structures": [_listed(group, tally) for group in structures],
        "structure_groups": structures,
    }
    objective, novelty = _first(tally, "coverage"), _first(tally, "novelty", noise=0.5)
    found["individuals"] = [
        draw(number, condition, figure)
        for number, condition, figure in (
            ("5", _first(tally, "coverage", driven=True), draw_individuals),
            ("8", _first(tally, "novelty", noise=0.5, driven=True), draw_individuals),
            ("9", novelty, draw_better),
        )
        if condition is not None
    ]
    species = count_species(tally)
    condition = objective or str(tally.runs["condition"][0])
    found["species"] = placed("11", draw_species(tally, condition, species=species, name="figure-11"))
    found["species_counts"] = species
    found["lineage"] = draw("12", condition, draw_lineage)
    return found


def _first(tally: Tally, selection: str, *, noise: float | None = None, driven: bool = False) -> str | None:
    """The first condition with runs and this selection; rather one that a robot drove (or not), and with this noise."""
    with_runs = set(tally.runs["condition"])
    there = [
        each
        for each in tally.conditions
        if each["name"] in with_runs and settings_of(each).get("selection") == selection
    ]
    there = [each for each in there if (each["name"] in tally.driven) == driven] or there
    wanted = [each for each in there if settings_of(each).get("noise") == noise]
    return str((wanted or there)[0]["name"]) if there else None


def _listed(group: Structures, tally: Tally) -> dict[str, Any]:
    """One kind of selection, for the table of structures."""
    rows = [
        {
            "letter": chr(ord("A") + rank),
            "words": structure.words,
            "n_hidden": structure.n_hidden,
            "n_links": len(structure.links),
            "n": structure.n,
            "percent": f"{100 * structure.n / group.n_networks:.1f} %",
        }
        for rank, structure in enumerate(group.listed)
    ]
    others = group.found[len(group.listed) :]
    n_other = sum(structure.n for structure in others)
    return {
        "selection": group.selection,
        "inputs": len(group.inputs),
        "n": group.n_networks,
        "n_runs": sum(len(tally.replicates(name)) for name in group.conditions),
        "rows": rows,
        "n_others": len(others),
        "n_other": n_other,
        "other_percent": f"{100 * n_other / group.n_networks:.1f} %",
    }
