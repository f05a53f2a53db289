"""Files that a study names: looked for beside the study's own file first, Python files only there."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from realitygap._limits import is_file
from realitygap.errors import TaskError
from realitygap.tasks import PYTHON, read_task_file

from ._problems import Problems


def find_files(data: dict[str, Any], folder: Path, problems: Problems) -> None:
    """Put the folder in front of the files of robots and arenas that are there, and read the files of Python tasks.

    Args:
        data: The study as its file has it; changed. What is no table there is left alone.
        folder: Of the study's file.
        problems: Takes what is wrong with Python files.
    """
    platforms = data.get("platform")
    if isinstance(platforms, dict):
        _find(platforms.get("sim"), "robot", folder)
    for table in _tables(data):
        _find(table.get("arena"), "file", folder)
        _find(table.get("sim"), "robot", folder)
        _find(table, "platform", folder, "sim:")
        if isinstance(task := table.get("task"), dict):
            _read_task(task, folder, problems)


def _read_task(task: dict[str, Any], folder: Path, problems: Problems) -> None:
    """Put the text of its Python file into a task that names one."""
    if task.pop("source", None) is not None:
        problems.add(
            "task.source",
            "code in a study file is not run. Put it into a Python file beside the study file, and name that: "
            'kind = "python:FILE.py:FUNCTION".',
        )
    kind = task.get("kind")
    if not isinstance(kind, str) or not kind.startswith(PYTHON) or kind.count(":") < 2:
        return
    task["source"] = ""  # so that a file that cannot be read is one mistake
    try:
        task["kind"], task["source"] = read_task_file(kind, folder)
    except TaskError as error:
        problems.add("task", str(error))


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
    return str(folder / file) if Path(file).suffix and is_file(folder / file) else file
