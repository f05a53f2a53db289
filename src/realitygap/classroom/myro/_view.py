"""The view of a simulated robot from outside: live in a notebook, or a map of letters in a terminal."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import Disc, Ink, Line, Picture, Shape
from realitygap.errors import RealityGapError
from realitygap.families.scribbler.emulator import SCRIBBLER_BODY
from realitygap.world import Arena, Pose, obstacle_shapes

from ._mistakes import choice, notebook_shell

_PERIOD_S = 0.1  # between two pictures
_APART = 0.01  # [m] between points of the line that are drawn
_COLUMNS = 64  # of a map of letters
_MARGIN = 0.02  # around the walls [m]
_ARROWS = "→↗↑↖←↙↓↘"

_WIDGET = """
export default {
  render({ model, el }) {
    const draw = () => { el.innerHTML = model.get("svg"); };
    model.on("change:svg", draw);
    draw();
  },
};
"""


class Watched(Protocol):
    """The members of a simulation that a view reads."""

    arena: Arena

    @property
    def is_timed(self) -> bool: ...
    def catch_up(self) -> None: ...
    def pose(self) -> Pose: ...
    def cells(self) -> tuple[int, ...]: ...
    def path(self) -> NDArray[np.float64]: ...


class View(Protocol):
    """Shows a simulated robot."""

    def look(self) -> None:
        """Show the present pose, unless it was shown a moment ago."""
        ...

    def close(self) -> None:
        """Show it once more, and no longer."""
        ...


def best_view(simulation: Watched, wanted: object = None) -> View | None:
    """Return the view that fits the program's environment: live in a notebook, none elsewhere.

    Args:
        simulation: Simulation to show.
        wanted: "notebook", "off", or None for what fits.
    """
    kind = choice(
        'initialize("sim"): the view',
        wanted or ("notebook" if _is_notebook() else "off"),
        {"notebook": "notebook", "off": "off"},
    )
    return NotebookView(simulation) if kind == "notebook" else None


def _is_notebook() -> bool:
    """Return whether there is a notebook to draw in; IPython in a terminal is none."""
    return getattr(notebook_shell(), "kernel", None) is not None


class NotebookView:
    """The robot live below the cell: by anywidget, or without it as a drawing that is replaced.

    A thread looks ten times a second where time passes by itself; otherwise the program's own waiting does.
    """

    def __init__(self, simulation: Watched) -> None:
        self._simulation = simulation
        self._screen = _screen(to_svg(simulation))
        self._last = time.monotonic()
        self._pose = simulation.pose()
        self._ended = threading.Event()
        self._lock = threading.Lock()
        if simulation.is_timed:
            threading.Thread(target=self._watch, name="myro-view", daemon=True).start()

    def look(self) -> None:
        """Show the present pose, unless it was shown a moment ago."""
        if time.monotonic() - self._last >= _PERIOD_S:
            self._draw()

    def close(self) -> None:
        """Show it once more, and no longer."""
        self._ended.set()
        self._draw()

    def _watch(self) -> None:
        while not self._ended.wait(_PERIOD_S):
            try:
                self._draw()
            except (RealityGapError, OSError):
                return

    def _draw(self) -> None:
        """Show it, unless it is still at the place where it was last shown."""
        with self._lock:
            self._last = time.monotonic()
            self._simulation.catch_up()
            pose = self._simulation.pose()
            if pose != self._pose:
                self._pose = pose
                self._screen(to_svg(self._simulation))


def _screen(svg: str) -> Callable[[str], object]:
    """Return a function that shows an SVG, and each later one in the same place."""
    from IPython.display import HTML, display

    from realitygap.playback import widget_class  # takes time that most programs can do without

    try:
        widget: Any = widget_class("RobotView", "", _WIDGET, svg="")(svg=svg)
    except RealityGapError:  # anywidget is an extra
        handle = display(HTML(svg), display_id=True)
        return lambda picture: handle.update(HTML(picture))
    display(widget)
    return lambda picture: widget.set_trait("svg", picture)


def to_svg(simulation: Watched) -> str:
    """Return the arena, the line that the pen drew, and the robot, as SVG."""
    arena, grid = simulation.arena, simulation.arena.grid
    left, bottom, right, top = _bounds(simulation)
    cell = grid.cell
    shapes: list[Shape] = [
        Line(grid.corners(k), None, closed=True, fill=Ink.VISITED) for k in simulation.cells()
    ]
    shapes += [
        Line(((grid.x + k * cell, grid.y), (grid.x + k * cell, grid.y + grid.rows * cell)), Ink.MUTED, 0.4)
        for k in range(grid.columns + 1)
    ]
    shapes += [
        Line(((grid.x, grid.y + k * cell), (grid.x + grid.columns * cell, grid.y + k * cell)), Ink.MUTED, 0.4)
        for k in range(grid.rows + 1)
    ]
    shapes += [Line(((x1, y1), (x2, y2)), Ink.TEXT, 2.4) for x1, y1, x2, y2 in arena.walls]
    shapes += [shape for obstacle in arena.obstacles for shape in obstacle_shapes(obstacle)]
    line = thinned([(float(x), float(y)) for _, x, y, _ in simulation.path()])
    if len(line) > 1:
        shapes.append(Line(tuple(line), Ink.OURS, 1.4))
    pose = simulation.pose()
    shapes.append(
        Line(tuple(pose.point(*corner) for corner in SCRIBBLER_BODY.corners), Ink.BODY, 1.6, closed=True)
    )
    nose = (pose.point(0.06, 0.03), pose.point(0.089, 0.0), pose.point(0.06, -0.03))
    shapes += [Line(nose, Ink.BODY, 1.6), Disc(pose.x, pose.y, 2.4, fill=Ink.OURS)]
    seen = (
        f"A robot at ({pose.x:.2f}, {pose.y:.2f}) m, facing {math.degrees(pose.heading):.0f} degrees, has visited "
        f"{len(simulation.cells())} of {grid.n_cells} cells of the arena {arena.name}."
    )
    return Picture(f"Robot in the arena {arena.name}", seen, left, bottom, right, top, tuple(shapes)).to_svg()


def thinned(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return a line with points that are not nearer than a centimeter to the one before; first and last stay."""
    kept: list[tuple[float, float]] = []
    for point in points:
        if not kept or math.dist(kept[-1], point) >= _APART:
            kept.append(point)
    return kept if not points or kept[-1] == points[-1] else [*kept, points[-1]]


def text_map(simulation: Watched) -> str:
    """Return the arena as lines of letters: # for walls, · for the pen's path, an arrow for the robot."""
    left, bottom, right, top = _bounds(simulation)
    step = (right - left) / _COLUMNS
    rows = math.ceil((top - bottom) / (2 * step))
    page = [[" "] * (_COLUMNS + 1) for _ in range(rows + 1)]

    def put(x: float, y: float, letter: str) -> None:
        column, row = int((x - left) / step), int((top - y) / (2 * step))
        if 0 <= row <= rows and 0 <= column <= _COLUMNS:
            page[row][column] = letter

    for x1, y1, x2, y2 in simulation.arena.walls:
        pieces = max(1, math.ceil(math.hypot(x2 - x1, y2 - y1) / (step / 2)))
        for piece in range(pieces + 1):
            put(x1 + (x2 - x1) * piece / pieces, y1 + (y2 - y1) * piece / pieces, "#")
    for _, x, y, _ in simulation.path():
        put(float(x), float(y), "·")
    pose = simulation.pose()
    put(pose.x, pose.y, _ARROWS[round(pose.heading / (math.pi / 4)) % 8])
    cells = f"{len(simulation.cells())} of {simulation.arena.grid.n_cells} cells visited"
    return "\n".join(["".join(row).rstrip() for row in page] + [cells])


def _bounds(simulation: Watched) -> tuple[float, float, float, float]:
    xs = [x for wall in simulation.arena.walls for x in wall[::2]]
    ys = [y for wall in simulation.arena.walls for y in wall[1::2]]
    return min(xs) - _MARGIN, min(ys) - _MARGIN, max(xs) + _MARGIN, max(ys) + _MARGIN
