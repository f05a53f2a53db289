"""A `JyroWorld` from above, as plain shapes."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from realitygap.drawing import Line, Picture, Shape, hex_of, picture_of
from realitygap.errors import did_you_mean

from ._world import JyroWorld

PARTS = ("boxes", "shapes", "lights", "walls", "trails", "rays", "bodies", "devices", "speech")
"""Parts of a picture."""
LAMP_RADIUS = 0.25  # as Jyro draws them [m]
_MARGIN = 0.03  # around everything, of the larger side
_FAR = 100.0  # what is further away is not shown: stored robots are [m]
_ALONE = (-0.5, 0.5)  # what is shown of an empty world [m]


@picture_of.register(JyroWorld)
def world_picture(world: JyroWorld, hide: Collection[str] = ()) -> Picture:
    """Return a picture of boxes, walls, lamps, and robots with their devices and rays, to scale.

    Args:
        world: The world in its present state.
        hide: Parts to leave out, of `PARTS`.

    Raises:
        ValueError: There is no such part.
    """
    for part in hide:
        if part not in PARTS:
            raise ValueError(f"Unknown part {part!r}. {did_you_mean(part, PARTS)}")
    left, right, bottom, top = _borders(world)
    margin = _MARGIN * max(right - left, top - bottom)
    parts: list[tuple[str, Sequence[Shape]]] = [
        ("boxes", [Line(area.corners, None, closed=True, fill=hex_of(area.fill)) for area in world.areas]),
        ("shapes", world.drawn),
        ("lights", [_disc(lamp.x, lamp.y, LAMP_RADIUS, hex_of(lamp.color)) for lamp in world.lights]),
        ("walls", _walls(world)),
    ]
    for robot in world.robots:
        parts += robot.parts().items()
    shapes = tuple(shape for part, own in parts if part not in hide for shape in own)
    n = len(world.robots)
    stalled = [str(robot.name) for robot in world.robots if robot.stalled]
    return Picture(
        "World",
        f"World of {right - left:.3g} by {top - bottom:.3g} m with {n} robot{'' if n == 1 else 's'} after "
        f"{world.n_steps} steps, {world.time:.4g} s; blocked: {', '.join(stalled) or 'none'}.",
        left - margin,
        bottom - margin,
        right + margin,
        top + margin,
        shapes,
    )


def _borders(world: JyroWorld) -> tuple[float, float, float, float]:
    """Return left, right, bottom, and top of all walls [m], or of the robots if there are no walls."""
    xs = [x for wall in world.walls for x in wall[::2]]
    ys = [y for wall in world.walls for y in wall[1::2]]
    if not xs:
        near = [pose for robot in world.robots if math.hypot(*(pose := robot.pose)[:2]) < _FAR]
        xs = [pose.x + side for pose in near for side in _ALONE] + [lamp.x for lamp in world.lights]
        ys = [pose.y + side for pose in near for side in _ALONE] + [lamp.y for lamp in world.lights]
    xs, ys = xs or list(_ALONE), ys or list(_ALONE)
    left, right, bottom, top = min(xs), max(xs), min(ys), max(ys)
    if left == right:
        left, right = left + _ALONE[0], right + _ALONE[1]
    if bottom == top:
        bottom, top = bottom + _ALONE[0], top + _ALONE[1]
    return left, right, bottom, top


def _walls(world: JyroWorld) -> list[Shape]:
    return [
        Line(((x1, y1), (x2, y2)), hex_of(color), 2.0)
        for (x1, y1, x2, y2), color in zip(world.walls, world.wall_colors, strict=True)
    ]


def _disc(x: float, y: float, radius: float, fill: str, n: int = 48) -> Line:
    angles = [2 * math.pi * k / n for k in range(n)]
    rim = tuple((x + radius * math.cos(angle), y + radius * math.sin(angle)) for angle in angles)
    return Line(rim, None, closed=True, fill=fill)
