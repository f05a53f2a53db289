"""Files that a study names: looked for beside the study's own file first."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from realitygap.tasks import PYTHON


def find_files(data: dict[str, Any], folder: Path) -> None:
    """Put the folder in front of the files of robots, arenas and tasks that are there.

    Args:
        data: The study as its file has it; changed. What is no table there is left alone.
        folder: Of the study's file.
    """
    platforms = data.get("platform")
    if isinstance(platforms, dict):
        _find(platforms.get("sim"), "robot", folder)
    for table in _tables(data):
        _find(table.get("arena"), "file", folder)
        _find(table.get("sim"), "robot", folder)
        _find(table, "platform", folder, "sim:")
        task = table.get("task")
        kind = task.get("kind") if isinstance(task, dict) else None
        if isinstance(task, dict) and isinstance(kind, str) and kind.startswith(PYTHON):
            file, _, function = kind.removeprefix(PYTHON).rpartition(":")
            task["kind"] = f"{PYTHON}{_beside(file, folder)}:{function}"


def _tables(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The study itself, and its conditions."""
    yield data
    conditions = data.get("condition")
    for condition in conditions if isinstance(conditions, list) else []:
        if isinstance(condition, dict):
            yield condition


def _find(table: Any, key: str, folder: Path, prefix: str = "") -> None:
    value = table.get(key) if isinstance(table, dict) else None
    if isinstance(value, str) and value.startswith(prefix):
        table[key] = prefix + _beside(value.removeprefix(prefix), folder)


def _beside(file: str, folder: Path) -> str:
    return str(folder / file) if Path(file).suffix and (folder / file).is_file() else file
