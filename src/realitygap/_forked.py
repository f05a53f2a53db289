"""Whether this process was forked from one that had used polars. A fork lacks its threads and would wait for them."""

from __future__ import annotations

import os

_is_used = False
_is_forked = False


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
