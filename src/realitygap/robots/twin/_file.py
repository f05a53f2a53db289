"""Twins as TOML files."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from realitygap._limits import is_file
from realitygap.errors import DescriptionError
from realitygap.settings import Settings
from realitygap.world._library import read_toml
from realitygap.world._numbers import in_si

from ._model import TwinModel

WIDTH = 110


def load_twin(path: str | Path) -> TwinModel:
    """A twin from its file.

    Args:
        path: Of a TOML file, as `TwinModel.to_toml` writes one. Keys may end in _mm, _cm or _in, angles in _deg.

    Raises:
        DescriptionError: There is no such file, or it cannot be used: every mistake with its place.
    """
    file = Path(path)
    if not is_file(file):
        raise DescriptionError(
            f"There is no twin file {file}. Draw one: realitygap twin sample --family close -o {file.name or 'FILE'}"
        )
    written = read_toml(file, str(file))
    if "format" not in written:
        raise DescriptionError(
            f'{file} is no twin file: it does not begin with format = "realitygap twin 1".'
        )
    try:
        return TwinModel(**in_si(written))
    except ValueError as error:
        lines = [
            line.removeprefix("TwinModel.").removeprefix("TwinModel: ") for line in str(error).split("\n")
        ]
        head = f"{file} has {len(lines)} mistake{'s' if len(lines) != 1 else ''}."
        raise DescriptionError("\n  ".join([head, *lines])) from None


def toml_of(model: TwinModel) -> str:
    """A twin as the text of its file, every value below what it means."""
    return "\n".join(_lines(model, "")) + "\n"


def _lines(model: Settings, place: str) -> Iterator[str]:
    """A table's own values, then the tables in it."""
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
    """The values of a further table of a list, whose meanings stand with the first."""
    for key in type(model).model_fields:
        yield f"{key} = {_value(getattr(model, key))}"


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, tuple):
        return f"[{', '.join(_value(each) for each in value)}]"
    return repr(value)
