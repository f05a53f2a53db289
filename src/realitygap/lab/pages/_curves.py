"""Best coverage by generation, as lines that a visitor can read and filter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nicegui.element import Element

from realitygap.drawing import line_pen, themed_color


class Curves(Element, component="curves.js"):
    """The median of each condition by generation.

    Args:
        curves: Curve of each condition, as `curves_of` returns it.
        name: Name of the figure, for visitors who cannot see it.
    """

    def __init__(self, curves: Sequence[dict[str, Any]], name: str) -> None:
        super().__init__()
        self._props |= {"name": name, "chosen": ""}
        self.put(curves)

    def put(self, curves: Sequence[dict[str, Any]]) -> None:
        """Show these curves."""
        inks = [line_pen(k) for k in range(len(curves))]
        self._props["curves"] = list(curves)
        self._props["inks"] = [
            {"color": themed_color(color), "dashes": list(dashes)} for color, dashes in inks
        ]
        self.update()

    def choose(self, condition: str) -> None:
        """Show one condition alone; all if it is empty."""
        self._props["chosen"] = condition
        self.update()
