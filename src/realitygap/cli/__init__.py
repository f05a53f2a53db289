"""The command line: parse, call one function, print."""

from __future__ import annotations

import atexit
import contextlib
import gc
import io
import os
import shutil
import sys
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from realitygap._foreign_text import printable
from realitygap._interrupts import kept_interrupts
from realitygap._process import on_wide_stack
from realitygap._version import __version__
from realitygap.errors import RealityGapError

from ._commands import COMMANDS, root_help

_COMPLETION = "_REALITYGAP_COMPLETE"
"""Variable that the scripts of `--show-completion` set."""

_N_YOUNG = 50_000
"""New objects between two searches for garbage. Imports make half a million, which live to the end."""

if TYPE_CHECKING:
    import typer

    app: typer.Typer


def __getattr__(name: str) -> Any:
    """Make the application of all commands at the first access, which imports every command."""
    if name == "app":
        from ._app import make_app

        globals()["app"] = make_app(COMMANDS)
        return globals()["app"]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _print_error(message: str) -> None:
    """Print a message."""
    with contextlib.suppress(OSError, ValueError, AttributeError):  # closed, or None
        print(f"realitygap: {printable(message)}", file=sys.stderr, flush=True)  # noqa: T201


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    _print_error(f"note: {message}")


@on_wide_stack
def main() -> None:
    """Run a command; our own errors print as one message and end with status 1, as a closed pipe does, Ctrl-C with 130.

    A terminal without some letter shows a question mark in its place.
    """
    warnings.showwarning = _show_warning
    if 0 < gc.get_threshold()[0] < _N_YOUNG:
        gc.set_threshold(_N_YOUNG)
    # Python ends with a search for garbage among all objects, which takes a second after a report
    atexit.register(gc.freeze)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # closed ones are None
            stream.reconfigure(errors="replace")
    try:
        _run_command()
    except BrokenPipeError:
        _forget_output()
        sys.exit(1)
    except (RealityGapError, OSError, ImportError, MemoryError) as error:
        _print_error(_message_of(error))
        if isinstance(error, OSError):
            _forget_output()
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    except RuntimeError as error:
        if isinstance(error.__cause__, KeyboardInterrupt):  # Python 3.11 reports one in a class body so
            sys.exit(130)
        if not _is_lack_of_memory(error):
            raise
        _print_error(_message_of(error))
        sys.exit(1)


_NO_MEMORY = ("failed to map segment", "cannot allocate memory", "can't start new thread")
"""Words of the system, in small letters, for a lack of memory."""


def _is_lack_of_memory(error: BaseException | None) -> bool:
    """Return whether an exception, or one that it replaced, comes from a lack of memory."""
    while error is not None:
        if isinstance(error, MemoryError) or any(words in str(error).lower() for words in _NO_MEMORY):
            return True
        error = error.__cause__ or error.__context__
    return False


def _message_of(error: Exception) -> str:
    """Return the message of an error that needs no traceback."""
    if _is_lack_of_memory(error):
        return "There is not enough memory. Close other programs, or raise the limit that `ulimit -v` shows."
    if isinstance(error, RealityGapError):
        return str(error)
    if isinstance(error, ImportError):
        return f"A part of realitygap cannot be loaded: {error}. Install it again."
    if isinstance(error, OSError) and error.errno is None:  # not of a file, but of a library
        return f"A part of realitygap cannot be loaded: {error}"
    if isinstance(error, OSError):
        return f"{error.filename or 'The output cannot be written'}: {error.strerror or error}."
    return str(error)


@contextlib.contextmanager
def _safe_path_for_children() -> Iterator[None]:
    """Keep child processes from looking for modules in the current folder, which may hold anybody's files.

    A program that calls `main` in its own process gets its environment back.
    """
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = before or "1"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("PYTHONSAFEPATH", None)
        else:
            os.environ["PYTHONSAFEPATH"] = before


@kept_interrupts()
@_safe_path_for_children()
def _run_command() -> None:
    """Run a command, to the last of what it prints.

    The list of commands and the version need no command, and answer without loading Typer.
    """
    arguments = sys.argv[1:]
    try:
        if _COMPLETION in os.environ:  # a shell asks for completions of words that it passes in variables
            from ._app import app_to_complete

            words = os.environ.get("COMP_WORDS") or os.environ.get("_TYPER_COMPLETE_ARGS") or ""
            app_to_complete(words.split()[1:])()
        if not arguments or arguments in (["-h"], ["--help"]):
            print(root_help(shutil.get_terminal_size().columns), end="")  # noqa: T201
            sys.exit(0 if arguments else 2)
        if arguments == ["--version"]:
            print(f"realitygap {__version__}")  # noqa: T201
            return
        from ._app import app_for

        app_for(arguments)()
    finally:
        if sys.stdout is not None:
            sys.stdout.flush()


def _forget_output() -> None:
    """Leave nothing to be written when Python ends, which would be tried in vain once more."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


__all__ = ["app", "main"]
