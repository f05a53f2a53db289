"""Permission to run the Python files of a study's tasks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from realitygap.errors import StudyError, TaskError
from realitygap.runs import Condition
from realitygap.tasks import (
    PYTHON,
    PythonTask,
    Task,
    as_task,
    is_allowed,
    not_allowed,
    read_task_file,
    source_hash,
)

from ._study import Study

AllowCode = bool | Callable[[PythonTask], bool]
"""Permission to run Python files that the user has not allowed before, or a function that asks once for each file."""


def python_tasks(study: Study) -> list[PythonTask]:
    """Return the Python tasks of a study, one for each file and function."""
    tasks = [each.task for each in study.conditions if isinstance(each.task, PythonTask)]
    return list({(task.kind, task.source): task for task in tasks}.values())


def with_code_allowed(study: Study, allow_code: AllowCode) -> Study:
    """Return the study with the permission to run its Python files, after running each once.

    Args:
        study: Study as resolved from its file.
        allow_code: True to run Python files that the user has not allowed before, or a function that asks.

    Raises:
        TaskError: A file is not allowed, cannot be run, or lacks its function.
    """
    tasks = python_tasks(study)
    asked: set[str] = set()
    for task in tasks:
        if task.may_run or task.sha256 in asked or is_allowed(task.sha256):
            continue
        asked.add(task.sha256)
        if not (allow_code(task) if callable(allow_code) else allow_code):
            raise TaskError(not_allowed(task))
    for task in tasks:
        task.allowed().function()
    return study.model_copy(update={"conditions": tuple(map(with_code, study.conditions))})


def with_code(condition: Condition) -> Condition:
    """Return a condition whose task may run code, if it is a Python task."""
    task = condition.task
    return (
        condition.model_copy(update={"task": task.allowed()}) if isinstance(task, PythonTask) else condition
    )


def allowed_task(condition: Condition, allow_code: bool) -> Condition:
    """Return a condition whose task may score trials.

    Raises:
        TaskError: It is a Python task that the user has not allowed.
    """
    task = condition.task
    if isinstance(task, PythonTask) and not (task.may_run or allow_code or is_allowed(task.sha256)):
        raise TaskError(not_allowed(task))
    return with_code(condition)


def task_named(task: str | Task, *, allow_code: bool = False) -> Task:
    """Return a task by its kind, with its defaults, or by its Python file.

    Raises:
        StudyError: There is no such task.
        TaskError: Its Python file cannot be read, or is not allowed.
    """
    if not isinstance(task, str):
        return task
    if not task.startswith(PYTHON):
        try:
            return as_task({"kind": task})  # type: ignore[no-any-return]  # by its kind
        except ValueError as error:
            raise StudyError(f"--task: {error}") from None
    own = PythonTask.from_file(task)
    if not (allow_code or is_allowed(own.sha256)):
        raise TaskError(not_allowed(own))
    return own.allowed()


def check_files(study: Study, folder: Path) -> None:
    """Raise an error unless the Python files of a study are in a folder, with the texts that the study has.

    A folder of results keeps the text for the record. The code that runs is a file of the user.

    Raises:
        StudyError: A file is missing, or has another text.
    """
    for task in python_tasks(study):
        try:
            # Its name alone: results name no file in another folder.
            _, source = read_task_file(f"{PYTHON}{Path(task.file).name}:{task.function_name}", folder)
        except TaskError as error:
            raise StudyError(f"Resuming the study needs its Python file: {error}") from None
        if source != task.source:
            raise StudyError(
                f"{task.file} in {folder} has SHA-256 {source_hash(source)}, and the results were computed with "
                f"{task.sha256}. Restore the file, or start a new study."
            )
