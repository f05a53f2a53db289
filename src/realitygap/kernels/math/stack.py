"""Several tuples of arrays as one tuple: kernels take any of them by its number, for any number of them."""

from __future__ import annotations

import typing
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from realitygap.kernels.compile.decorators import inlined

from .lanes import zeros

T = TypeVar("T", bound=tuple[Any, ...])


def stack(members: Sequence[T]) -> T:
    """Return one tuple for all members: their arrays side by side along a first axis, and their common numbers.

    Args:
        members: Named tuples of the same kind, whose arrays have the same shapes.

    Raises:
        ValueError: They differ in a number.
    """
    first = members[0]
    if isinstance(first, np.ndarray):
        together = zeros((len(members), *first.shape), first.dtype)
        for k, member in enumerate(members):
            together[k] = member
        return together
    if isinstance(first, tuple):
        return type(first)(*(stack(parts) for parts in zip(*members, strict=True)))
    if any(member != first for member in members):
        raise ValueError(f"Expected the same number in each, got {members}.")
    return first


def member_of(kind: type[T]) -> Callable[[T, int], T]:
    """Return a kernel that takes member k out of a stack of named tuples of this kind; its arrays are views."""
    space: dict[str, Any] = {"kind": kind}
    parts = []
    for name, hint in typing.get_type_hints(kind).items():
        if hasattr(hint, "_fields"):
            space[f"take_{name}"] = member_of(hint)
            parts.append(f"take_{name}(stack.{name}, k)")
        else:
            parts.append(f"stack.{name}" if hint in (bool, int, float) else f"stack.{name}[k]")
    exec(f"def member(stack, k):\n    return kind({', '.join(parts)})\n", space)
    space["member"].__module__ = __name__
    kernel: Callable[[T, int], T] = inlined(space["member"])
    return kernel
