"""The picture of an object, without an import of what draws it."""

from __future__ import annotations

import functools
from typing import Any

from ._picture import Picture


@functools.singledispatch
def picture_of(shown: Any, **options: Any) -> Picture:
    """Return the picture of an object. A module that draws a type registers its function here.

    Raises:
        TypeError: Nothing draws this type.
    """
    raise TypeError(f"Nothing draws {type(shown).__name__}.")
