"""Selection of cells in a small grid, with keys, in a plain terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from realitygap._terminal import draw

from ._keys import single_keys

if TYPE_CHECKING:
    from realitygap.world import Arena, Grid, Pose

Outcome = Literal["done", "later"]

HELP = (
    "Arrows: move, space: mark or clear a cell, d: draw while moving, u: undo, c: clear all, Enter: done, "
    "Escape: later"
)

_WAYS = {
    "up": (0, 1), "down": (0, -1), "right": (1, 0), "left": (-1, 0),
    "k": (0, 1), "j": (0, -1), "l": (1, 0), "h": (-1, 0),
}  # fmt: skip


@dataclass
class GridEdit:
    """The marked cells and the cursor of an editor.

    Attributes:
        columns, rows: Size of the grid; row 0 is the lowest.
        cells: Marked ones in the order in which they were marked, columns * row + column.
        column, row: Position of the cursor.
        is_drawing: Whether moving marks.
    """

    columns: int
    rows: int
    cells: list[int] = field(default_factory=list)
    column: int = 0
    row: int = 0
    is_drawing: bool = False
    _before: list[list[int]] = field(default_factory=list)

    @property
    def here(self) -> int:
        """The cell under the cursor."""
        return self.columns * self.row + self.column

    def press(self, key: str) -> Outcome | None:
        """Take a key; what it ends with, if it ends."""
        if key in _WAYS:
            self._move(*_WAYS[key])
        elif key == "space":
            self._change(
                [cell for cell in self.cells if cell != self.here]
                if self._is_marked()
                else [*self.cells, self.here]
            )
        elif key == "d":
            self.is_drawing = not self.is_drawing
            self._mark()
        elif key == "u" and self._before:
            self.cells = self._before.pop()
        elif key == "c":
            self._change([])
        elif key == "enter" and self.cells:
            return "done"
        elif key == "escape":
            return "later"
        return None

    def _move(self, right: int, up: int) -> None:
        self.column = min(max(self.column + right, 0), self.columns - 1)
        self.row = min(max(self.row + up, 0), self.rows - 1)
        self._mark()

    def _mark(self) -> None:
        if self.is_drawing and not self._is_marked():
            self._change([*self.cells, self.here])

    def _is_marked(self) -> bool:
        return self.here in self.cells

    def _change(self, cells: list[int]) -> None:
        self._before.append(self.cells)
        self.cells = cells

    def lines(self) -> list[str]:
        """Return the grid as text, the highest row first, with the cursor in brackets."""
        shown = []
        for row in reversed(range(self.rows)):
            cells = "".join(self._shown(column, row) for column in range(self.columns))
            shown.append(f"  {row:2} {cells}")
        shown.append("     " + "".join(f"{column:^3}" for column in range(self.columns)))
        drawing = ", drawing" if self.is_drawing else ""
        shown.append(f"  {len(self.cells)} of {self.columns * self.rows} cells{drawing}")
        return shown

    def _shown(self, column: int, row: int) -> str:
        mark = "#" if self.columns * row + column in self.cells else "."
        return f"[{mark}]" if (column, row) == (self.column, self.row) else f" {mark} "


def edit_cells(
    grid: Grid,
    start: Pose,
    read_key: Callable[[], str | None],
    write: Callable[[str], None],
    cells: Iterable[int] = (),
) -> list[int] | None:
    """Let the operator pick cells, beginning at the start cell of trials.

    Args:
        grid: Grid of reachable cells.
        start: Start of trials.
        read_key: Function that returns the next key; None if there are no more.
        write: Puts text on the terminal.
        cells: Marked at first.

    Returns:
        The cells, or None for later.
    """
    first = grid.cell_at(start.x, start.y)
    marked = list(cells) or ([] if first is None else [first])
    edit = GridEdit(grid.columns, grid.rows, marked)
    edit.row, edit.column = divmod(first or 0, grid.columns)
    write(HELP + "\n")
    write("\n".join(edit.lines()) + "\n")
    while True:
        key = read_key()
        outcome = "later" if key is None else edit.press(key)
        if outcome == "done":
            return edit.cells
        if outcome == "later":
            return None
        lines = edit.lines()
        write(f"\x1b[{len(lines)}A\x1b[J" + "\n".join(lines) + "\n")


def pick_cells(
    arena: Arena, cells: Sequence[int] = (), *, write: Callable[[str], None] | None = None
) -> list[int] | None:
    """Return cells selected in the terminal; None for later."""
    with single_keys() as keys:
        return edit_cells(arena.grid, arena.start, keys.read, write or draw, cells)
