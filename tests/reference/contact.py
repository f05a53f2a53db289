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
SUBSTEPS, SWEEPS, RESCUES = 4, 2, 4
LEAST_GIVE, MOST_TURN = 0.05, 0.25


class Touch(NamedTuple):
    """The deepest contact: gap [m], unit normal towards the body and point of contact, in the world."""

    gap: float
    normal: Point
    point: Point


@dataclass
class Body:
    corners: list[Point]
    radius: float
    friction: float = 0.0
    give: tuple[float, float, float] = (1.0, 1.0, 1.0)  # along, across, around
    model: str = "slide"


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
    gap, (a, b), (x, y) = inside
    return Touch(gap - body.radius - polygon.radius, (a, b), (x - body.radius * a, y - body.radius * b))


def deepest(body: Body, pose: Pose, world: World) -> Touch:
    touches = []
    for (a, b), offset in world.planes:
        for x, y in placed(body, pose):
            gap = a * x + b * y - offset - body.radius
            touches.append(Touch(gap, (a, b), (x - body.radius * a, y - body.radius * b)))
    touches += [touch_polygon(body, pose, polygon) for polygon in world.polygons]
    return min(touches, key=lambda touch: touch.gap)


def arc(pose: Pose, length: float, turn: float) -> Pose:
    x, y, heading = pose
    half = turn / 2
    chord = length * (math.sin(half) / half if half else 1.0)
    return x + chord * math.cos(heading + half), y + chord * math.sin(heading + half), heading + turn


def pushed(body: Body, pose: Pose, before: Pose, touch: Touch) -> Pose:
    """Free of the contact by a push along its normal and by friction, which holds as long as mu allows."""
    x, y, heading = pose
    c, s = math.cos(heading), math.sin(heading)

    def in_body(v: Point) -> Point:
        return c * v[0] + s * v[1], c * v[1] - s * v[0]

    a, b = in_body(touch.normal)
    px, py = in_body((touch.point[0] - x, touch.point[1] - y))
    n, t = (a, b, px * b - py * a), (-b, a, px * a + py * b)  # wrenches: along, across, around

    def gives(f: tuple[float, float, float], g: tuple[float, float, float]) -> float:
        return sum(give * one * two for give, one, two in zip(body.give, f, g, strict=True))

    moved = in_body((x - before[0], y - before[1]))
    turned = math.remainder(heading - before[2], math.tau)
    slip = moved[0] * t[0] + moved[1] * t[1] + turned * t[2]
    nn, nt, tt = gives(n, n), gives(n, t), gives(t, t)
    deep = CLEAR - touch.gap
    whole = nn * tt - nt * nt
    push, rub = deep * tt + slip * nt, -slip * nn - deep * nt
    if whole > 0 and abs(rub) <= body.friction * push:
        push, rub = push / whole, rub / whole
    else:
        side = -1.0 if rub < 0 else 1.0
        push = deep / max(nn + side * body.friction * nt, LEAST_GIVE * nn)
        rub = side * body.friction * push
    f = [push * one + rub * two for one, two in zip(n, t, strict=True)]
    along, across, around = (give * part for give, part in zip(body.give, f, strict=True))
    limit = MOST_TURN / max(abs(around), MOST_TURN)
    along, across, around = along * limit, across * limit, around * limit
    return x + c * along - s * across, y + s * along + c * across, heading + around


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
        for _ in range(SWEEPS if body.model == "slide" else 0):
            touch = deepest(body, pose, world)
            if touch.gap > 0:
                break
            pose = pushed(body, pose, before, touch)
    if body.model == "freeze":
        return start if blocked else pose
    for _ in range(RESCUES):
        touch = deepest(body, pose, world)
        if touch.gap > 0:
            return pose
        deep = CLEAR - touch.gap
        pose = (pose[0] + deep * touch.normal[0], pose[1] + deep * touch.normal[1], pose[2])
    return pose if deepest(body, pose, world).gap > 0 else start
