"""Asking whether a Python file of a study may run."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import TaskError

from ._keys import read_line

if TYPE_CHECKING:
    from realitygap.study import AllowCode
    from realitygap.tasks import PythonFunction

AllowTasks = Annotated[
    bool,
    typer.Option(
        "--allow-code", help="Run the Python files of a study without asking. The answer is not remembered."
    ),
]
"""The option of commands that run studies."""


AllowFiles = Annotated[
    bool,
    typer.Option(
        "--allow-code", help="Run the Python files that correcting an archive needs, without asking."
    ),
]
"""The option of commands that draw results."""


def _allow_platforms(wanted: bool) -> bool:
    if wanted:
        realitygap.platforms.allow_code()
    return wanted


AllowPlatforms = Annotated[
    bool,
    typer.Option(
        "--allow-code",
        callback=_allow_platforms,
        is_eager=True,
        help="Run the Python files of platforms, tasks, and descriptors, without asking.",
    ),
]
"""The option of commands that open platforms."""


def code_permission(allow_code: bool) -> AllowCode:
    """Return what `run_study` takes: True if the option is given, otherwise a function that asks."""
    return allow_code or _ask_once()


def _ask_once() -> AllowCode:
    answers: set[str] = set()

    def ask(function: PythonFunction) -> bool:
        """Show a file and ask; an answer that cannot be saved holds for this command."""
        if function.sha256 not in answers:
            if not _is_terminal():
                return False
            _ask(function)
            answers.add(function.sha256)
        return True

    return ask


def _is_terminal() -> bool:
    """Return whether the user can see the file and answer."""
    streams = (sys.stdin, sys.stderr)
    return all(stream is not None and stream.isatty() for stream in streams)


def _ask(function: PythonFunction) -> None:
    """Show the file of a function and remember that it may run.

    Raises:
        TaskError: The file may not run.
    """
    from realitygap.settings import visible

    # `splitlines` also splits at letters that do not end a line of Python.
    lines = function.source.removesuffix("\n").split("\n")
    echo(
        f"This study runs {function.function_name} of {visible(function.file)}, which you have not allowed before:\n",
        err=True,
    )
    for number, line in enumerate(lines, 1):
        echo(f"{number:5d}  {visible(line)}", err=True)
    echo(
        f"\n{visible(function.file)}: {len(lines)} lines, SHA-256 {function.sha256}\nThis code, and the modules that "
        "it imports, can do everything on this machine that you can do.\nRun it? [y/N] ",
        err=True,
        nl=False,
    )
    if read_line().lower() not in ("y", "yes"):
        raise TaskError(f"{visible(function.file)} may not run. Nothing was run, and nothing was written.")
    try:
        realitygap.tasks.remember_allowed(function.sha256, function.file)
    except (OSError, RuntimeError) as error:
        echo(f"realitygap: note: the answer cannot be saved: {error}.", err=True)
