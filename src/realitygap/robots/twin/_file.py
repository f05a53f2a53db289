"""Twins from TOML files."""

from __future__ import annotations

from pathlib import Path

from realitygap._limits import is_file
from realitygap.errors import DescriptionError
from realitygap.world import in_si, read_toml

from ._model import TwinModel


def load_twin(path: str | Path) -> TwinModel:
    """Return a twin from its file.

    Args:
        path: Path of a TOML file, as written by `TwinModel.to_toml`. Keys may end in _mm, _cm or _in, angles in _deg.

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
