"""Permission to run the Python files of a study, of tasks and of descriptors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from realitygap.errors import StudyError, TaskError
from realitygap.runs import Condition
from realitygap.tasks import (
    PYTHON,
    PythonFunction,
    PythonTask,
    Task,
    as_task,
    not_allowed,
    read_python_file,
    source_hash,
)

from ._study import Study

AllowCode = bool | Callable[[PythonFunction], bool]
"""Permission to run Python files that the user has not allowed before, or a function that asks once for each file."""


def python_functions(study: Study) -> list[PythonFunction]:
    """Return the Python functions of a study, each once."""
    functions = [function for each in study.conditions for function in each.functions]
    return list({(function.kind, function.source): function for function in functions}.values())


def with_code_allowed(study: Study, allow_code: AllowCode) -> Study:
    """Return the study with the permission to run its Python files, after running each once.

    Args:
        study: Study as resolved from its file.
        allow_code: True to run Python files that the user has not allowed before, or a function that asks.

    Raises:
        TaskError: A file is not allowed, cannot be run, or lacks its function.
    """
    functions = python_functions(study)
    asked: set[str] = set()
    for function in functions:
        if function.may_run or function.sha256 in asked:
            continue
        asked.add(function.sha256)
        if not (allow_code(function) if callable(allow_code) else allow_code):
            raise TaskError(not_allowed(function))
    for function in functions:
        function.allowed().function()
    return study.model_copy(update={"conditions": tuple(each.allowed() for each in study.conditions)})


def allowed_condition(condition: Condition, allow_code: bool) -> Condition:
    """Return a condition whose task may score trials, and whose descriptors may describe them.

    Raises:
        TaskError: A function of it is in a Python file that the user has not allowed.
    """
    for function in condition.functions:
        _check_allowed(function, allow_code)
    return condition.allowed()


def allowed_task(task: Task, allow_code: bool) -> Task:
    """Return a task that may score trials.

    Raises:
        TaskError: Its function is in a Python file that the user has not allowed.
    """
    if not isinstance(task, PythonTask):
        return task
    _check_allowed(task, allow_code)
    return task.allowed()


def _check_allowed(function: PythonFunction, allow_code: bool) -> None:
    if not (allow_code or function.may_run):
        raise TaskError(not_allowed(function))


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
    return allowed_task(PythonTask.from_file(task), allow_code)


def check_files(study: Study, folder: Path) -> None:
    """Raise an error unless the Python files of a study are in a folder, with the texts that the study has.

    A folder of results keeps the text for the record. The code that runs is a file of the user.

    Raises:
        StudyError: A file is missing, or has another text.
    """
    for function in python_functions(study):
        try:
            # Its name alone: results name no file in another folder.
            named = f"{PYTHON}{Path(function.file).name}:{function.function_name}"
            _, source = read_python_file(named, folder)
        except TaskError as error:
            raise StudyError(f"Resuming the study needs its Python file: {error}") from None
        if source != function.source:
            raise StudyError(
                f"{function.file} in {folder} has SHA-256 {source_hash(source)}, and the results were computed with "
                f"{function.sha256}. Restore the file, or start a new study."
            )
