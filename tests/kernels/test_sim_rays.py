"""Rays of range sensors against a plain reference: a room, a box, a rounded triangle, a disc, an open wall."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from tests.kernels.sim_cases import DEPTH, SCRIBBLER, WIDTH, drive_robots, obstacle, outline, room
from tests.reference import senses as reference
from tests.reference.effort import cases

pytestmark = pytest.mark.slow

BOX = [(-0.06, -0.05), (0.06, -0.05), (0.06, 0.05), (-0.06, 0.05)]
TRIANGLE = [(-0.05, -0.04), (0.07, 0.0), (-0.04, 0.05)]
PLACES = [
    (0.5, 0.15, 0.4, BOX, 0.0),
    (0.25, 0.45, 1.0, TRIANGLE, 0.015),
    (0.75, 0.4, 0.0, [(0.0, 0.0)], 0.05),
]
REACH, CONE = 0.4, 0.2
MOUNTS = [(0.05, 0.02, 0.3), (0.0, -0.06, -1.6), (-0.07, 0.0, 3.0)]  # x, y, direction


def far(x: float, y: float, angle: float, things: list[Any]) -> float:
    """How far one sees from a point [m]: on by the distance to what is nearest, again and again."""
    gone = 0.0
    for _ in range(400):
        at = (x + gone * math.cos(angle), y + gone * math.sin(angle))
        gap = min(reference.gap(at, corners, radius) for corners, radius in things)
        gone += max(gap, 0.0)
        if gap < 1e-9 or gone >= REACH:
            break
    return min(gone, REACH)


def cosine(x: float, y: float, angle: float, gone: float, things: list[Any]) -> float:
    """How fast what is nearest comes nearer, along a ray, where it is met."""

    def gap(way: float) -> float:
        at = (x + way * math.cos(angle), y + way * math.sin(angle))
        return min(reference.gap(at, corners, radius) for corners, radius in things)

    return (gap(gone - 2e-5) - gap(gone - 1e-5)) / 1e-5


@pytest.mark.parametrize("enclosed", [True, False])
def test_rays_of_a_cone_end_where_the_reference_meets_something(enclosed: bool) -> None:
    rng = np.random.default_rng(1)
    numbers: dict[str, Any] = {**SCRIBBLER, **outline([(0.0, 0.0)]), **room()}
    things: list[Any] = []
    for k, (x, y, heading, corners, radius) in enumerate(PLACES):
        numbers |= obstacle(k, x, y, heading, corners if k < 2 else [], radius)
        c, s = math.cos(heading), math.sin(heading)
        things.append(([(x + c * a - s * b, y + s * a + c * b) for a, b in corners], radius))
    ends = [(0.0, 0.0), (WIDTH, 0.0), (WIDTH, DEPTH), (0.0, DEPTH), (0.0, 0.0)]
    things += [([a, b], 0.0) for a, b in itertools.pairwise(ends)]
    if not enclosed:
        wall = {"x1": 0.4, "y1": 0.6, "x2": 0.5, "y2": 0.35}
        numbers |= {f"arena.wall.4.{name}": value for name, value in wall.items()}
        things.append(([(0.4, 0.6), (0.5, 0.35)], 0.0))
    for k, (x, y, direction) in enumerate(MOUNTS):
        mount = {"x": x, "y": y, "direction": direction, "cone": CONE, "reach": REACH}
        numbers |= {f"range.{k}.{name}": value for name, value in mount.items()}
    starts: list[tuple[float, float, float]] = []
    while len(starts) < cases(40, 6):
        at = (rng.uniform(0.1, WIDTH - 0.1), rng.uniform(0.1, DEPTH - 0.1))
        if min(reference.gap(at, *thing) for thing in things) > 0.08:  # no sensor is in anything
            starts.append((*at, rng.uniform(-math.pi, math.pi)))
    place = dict(
        zip(("arena.start.x", "arena.start.y", "arena.start.heading"), np.array(starts).T, strict=True)
    )
    driven = drive_robots(
        {**numbers, **place}, np.zeros((1, 2)), parts=[1], obstacles=[4, 3, 0], obstacle_round=[False, True, True],
        n_walls=4 if enclosed else 5, enclosed=enclosed, range_response=["linear"] * 3, range_rays=[3, 3, 3],
    )  # fmt: skip
    seen = []
    for k, (x, y, heading) in enumerate(starts):
        c, s = math.cos(heading), math.sin(heading)
        for sensor, (a, b, direction) in enumerate(MOUNTS):
            for ray in range(3):
                angle = heading + direction + (ray - 1) * CONE
                seen.append(far(x + c * a - s * b, y + s * a + c * b, angle, things))
                assert driven.distances[0, k, 3 * sensor + ray] == pytest.approx(seen[-1], abs=1e-6)
                found = driven.cosines[0, k, 3 * sensor + ray]
                if seen[-1] < REACH:
                    from_x, from_y = x + c * a - s * b, y + s * a + c * b
                    assert found == pytest.approx(cosine(from_x, from_y, angle, seen[-1], things), abs=2e-3)
                else:
                    assert found == 1.0
    assert 0.5 < np.mean(np.array(seen) < REACH) < 0.99
