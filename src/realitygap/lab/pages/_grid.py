"""The grid of cells: a visitor marks cells, or watches the robot."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from nicegui import events
from nicegui.element import Element

from realitygap.drawing import hex_of
from realitygap.world import Arena


class CellGrid(Element, component="cell_grid.js"):
    """Cells of an arena, to be tapped or drawn over.

    Args:
        arena: Whose.
        cells: Marked ones.
        line: (x, y) [m] of what was drawn.
        pieces: Further lines, such as a trace that was followed on a photograph.
        sure: How sure whoever proposed the cells is of each, 0.5 to 1; empty where nobody did.
        picture: What lies below the cells: its address; left, lower, right and upper end [m]. None for nothing.
        ink: Its color, as pens are named.
        name: Of the grid, for who cannot see it.
        change: Called with the marked cells after each tap; None where nothing can be tapped.
        shows_start: Whether to draw where the robot starts.
    """

    def __init__(
        self,
        arena: Arena,
        *,
        cells: Iterable[int] = (),
        line: Sequence[Sequence[float]] = (),
        pieces: Sequence[Sequence[Sequence[float]]] = (),
        sure: Sequence[float] = (),
        picture: tuple[str, Sequence[float]] | None = None,
        ink: str = "black",
        name: str = "Cells",
        change: Callable[[list[int]], Any] | None = None,
        shows_start: bool = True,
    ) -> None:
        super().__init__()
        self._grid = grid = arena.grid
        xs = [x for wall in arena.walls for x in (wall[0], wall[2])] or [grid.x, grid.right_end]
        ys = [y for wall in arena.walls for y in (wall[1], wall[3])] or [grid.y, grid.upper_end]
        low, high = self._in_cells((min(xs), min(ys))), self._in_cells((max(xs), max(ys)))
        self._props |= {
            "columns": grid.columns,
            "rows": grid.rows,
            "cells": list(cells),
            "frame": [*low, *high],
            "walls": [[*self._in_cells(wall[:2]), *self._in_cells(wall[2:])] for wall in arena.walls],
            "start": [*self._in_cells(arena.start[:2]), arena.start.heading] if shows_start else None,
            "line": [self._in_cells(each) for each in line],
            "pieces": [[self._in_cells(each) for each in piece] for piece in pieces],
            "sure": list(sure),
            "picture": None if picture is None else self._placed(*picture),
            "ink": ink_of(ink),
            "locked": change is None,
            "name": name,
        }
        if change is not None:
            self.on("change", lambda event: self._changed(event, change))

    def follow(self, pose: Sequence[float] | None, points: Sequence[Sequence[float]], *, anew: bool) -> None:
        """Show where the robot is [m, rad], and a further piece of its line [m]."""
        at = None if pose is None else [*self._in_cells(pose), round(pose[2], 3)]
        self.run_method("follow", at, [self._in_cells(each) for each in points], anew)

    def put(self, cells: Iterable[int]) -> None:
        """Mark these cells and no others."""
        self._props["cells"] = list(cells)
        self.update()

    def _placed(self, address: str, box: Sequence[float]) -> dict[str, Any]:
        (left, lower), (right, upper) = self._in_cells(box[:2]), self._in_cells(box[2:])
        return {
            "address": address,
            "left": left,
            "top": upper,
            "width": right - left,
            "height": upper - lower,
        }

    def _in_cells(self, at: Sequence[float]) -> list[float]:
        grid = self._grid
        return [round((at[0] - grid.x) / grid.cell, 3), round((at[1] - grid.y) / grid.cell, 3)]

    def _changed(self, event: events.GenericEventArguments, change: Callable[[list[int]], Any]) -> None:
        """Take what the page says, as far as it names cells."""
        given = event.args if isinstance(event.args, list) else []
        n_cells = self._grid.n_cells
        cells = sorted({each for each in given if type(each) is int and 0 <= each < n_cells})
        self._props["cells"] = cells
        change(cells)


def ink_of(pen: str) -> str:
    """The color of a pen by its name; black where that is no color."""
    name = re.sub(r"[^a-z]", "", pen.lower())
    try:
        return hex_of(name)
    except (KeyError, ValueError):
        return "#000000"
