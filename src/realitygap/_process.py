"""This process: the processors that it may use, its room for frames of Python, and whether it was forked."""

from __future__ import annotations

import os
from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])

_FRAME_SIZE = 2**17
"""Size of a frame [words]. Python then takes 2 MiB from the system, of which half remains for other frames."""

_is_used = False
_is_forked = False


def usable_processors() -> int:
    """Return processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def on_wide_stack(function: F) -> F:
    """Give a function room on Python's stack for the frames of everything that it calls.

    Python takes 16 KiB from the system when a frame does not fit into the last piece of its stack. It returns them
    when this frame ends. A loop at such a depth does so in each iteration. Compiling the kernels of a study did it
    180,000 times, which took a tenth of the processor time. A large frame makes Python take a large piece. The
    frame's unused pages need no memory.
    """
    plain = cast(FunctionType, function)
    plain.__code__ = plain.__code__.replace(co_stacksize=_FRAME_SIZE)
    return function


def use_polars() -> None:
    """Raise an error if polars cannot work in this process. Call it before polars computes anything.

    Raises:
        RuntimeError: The process was forked from one that had used polars.
    """
    global _is_used
    if _is_forked:
        raise RuntimeError(
            "This process was forked from one that had used polars, whose threads do not exist in a fork. "
            'Start it with multiprocessing.get_context("spawn") or "forkserver".'
        )
    _is_used = True


def _note_fork() -> None:
    global _is_forked
    _is_forked = _is_forked or _is_used


if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_note_fork)
