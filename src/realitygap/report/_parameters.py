"""The settings of a study as tables: the paper's Table 1, and all of them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from realitygap.report._declared import declared
from realitygap.report._tally import settings_of

_N_OUTPUTS = 2
"""Move and turn."""

_MOST_NAMES = 6
"""Conditions listed by name; more are counted."""


@dataclass(frozen=True)
class Parameter:
    """A row of Table 1.

    Attributes:
        name: Name in the paper's words.
        paper: Paper's value.
        ours: Value of most conditions.
        others: Conditions with another value, such as "4 in novelty-10"; empty if there are none.
    """

    name: str
    paper: str
    ours: str
    others: str


@dataclass(frozen=True)
class SettingsTables:
    """All resolved settings of a study.

    Attributes:
        differing: Names of the settings that are not the same in all conditions, such as `neat.activation`.
        rows: For each condition its name, the first digits of its hash, and for each of `differing` the value and
            whether it is another than the condition's baseline has (the first condition's without one).
        common: Name and value of the settings that are the same everywhere.
    """

    differing: tuple[str, ...]
    rows: tuple[tuple[str, str, tuple[tuple[str, bool], ...]], ...]
    common: tuple[tuple[str, str], ...]


def neat_parameters(conditions: Sequence[Mapping[str, Any]]) -> list[Parameter]:
    """The paper's Table 1 with its values and those of the study."""
    names = [condition["name"] for condition in conditions]
    settings = [settings_of(condition) for condition in conditions]

    def row(name: str, paper: str, values: list[Any]) -> Parameter:
        shown = [_show(value) for value in values]
        counts = {value: shown.count(value) for value in dict.fromkeys(shown)}
        usual = max(counts, key=lambda value: counts[value])
        others = [
            f"{value} in {_list_names(_names_with(value, names, shown))}"
            for value in counts
            if value != usual
        ]
        return Parameter(name, paper, usual, "; ".join(others))

    def neat(key: str) -> list[Any]:
        return [each.get("neat", {}).get(key) for each in settings]

    return [
        row("Generations", "5", neat("generations")),
        row("Population size", "8", neat("population")),
        row("Input nodes", "3; 4 with novelty", [len(declared(each)[0]) for each in settings]),
        row("Hidden nodes, at first", "0", [0] * len(names)),
        row("Output nodes", "2", [_N_OUTPUTS] * len(names)),
        row("Prob. to add link", "0.1", neat("add_link")),
        row("Prob. to add node", "0.05", neat("add_node")),
    ]


def settings_tables(conditions: Sequence[Mapping[str, Any]]) -> SettingsTables:
    """All resolved settings, those that differ between conditions apart from those that do not."""
    flat = {condition["name"]: dict(_flatten(settings_of(condition))) for condition in conditions}
    keys = list(dict.fromkeys(key for values in flat.values() for key in values))
    differing = [key for key in keys if len({values.get(key, "") for values in flat.values()}) > 1]
    first = conditions[0]["name"]
    rows = []
    for condition in conditions:
        values = flat[condition["name"]]
        baseline = flat.get(condition.get("baseline") or first, flat[first])
        cells = tuple((values.get(key, "–"), values.get(key) != baseline.get(key)) for key in differing)
        rows.append((condition["name"], str(condition.get("hash") or "")[:12], cells))
    common = [(key, flat[first].get(key, "–")) for key in keys if key not in differing]
    return SettingsTables(tuple(differing), tuple(rows), tuple(common))


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
