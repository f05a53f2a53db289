"""Plots that a visitor can read and filter: curves by generation, and scores on two platforms."""

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


class Scatter(Element, component="scatter.js"):
    """Mean score of each controller on the simulator and on the target.

    Args:
        points: Name, kind, means, and intervals of each controller.
        sides: Names of the simulator and the target.
        score: Name of the score.
    """

    def __init__(self, points: Sequence[dict[str, Any]], sides: Sequence[str], score: str) -> None:
        super().__init__()
        self._props |= {"points": list(points), "sides": list(sides), "score": score}
