"""The figures that show a study rather than measure it: arena, individuals, networks, species, a lineage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from realitygap._version import __version__
from realitygap.errors import RecordVersionError
from realitygap.report import _arena_figure, _lineage_figure, _networks_figure
from realitygap.report._drawing import Drawing
from realitygap.report._individuals_figure import draw_tally_better, draw_tally_individuals
from realitygap.report._species_figure import count_species, draw_tally_species
from realitygap.report._structures import Structures
from realitygap.report._tally import Tally, settings_of


def content(
    tally: Tally, widths: Sequence[float], on_page: Callable[[str, str, Sequence[Drawing]], Any]
) -> dict[str, Any]:
    """What the page shows of these figures, each in all widths, or why one is missing.

    Args:
        tally: the study.
        widths: of the figures [in].
        on_page: makes of anchor, title and drawings what the template shows.
    """

    def placed(anchor: str, title: str, drawn: list[Drawing] | str) -> Any:
        return drawn if isinstance(drawn, str) else on_page(anchor, title, drawn)

    networks, structures = _networks_figure.content(tally, widths)
    found: dict[str, Any] = {
        "arena": placed("figure-2", "Figure 2", _arena_figure.content(tally, widths)),
        "individuals": [],
        "networks": placed("figure-7", "Figure 7", networks),
        "structures": [_listed(group, tally) for group in structures],
        "structure_groups": structures,
    }
    objective, novelty = _first(tally, "coverage"), _first(tally, "novelty", noise=0.5)
    for number, condition, draw in (
        ("5", _first(tally, "coverage", driven=True), draw_tally_individuals),
        ("8", _first(tally, "novelty", noise=0.5, driven=True), draw_tally_individuals),
        ("9", novelty, draw_tally_better),
    ):
        if condition is not None:
            try:
                drawn: list[Drawing] | str = draw(tally, condition, widths=widths, name=f"figure-{number}")
            except RecordVersionError:
                drawn = (
                    f"Figure {number} is missing: this realitygap ({__version__}) cannot read the settings of "
                    f"condition {condition}. Use the version that ran the study."
                )
            found["individuals"].append(placed(f"figure-{number}", f"Figure {number}", drawn))
    species = count_species(tally)
    condition = objective or str(tally.runs["condition"][0])
    found["species"] = placed(
        "figure-11",
        "Figure 11",
        draw_tally_species(tally, species, condition, widths=widths, name="figure-11"),
    )
    found["species_counts"] = species
    found["lineage"] = placed("figure-12", "Figure 12", _lineage_figure.content(tally, condition, widths))
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
