"""The picture, the card, and the widget of an object, without an import of what draws it."""

from __future__ import annotations

import functools
from typing import Any

from ._card import Card
from ._picture import Picture


@functools.singledispatch
def picture_of(shown: Any, **options: Any) -> Picture:
    """Return the picture of an object. A module that draws a type registers its function here.

    Raises:
        TypeError: Nothing draws this type.
    """
    raise TypeError(f"Nothing draws {type(shown).__name__}.")


@functools.singledispatch
def card_of(shown: Any) -> Card:
    """Return the card of an object. A module that describes a type registers its function here.

    Raises:
        TypeError: Nothing describes this type.
    """
    raise TypeError(f"Nothing describes {type(shown).__name__}.")


class ShownAsCard:
    """Something that notebooks show by its card."""

    def _repr_html_(self) -> str:
        return card_of(self).to_html()


@functools.singledispatch
def widget_of(shown: Any) -> Any:
    """Return the widget of an object; None if it has none, or what shows it is not installed."""
    return None
