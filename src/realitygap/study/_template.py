"""The commented study file that `realitygap new-study` writes."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from realitygap.evolution import NAMED_SETTINGS
from realitygap.robot_families import default_family
from realitygap.runs import NAME_PATTERN, Condition
from realitygap.settings import is_hidden
from realitygap.world import RobotModel

from ._file import DEFAULT_NEAT, SECTIONS, platform_sections, read_named_study
from ._study import ConditionNotes, ReportSection, StudySection, TrialsSection

WIDTH = 100
_EXAMPLES = {
    "published": [0.154, 0.222, 0.166],
    "published_source": "Table 2",
    "baseline": "coverage-10",
    "change": "trials begin in the center",
}


def study_template(name: str, source: str | None = None) -> str:
    """Return a study file to change: two conditions with every setting, its meaning, and its default, or a copy.

    Args:
        name: Name of the study: letters, digits, dot, dash, and underscore.
        source: Study that comes with realitygap. Its file is copied, with the new name as name and title.

    Raises:
        ValueError: It cannot be the name of a study.
        StudyError: There is no study `source`.
    """
    if not (isinstance(name, str) and len(name) <= 80 and re.fullmatch(NAME_PATTERN, name)):
        raise ValueError(
            f"name is {name!r}, expected at most 80 letters, digits, '.', '-' and '_', a letter or digit first."
        )
    if source is not None:
        return _copy(source, name)
    parts = [
        _comment(
            "A study for `realitygap run`. A line that begins with '# key = value' shows the default: remove "
            "the '# ' to change it. Lengths are in meters, angles in radians, times in seconds."
        ),
        _section("study", StudySection, {"name": name, "seed": 1, "replicates": 100}),
    ]
    tables = SECTIONS | {f"platform.{name}": model for name, model in platform_sections().items()}
    for section, model in tables.items():
        written: dict[str, Any] = {}
        defaults: Mapping[str, Any] = {}
        if section == "neat":
            written = {"settings": DEFAULT_NEAT}
            defaults = NAMED_SETTINGS[DEFAULT_NEAT]
        parts.append(_section(section, model, written, defaults))
    parts.append(_section("trials", TrialsSection, {}))
    parts.append(_section("report", ReportSection, {}))
    parts.append(
        _comment(
            "One [[condition]] for each cell of the design. What differs from the sections above goes into "
            "[condition.arena], [condition.task], [condition.controller], [condition.neat], [condition.novelty], and "
            f"[condition.jyro], [condition.sim] or [condition.{default_family().name}], whichever its platform is."
        )
    )
    own = ["name", "selection", "platform", "noise"]
    first = {"name": "coverage-10", "selection": "coverage", "platform": "jyro", "noise": 0.1}
    lines = ["[[condition]]"]
    for key in own:
        lines += [_comment(Condition.model_fields[key].description or ""), f"{key} = {_toml(first[key])}"]
    for key in ("published", "published_source"):
        lines += _example(key)
    parts.append("\n".join(lines))
    parts.append(
        "\n".join(
            [
                "[[condition]]",
                'name = "coverage-10-center"',
                'selection = "coverage"',
                "noise = 0.1",
                *_example("baseline"),
                *_example("change"),
                "",
                "[condition.arena]",
                'start = "center"',
            ]
        )
    )
    return "\n\n".join(parts) + "\n"


def _copy(source: str, name: str) -> str:
    text = read_named_study(source)
    for key in ("name", "title"):
        text = re.sub(rf"^{key} = .*$", f"{key} = {_toml(name)}", text, count=1, flags=re.MULTILINE)
    return f"# Copied from the study {source} to change it.\n{text}"


def _example(key: str) -> list[str]:
    """Return the optional notes of a condition, commented out."""
    return [
        _comment(ConditionNotes.model_fields[key].description or ""),
        f"# {key} = {_toml(_EXAMPLES[key])}",
    ]


def _section(
    place: str, model: type[BaseModel], written: Mapping[str, Any], defaults: Mapping[str, Any] | None = None
) -> str:
    lines = [f"[{place}]"]
    for key, info in model.model_fields.items():
        if is_hidden(info):
            continue
        lines.append(_comment(info.description or ""))
        if key in written:
            lines.append(f"{key} = {_toml(written[key])}")
        else:
            default = info.get_default(call_default_factory=True, validated_data={})
            default = (defaults or {}).get(key, default)
            lines.append(f"# {key} = {_toml(default)}")
    return "\n".join(lines)


def _comment(text: str) -> str:
    return "\n".join(textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="# "))


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, RobotModel):
        value = value.name
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return repr(list(value) if isinstance(value, tuple) else value)
