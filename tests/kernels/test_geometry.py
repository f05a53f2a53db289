"""Where lines meet, against exact fractions."""

from __future__ import annotations

import math
import random
from fractions import Fraction

import pytest

from realitygap.kernels import _geometry
from tests.reference.effort import cases

Segment = tuple[float, float, float, float]


def crossing(one: Segment, other: Segment) -> tuple[Fraction, Fraction] | None:
    """How far along each of two lines they meet; None when they are parallel."""
    ax, ay, bx, by = map(Fraction, one)
    cx, cy, dx, dy = map(Fraction, other)
    turn = (bx - ax) * (dy - cy) - (by - ay) * (dx - cx)
    if turn == 0:
        return None
    along_one = ((cx - ax) * (dy - cy) - (cy - ay) * (dx - cx)) / turn
    along_other = ((cx - ax) * (by - ay) - (cy - ay) * (bx - ax)) / turn
    return along_one, along_other


def random_segment(rng: random.Random, *, on_grid: bool) -> Segment:
    """Anywhere, or on a lattice of eighths, where lines touch, meet at ends and lie on one another."""
    if on_grid:
        a, b, c, d = (rng.randint(0, 16) / 8 for _ in range(4))
    else:
        a, b, c, d = (rng.uniform(0, 2) for _ in range(4))
    return a, b, c, d


@pytest.mark.parametrize("on_grid", [True, False])
def test_segments_touch_as_exact_arithmetic_says(on_grid: bool) -> None:
    rng = random.Random(1)
    found = {True: 0, False: 0}
    for _ in range(cases(20_000, 1_000)):
        one, other = random_segment(rng, on_grid=on_grid), random_segment(rng, on_grid=on_grid)
        where = crossing(one, other)
        expected = where is not None and all(0 <= along <= 1 for along in where)
        assert _geometry.segments_touch(*one, *other) == expected, (one, other)
        found[expected] += 1
    assert min(found.values()) > 0.1 * sum(found.values())


@pytest.mark.parametrize("on_grid", [True, False])
def test_a_ray_gets_as_far_as_exact_arithmetic_says(on_grid: bool) -> None:
    rng = random.Random(2)
    for _ in range(cases(20_000, 1_000)):
        ray, wall = random_segment(rng, on_grid=on_grid), random_segment(rng, on_grid=on_grid)
        where = crossing(ray, wall)
        fraction = _geometry.ray_fraction(*ray, *wall)
        if where is not None and all(0 <= along <= 1 for along in where):
            assert fraction == pytest.approx(float(where[0]), abs=1e-12)
        else:
            assert fraction == math.inf


@pytest.mark.parametrize(
    ("other", "touches"),
    [
        ((1.0, 0.0, 1.0, 1.0), True),  # an end on an end
        ((0.5, 0.0, 0.5, 1.0), True),  # an end on the middle
        ((0.5, 1e-300, 0.5, 1.0), False),  # the next thing to it
        ((1.0000001, 0.0, 1.0000001, 1.0), False),  # beyond the end
        ((0.0, 0.0, 1.0, 0.0), False),  # the same line: parallel lines never meet
        ((0.5, 0.0, 2.0, 0.0), False),  # a part of the same line
        ((0.0, 1.0, 1.0, 1.0), False),
        ((0.3, 0.0, 0.3, 0.0), False),  # a point has no direction
    ],
)
def test_corners(other: Segment, touches: bool) -> None:
    one = (0.0, 0.0, 1.0, 0.0)
    assert _geometry.segments_touch(*one, *other) is touches
    assert _geometry.segments_touch(*other, *one) is touches
    assert (_geometry.ray_fraction(*one, *other) <= 1.0) is touches


def test_a_ray_that_starts_on_a_wall_reads_nothing_before_it() -> None:
    assert _geometry.ray_fraction(0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 1.0) == 0.0


def test_a_ray_along_a_wall_does_not_see_it() -> None:
    assert _geometry.ray_fraction(0.0, 0.0, 1.0, 0.0, 0.5, 0.0, 0.8, 0.0) == math.inf
