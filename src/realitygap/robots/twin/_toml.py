"""Settings as the text of a TOML file that explains each value."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator
from typing import Any

from realitygap.settings import Settings

WIDTH = 110


def toml_of(model: Settings) -> str:
    """Return a model as the text of its file, with the meaning of each value above it."""
    return "\n".join(_lines(model, "")) + "\n"


def _lines(model: Settings, place: str) -> Iterator[str]:
    """Yield a table's own values, then the tables in it."""
    tables: list[tuple[str, Any]] = []
    for key, field in type(model).model_fields.items():
        value = getattr(model, key)
        if value is None:
            continue
        is_list = isinstance(value, tuple) and value and isinstance(value[0], Settings)
        if isinstance(value, Settings) or is_list:
            tables.append((key, value))
            continue
        yield from textwrap.wrap(
            field.description or "", WIDTH, initial_indent="# ", subsequent_indent="#   "
        )
        yield f"{key} = {_value(value)}"
    for key, value in tables:
        for k, each in enumerate(value if isinstance(value, tuple) else [value]):
            name = f"{place}{key}"
            header = f"[[{name}]]" if isinstance(value, tuple) else f"[{name}]"
            meaning = (type(each).__doc__ or "").strip().splitlines()[0]
            yield ""
            yield f"{header}  # {meaning}" if not k else header
            yield from _lines(each, f"{name}.") if not k else _bare(each)


def _bare(model: Settings) -> Iterator[str]:
    """Return the values of a further table of a list, without comments, which the first table has."""
    for key in type(model).model_fields:
        yield f"{key} = {_value(getattr(model, key))}"


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, tuple):
        return f"[{', '.join(_value(each) for each in value)}]"
    return repr(value)
