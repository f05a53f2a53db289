"""A JSON object in a file of a folder of results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from realitygap._limits import MOST_JSON_BYTES, parse_json, read_file
from realitygap.errors import RecordError
from realitygap.records._files import reading


def read_object(path: Path) -> dict[str, Any]:
    """Return the object in a JSON file.

    Raises:
        RecordError: The file cannot be read, or holds something else.
    """
    with reading(path):
        data = read_file(path, MOST_JSON_BYTES, plain=True)
    try:
        values = parse_json(data, nan=True)
    except ValueError as error:
        raise RecordError(f"{path} is damaged: it is not JSON ({error}). Restore it from a copy.") from None
    if not isinstance(values, dict):
        raise RecordError(f"{path} is damaged: it holds no JSON object. Restore it from a copy.")
    return values
