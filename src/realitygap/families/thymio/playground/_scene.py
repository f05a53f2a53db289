"""An arena as a scene of Aseba's playground."""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

from realitygap.errors import RobotError
from realitygap.world import Arena, Obstacle, bounds_of, walls_within

CM = 100.0
HEIGHT_CM = 10.0
"""Height of walls and obstacles. A Thymio's sensors are 3.4 cm above the floor."""
WALL_CM = 0.2
"""Thickness of a wall inside the room."""


def corner_of(arena: Arena) -> tuple[float, float]:
    """Return the point of the arena that is the playground's origin [m].

    Raises:
        RobotError: The playground cannot have this arena.
    """
    room = bounds_of(arena)
    if room is None:
        raise RobotError(
            f"Arena {arena.name!r} has no walls around it, expected some: the playground is a room."
        )
    if arena.vary:
        raise RobotError(
            f"In arena {arena.name!r} {', '.join(arena.vary)} are drawn, expected plain numbers on a Thymio."
        )
    if arena.floor.tape or arena.floor.image is not None:
        raise RobotError(
            f"Arena {arena.name!r} has something on its floor, which the playground's scene leaves out. Use platform "
            "enki."
        )
    return room[:2]


def scene_of(arena: Arena, port: int) -> str:
    """Return the scene: the rectangle around all walls, the obstacles, and a Thymio at the start.

    Args:
        arena: Lights and a goal are left out.
        port: TCP port of the robot.

    Raises:
        RobotError: The playground cannot have this arena.
    """
    left, low = corner_of(arena)
    _, _, right, high = bounds_of(arena) or (0.0, 0.0, 0.0, 0.0)
    x, y, heading = arena.start
    lines = [
        "<!DOCTYPE aseba-playground>",
        "<aseba-playground>",
        _element("color", name="wall", r=0.9, g=0.9, b=0.9),
        _element("world", w=(right - left) * CM, h=(high - low) * CM, color="wall"),
    ]
    for wall in walls_within(arena, (left, low, right, high)):
        lines.append(_wall(*wall, left, low))
    for obstacle in arena.obstacles:
        lines += _obstacle(obstacle, left, low)
    robot = {"x": (x - left) * CM, "y": (y - low) * CM, "angle": heading}
    lines.append(_element("robot", type="thymio2", **robot, port=port, nodeId=1, name="t"))
    return "\n".join([*lines, "</aseba-playground>", ""])


def _obstacle(obstacle: Obstacle, left: float, low: float) -> Iterator[str]:
    """Yield a disc, or the sides of an outline: the playground has no other shapes."""
    if len(obstacle.corners) == 1:
        ((x, y),) = obstacle.placed
        size = {"r": obstacle.radius * CM, "h": HEIGHT_CM}
        yield _element("cylinder", x=(x - left) * CM, y=(y - low) * CM, **size, color="wall")
        return
    points = obstacle.outline()
    for (x1, y1), (x2, y2) in zip(points, (*points[1:], points[0]), strict=True):
        length = math.hypot(x2 - x1, y2 - y1)
        if length:  # half of the thickness inwards, so that its outer face is where the side is
            inward = WALL_CM / CM / 2 / length
            dx, dy = -(y2 - y1) * inward, (x2 - x1) * inward
            yield _wall(x1 + dx, y1 + dy, x2 + dx, y2 + dy, left, low)


def _wall(x1: float, y1: float, x2: float, y2: float, left: float, low: float) -> str:
    middle = {"x": ((x1 + x2) / 2 - left) * CM, "y": ((y1 + y2) / 2 - low) * CM}
    size = {"l1": math.hypot(x2 - x1, y2 - y1) * CM, "l2": WALL_CM, "h": HEIGHT_CM}
    return _element("wall", **middle, **size, angle=math.atan2(y2 - y1, x2 - x1), color="wall")


def _element(element: str, **values: float | str) -> str:
    return f"  <{element} {' '.join(f'{name}={quoteattr(str(value))}' for name, value in values.items())}/>"
