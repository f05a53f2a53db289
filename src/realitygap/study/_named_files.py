"""Files that a study names: searched next to the study file first, Python files only there."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from realitygap._limits import is_file
from realitygap.errors import TaskError
from realitygap.platforms import Platform, built_in_platforms, platform_class, platform_names, split_spec
from realitygap.tasks import PYTHON, read_python_file

from ._problems import Problems


def find_files(data: dict[str, Any], folder: Path, problems: Problems) -> None:
    """Put the folder in front of the files of robots and arenas that are there, and read Python files.

    Args:
        data: The study as its file has it; changed. What is no table there is left alone.
        folder: Folder of the study's file.
        problems: Takes what is wrong with Python files.
    """
    platforms = data.get("platform")
    if isinstance(platforms, dict):
        _find_settings(platforms, folder, _platforms_in(data))
    for table in _tables(data):
        _find(table.get("arena"), "file", folder)
        _find_settings(table, folder, _platforms_in(data))
        for model in _platforms_in(data):
            if model.rest_setting in model.file_settings:
                _find(table, "platform", folder, f"{model.name}:")
        archive = table.get("archive")
        for place, function in (
            ("task", table.get("task")),
            ("archive.own", archive.get("own") if isinstance(archive, dict) else None),
        ):
            if isinstance(function, dict):
                _read_function(function, folder, place, problems)


def _read_function(function: dict[str, Any], folder: Path, place: str, problems: Problems) -> None:
    """Put the text of its Python file into a function that names one."""
    if function.pop("source", None) is not None:
        problems.add(
            f"{place}.source",
            "code in a study file is not run. Put it into a Python file next to the study file, and name that: "
            'kind = "python:FILE.py:FUNCTION".',
        )
    kind = function.get("kind")
    if not isinstance(kind, str) or not kind.startswith(PYTHON) or kind.count(":") < 2:
        return
    function["source"] = ""  # so that a file that cannot be read is one mistake
    try:
        function["kind"], function["source"] = read_python_file(kind, folder)
    except TaskError as error:
        problems.add(place, str(error))


def _tables(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the study itself, and its conditions."""
    yield data
    conditions = data.get("condition")
    for condition in conditions if isinstance(conditions, list) else []:
        if isinstance(condition, dict):
            yield condition


def _platforms_in(data: dict[str, Any]) -> list[type[Platform]]:
    """Return the platforms of realitygap, and those of other packages that the study names."""
    tables = data.get("platform")
    named = set(tables) if isinstance(tables, dict) else set()
    named |= {split_spec(str(table.get("platform")))[0] for table in _tables(data)}
    own = [model.name for model in built_in_platforms()]
    return [platform_class(name) for name in (*own, *sorted(named - set(own))) if name in platform_names()]


def _find_settings(tables: dict[str, Any], folder: Path, models: list[type[Platform]]) -> None:
    """Find the files that the settings of platforms name."""
    for model in models:
        for setting in model.file_settings:
            _find(tables.get(model.name), setting, folder)


def _find(table: Any, key: str, folder: Path, prefix: str = "") -> None:
    value = table.get(key) if isinstance(table, dict) else None
    if isinstance(value, str) and value.startswith(prefix):
        table[key] = prefix + _beside(value.removeprefix(prefix), folder)


def _beside(file: str, folder: Path) -> str:
    return str(folder / file) if Path(file).suffix and is_file(folder / file) else file
