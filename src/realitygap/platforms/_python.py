"""A platform of one Python file, which the user allows to run: `python:FILE:CLASS`."""

from __future__ import annotations

import hashlib
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from realitygap.errors import StudyError

from ._platform import Platform

PYTHON = "python"
EXPECTED = "python:FILE.py:CLASS"

_loaded: dict[str, type[Platform]] = {}
_allowed: list[bool] = [False]


def allow_code(allowed: bool = True) -> None:
    """Let this program run the Python file of each platform that it is asked for by name, or no longer."""
    _allowed[0] = allowed


def load_platform(spec: str) -> type[Platform]:
    """Run a Python file and return the platform that it defines. Call it for a file that you trust.

    From then on the name stands for the platform in this program.

    Args:
        spec: `python:FILE.py:CLASS`, with a subclass of `Platform`.

    Raises:
        StudyError: The file cannot be run, or has no such class.
    """
    file, name = _parts(spec)
    path = Path(file).resolve()
    where = spec_from_file_location(f"realitygap_platform_{path.stem}", path)
    if where is None or where.loader is None or not path.is_file():
        raise StudyError(f"There is no Python file {file} for the platform {spec!r}. Expected {EXPECTED}.")
    module = module_from_spec(where)
    sys.modules[where.name] = module  # the classes of the file look their annotations up there
    try:
        where.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a user's file may raise anything
        raise StudyError(f"{file} cannot be run: {type(error).__name__}: {error}.") from error
    found = getattr(module, name, None)
    if not (isinstance(found, type) and issubclass(found, Platform) and found is not Platform):
        raise StudyError(f"{file} has no subclass {name!r} of realitygap.platforms.Platform.")
    found.version = f"SHA-256 {hashlib.sha256(path.read_bytes()).hexdigest()}"
    _loaded[spec] = found
    return found


def loaded_platform(spec: str) -> type[Platform]:
    """Return the platform of a file that `load_platform` ran.

    Raises:
        StudyError: It did not.
    """
    if spec not in _loaded and _allowed[0]:
        return load_platform(spec)
    if spec not in _loaded:
        _parts(spec)
        raise StudyError(
            f"The platform {spec} runs the code of a Python file, and you have not allowed this. Nothing was run. Read "
            "the file. If you trust it, give --allow-code (in Python: realitygap.platforms.load_platform)."
        )
    return _loaded[spec]


def _parts(spec: str) -> tuple[str, str]:
    file, _, name = spec.removeprefix(f"{PYTHON}:").rpartition(":")
    if not file or not name:
        raise StudyError(f"{spec!r} is no platform, expected {EXPECTED}.")
    return file, name
