"""Scores of controllers on two platforms, as a scatter that a visitor can read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nicegui.element import Element


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
