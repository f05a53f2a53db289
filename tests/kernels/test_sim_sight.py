"""Shadows and touch against the plain reference: discs, open walls, rounded polygons, enclosed rooms."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import sight
from realitygap.kernels.sim.shape import make_sim_shape
from tests.kernels.sim_rows import PRECISIONS, row
from tests.reference import senses as reference
from tests.reference.effort import cases

Outline = tuple[list[tuple[float, float]], float]  # corners, radius


def place(outlines: Sequence[Sequence[Outline]], real: Any) -> tuple[Any, np.ndarray]:
    """The structure and the numbers of outlines: for each, one in every lane with as many corners."""
    shape = make_sim_shape(
        parts=[1],
        obstacles=[0 if len(outline[0][0]) == 1 else len(outline[0][0]) for outline in outlines],
        obstacle_round=[True] * len(outlines),
    )
    p = np.zeros((shape.n_all_rows, LANES), real)
    for q, of_lanes in enumerate(outlines):
        for lane, (corners, radius) in enumerate(of_lanes):
            first, n = shape.row_shape[q], len(corners)
            for k, ((x1, y1), (x2, y2)) in enumerate(reference.edges(corners)):
                length = math.hypot(x2 - x1, y2 - y1)
                normal = ((y2 - y1) / length, (x1 - x2) / length) if length > 0 else (0.0, 0.0)
                p[first + 5 * k : first + 5 * k + 5, lane] = (x1, y1, *normal, length)
            p[first + 5 * n, lane] = radius
    return shape, p


def shade(shape: Any, p: np.ndarray, a: Any, b: Any) -> np.ndarray:
    real = p.dtype.type
    lit = row(7.0, real)
    sight.shade_light(shape, p, row(a[0], real), row(a[1], real), row(b[0], real), row(b[1], real), 0.5, lit)
    return lit


def gaps(shape: Any, p: np.ndarray, x: Any, y: Any) -> np.ndarray:
    real = p.dtype.type
    room = [row(0.0, real) for _ in range(3)]
    sight.gap_of_point(shape, p, row(x, real), row(y, real), *room)
    return room[2]


def random_outline(rng: np.random.Generator, n: int) -> Outline:
    """n corners of a circle around a random place, counter-clockwise, 0 to 5 cm rounder."""
    angles = np.sort(rng.uniform(0, math.tau, n))
    middle, size = rng.uniform(0.2, 0.8, 2), rng.uniform(0.05, 0.2)
    corners = [(middle[0] + size * math.cos(angle), middle[1] + size * math.sin(angle)) for angle in angles]
    return corners, float(rng.choice([0.0, rng.uniform(0.01, 0.05)]))


@pytest.mark.parametrize("real", PRECISIONS)
def test_shadows_and_distances_equal_the_reference(real: Any) -> None:
    rng = np.random.default_rng(1)
    shaded = []
    for _ in range(cases(20, 2)):
        outlines = [[random_outline(rng, n) for _ in range(LANES)] for n in (1, 2, 3, 5)]
        shape, p = place(outlines, real)
        a, b = rng.uniform(0, 1, (2, 2, LANES))
        lit, gap = shade(shape, p, a, b), gaps(shape, p, *a)
        for lane in range(LANES):
            from_, to = (a[0, lane], a[1, lane]), (b[0, lane], b[1, lane])
            here = [of_lanes[lane] for of_lanes in outlines]
            near = [min(reference.gap(end, *outline) for end in (from_, to)) for outline in here]
            assert gap[lane] == pytest.approx(
                min(reference.gap(from_, *outline) for outline in here), abs=1e-6
            )
            if min(near) < 1e-5:
                continue  # an end inside an obstacle: neither a robot nor a light is there
            blocked = [reference.is_shaded(from_, to, *outline) for outline in here]
            if blocked != [
                reference.is_shaded(from_, to, outline, radius + 1e-6) for outline, radius in here
            ]:
                continue  # a rounding decides
            assert lit[lane] == (0.5 if any(blocked) else 1.0)
            shaded.append(any(blocked))
    assert 0.2 < np.mean(shaded) < 0.9


def test_a_box_keeps_light_from_what_is_behind_it() -> None:
    box = [(0.4, 0.4), (0.6, 0.4), (0.6, 0.6), (0.4, 0.6)]
    shape, p = place([[(box, 0.0)] * LANES], np.float64)
    assert shade(shape, p, (0.0, 0.5), (1.0, 0.5))[0] == 0.5
    assert shade(shape, p, (0.0, 0.5), (0.3, 0.5))[0] == 1.0  # the light is before it
    assert shade(shape, p, (0.0, 0.7), (1.0, 0.7))[0] == 1.0
    rounded, q = place([[(box, 0.11)] * LANES], np.float64)
    assert shade(rounded, q, (0.0, 0.7), (1.0, 0.7))[0] == 0.5
    assert gaps(shape, p, 0.5, 0.3)[0] == pytest.approx(0.1)
    assert gaps(shape, p, 0.5, 0.5)[0] == pytest.approx(-0.1)
    assert gaps(rounded, q, 0.7, 0.7)[0] == pytest.approx(0.1 * math.sqrt(2) - 0.11)


def test_walls_of_a_room_keep_out_the_light_of_other_rooms() -> None:
    shape = make_sim_shape(parts=[1], n_walls=1, enclosed=True)
    p = np.zeros((shape.n_all_rows, LANES))
    p[shape.row_plane : shape.row_plane + 3] = [[1.0], [0.0], [0.2]]  # the room is where x > 0.2
    assert shade(shape, p, (0.5, 0.0), (0.3, 1.0))[0] == 1.0
    assert shade(shape, p, (0.5, 0.0), (0.1, 1.0))[0] == 0.5
    assert gaps(shape, p, 0.5, 3.0)[0] == pytest.approx(0.3)


def test_a_bump_sensor_feels_what_is_within_its_reach() -> None:
    reading = row(7.0, np.float64)
    gap = row(np.linspace(-0.01, 0.02, LANES), np.float64)
    sight.answer_bump(gap, row(0.005, np.float64), reading)
    assert (reading == (gap <= 0.005)).all()
