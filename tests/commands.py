"""Commands in processes that are forked from one that has imported everything: there at once."""

from __future__ import annotations

import io
import os
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import cv2  # noqa: F401  # imported once, for all that are forked
import numba  # noqa: F401
import polars  # noqa: F401
import rich.progress  # noqa: F401
import scipy.ndimage
import scipy.optimize
import scipy.stats  # noqa: F401
import typer

import realitygap.cli
from tests.forks import fork_context

PATIENCE_S = 300

typer.main.get_command(realitygap.cli.app)  # imports what all commands need


class Done(NamedTuple):
    """How a command ended, as `subprocess.CompletedProcess` has it."""

    returncode: int | None
    stdout: str
    stderr: str


def run_command(*words: str, cwd: Path | None = None, env: Mapping[str, str] | None = None) -> Done:
    """Run `realitygap WORDS...` in a process of its own and wait for its end."""
    with tempfile.TemporaryDirectory() as folder:
        output, errors = Path(folder) / "output", Path(folder) / "errors"
        order = (words, cwd or Path.cwd(), dict(os.environ if env is None else env), output, errors)
        process = fork_context().Process(target=_command, args=order)
        process.start()
        process.join(PATIENCE_S)
        if process.is_alive():
            process.kill()
            raise AssertionError(f"realitygap {' '.join(words)} does not end")
        return Done(process.exitcode, output.read_text("utf-8"), errors.read_text("utf-8"))


def _command(
    words: tuple[str, ...], folder: Path, environment: dict[str, str], output: Path, errors: Path
) -> None:
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    for stream, path in ((1, output), (2, errors)):
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.dup2(descriptor, stream)
        os.close(descriptor)
    sys.stdout = io.TextIOWrapper(os.fdopen(1, "wb", closefd=False), "utf-8")
    sys.stderr = io.TextIOWrapper(os.fdopen(2, "wb", closefd=False), "utf-8", write_through=True)
    sys.argv = ["realitygap", *words]
    realitygap.cli.main()
