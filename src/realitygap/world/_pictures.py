"""Pictures of an arena and a robot as plain shapes, to scale and with dimensions."""

from __future__ import annotations

import math
from itertools import pairwise

from realitygap._wording import fixed
from realitygap.drawing import Disc, Ink, Line, Picture, Shape, Text, picture_of

from ._arena import Arena, Pose
from ._described import INCH
from ._floor import BARE_FLOOR, Floor, FloorImage
from ._obstacle import Goal, Light, Obstacle
from ._part import Body, RangeSensors
from ._robot_model import RobotModel

_TICK = 0.012  # half the length of the strokes that end a dimension line [m]
PAPER_WIDTH = 42 * INCH  # what sizes in pictures were chosen for [m]
MOST_DRAWN = 96  # pixels of a floor image that a picture shows across or up
GRAYS = 32  # of 256 that a picture does not tell apart
TAPE = "#3d434c"
LIGHT, LIGHT_GLOW = "#e0a100", "#f6e3a1"
_WHOLE = 1e-6  # a length this near to whole inches was meant so [in]


@picture_of.register(Arena)
def arena_picture(
    arena: Arena, body: Body | RobotModel | None = None, sensors: RangeSensors | None = None
) -> Picture:
    """Return a drawing of the arena from above, to scale, and of the robot at its start if it is given.

    Args:
        arena: Arena to draw.
        body: Outline of the robot, or the robot itself, drawn at the start.
        sensors: Range sensors, whose rays are drawn up to their reach.
    """
    left, bottom, right, top = extent_of(arena)
    size = max(right - left, top - bottom) / PAPER_WIDTH  # 1 for the paper's arena
    grid = arena.grid
    cells_right, cells_top = grid.right_end, grid.upper_end
    shapes: list[Shape] = [*floor_shapes(arena.floor), *_cells(arena)]
    shapes += [shape for obstacle in arena.obstacles for shape in obstacle_shapes(obstacle)]
    shapes += [Line(((x1, y1), (x2, y2)), Ink.TEXT, 2.4) for x1, y1, x2, y2 in arena.walls]
    shapes += [shape for light in arena.lights for shape in light_shapes(light)]
    if arena.goal is not None:
        shapes += goal_shapes(arena.goal)
    for start in arena.starts:
        if sensors is not None:
            shapes += _rays(sensors, start)
        if isinstance(body, RobotModel):
            shapes += _model_shapes(body, start)
        elif body is not None:
            shapes += _outline(body, start)
        shapes += _start(start, size)
    gap = 0.05 * size
    shapes += dimension_line(left, bottom - gap, right, bottom - gap, length_text(right - left), size=size)
    shapes += dimension_line(left - gap, bottom, left - gap, top, length_text(top - bottom), size=size)
    over = cells_top + 0.028 * size
    shapes += dimension_line(cells_right - grid.cell, over, cells_right, over, "", color=Ink.REACH, size=size)
    shapes.append(
        Text(
            cells_right - grid.cell - 0.02 * size,
            cells_top + 0.034 * size,
            f"{grid.columns} × {grid.rows} cells of {length_text(grid.cell)}",
            7.5,
            "end",
            color=Ink.REACH,
            halo=cells_top + 0.06 * size > top,
        )
    )
    return Picture(
        f"Arena {arena.name}",
        _arena_in_words(arena, right - left, top - bottom),
        left - 0.13 * size,
        bottom - 0.13 * size,
        right + 0.02 * size,
        max(top + 0.02 * size, over + 0.04 * size),
        tuple(shapes),
    )


def _model_shapes(model: RobotModel, pose: Pose) -> list[Shape]:
    """Return a robot of a file at a pose: its rays, cut off at the size of its body, and its outline."""
    shapes: list[Shape] = []
    for sensor in model.range:
        x, y = pose.point(sensor.x, sensor.y)
        angle, far = pose.heading + sensor.direction, min(sensor.reach, 2 * model.radius)
        end = (x + far * math.cos(angle), y + far * math.sin(angle))
        shapes += [Line(((x, y), end), Ink.PUBLISHED, 0.9, (3.0, 1.6)), Disc(x, y, 1.3, None, Ink.PUBLISHED)]
    for part in model.body:
        outline = tuple(pose.point(x, y) for x, y in part.outline())
        shapes.append(Line(outline, Ink.BODY, 1.4, closed=True))
    return shapes


def extent_of(arena: Arena) -> tuple[float, float, float, float]:
    """Return left, bottom, right, and top of the visible part [m]."""
    grid = arena.grid
    points = [(x, y) for x1, y1, x2, y2 in arena.walls for x, y in ((x1, y1), (x2, y2))]
    points += [(light.x, light.y) for light in arena.lights]
    points += [point for obstacle in arena.obstacles for point in obstacle.outline()]
    if not arena.walls:
        points += [(grid.x, grid.y), (grid.right_end, grid.upper_end)]
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return min(xs), min(ys), max(xs), max(ys)


def _cells(arena: Arena) -> list[Shape]:
    """Return the reachable cells, lightly filled unless there is something on the floor."""
    grid = arena.grid
    right, top = grid.right_end, grid.upper_end
    corners = ((grid.x, grid.y), (right, grid.y), (right, top), (grid.x, top))
    fill = Ink.VISITED if arena.floor == BARE_FLOOR else None
    shapes: list[Shape] = [Line(corners, None, closed=True, fill=fill)]
    shapes += [
        Line(((grid.x + k * grid.cell, grid.y), (grid.x + k * grid.cell, top)), Ink.MUTED, 0.4)
        for k in range(1, grid.columns)
    ]
    shapes += [
        Line(((grid.x, grid.y + k * grid.cell), (right, grid.y + k * grid.cell)), Ink.MUTED, 0.4)
        for k in range(1, grid.rows)
    ]
    return [*shapes, Line(corners, Ink.REACH, 1.4, closed=True)]


def _arena_in_words(arena: Arena, width: float, height: float) -> str:
    grid, start = arena.grid, arena.start
    things = [
        (len(arena.others), "other robot"),
        (len(arena.obstacles), "obstacle"),
        (len(arena.lights), "light"),
        (len(arena.floor.tape), "strip of tape"),
        (arena.goal is not None, "goal"),
    ]
    contents = [
        f"{n:d} {what}{'s' if n > 1 else ''}".replace("strip of tapes", "strips of tape")
        for n, what in things
        if n
    ]
    return (
        f"Arena {arena.name}, {length_text(width)} by {length_text(height)}, with {grid.columns} by {grid.rows} "
        f"reachable cells of {length_text(grid.cell)}{', ' if contents else ''}{', '.join(contents)}. Trials begin at "
        f"({start.x:.4g}, {start.y:.4g}) m, heading {start.heading:.4g} rad."
    )


def things_in(arena: Arena) -> list[Shape]:
    """Return obstacles, lights and the goal."""
    shapes = [shape for obstacle in arena.obstacles for shape in obstacle_shapes(obstacle)]
    shapes += [shape for light in arena.lights for shape in light_shapes(light)]
    return shapes + (goal_shapes(arena.goal) if arena.goal is not None else [])


def obstacle_shapes(obstacle: Obstacle) -> list[Shape]:
    """Return an obstacle from above."""
    return [Line(obstacle.outline(), Ink.TEXT, 1.6, closed=True, fill=Ink.RULE)]


def light_shapes(light: Light) -> list[Shape]:
    """Return a light from above, and how strong it is."""
    shapes: list[Shape] = [
        Disc(light.x, light.y, radius, color=None, fill=fill)
        for radius, fill in ((9.0, LIGHT_GLOW), (5.5, LIGHT_GLOW), (4.0, LIGHT))
    ]
    return [*shapes, Text(light.x, light.y, f"light {light.strength:g}", 7.5, shift=(0.0, 14.0), halo=True)]


def goal_shapes(goal: Goal) -> list[Shape]:
    """Return the goal from above."""
    rim = tuple(
        (goal.x + goal.radius * math.cos(k * math.pi / 24), goal.y + goal.radius * math.sin(k * math.pi / 24))
        for k in range(48)
    )
    return [
        Line(rim, Ink.PEN3, 1.4, (3.0, 1.6), closed=True),
        Disc(goal.x, goal.y, 2.0, color=None, fill=Ink.PEN3),
        Text(goal.x, goal.y, "goal", 7.5, shift=(0.0, -9.0), color=Ink.PEN3, halo=True),
    ]


def floor_shapes(floor: Floor) -> list[Shape]:
    """Return the shapes on the floor: an image in coarse pixels, and tape at its true width."""
    shapes: list[Shape] = _image_shapes(floor.image) if floor.image is not None else []
    for x1, y1, x2, y2 in floor.tape:
        length = math.hypot(x2 - x1, y2 - y1) or 1.0
        across_x, across_y = (
            -(y2 - y1) / length * floor.tape_width / 2,
            (x2 - x1) / length * floor.tape_width / 2,
        )
        corners = (
            (x1 + across_x, y1 + across_y),
            (x2 + across_x, y2 + across_y),
            (x2 - across_x, y2 - across_y),
            (x1 - across_x, y1 - across_y),
        )
        shapes.append(Line(corners, None, closed=True, fill=TAPE))
    return shapes


def _image_shapes(image: FloorImage) -> list[Shape]:
    """Return runs of like brightness, row by row."""
    step = max(1, math.ceil(max(image.columns, image.rows) / MOST_DRAWN))
    gray = image.gray[::step, ::step] // GRAYS * GRAYS
    pixel = image.width / image.columns * step
    shapes: list[Shape] = []
    for row, values in enumerate(gray):
        top = image.y + image.height - row * pixel
        bottom = max(image.y, top - pixel)
        ends = [0, *(k for k in range(1, len(values)) if values[k] != values[k - 1]), len(values)]
        for first, last in pairwise(ends):
            left, right = image.x + first * pixel, min(image.x + last * pixel, image.x + image.width)
            level = min(255, int(values[first]) + GRAYS - 1)
            fill = f"#{level:02x}{level:02x}{level:02x}"
            shapes.append(
                Line(
                    ((left, bottom), (right, bottom), (right, top), (left, top)), None, closed=True, fill=fill
                )
            )
    return shapes


def robot_picture(name: str, body: Body, sensors: RangeSensors) -> Picture:
    """Return a robot from above, facing right: outline, center, rays as far as they see, and its dimensions."""
    forwards, lefts = zip(*body.corners, strict=True)
    back, front, low, high = min(forwards), max(forwards), min(lefts), max(lefts)
    here = Pose(0.0, 0.0, 0.0)
    shapes = [*_rays(sensors, here), *_outline(body, here), *_start(here)]
    far = max((forward for forward, _, _ in sensors.mounts), default=front) + sensors.max_range
    offset = max((left for _, left, _ in sensors.mounts), default=0.0)
    shapes += dimension_line(back, low - 0.03, front, low - 0.03, length_text(front - back))
    shapes += dimension_line(back - 0.03, low, back - 0.03, high, length_text(high - low))
    shapes += dimension_line(front, low - 0.03, far, low - 0.03, f"sees {length_text(sensors.max_range)}")
    if offset > 0:
        shapes += dimension_line(far + 0.025, 0.0, far + 0.025, offset, "")
        shapes.append(Text(far + 0.04, offset / 2, length_text(offset), 7.5, "start"))
    n = len(sensors.mounts)
    shapes.append(Text(back, high + 0.025, name, 8.0, "start", bold=True))
    size = f"{length_text(front - back)} long, {length_text(high - low)} wide"
    return Picture(
        f"Robot {name}",
        f"Outline of {name} seen from above, facing right: {size}, "
        f"with {n} rays that see {length_text(sensors.max_range)}.",
        back - 0.1,
        low - 0.1,
        max(far, front) + 0.13,
        high + 0.045,
        tuple(shapes),
    )


def _outline(body: Body, pose: Pose) -> list[Shape]:
    corners = tuple(pose.point(forward, left) for forward, left in body.corners)
    return [Line(corners, Ink.BODY, 1.4, closed=True)]


def _rays(sensors: RangeSensors, pose: Pose) -> list[Shape]:
    shapes: list[Shape] = []
    for forward, left, direction in sensors.mounts:
        x, y = pose.point(forward, left)
        angle = pose.heading + direction
        end = (x + sensors.max_range * math.cos(angle), y + sensors.max_range * math.sin(angle))
        shapes.append(Line(((x, y), end), Ink.PUBLISHED, 1.0, (3.0, 1.6)))
        shapes.append(Disc(x, y, 1.8, fill=Ink.PUBLISHED))
    return shapes


def _start(pose: Pose, size: float = 1.0) -> list[Shape]:
    tip = pose.point(0.062 * size, 0.0)
    shaft = Line(((pose.x, pose.y), tip), Ink.OURS, 1.4)
    back, aside = 0.045 * size, 0.012 * size
    head = Line((pose.point(back, aside), tip, pose.point(back, -aside)), Ink.OURS, 1.4)
    return [shaft, head, Disc(pose.x, pose.y, 2.6, fill=Ink.OURS)]


def dimension_line(
    x1: float, y1: float, x2: float, y2: float, text: str, color: str = Ink.TEXT, size: float = 1.0
) -> list[Shape]:
    """Return a dimension line along an axis. Its text is outside: below a level line, left of an upright one."""
    level = y1 == y2
    tick = _TICK * size
    ends = [
        Line(
            ((x - (0 if level else tick), y - (tick if level else 0)),
             (x + (0 if level else tick), y + (tick if level else 0))),
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


def length_text(value: float) -> str:
    """Return a length [m] in meters, and also in inches if these are whole."""
    inches = value / INCH
    metric = fixed(value, 3)
    if "e" in metric:
        return f"{metric} m"
    metric = metric.rstrip("0").rstrip(".") + " m"
    if abs(inches - round(inches)) < _WHOLE * max(1.0, inches) and round(inches) > 0:
        return f"{metric} ({round(inches)} in)"
    return metric
