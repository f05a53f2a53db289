"""Elements of pages that have a script, and the values that these scripts send."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from nicegui import events
from nicegui.element import Element
from nicegui.elements.mixins.value_element import ValueElement
from pydantic import ConfigDict, TypeAdapter, ValidationError, with_config
from typing_extensions import TypedDict

from realitygap.drawing import hex_of, line_pen, themed_color
from realitygap.lab._choices import Choices
from realitygap.lab._messages import Curve, Replay, ScorePairs
from realitygap.playback import PackedScene, PackedTrial
from realitygap.world import Arena

T = TypeVar("T")


def _content(event: events.GenericEventArguments, kind: TypeAdapter[T]) -> T | None:
    """Return what a script sent; None if it is not of this kind: some other program sent it."""
    try:
        return kind.validate_python(event.args, strict=True)
    except ValidationError:
        return None


@with_config(ConfigDict(extra="forbid", allow_inf_nan=False))
class Pull(TypedDict):
    """The position of the pad: parts of full speed; and the stops that the page knew of when it was pressed."""

    move: float
    turn: float
    stops: int


_PULL = TypeAdapter(Pull)
_CELLS = TypeAdapter(list[int])


class DrivePad(Element, component="drive_pad.js"):
    """A pad that drives the robot while it is held.

    Args:
        name: Name of the pad.
        is_off: Whether it is off.
        stops: Number of stops so far.
        drive: Called again and again while it is pulled.
        release: Called when it is let go.
    """

    def __init__(
        self,
        name: str,
        *,
        is_off: bool,
        stops: int,
        drive: Callable[[Pull], None],
        release: Callable[[], None],
    ) -> None:
        super().__init__()
        self._props |= {"name": name, "disabled": is_off, "stops": stops}

        def pulled(event: events.GenericEventArguments) -> None:
            if (pull := _content(event, _PULL)) is not None:
                drive(pull)

        self.on("drive", pulled)
        self.on("release", release)

    def know(self, stops: int, *, is_off: bool) -> None:
        """Set the number of stops so far, and whether the pad is off; it drives only if pressed after all stops."""
        if (self._props["stops"], self._props["disabled"]) != (stops, is_off):
            self._props["stops"], self._props["disabled"] = stops, is_off
            self.update()


@dataclass(frozen=True)
class Trace:
    """A line as a photograph or a camera saw it.

    Attributes:
        pieces: Pieces of the line, (x, y) [m].
        sure: How sure each cell of the grid is, 0.5 to 1; empty if unknown.
        picture: What lies below the cells: its address; left, lower, right and upper end [m]. None for nothing.
    """

    pieces: Sequence[Sequence[Sequence[float]]] = ()
    sure: Sequence[float] = ()
    picture: tuple[str, Sequence[float]] | None = None


NO_TRACE = Trace()


class CellGrid(Element, component="cell_grid.js"):
    """Cells of an arena, to be tapped or drawn over.

    Args:
        arena: Arena whose cells are shown.
        cells: Marked cells.
        line: (x, y) [m] of the points of a line.
        trace: Cells and lines that a photograph or a camera showed.
        ink: Color of the line: the name of a pen, or any color of CSS.
        outlines: Parts of a robot that is shown by `follow`: (forward, left) [m].
        name: Name of the grid for screen readers.
        change: Called with the marked cells after each tap; None where nothing can be tapped.
    """

    def __init__(
        self,
        arena: Arena,
        *,
        cells: Iterable[int] = (),
        line: Sequence[Sequence[float]] = (),
        trace: Trace = NO_TRACE,
        ink: str = "black",
        outlines: Sequence[Sequence[Sequence[float]]] = (),
        name: str = "Cells",
        change: Callable[[list[int]], Any] | None = None,
    ) -> None:
        super().__init__()
        self._grid = grid = arena.grid
        self._n_points = 0
        xs = [x for wall in arena.walls for x in (wall[0], wall[2])] or [grid.x, grid.right_end]
        ys = [y for wall in arena.walls for y in (wall[1], wall[3])] or [grid.y, grid.upper_end]
        low, high = self._in_cells((min(xs), min(ys))), self._in_cells((max(xs), max(ys)))
        self._props |= {
            "columns": grid.columns,
            "rows": grid.rows,
            "cells": list(cells),
            "frame": [*low, *high],
            "walls": [[*self._in_cells(wall[:2]), *self._in_cells(wall[2:])] for wall in arena.walls],
            "start": [*self._in_cells(arena.start[:2]), arena.start.heading],
            "line": [self._in_cells(each) for each in line],
            "pieces": [[self._in_cells(each) for each in piece] for piece in trace.pieces],
            "sure": list(trace.sure),
            "picture": None if trace.picture is None else self._placed(*trace.picture),
            "ink": ink_of(ink),
            "outlines": [[[x / grid.cell, y / grid.cell] for x, y in outline] for outline in outlines],
            "locked": change is None,
            "name": name,
        }
        if change is not None:
            self.on("change", lambda event: self._changed(event, change))

    def follow(self, pose: Sequence[float], line: Sequence[Sequence[float]], cells: Sequence[int]) -> str:
        """Show a robot, and return the number of its cells in words.

        Args:
            pose: Its pose [m, rad].
            line: (x, y) [m] where it has been. Only the points after those of the last call are sent.
            cells: Cells that it has entered.
        """
        anew = len(line) < self._n_points or self._n_points == 0
        points = line if anew else line[self._n_points :]
        self._n_points = len(line)
        at = [*self._in_cells(pose), round(pose[2], 3)]
        self.run_method("follow", at, [self._in_cells(point) for point in points], anew, list(cells))
        return f"{len(cells)} of {self._grid.n_cells} cells"

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
        n_cells = self._grid.n_cells
        cells = sorted({cell for cell in _content(event, _CELLS) or () if 0 <= cell < n_cells})
        self._props["cells"] = cells
        change(cells)


def ink_of(pen: str) -> str:
    """The color of a pen by its name; black where that is no color."""
    name = re.sub(r"[^a-z]", "", pen.lower())
    try:
        return hex_of(name)
    except (KeyError, ValueError):
        return "#000000"


class Picker(ValueElement[str], component="picker.js"):
    """A choice from groups of texts; the last entry is for a text that the visitor types.

    Args:
        choices: The groups; empty ones are left out.
        value: Initial text.
        name: Name of the field.
        hint: Shown in the line for a text of one's own while that is empty.
    """

    LOOPBACK = False

    def __init__(self, choices: Choices, value: str, name: str, hint: str = "") -> None:
        super().__init__(value=value)
        groups = [[title, list(words.items())] for title, words in choices.items() if words]
        self._props |= {"groups": groups, "name": name, "hint": hint}

    def _event_args_to_value(self, e: events.GenericEventArguments) -> str:
        """Take a text only: some other program may send something else."""
        return e.args if isinstance(e.args, str) else ""


class Curves(Element, component="curves.js"):
    """The median of each condition by generation.

    Args:
        curves: Curve of each condition, as `curves_of` returns it.
        name: Name of the figure, for visitors who cannot see it.
    """

    def __init__(self, curves: Sequence[Curve], name: str) -> None:
        super().__init__()
        self._props |= {"name": name, "chosen": ""}
        self.put(curves)

    def put(self, curves: Sequence[Curve]) -> None:
        """Show these curves."""
        self._props["curves"] = list(curves)
        self._props["inks"], self._props["keys"] = _inks_of(curves)
        self.update()

    def choose(self, condition: str) -> None:
        """Show one condition alone; all if it is empty."""
        self._props["chosen"] = condition
        self.update()


def _inks_of(curves: Sequence[Curve]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the color and dashes of each line, and the key that explains them.

    The color is that of the search, the dashes those of the noise, if these two identify each condition.
    """
    searches = list(dict.fromkeys(curve["search"] for curve in curves))
    noises = sorted({curve["noise"] for curve in curves})
    colors = [themed_color(line_pen(1 + k)[0]) for k in range(len(searches))]
    dashes = [list(line_pen(k)[1]) for k in range(len(noises))]
    pairs = [(searches.index(curve["search"]), noises.index(curve["noise"])) for curve in curves]
    if len(set(pairs)) < len(curves):
        pens = [line_pen(k) for k in range(len(curves))]
        inks = [{"color": themed_color(color), "dashes": list(dash)} for color, dash in pens]
        return inks, [ink | {"text": curve["condition"]} for ink, curve in zip(inks, curves, strict=True)]
    of_searches = [
        {"color": color, "dashes": [], "text": text} for color, text in zip(colors, searches, strict=True)
    ]
    of_noises = [
        {"color": "currentColor", "dashes": dash, "text": f"noise {noise:g}"}
        for dash, noise in zip(dashes, noises, strict=True)
    ]
    return [{"color": colors[k], "dashes": dashes[n]} for k, n in pairs], of_searches + of_noises


class Generations(Element, component="generations.js"):
    """Paths of a run, of the generation that the visitor chooses; the last one as long as the visitor chooses none."""

    def put(self, replay: Replay) -> None:
        """Show the paths of a run."""
        # One text, as in `Player`.
        self._props["shown"] = json.dumps({"scene": replay.scene, "generations": replay.generations})
        self.update()


class Elites(Element, component="elites.js"):
    """Maps of the elites of an archive; a tap on one emits `choose` with its generation and individual.

    Args:
        maps: `EliteMaps` as a dictionary.
    """

    def __init__(self, maps: dict[str, Any]) -> None:
        super().__init__()
        self._props["shown"] = json.dumps(maps)  # one text, as in `Player`


class Scatter(Element, component="scatter.js"):
    """Mean score of each controller on the simulator and on the target.

    Args:
        pairs: The scores.
        beside: Scores in the next figure, which has the same axes.
    """

    def __init__(self, pairs: ScorePairs, beside: ScorePairs | None = None) -> None:
        super().__init__()
        self._props |= {"points": pairs["points"], "sides": pairs["sides"], "score": pairs["score"]}
        self._props["beside"] = [] if beside is None else beside["points"]


class Player(Element, component="player.js"):
    """Player of trials; `live` shows a trial that is being driven."""

    def __init__(self, scene: PackedScene, trials: list[PackedTrial], *, live: bool = False) -> None:
        super().__init__()
        # One text, because NiceGUI watches each list within a value, which takes much of the server's time.
        self._props |= {"shown": json.dumps({"scene": scene, "trials": trials}), "live": live}


class PhotoInput(Element, component="photo_input.js"):
    """Field that takes a photograph and sends it to `address`."""

    def __init__(self, address: str, name: str) -> None:
        super().__init__()
        self._props |= {"address": address, "name": name}
