"""Trials in a notebook: played, stopped, and gone through step by step."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cache
from importlib import import_module, resources
from typing import Any, Required, TypedDict

import numpy as np

from realitygap._how_to_run import install_command
from realitygap.drawing import PENS, Disc, Ink, Line, Shape, theme_rules, themed_color
from realitygap.errors import RealityGapError
from realitygap.world import Arena, floor_shapes, things_in

from ._moving import MovingTrial, RobotShape, all_trials, extent
from ._screen import LETTERS, MOST_TRIALS

_DIGITS = 4
"""Digits of lengths [m] and angles [rad] that are sent to a page."""


def play(trials: MovingTrial | Iterable[MovingTrial], *, title: str = "", speed: float = 1.0) -> Any:
    """Return a widget that plays trials in a notebook: rays, trails, cells, a slider and the choice of a speed.

    Args:
        trials: One trial, or up to eight in one arena.
        title: Title in the head.
        speed: Speed at the start: 0.25, 0.5, 1, 2, 4 or 8.

    Raises:
        RealityGapError: anywidget is not there.
        TypeError: what is given is no trial.
        ValueError: none is given, or too many, or in different arenas; the speed is none of these.
    """
    listed = all_trials(trials)
    if len(listed) > MOST_TRIALS:
        raise ValueError(
            f"{len(listed)} trials to show together, expected at most {MOST_TRIALS}, one a pen. Choose some of them."
        )
    title = title or (listed[0].title if len(listed) == 1 else f"{len(listed)} trials")
    return player_class()(
        scene=pack_scene(listed[0].arena, title),
        trials=pack_trials(listed),
        speed=check_speed(speed),
    )


def check_speed(speed: float) -> float:
    """Return the speed, if a player offers it.

    Raises:
        ValueError: it does not.
    """
    speeds = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
    if speed not in speeds:
        raise ValueError(
            f"speed is {speed:g}, expected one of {', '.join(f'{choice:g}' for choice in speeds)}."
        )
    return float(speed)


FILES = resources.files("realitygap.playback")
"""Files of the pages of the widgets."""


_TRAITS = {str: "Unicode", float: "Float", bool: "Bool", list: "List", dict: "Dict"}


def widget_class(name: str, missing: str, esm: str, css: str = "", **values: object) -> type:
    """Return the class of a widget in a notebook, which its page and the kernel share values with.

    Args:
        name: Name of the class.
        missing: Message if anywidget, which is an extra, is not installed.
        esm, css: Script and styles of the page.
        values: First value of each shared one, by its name.

    Raises:
        RealityGapError: anywidget is not installed.
    """
    try:
        anywidget, traitlets = import_module("anywidget"), import_module("traitlets")
    except ImportError as error:
        raise RealityGapError(missing) from error
    traits = {
        key: getattr(traitlets, _TRAITS[type(value)])(value).tag(sync=True) for key, value in values.items()
    }
    return type(name, (anywidget.AnyWidget,), {"_esm": esm, "_css": css, **traits})


@cache
def player_class() -> type:
    """Return the class of the player.

    Raises:
        RealityGapError: anywidget is not there.
    """
    return widget_class(
        "Player",
        f"Trials are shown in a notebook by anywidget, which is not installed: {install_command('notebook')}. "
        "realitygap.write_movie needs none.",
        FILES.joinpath("player.js").read_text("utf-8"),
        theme_rules(".rg-player") + FILES.joinpath("player.css").read_text("utf-8"),
        scene={},
        trials=[],
        speed=1.0,
        live=False,
        was_live=False,
    )


class PackedLine(TypedDict):
    """A line of an arena on a page: points [m], and colors, width [pt], and dashes [pt]."""

    points: list[list[float]]
    fill: str
    stroke: str
    width: float
    dash: list[float]


class PackedDisc(TypedDict):
    """A disc of an arena on a page: its middle [m], its radius [pt], and its color."""

    x: float
    y: float
    radius: float
    fill: str


class PackedText(TypedDict):
    """A text of an arena on a page: its place [m], the shift upward [pt], and its color."""

    x: float
    y: float
    text: str
    up: float
    fill: str


class PackedGrid(TypedDict):
    """The cells of an arena on a page: corner and side [m], and numbers of columns and rows."""

    x: float
    y: float
    cell: float
    columns: int
    rows: int


class PackedScene(TypedDict, total=False):
    """The fixed parts of a scene on a page; without an arena the title and the extent [m] alone."""

    title: Required[str]
    extent: Required[list[float]]
    shapes: list[PackedLine | PackedDisc | PackedText]
    walls: list[list[float]]
    grid: PackedGrid


def pack_scene(arena: Arena | None, title: str) -> PackedScene:
    """Return the fixed parts of a scene, ready for JSON; without an arena a bare rectangle around the origin."""
    if arena is None:
        return {"title": title, "extent": [-0.4, 0.4, -0.25, 0.25]}
    grid = arena.grid
    return {
        "title": title,
        "extent": [round(float(end), _DIGITS) for end in extent(arena)],
        "shapes": [_pack_thing(shape) for shape in (*floor_shapes(arena.floor), *things_in(arena))],
        "walls": [list(wall) for wall in arena.walls],
        "grid": {"x": grid.x, "y": grid.y, "cell": grid.cell, "columns": grid.columns, "rows": grid.rows},
    }


def _pack_thing(shape: Shape) -> PackedLine | PackedDisc | PackedText:
    """Return a plain shape of an object in the arena, ready for JSON."""
    if isinstance(shape, Line):
        points = [[round(x, _DIGITS), round(y, _DIGITS)] for x, y in shape.points]
        return {
            "points": [*points, points[0]] if shape.closed else points,
            "fill": _paint(shape.fill),
            "stroke": _paint(shape.color),
            "width": shape.width,
            "dash": list(shape.dash),
        }
    if isinstance(shape, Disc):
        return {"x": shape.x, "y": shape.y, "radius": shape.radius, "fill": themed_color(shape.fill)}
    return {
        "x": shape.x,
        "y": shape.y,
        "text": shape.text,
        "up": shape.shift[1],
        "fill": themed_color(shape.color),
    }


def _paint(color: str | None) -> str:
    return "none" if color is None else themed_color(color)


class PackedPen(TypedDict):
    """Letter, color, and dashes [pt] of a trial on a page."""

    letter: str
    color: str
    dashes: list[float]


class PackedShape(TypedDict):
    """The drawn shape of a robot on a page; see `RobotShape`."""

    outlines: list[list[list[float]]]
    mounts: list[list[float]]
    reach: list[float]


class PackedTrial(PackedPen, PackedShape):
    """A trial on a page: poses [m, rad] and rays [m] by row, and the visited cells with their rows."""

    title: str
    label: str
    placed: bool
    step_s: float
    parts: int
    poses: list[list[float]]
    rays: list[list[float | None]]
    stalled: list[int]
    cells: list[int]
    visited_at: list[int]


def pack_trials(trials: Sequence[MovingTrial], *, placed: bool = True) -> list[PackedTrial]:
    """Return trials in a form for JSON; `placed` is false if the robot's poses are unknown."""
    pens = [pack_pen(pen) for pen in range(len(trials))]
    if len(trials) == 1:
        pens[0]["color"] = themed_color(Ink.OURS)
    return [
        {
            "title": trial.title,
            "label": trial.label,
            "placed": placed,
            **pens[pen],
            **pack_shape(trial.shape),
            "step_s": trial.step_s,
            "parts": trial.parts,
            "poses": np.round(trial.poses, _DIGITS).tolist(),
            "rays": [pack_rays(row) for row in trial.rays.tolist()],
            "stalled": trial.stalled.astype(int).tolist(),
            "cells": list(trial.cells),
            "visited_at": list(trial.visited_at),
        }
        for pen, trial in enumerate(trials)
    ]


def pack_pen(pen: int) -> PackedPen:
    """Return the letter, the color, and the dashes [pt] of the trial with a pen, ready for JSON."""
    color, dashes = PENS[pen]
    return {"letter": LETTERS[pen], "color": themed_color(color), "dashes": list(dashes)}


def pack_shape(shape: RobotShape) -> PackedShape:
    """Return the drawn shape of a robot, ready for JSON."""
    return {
        "outlines": [[list(corner) for corner in outline] for outline in shape.outlines],
        "mounts": [list(mount) for mount in shape.mounts],
        "reach": list(shape.reach),
    }


def pack_rays(lengths: Iterable[float]) -> list[float | None]:
    """Return lengths of rays ready for JSON, which has no NaN."""
    return [None if math.isnan(length) else round(length, _DIGITS) for length in lengths]
