"""The commented study file that `realitygap new-study` writes."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from realitygap.evolution import NAMED_SETTINGS
from realitygap.runs import Condition

from ._file import DEFAULT_NEAT, PLATFORMS, SECTIONS
from ._study import ConditionNotes, ReportSection, StudySection

WIDTH = 100


def study_template(name: str) -> str:
    """A study file with two conditions in which every setting stands with its meaning and its default.

    Args:
        name: Of the study.
    """
    parts = [
        _comment(
            "A study for `realitygap run`. A line that begins with '# key = value' shows the default: take the "
            "'# ' away to change it. Lengths are in meters, angles in radians, times in seconds."
        ),
        _section("study", StudySection, {"name": name, "seed": 1, "replicates": 100}),
    ]
    for section, model in SECTIONS.items():
        place = f"platform.{section}" if section in PLATFORMS else section
        written: dict[str, Any] = {}
        defaults: Mapping[str, Any] = {}
        if section == "neat":
            written = {"settings": DEFAULT_NEAT}
            defaults = NAMED_SETTINGS[DEFAULT_NEAT]
        parts.append(_section(place, model, written, defaults))
    parts.append(_section("report", ReportSection, {}))
    parts.append(
        _comment(
            "One [[condition]] for each cell of the design. What differs from the sections above goes into "
            "[condition.arena], [condition.task], [condition.neat], [condition.novelty] or [condition.jyro]."
        )
    )
    notes = {field: (info.description or "") for field, info in ConditionNotes.model_fields.items()}
    own = ["name", "selection", "platform", "noise"]
    first = {"name": "coverage-10", "selection": "coverage", "platform": "jyro", "noise": 0.1}
    lines = ["[[condition]]"]
    for key in own:
        lines += [_comment(Condition.model_fields[key].description or ""), f"{key} = {_toml(first[key])}"]
    examples = {
        "published": [0.154, 0.222, 0.166],
        "published_source": "Table 2",
        "baseline": "",
        "change": "",
    }
    for key, description in notes.items():
        lines += [_comment(description), f"# {key} = {_toml(examples[key])}"]
    parts.append("\n".join(lines))
    parts.append(
        "\n".join(
            [
                "[[condition]]",
                'name = "coverage-10-center"',
                'selection = "coverage"',
                "noise = 0.1",
                "",
                "[condition.arena]",
                'start = "center"',
            ]
        )
    )
    return "\n\n".join(parts) + "\n"


def _section(
    place: str, model: type[BaseModel], written: Mapping[str, Any], defaults: Mapping[str, Any] | None = None
) -> str:
    lines = [f"[{place}]"]
    for key, info in model.model_fields.items():
        lines.append(_comment(info.description or ""))
        if key in written:
            lines.append(f"{key} = {_toml(written[key])}")
        else:
            default = (defaults or {}).get(key, info.default)
            lines.append(f"# {key} = {_toml(default)}")
    return "\n".join(lines)


def _comment(text: str) -> str:
    return "\n".join(textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="# "))


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    return repr(value)
