"""Plain values as TOML, for files that are written to be read by people."""

from __future__ import annotations

import json
from collections.abc import Mapping

DIGITS = 9
"""Maximum number of digits of a number: more than any measurement has, and few enough to parse."""


def toml_value(value: object, *, digits: int | None = DIGITS) -> str:
    """Return a value on one line.

    Args:
        value: Texts, numbers, truth values, and lists, arrays and tables of such.
        digits: Significant digits of numbers with a fraction; None for all.

    Raises:
        TypeError: TOML has no such value, such as None.
    """
    if hasattr(value, "tolist"):  # of NumPy, whose import takes long
        value = value.tolist()
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value if digits is None else _shortened(value, digits))
    if isinstance(value, Mapping):
        parts = ", ".join(
            f"{toml_key(key)} = {toml_value(part, digits=digits)}" for key, part in value.items()
        )
        return f"{{ {parts} }}" if parts else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(toml_value(part, digits=digits) for part in value)}]"
    raise TypeError(f"{value!r} is a {type(value).__name__}, expected a text, a number, a list or a table.")


def as_in_file(value: object) -> object:
    """Return a value with its numbers as a file has them, so that computing with them does not depend on the file."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float):
        return _shortened(value, DIGITS)
    if isinstance(value, Mapping):
        return {key: as_in_file(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [as_in_file(part) for part in value]
    return value


def _shortened(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def toml_key(key: str) -> str:
    """Return a key, in quotes if it needs them."""
    is_bare = bool(key) and key.isascii() and all(letter.isalnum() or letter in "_-" for letter in key)
    return key if is_bare else toml_value(key)


def toml_table(values: Mapping[str, object]) -> str:
    """Return a table, a line for each key; a list of tables or texts has a line for each of them."""
    return "\n".join(f"{toml_key(key)} = {_spread(value)}" for key, value in values.items())


def _spread(value: object) -> str:
    if isinstance(value, list | tuple) and any(isinstance(part, Mapping | str) for part in value):
        return "\n".join(["[", *(f"    {toml_value(part)}," for part in value), "]"])
    return toml_value(value)
