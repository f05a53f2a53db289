"""The settings of a study as tables: the paper's Table 1, and all of them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from realitygap.report._table import Cell, Column, Part, Row, TableOnPage
from realitygap.report._tally import DescribedCondition, declared, settings_of

_N_OUTPUTS = 2
"""Move and turn."""

_MOST_NAMES = 6
"""Conditions listed by name; more are counted."""


def neat_parameters(conditions: Sequence[DescribedCondition]) -> TableOnPage:
    """Return the paper's Table 1 with its values and those of the study."""
    names = [condition["name"] for condition in conditions]
    settings = [settings_of(condition) for condition in conditions]

    def row(name: str, paper: str, values: list[Any]) -> Row:
        shown = [_show(value) for value in values]
        counts = {value: shown.count(value) for value in dict.fromkeys(shown)}
        usual = max(counts, key=lambda value: counts[value])
        others = [
            f"{value} in {_list_names(_names_with(value, names, shown))}"
            for value in counts
            if value != usual
        ]
        return name, paper, Cell(usual, more="".join(f"; {other}" for other in others))

    def neat(key: str) -> list[Any]:
        return [each.get("neat", {}).get(key) for each in settings]

    rows = [
        row("Generations", "5", neat("generations")),
        row("Population size", "8", neat("population")),
        row("Input nodes", "3; 4 with novelty", [len(declared(each)[0]) for each in settings]),
        row("Hidden nodes, at first", "0", [0] * len(names)),
        row("Output nodes", "2", [_N_OUTPUTS] * len(names)),
        row("Prob. to add link", "0.1", neat("add_link")),
        row("Prob. to add node", "0.05", neat("add_node")),
    ]
    columns = (Column("Parameter"), Column("The paper"), Column("This study"))
    caption = "NEAT parameters. Counterpart of the paper’s Table 1."
    return TableOnPage("parameters", caption, columns, (Part(rows),), kind="")


def settings_tables(conditions: Sequence[DescribedCondition]) -> list[TableOnPage]:
    """Return all resolved settings: those that differ between conditions, if any do, and the others.

    A marked value is another than in the condition's baseline. Without one, it is compared with the first condition.
    """
    flat = {condition["name"]: dict(_flatten(settings_of(condition))) for condition in conditions}
    keys = list(dict.fromkeys(key for values in flat.values() for key in values))
    differing = [key for key in keys if len({values.get(key, "") for values in flat.values()}) > 1]
    first = conditions[0]["name"]
    rows: list[Row] = []
    for condition in conditions:
        values = flat[condition["name"]]
        baseline = flat.get(condition.get("baseline") or first, flat[first])
        cells = (
            Cell(values.get(key, "–"), element="mark" if values.get(key) != baseline.get(key) else "")
            for key in differing
        )
        name, shortened = condition["name"], str(condition.get("hash") or "")[:12]
        rows.append((name, *cells, Cell(shortened, element="code")))
    tables = []
    if differing:
        columns = (Column("Condition"), *(Column(key, is_code=True) for key in differing), Column("Hash"))
        caption = (
            "Settings that differ between conditions. Marked: another value than in the condition’s baseline (without "
            "one, in the first condition)."
        )
        tables.append(
            TableOnPage("settings-by-condition", caption, columns, (Part(rows),), kind="settings differing")
        )
    common = [(Cell(key, element="code"), flat[first].get(key, "–")) for key in keys if key not in differing]
    caption = "Settings that are the same in all conditions." if differing else "Settings."
    columns = (Column("Setting"), Column("Value"))
    return [*tables, TableOnPage("settings", caption, columns, (Part(common),), kind="settings")]


def _flatten(values: Mapping[str, Any], place: str = "") -> Iterator[tuple[str, str]]:
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _flatten(value, f"{place}{key}.")
        else:
            yield f"{place}{key}", _show(value)


def _show(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    return json.dumps(value)


def _names_with(value: str, names: list[str], shown: list[str]) -> list[str]:
    return [name for name, each in zip(names, shown, strict=True) if each == value]


def _list_names(names: list[str]) -> str:
    if len(names) <= _MOST_NAMES:
        return ", ".join(names)
    return f"{', '.join(names[:_MOST_NAMES])} and {len(names) - _MOST_NAMES} more"
