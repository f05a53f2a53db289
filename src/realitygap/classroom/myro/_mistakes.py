"""Messages about a learner's mistakes: the expected value, the value given, and the next step."""

from __future__ import annotations

import linecache
import math
import numbers
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from realitygap._foreign_text import printable
from realitygap.errors import RealityGapError, did_you_mean

K = TypeVar("K")
T = TypeVar("T")

_OURS = str(Path(__file__).resolve().parents[2])


class MyroError(RealityGapError):
    """A mistake in a program that uses Myro's functions; its text says what to do instead."""

    __module__ = "realitygap.classroom.myro"  # where people find it


def number(name: str, value: object, least: float | None = None, most: float | None = None) -> float:
    """Return a number that a learner gave, checked.

    Args:
        name: Name of function and argument, for the message.
        value: Value of the argument.
        least, most: Smallest and largest allowed value. Default: no limit.

    Raises:
        MyroError: It is not a number, or out of range.
    """
    if not isinstance(value, numbers.Real):
        raise MyroError(f"{name} is {value!r}, expected a number.{_hint(value)}")
    result = float(value)
    if (
        not math.isfinite(result)
        or (least is not None and result < least)
        or (most is not None and result > most)
    ):
        above = "" if least is None else f" from {least:g}" if most is not None else f" of at least {least:g}"
        below = "" if most is None else f" to {most:g}" if least is not None else f" of at most {most:g}"
        raise MyroError(f"{name} is {value!r}, expected a number{above}{below}.")
    return result


def _hint(value: object) -> str:
    """Return a hint for a person who gave text for a number, as `input()` does; empty for other values."""
    if not isinstance(value, str):
        return ""
    try:
        float(value)
    except ValueError:
        return ""
    return f" A number is written without quotation marks; text becomes a number with float({value!r})."


def whole(name: str, value: object, least: int, most: int) -> int:
    """Return a whole number that a learner gave; 3.0 counts as 3.

    Raises:
        MyroError: It is not one, or out of range.
    """
    result = number(name, value)
    if result != int(result) or not least <= result <= most:
        raise MyroError(f"{name} is {value!r}, expected a whole number from {least} to {most}.")
    return int(result)


def choice(name: str, value: object, choices: Mapping[K, T]) -> T:
    """Return the meaning of a word or a number; words in any case.

    Args:
        name: Name of function and argument, for the message.
        value: Value of the argument.
        choices: Meaning of each word and number.

    Raises:
        MyroError: It is none of them; the text names them.
    """
    key = value.lower() if isinstance(value, str) else value
    for word, meaning in choices.items():
        if isinstance(key, (str, numbers.Real)) and key == word:  # 1.0 finds 1
            return meaning
    words = [repr(word) for word in choices if isinstance(word, str)]
    digits = [str(digit) for digit in choices if not isinstance(digit, str)]
    hint = (
        did_you_mean(key, [word for word in choices if isinstance(word, str)]) if isinstance(key, str) else ""
    )
    hint = f" {hint}" if hint.startswith("Did") else ""
    raise MyroError(f"{name} is {value!r}, expected {_either([*words, *digits])}.{hint}")


def _either(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def is_on(name: str, value: object) -> bool:
    """Return whether a value means "on": "on", 1, True; "off", 0, False, None mean the opposite.

    Raises:
        MyroError: Text that is neither.
    """
    if isinstance(value, str):
        return choice(name, value, {"on": True, "off": False})
    return bool(value)


def explanation(error: BaseException, trace: TracebackType | None) -> str:
    """Return the line of the learner's program that went wrong, and why, as text.

    Args:
        error: Raised error.
        trace: Trace of the error, in which frames inside realitygap are skipped.
    """
    theirs = [
        frame for frame in traceback.extract_tb(trace) if not frame.filename.startswith((_OURS, "<frozen"))
    ]
    where = ""
    if theirs:
        last = theirs[-1]
        name = "this cell" if "ipykernel" in last.filename else Path(last.filename).name
        line = linecache.getline(last.filename, last.lineno or 0).strip()
        where = f"Line {last.lineno} of {name}: {line}\n"
    return f"{where}{type(error).__name__}: {error}"


class _PlainHook:
    """The end of a program by an exception: ours are shown by one message, and others by the hook of before."""

    def __init__(
        self,
        before: Callable[[type[BaseException], BaseException, TracebackType | None], object],
        on_error: Callable[[], None],
    ) -> None:
        self._before, self._on_error = before, on_error

    def __call__(self, kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        self._on_error()
        if issubclass(kind, RealityGapError):
            sys.stderr.write(printable(explanation(error, trace)) + "\n")
        else:
            self._before(kind, error, trace)


def show_mistakes_plainly(on_error: Callable[[], None], on_cell: Callable[[], None]) -> None:
    """Make a mistake end a program, or a cell of a notebook, with one message and no traceback.

    Other exceptions are shown as before.

    Args:
        on_error: Called when a program, a line at the prompt or a cell ends with any exception.
        on_cell: Called when a cell begins.
    """
    if isinstance(sys.excepthook, _PlainHook):
        return
    sys.excepthook = _PlainHook(sys.excepthook, on_error)
    shell = notebook_shell()
    if shell is not None:
        shell.set_custom_exc((RealityGapError,), _in_notebook)
        shell.events.register("pre_run_cell", lambda _: on_cell())
        shell.events.register("post_run_cell", lambda result: None if result.success else on_error())


def _in_notebook(
    shell: Any, kind: type[BaseException], error: BaseException, trace: TracebackType | None, **_: Any
) -> None:
    sys.stderr.write(printable(explanation(error, trace)) + "\n")


def notebook_shell() -> Any:
    """Return IPython's running shell, or None; IPython is not imported for it."""
    module = sys.modules.get("IPython")
    get: Callable[[], Any] | None = getattr(module, "get_ipython", None)
    return None if get is None else get()
