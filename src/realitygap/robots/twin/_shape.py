"""A twin in its arena as a model of MuJoCo: wheels that grip a floor, a shell that meets walls.

The shell is a ring of capsules lying along its sides, so its corners are round; each wheel touches the floor in one
point. The pen is the origin of the body `robot`. Nothing of the robot is in the group that rays of sensors look at.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from realitygap.world import Arena, Obstacle, Segment, enclosing_walls, is_inside, rounded

from ._model import TwinModel

STEP_S = 0.005  # of the physics: a trial of 100 commands of 0.5 s takes some 0.1 s of a core
CONTACT_S = 0.01  # time constant of contacts [s]: MuJoCo wants two steps
WALL, FLOOR, ROBOT, DRAWN = 0, 1, 2, 3  # groups
WALL_HEIGHT = 0.089  # of the paper's blocks, 3.5 in [m]
THIN_HALF = 0.001  # half the thickness of a wall [m]
THICK_HALVES = (0.02, 0.01, 0.005, 0.002)  # where there is room for it behind a wall that encloses the arena
SHELL_ABOVE = 0.035  # of the floor, where the shell meets walls [m]
SHELL_BOTTOM, SHELL_TOP = 0.0126, 0.063  # of what is drawn [m]
WHEEL_WIDTH = 0.0095  # that is drawn [m]
SUPPORT = 0.006  # radius of what touches the floor besides the wheels [m]
TIPS = 0.0005  # by which the skid is above the floor [m]
GRAVITY = 9.81
LEAST_INERTIA = 2e-4  # of a motor behind its gears, about the wheel; chosen [kg m2]


def mjcf_of(model: TwinModel, arena: Arena) -> str:
    """Return the twin in its arena in MuJoCo's XML."""
    slope, uphill = model.oddities.slope, model.oddities.uphill
    along = -GRAVITY * math.sin(slope)
    gravity = along * math.cos(uphill), along * math.sin(uphill), -GRAVITY * math.cos(slope)
    return f"""<mujoco model="twin">
  <option timestep="{STEP_S}" cone="elliptic" impratio="10" integrator="implicitfast" gravity="{_row(*gravity)}"/>
  <visual><headlight ambient=".35 .35 .35" diffuse=".5 .5 .5"/><global offwidth="1920" offheight="1920"/></visual>
  <asset><mesh name="shell" vertex="{_shell_points(model)}"/></asset>
  <default><geom solref="{CONTACT_S} 1" solimp=".95 .99 .001" condim="3" contype="0" conaffinity="0"/></default>
  <worldbody>
    <light pos="{_row(*arena.start[:2], 2.5)}" dir="0.2 0.3 -1" directional="true" diffuse=".4 .4 .4"/>
    <geom name="floor" type="plane" size="100 100 1" group="{FLOOR}" contype="1" friction=".0001 .0001 .0001"
          rgba=".93 .91 .87 1"/>
    {_joined(_walls(arena, model.walls.friction))}
    <body name="robot" pos="0 0 {model.wheels.diameter / 2}">
      <freejoint/>
      {_joined(_chassis(model))}
      {_joined(_wheels(model))}
    </body>
  </worldbody>
  <actuator>{"".join(_motor(model, side) for side in ("left", "right"))}</actuator>
</mujoco>"""


def shell_of(model: TwinModel) -> tuple[tuple[tuple[float, float], ...], float]:
    """Return the corners of the outline that meets walls, x and y [m], and the radius they are grown by."""
    body = model.body
    if body.cardboard is None:
        scale_x, scale_y = body.length_scale, body.width_scale
        return tuple((x * scale_x, y * scale_y) for x, y in body.corners), body.corner_radius
    edge = 0.002  # of folded cardboard
    x, y = (max(size / 2 - edge, edge) for size in body.cardboard)
    return ((x, y), (-x, y), (-x, -y), (x, -y)), edge


def _chassis(model: TwinModel) -> Iterator[str]:
    body, wheels = model.body, model.wheels
    floor = -wheels.diameter / 2
    yield (
        f'<inertial pos="{_row(body.center, 0, -0.01)}" mass="{body.mass}" '
        f'diaginertia="{_row(0.7 * body.inertia, 0.7 * body.inertia, body.inertia)}"/>'
    )
    corners, radius = shell_of(model)
    height = floor + SHELL_ABOVE
    for (x1, y1), (x2, y2) in pairwise((*corners, corners[0])):
        yield (
            f'<geom type="capsule" size="{radius}" fromto="{_row(x1, y1, height, x2, y2, height)}" group="{ROBOT}" '
            f'contype="4" conaffinity="2" mass="0" friction="{model.walls.friction} .0001 .0001" rgba=".2 .35 .75 1"/>'
        )
    yield f'<geom type="mesh" mesh="shell" group="{DRAWN}" mass="0" rgba=".75 .13 .12 1"/>'
    board = _row(max(mount.x for mount in model.ir.mount) * body.length_scale - 0.006, 0, height + 0.035)
    yield f'<geom type="box" size=".002 .03 .02" pos="{board}" group="{DRAWN}" mass="0" rgba=".1 .5 .2 1"/>'
    for x, lift, friction in ((wheels.caster, 0.0, wheels.caster_friction), (wheels.skid, TIPS, 0.1)):
        yield (
            f'<geom type="sphere" size="{SUPPORT}" pos="{_row(x, 0, floor + SUPPORT + lift)}" group="{ROBOT}" '
            f'condim="{3 if friction else 1}" conaffinity="1" mass="0" priority="1" '
            f'friction="{friction} .0001 .0001" rgba=".3 .3 .3 1"/>'
        )


def _shell_points(model: TwinModel) -> str:
    """Return the shell that is drawn: its outline below and, drawn in a little, above."""
    corners, radius = shell_of(model)
    low, high = -model.wheels.diameter / 2 + SHELL_BOTTOM, -model.wheels.diameter / 2 + SHELL_TOP
    return " ".join(
        _row(x * part, y * part, z)
        for x, y in rounded(corners, radius)
        for z, part in ((low, 1.0), (SHELL_ABOVE - model.wheels.diameter / 2, 1.0), (high, 0.85))
    )


def _wheels(model: TwinModel) -> Iterator[str]:
    wheels = model.wheels
    for side, sign in (("left", 1), ("right", -1)):
        yield (
            f'<body name="{side}" pos="{_row(wheels.axle, sign * wheels.track / 2, 0)}">'
            f'<joint name="{side}" type="hinge" axis="0 1 0" armature="{_geared_inertia(model)}"/>'
            f'<geom type="sphere" size="{wheels.diameter / 2}" mass="{wheels.mass}" group="{ROBOT}" conaffinity="1" '
            f'priority="2" friction="{wheels.friction} .001 .0001" rgba="0 0 0 0"/>'
            f'<geom type="cylinder" size="{_row(wheels.diameter / 2, WHEEL_WIDTH / 2)}" euler="90 0 0" mass="0" '
            f'group="{DRAWN}" rgba=".15 .15 .15 1"/></body>'
        )


def _geared_inertia(model: TwinModel) -> float:
    """Return the inertia of a motor behind its gears about the wheel [kg m2].

    It is so large that no step of full torque overshoots.
    """
    return max(LEAST_INERTIA, 1.2 * model.motors.stiffness * STEP_S)


def _motor(model: TwinModel, side: str) -> str:
    motors = model.motors
    return (
        f'<velocity name="{side}" joint="{side}" kv="{motors.stiffness}" '
        f'forcerange="{_row(-motors.torque, motors.torque)}"/>'
    )


def _walls(arena: Arena, friction: float) -> Iterator[str]:
    look = f'group="{WALL}" contype="2" conaffinity="4" friction="{friction} .0001 .0001" rgba=".75 .6 .42 1"'
    enclosing = enclosing_walls(arena.walls)
    for wall in arena.walls:
        if wall[:2] != wall[2:]:
            half, to_left = _thickness(arena, wall) if wall in enclosing else (THIN_HALF, 0.0)
            yield _box_along(wall, half, to_left, look)
    for obstacle in arena.obstacles:
        yield from _obstacle(obstacle, look)


def _thickness(arena: Arena, wall: Segment) -> tuple[float, float]:
    """Return half the thickness of an enclosing wall, and how far to the left of it its middle lies [m]."""
    for side in (1.0, -1.0):
        if not any(_is_inside_beside(arena, wall, -side * far) for far in (THIN_HALF, 2 * THIN_HALF)):
            continue
        for half in THICK_HALVES:
            if not any(_is_inside_beside(arena, wall, side * far) for far in (half / 2, half, 2 * half)):
                return half, side * half
    return THIN_HALF, 0.0


def _is_inside_beside(arena: Arena, wall: Segment, to_left: float) -> bool:
    """Return whether the arena continues next to a wall, this far to the left of it."""
    x1, y1, x2, y2 = wall
    length = math.hypot(x2 - x1, y2 - y1)
    left_x, left_y = -(y2 - y1) / length * to_left, (x2 - x1) / length * to_left
    return any(
        is_inside(arena, x1 + part * (x2 - x1) + left_x, y1 + part * (y2 - y1) + left_y)
        for part in (0.1, 0.3, 0.5, 0.7, 0.9)
    )


def _box_along(wall: Segment, half: float, to_left: float, look: str) -> str:
    """Return a box along a wall, with its middle next to the wall."""
    x1, y1, x2, y2 = wall
    length = math.hypot(x2 - x1, y2 - y1)
    sine, cosine = (y2 - y1) / length, (x2 - x1) / length
    x, y = (x1 + x2) / 2 - to_left * sine, (y1 + y2) / 2 + to_left * cosine
    return _box(x, y, math.atan2(sine, cosine), length / 2, half, look)


def _box(x: float, y: float, heading: float, length: float, width: float, look: str) -> str:
    turned = _row(math.cos(heading / 2), 0, 0, math.sin(heading / 2))
    size, at = _row(length, width, WALL_HEIGHT / 2), _row(x, y, WALL_HEIGHT / 2)
    return f'<geom type="box" size="{size}" pos="{at}" quat="{turned}" {look}/>'


def _obstacle(obstacle: Obstacle, look: str) -> Iterator[str]:
    """Add its sides as boxes around its edge, and a cylinder at each rounded corner."""
    placed = obstacle.placed
    if obstacle.radius:
        for x, y in placed:
            size, at = _row(obstacle.radius, WALL_HEIGHT / 2), _row(x, y, WALL_HEIGHT / 2)
            yield f'<geom type="cylinder" size="{size}" pos="{at}" {look}/>'
    half = max(min(THICK_HALVES[0], obstacle.radius), THIN_HALF)
    for side in obstacle.edges():
        yield _box_along(side, half, half, look)


def _row(*numbers: float) -> str:
    return " ".join(f"{number:.9g}" for number in numbers)


def _joined(parts: Iterator[str]) -> str:
    return "\n    ".join(parts)
