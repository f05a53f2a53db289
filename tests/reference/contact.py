"""Contact of one robot, a polygon grown by a radius, one corner at a time: float64, written for the eye.

The pose is that of the axle, which is the body's origin here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

Point = tuple[float, float]
Pose = tuple[float, float, float]

CLEAR = 2e-6  # how far a body that was pushed is free [m]
SUBSTEPS, RESCUES = 4, 4
OPPOSED = -0.6  # cosine between the normals of two straight pushes, below which a body is wedged
LEAST_GIVE, MOST_TURN = 0.05, 0.25
SECANTS = 4


class Touch(NamedTuple):
    """A contact in the world: gap [m], unit normal towards the body, and its corner, before it is grown."""

    gap: float
    normal: Point
    corner: Point


@dataclass
class Body:
    corners: list[Point]
    radius: float
    friction: float = 0.0
    give: tuple[float, float, float] = (1.0, 1.0, 1.0)  # along, across, around
    model: str = "slide"
    slip: float = math.inf  # of a wheel in a part of a step, from which on its grip hardly grows [m]


@dataclass
class Polygon:
    """An obstacle, counter-clockwise; one corner: a disc; two: a wall."""

    corners: list[Point]
    radius: float = 0.0


@dataclass
class World:
    planes: list[tuple[Point, float]] = field(default_factory=list)  # inward normal and offset
    polygons: list[Polygon] = field(default_factory=list)


def placed(body: Body, pose: Pose) -> list[Point]:
    x, y, heading = pose
    c, s = math.cos(heading), math.sin(heading)
    return [(x + c * ahead - s * left, y + s * ahead + c * left) for ahead, left in body.corners]


def nearest_on_edge(point: Point, a: Point, b: Point) -> Point:
    ex, ey = b[0] - a[0], b[1] - a[1]
    square = ex * ex + ey * ey
    t = 0.0 if square == 0 else min(max(((point[0] - a[0]) * ex + (point[1] - a[1]) * ey) / square, 0.0), 1.0)
    return a[0] + t * ex, a[1] + t * ey


def edges(corners: list[Point]) -> list[tuple[Point, Point]]:
    return list(zip(corners, corners[1:] + corners[:1], strict=True))


def overlap(body: list[Point], other: list[Point]) -> Touch | None:
    """How to part two polygons that overlap along the shortest way; None where they are apart."""
    best: Touch | None = None
    for ours, corners, others in ((False, other, body), (True, body, other)):
        if len(corners) == 1:
            continue
        for a, b in edges(corners):
            length = math.dist(a, b)
            n = ((b[1] - a[1]) / length, -(b[0] - a[0]) / length)
            lowest = min(others, key=lambda q, n=n: n[0] * q[0] + n[1] * q[1])
            gap = n[0] * (lowest[0] - a[0]) + n[1] * (lowest[1] - a[1])
            if gap > 0:
                return None
            if best is None or gap > best.gap:
                foot = (lowest[0] - gap * n[0], lowest[1] - gap * n[1])
                best = Touch(gap, (-n[0], -n[1]), foot) if ours else Touch(gap, n, lowest)
    return best


def touch_polygon(body: Body, pose: Pose, polygon: Polygon) -> Touch:
    corners = placed(body, pose)
    inside = overlap(corners, polygon.corners)
    if inside is None:
        pairs = [(p, nearest_on_edge(p, a, b)) for p in corners for a, b in edges(polygon.corners)]
        pairs += [(nearest_on_edge(q, a, b), q) for q in polygon.corners for a, b in edges(corners)]
        ours, theirs = min(pairs, key=lambda pair: math.dist(*pair))
        distance = math.dist(ours, theirs)
        if distance > 0:
            normal = ((ours[0] - theirs[0]) / distance, (ours[1] - theirs[1]) / distance)
            inside = Touch(distance, normal, ours)
    if inside is None:  # one point in common, or none: two discs about the same place
        inside = Touch(0.0, (1.0, 0.0), corners[0])
    return Touch(inside.gap - body.radius - polygon.radius, inside.normal, inside.corner)


def touched(body: Body, pose: Pose, world: World) -> list[Touch]:
    """From the deepest on: each corner at each plane, and each polygon where it is met deepest."""
    touches = [
        Touch(a * x + b * y - offset - body.radius, (a, b), (x, y))
        for (a, b), offset in world.planes
        for x, y in placed(body, pose)
    ]
    touches += [touch_polygon(body, pose, polygon) for polygon in world.polygons]
    return sorted(touches, key=lambda touch: touch.gap)


def deepest(body: Body, pose: Pose, world: World) -> Touch:
    return touched(body, pose, world)[0]


def arc(pose: Pose, length: float, turn: float) -> Pose:
    x, y, heading = pose
    half = turn / 2
    chord = length * (math.sin(half) / half if half else 1.0)
    return x + chord * math.cos(heading + half), y + chord * math.sin(heading + half), heading + turn


Vector = tuple[float, float, float]  # along, across, around, in the frame of the axle


class Held(NamedTuple):
    """A contact at some heading: wrenches of its normal and tangent, what is deep, and what has slipped."""

    n: Vector
    t: Vector
    deep: float
    slip: float


def dot(f: Vector, g: Vector) -> float:
    return sum(one * two for one, two in zip(f, g, strict=True))


@dataclass
class Give:
    """How a body moves by a wrench: a force of 1 ahead moves it `along`, and turns it by `both`."""

    along: float
    across: float
    around: float
    both: float = 0.0

    def __call__(self, wrench: Vector) -> Vector:
        ahead, aside, torque = wrench
        return (
            self.along * ahead + self.both * torque,
            self.across * aside,
            self.around * torque + self.both * ahead,
        )


def softened(body: Body, move: Vector) -> Give:
    """What a body gives whose wheels slipped by a motion: two springs beside each other, each the secant to its grip.

    A wheel of stiffness 1 / (2 long) along and 1 / (2 lat) across, r to its side of the axle's middle, holds with
    1 / softness of that.
    """
    long, lat, ang = body.give
    arm = math.sqrt(long / ang)
    stiff_along = stiff_across = stiff_around = stiff_both = 0.0
    for side in (1.0, -1.0):  # left, right
        ahead, aside = move[0] - side * arm * move[2], move[1]
        softness = math.sqrt(1 + (ahead**2 + aside**2 * long / lat) / body.slip**2)
        stiff_along += 1 / (2 * long * softness)
        stiff_across += 1 / (2 * lat * softness)
        stiff_around += arm**2 / (2 * long * softness)
        stiff_both -= side * arm / (2 * long * softness)
    whole = stiff_along * stiff_around - stiff_both**2
    return Give(stiff_around / whole, 1 / stiff_across, stiff_along / whole, -stiff_both / whole)


def held_at(body: Body, pose: Pose, before: Pose, heading: float, touch: Touch) -> Held:
    """A contact as it would be if the body stood at another heading; the deep part is that of its pose."""
    c, s = math.cos(heading), math.sin(heading)
    a, b = c * touch.normal[0] + s * touch.normal[1], c * touch.normal[1] - s * touch.normal[0]
    own_c, own_s = math.cos(pose[2]), math.sin(pose[2])
    dx, dy = touch.corner[0] - pose[0], touch.corner[1] - pose[1]
    px = own_c * dx + own_s * dy - body.radius * a  # of the body's own corner
    py = own_c * dy - own_s * dx - body.radius * b
    n, t = (a, b, px * b - py * a), (-b, a, px * a + py * b)
    dx, dy = pose[0] - before[0], pose[1] - before[1]
    moved = (c * dx + s * dy, c * dy - s * dx, math.remainder(pose[2] - before[2], math.tau))
    return Held(n, t, CLEAR - touch.gap, dot(moved, t))


def push(body: Body, give: Give, held: Held, others: Vector = (0.0, 0.0, 0.0)) -> Vector:
    """The motion by one contact, beside that of others: free by a push, and by friction as far as mu allows."""
    nn, tt, nt = (dot(give(f), g) for f, g in ((held.n, held.n), (held.t, held.t), (held.n, held.t)))
    deep, slip = held.deep - dot(others, held.n), held.slip + dot(others, held.t)
    if deep <= 0:
        return 0.0, 0.0, 0.0
    whole = nn * tt - nt * nt
    press, rub = deep * tt + slip * nt, -slip * nn - deep * nt
    if whole > 0 and abs(rub) <= body.friction * press:
        press, rub = press / whole, rub / whole
    else:
        side = -1.0 if rub < 0 else 1.0
        press = deep / max(nn + side * body.friction * nt, LEAST_GIVE * nn)
        rub = side * body.friction * press
    n, t = held.n, held.t
    return give((press * n[0] + rub * t[0], press * n[1] + rub * t[1], press * n[2] + rub * t[2]))


def clipped(angle: float) -> float:
    return min(max(angle, -MOST_TURN), MOST_TURN)


def pushed_by(
    body: Body, give: Give, pose: Pose, before: Pose, contacts: list[Touch]
) -> tuple[Vector, float]:
    """How it moves free of contacts, as they are with the body halfway through its turn, and its heading there."""
    turned = math.remainder(pose[2] - before[2], math.tau)
    around = push(body, give, held_at(body, pose, before, pose[2] + clipped(-turned / 2), contacts[0]))[2]
    heading = pose[2] + clipped((around - turned) / 2)
    held = [held_at(body, pose, before, heading, contact) for contact in contacts]
    moves: list[Vector] = [(0.0, 0.0, 0.0)] * len(held)
    for _ in range(2):
        for k in range(len(held)):
            moves[k] = push(body, give, held[k], moves[1 - k] if len(held) == 2 else (0.0, 0.0, 0.0))
    along, across, around = (sum(parts) for parts in zip(*moves, strict=True))
    limit = MOST_TURN / max(abs(around), MOST_TURN)
    return (limit * along, limit * across, limit * around), heading


def pushed(body: Body, pose: Pose, before: Pose, world: World) -> Pose:
    """Free of the deepest two contacts."""
    contacts = touched(body, pose, world)[:2]
    move, heading = pushed_by(body, Give(*body.give), pose, before, contacts)
    for _ in range(SECANTS if body.slip < math.inf else 0):
        move, heading = pushed_by(body, softened(body, move), pose, before, contacts)
    along, across, around = move
    c, s = math.cos(heading), math.sin(heading)
    return pose[0] + c * along - s * across, pose[1] + s * along + c * across, pose[2] + around


def _stopped(body: Body, pose: Pose, before: Pose, world: World) -> Pose:
    turned = (before[0], before[1], pose[2])
    return before if deepest(body, turned, world).gap <= 0 else turned


def step(body: Body, start: Pose, world: World, length: float, turn: float) -> Pose:
    """One step of a robot that drives an arc and gives way to what it touches."""
    pose = start
    if not world.polygons and deepest(body, arc(start, length, turn), world).gap > 0:
        return arc(start, length, turn)
    blocked = False
    for _ in range(SUBSTEPS):
        before = pose
        pose = arc(pose, length / SUBSTEPS, turn / SUBSTEPS)
        touches = deepest(body, pose, world).gap <= 0
        blocked |= touches
        if touches and body.model == "stop":
            pose = _stopped(body, pose, before, world)
        if touches and body.model == "slide":
            pose = pushed(body, pose, before, world)
    if body.model == "freeze":
        return start if blocked else pose
    last = (0.0, 0.0)
    for _ in range(RESCUES):
        touch = deepest(body, pose, world)
        if touch.gap > 0:
            return pose
        if touch.normal[0] * last[0] + touch.normal[1] * last[1] < OPPOSED:
            return start
        last = touch.normal
        deep = CLEAR - touch.gap
        pose = (pose[0] + deep * touch.normal[0], pose[1] + deep * touch.normal[1], pose[2])
    return pose if deepest(body, pose, world).gap > 0 else start
