"""Substitutes for the functions left out of Myro. A call raises an error with the reason and an alternative."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn

from ._catalog import LEFT_OUT
from ._mistakes import MyroError


def left_out(name: str) -> Callable[..., NoReturn]:
    """Return a function of this name that refuses with its reason.

    Raises:
        KeyError: Nothing of that name is left out.
    """
    reason = LEFT_OUT[name]

    def function(*args: Any, **kwargs: Any) -> NoReturn:
        raise MyroError(f"{name}() is left out. {reason}")

    function.__name__ = function.__qualname__ = name
    function.__doc__ = f"Left out. {reason}"
    return function
