"""What an arena and a robot look like, to scale and with their dimensions, as plain shapes."""

from __future__ import annotations

import math

from realitygap.drawing import Disc, Ink, Line, Picture, Point, Shape, Text

from ._arena import Arena, Pose
from ._robot import Body, RangeSensors
from ._units import INCH

_TICK = 0.012  # half the length of the strokes that end a dimension line [m]
_WHOLE = 1e-6  # a length this near to whole inches was meant so [in]


def arena_picture(arena: Arena, body: Body | None = None, sensors: RangeSensors | None = None) -> Picture:
    """The arena from above: walls, reachable cells, start, and where given the robot there, to scale.

    Args:
        arena: What does not move.
        body: Outline of the robot, drawn at the start.
        sensors: Its rays, drawn as far as they see.
    """
    xs = [x for wall in arena.walls for x in wall[::2]]
    ys = [y for wall in arena.walls for y in wall[1::2]]
    grid = arena.grid
    left, right, bottom, top = min(xs), max(xs), min(ys), max(ys)
    cells_right, cells_top = grid.x + grid.columns * grid.cell, grid.y + grid.rows * grid.cell
    shapes: list[Shape] = [
        Line(
            ((grid.x, grid.y), (cells_right, grid.y), (cells_right, cells_top), (grid.x, cells_top)),
            None,
            closed=True,
            fill=Ink.VISITED,
        )
    ]
    shapes += [
        Line(((grid.x + k * grid.cell, grid.y), (grid.x + k * grid.cell, cells_top)), Ink.MUTED, 0.4)
        for k in range(1, grid.columns)
    ]
    shapes += [
        Line(((grid.x, grid.y + k * grid.cell), (cells_right, grid.y + k * grid.cell)), Ink.MUTED, 0.4)
        for k in range(1, grid.rows)
    ]
    shapes.append(
        Line(
            ((grid.x, grid.y), (cells_right, grid.y), (cells_right, cells_top), (grid.x, cells_top)),
            Ink.REACH,
            1.4,
            closed=True,
        )
    )
    shapes += [Line(((x1, y1), (x2, y2)), Ink.TEXT, 2.4) for x1, y1, x2, y2 in arena.walls]
    if sensors is not None:
        shapes += _rays(sensors, arena.start)
    if body is not None:
        shapes += _outline(body, arena.start)
    shapes += _start(arena.start)
    gap = 0.05
    shapes += _measure(left, bottom - gap, right, bottom - gap, _length(right - left))
    shapes += _measure(left - gap, bottom, left - gap, top, _length(top - bottom))
    shapes += _measure(
        cells_right - grid.cell, cells_top + 0.028, cells_right, cells_top + 0.028, "", color=Ink.REACH
    )
    shapes.append(
        Text(
            cells_right - grid.cell - 0.02,
            cells_top + 0.034,
            f"{grid.columns} × {grid.rows} cells of {_length(grid.cell)}",
            7.5,
            "end",
            color=Ink.REACH,
        )
    )
    start = arena.start
    return Picture(
        f"Arena {arena.name}",
        f"Arena {arena.name}, {_length(right - left)} by {_length(top - bottom)}, with {grid.columns} by {grid.rows} "
        f"reachable cells of {_length(grid.cell)}. Trials begin at ({start.x:.4g}, {start.y:.4g}) m, heading "
        f"{start.heading:.4g} rad.",
        left - 0.13,
        bottom - 0.13,
        right + 0.02,
        top + 0.02,
        tuple(shapes),
    )


def robot_picture(name: str, body: Body, sensors: RangeSensors) -> Picture:
    """A robot from above, facing right: outline, center, rays as far as they see, and its dimensions."""
    forwards, lefts = zip(*body.corners, strict=True)
    back, front, low, high = min(forwards), max(forwards), min(lefts), max(lefts)
    here = Pose(0.0, 0.0, 0.0)
    shapes = [*_rays(sensors, here), *_outline(body, here), *_start(here)]
    far = max((forward for forward, _, _ in sensors.mounts), default=front) + sensors.max_range
    offset = max((left for _, left, _ in sensors.mounts), default=0.0)
    shapes += _measure(back, low - 0.03, front, low - 0.03, _length(front - back))
    shapes += _measure(back - 0.03, low, back - 0.03, high, _length(high - low))
    shapes += _measure(front, low - 0.03, far, low - 0.03, f"sees {_length(sensors.max_range)}")
    if offset > 0:
        shapes += _measure(far + 0.025, 0.0, far + 0.025, offset, "")
        shapes.append(Text(far + 0.04, offset / 2, _length(offset), 7.5, "start"))
    n = len(sensors.mounts)
    shapes.append(Text(back, high + 0.025, name, 8.0, "start", bold=True))
    return Picture(
        f"Robot {name}",
        f"Outline of {name} seen from above, facing right: {_length(front - back)} long, {_length(high - low)} wide, "
        f"with {n} rays that see {_length(sensors.max_range)}.",
        back - 0.1,
        low - 0.1,
        max(far, front) + 0.13,
        high + 0.045,
        tuple(shapes),
    )


def _placed(pose: Pose, forward: float, left: float) -> Point:
    sine, cosine = math.sin(pose.heading), math.cos(pose.heading)
    return (pose.x + forward * cosine - left * sine, pose.y + forward * sine + left * cosine)


def _outline(body: Body, pose: Pose) -> list[Shape]:
    corners = tuple(_placed(pose, forward, left) for forward, left in body.corners)
    return [Line(corners, Ink.BODY, 1.4, closed=True)]


def _rays(sensors: RangeSensors, pose: Pose) -> list[Shape]:
    shapes: list[Shape] = []
    for forward, left, direction in sensors.mounts:
        x, y = _placed(pose, forward, left)
        angle = pose.heading + direction
        end = (x + sensors.max_range * math.cos(angle), y + sensors.max_range * math.sin(angle))
        shapes.append(Line(((x, y), end), Ink.PUBLISHED, 1.0, (3.0, 1.6)))
        shapes.append(Disc(x, y, 1.8, fill=Ink.PUBLISHED))
    return shapes


def _start(pose: Pose) -> list[Shape]:
    tip = _placed(pose, 0.062, 0.0)
    shaft = Line(((pose.x, pose.y), tip), Ink.OURS, 1.4)
    head = Line((_placed(pose, 0.045, 0.012), tip, _placed(pose, 0.045, -0.012)), Ink.OURS, 1.4)
    return [shaft, head, Disc(pose.x, pose.y, 2.6, fill=Ink.OURS)]


def _measure(x1: float, y1: float, x2: float, y2: float, text: str, color: str = Ink.TEXT) -> list[Shape]:
    """A dimension line along an axis, its text outside: below a level one, left of an upright one."""
    level = y1 == y2
    ends = [
        Line(
            ((x - (0 if level else _TICK), y - (_TICK if level else 0)),
             (x + (0 if level else _TICK), y + (_TICK if level else 0))),
            color, 0.7,
        )
        for x, y in ((x1, y1), (x2, y2))
    ]  # fmt: skip
    shapes: list[Shape] = [Line(((x1, y1), (x2, y2)), color, 0.7), *ends]
    if text:
        shift = (0.0, -9.0) if level else (-9.0, 0.0)
        shapes.append(
            Text(
                (x1 + x2) / 2,
                (y1 + y2) / 2,
                text,
                7.5,
                shift=shift,
                color=color,
                halo=True,
                upright=not level,
            )
        )
    return shapes


def _length(value: float) -> str:
    inches = value / INCH
    metric = f"{value:.3f}".rstrip("0").rstrip(".") + " m"
    if abs(inches - round(inches)) < _WHOLE * max(1.0, inches) and round(inches) > 0:
        return f"{metric} ({round(inches)} in)"
    return metric
