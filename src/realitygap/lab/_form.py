"""A form made from the settings of study files, and the file made from the form."""

from __future__ import annotations

import json
import math
import re
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from datetime import time as clock_time
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from realitygap._limits import parse_toml
from realitygap.evolution import NAMED_SETTINGS
from realitygap.runs import Condition
from realitygap.settings import is_hidden
from realitygap.study import (
    DEFAULT_NEAT,
    SECTIONS,
    ReportSection,
    StudySection,
    TrialsSection,
    platform_sections,
)

Kind = Literal["yes-no", "choice", "whole", "number", "text", "toml"]
TITLES = {
    "study": "The study",
    "arena": "Arena",
    "task": "Task",
    "controller": "Controller",
    "neat": "NEAT",
    "novelty": "Novelty search",
    "archive": "MAP-Elites",
    **{
        f"platform.{model.name}": f"Platform {model.name}: {model.summary.partition(':')[0]}"
        for model in platform_sections().values()
    },
    "trials": "Trials on a robot",
    "report": "Report",
}


@dataclass(frozen=True)
class Field:
    """One setting, as a form shows it.

    Attributes:
        place: Its section and key, such as neat.population.
        kind: Of what is entered; toml: a value as a file has it, such as a list.
        description: What it means.
        default: What it is where nothing is entered, as a file has it; empty where there is none.
        choices: Of a choice.
    """

    place: str
    kind: Kind
    description: str
    default: str
    choices: tuple[str, ...] = ()


def form_sections() -> dict[str, list[Field]]:
    """The settings of all sections, by the section's place."""
    sections = {"study": _fields("study", StudySection)}
    tables = SECTIONS | {f"platform.{name}": model for name, model in platform_sections().items()}
    for name, model in tables.items():
        defaults = NAMED_SETTINGS[DEFAULT_NEAT] if name == "neat" else {}
        sections[name] = _fields(name, model, defaults)
    sections["trials"] = _fields("trials", TrialsSection)
    sections["report"] = _fields("report", ReportSection)
    return sections


def condition_fields() -> list[Field]:
    """Return the settings of a condition that the form shows."""
    own = ("name", "selection", "platform", "noise")
    return [_field("condition", key, Condition.model_fields[key], {}) for key in own]


def _fields(place: str, model: type[BaseModel], defaults: Mapping[str, Any] | None = None) -> list[Field]:
    return [
        _field(place, key, info, defaults or {})
        for key, info in model.model_fields.items()
        if not is_hidden(info)
    ]


def _field(place: str, key: str, info: FieldInfo, defaults: Mapping[str, Any]) -> Field:
    default = defaults.get(key)
    if default is None and not info.is_required():
        default = info.get_default(call_default_factory=True, validated_data={})
    kind, choices = _kind(info.annotation)
    text = "" if default is None or info.is_required() else toml_value(default)
    if place == "neat" and key == "settings":
        kind, choices = "choice", tuple(NAMED_SETTINGS)
    return Field(f"{place}.{key}", kind, info.description or "", text, choices)


def _kind(annotation: Any) -> tuple[Kind, tuple[str, ...]]:
    """Return the kind of field for a type, and its choices; optional types have None in addition."""
    origin = get_origin(annotation)
    if origin is typing.Annotated:
        return _kind(get_args(annotation)[0])
    if origin is Literal and all(isinstance(each, str) for each in get_args(annotation)):
        return "choice", get_args(annotation)
    if origin in (typing.Union, types.UnionType):
        rest = [each for each in get_args(annotation) if each is not type(None)]
        return _kind(rest[0]) if len(rest) == 1 else ("toml", ())
    plain: dict[Any, Kind] = {bool: "yes-no", int: "whole", float: "number", str: "text"}
    return plain.get(annotation, "toml"), ()


def read_form(text: str) -> dict[str, Any]:
    """The values of a study file: section, key, value; `condition` is a list.

    Raises:
        ValueError: It is not TOML.
    """
    return parse_toml(text)


def entered(field: Field, text: str) -> Any:
    """The value of what was entered in a field.

    Raises:
        ValueError: It cannot be one.
    """
    if field.kind in ("text", "choice"):
        return text
    try:
        return parse_toml(f"value = {text}")["value"]
    except ValueError:
        expected = {"whole": "a whole number", "number": "a number", "yes-no": "true or false"}.get(
            field.kind, 'a value as study files have it, such as [1, 2] or "text"'
        )
        raise ValueError(f"{field.place}: expected {expected}, got {text!r}.") from None


def written_form(data: Mapping[str, Any]) -> str:
    """Study file with these values; a section without any is left out, and what is no section is kept as it is."""
    conditions = _conditions(data)
    plain = {
        key: value
        for key, value in data.items()
        if not isinstance(value, Mapping) and not (key == "condition" and conditions)
    }
    lines = [*_lines(plain), ""] if plain else []
    for place, values in _tables(data):
        if values:
            lines += [f"[{place}]", *_lines(values), ""]
    for condition in conditions:
        lines.append("[[condition]]")
        lines += _lines({key: value for key, value in condition.items() if not isinstance(value, dict)})
        for section, values in condition.items():
            if isinstance(values, dict):
                lines += ["", f"[condition.{_key(section)}]", *_lines(values)]
        lines.append("")
    return "\n".join(lines)


def _conditions(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    listed = data.get("condition")
    is_proper = isinstance(listed, list) and all(isinstance(each, dict) for each in listed)
    return listed if is_proper and listed is not None else []


def _tables(data: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    found: list[tuple[str, Mapping[str, Any]]] = []
    for section, values in data.items():
        if not isinstance(values, Mapping):
            continue
        apart = {key for key, each in values.items() if section == "platform" and isinstance(each, Mapping)}
        found.append((_key(section), {key: each for key, each in values.items() if key not in apart}))
        found += [(f"platform.{_key(key)}", each) for key, each in values.items() if key in apart]
    return found


def _lines(values: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {toml_value(value)}" for key, value in values.items()]


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else toml_value(key)


def toml_value(value: Any) -> str:
    """A value as a study file has it."""
    if isinstance(value, BaseModel):
        name = getattr(value, "name", None)
        return toml_value(name if isinstance(name, str) else value.model_dump(mode="json", exclude_none=True))
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, date | clock_time):
        return value.isoformat()
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if value != value else "inf" if value > 0 else "-inf"
    if isinstance(value, Mapping):
        return (
            "{ " + ", ".join(f"{_key(str(key))} = {toml_value(each)}" for key, each in value.items()) + " }"
        )
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(each) for each in value) + "]"
    return repr(value)
