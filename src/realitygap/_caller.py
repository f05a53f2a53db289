"""The caller: a command, a function, or a form. Messages name a setting as its caller wrote it.

The sources name a setting by its option, such as `--hold-out`. An error translates these names when it is made.
Commands to type stay as they are, such as `realitygap run --fresh`.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Caller:
    """The names of settings for one kind of caller.

    Attributes:
        name_of: Returns the name of a setting for its option, such as --hold-out.
        joint: Text between a name and its value.
    """

    name_of: Callable[[str], str]
    joint: str


def function_caller(names: Mapping[str, str]) -> Caller:
    """Return a caller of functions. Options without another name have that of their words: `hold_out`."""
    return Caller(lambda option: names.get(option, option.lstrip("-").replace("-", "_")), "=")


COMMAND = Caller(str, " ")
_FUNCTION = function_caller({"-o": "out"})
_callers = [_FUNCTION]

_NAMED = re.compile(
    r"`[^`]*`|\b(?:realitygap|uv) [a-z][^;`)\n]*?(?=[;`)\n]|\. |\.?$)"  # a command
    r"|(?P<open>\()?(?<![\w-])(?P<option>--[a-z][a-z-]*|-o)\b(?: (?P<value>[^\s)-]+))?"
)


@contextlib.contextmanager
def called_by(caller: Caller) -> Iterator[None]:
    """Let messages name settings as this caller does. In all threads, because a process has one caller at a time."""
    _callers.append(caller)
    try:
        yield
    finally:
        _callers.remove(caller)


@contextlib.contextmanager
def called_by_function(names: Mapping[str, str]) -> Iterator[None]:
    """Let messages name settings as the arguments of a function, unless a command or a form calls it.

    Args:
        names: Names of arguments that differ from their options.
    """
    with called_by(function_caller(names)) if _callers[-1] is _FUNCTION else contextlib.nullcontext():
        yield


def as_given(text: str) -> str:
    """Return a message with settings named as the caller wrote them."""
    caller = _callers[-1]

    def renamed(match: re.Match[str]) -> str:
        option, value, opened = match["option"], match["value"], match["open"] or ""
        if option is None or caller is COMMAND:
            return match[0]
        is_joined = value is not None and (opened or value[:2].isupper())
        joint = caller.joint if is_joined else "" if value is None else " "
        return f"{opened}{caller.name_of(option)}{joint}{value or ''}"

    return _NAMED.sub(renamed, text)
