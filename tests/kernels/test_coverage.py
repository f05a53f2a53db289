"""Cells on lines, against exact fractions."""

from __future__ import annotations

import itertools
import math
import random

import numpy as np
import pytest

from realitygap.kernels.tasks import coverage
from realitygap.world import ArenaSettings, paper_arena
from realitygap.world._arena import NAMED_STARTS
from tests.reference.coverage import cells_on_line, first_visits
from tests.reference.effort import cases

COLUMNS, ROWS = 12, 6
Line = tuple[float, float, float, float]


def kernel_cells(points: list[tuple[float, float]], columns: int = COLUMNS, rows: int = ROWS) -> list[int]:
    """Cells in order of first visit on a path from point to point."""
    visited = np.zeros(columns * rows, np.bool_)
    order = np.zeros(columns * rows, np.uint8)
    u, v = points[0]
    n = coverage.visit(math.floor(u), math.floor(v), columns, rows, visited, order, np.int64(0))
    for to_u, to_v in points[1:]:
        n = coverage.visit_line(u, v, to_u, to_v, columns, rows, visited, order, n)
        u, v = to_u, to_v
    cells = order[:n].tolist()
    assert sorted(cells) == np.flatnonzero(visited).tolist()
    return cells


def exact_cells(points: list[tuple[float, float]], columns: int = COLUMNS, rows: int = ROWS) -> list[int]:
    lines = itertools.pairwise(points)
    return first_visits([cell for a, b in lines for cell in cells_on_line(*a, *b)], columns, rows)


def assert_line(*ends: float) -> None:
    points = [(ends[0], ends[1]), (ends[2], ends[3])]
    assert kernel_cells(points) == exact_cells(points), ends


def numbered(*cells: tuple[int, int]) -> list[int]:
    return [COLUMNS * row + column for column, row in cells]


@pytest.mark.parametrize(
    ("step", "reach"),
    [
        (1 / 2, 0),  # half cells: every other point lies on a border, every fourth on a corner
        (1 / 4, 3),  # quarters, and up to three cells outside the grid
        (1 / 64, 2),
    ],
)
def test_lines_between_points_of_a_lattice_are_exact(step: float, reach: int) -> None:
    """Short and long ones, many along borders, through corners, ending on borders."""
    rng = random.Random(round(1 / step))
    for _ in range(cases(6_000, 300)):
        u0, u1 = (rng.randint(round(-reach / step), round((COLUMNS + reach) / step)) * step for _ in range(2))
        v0, v1 = (rng.randint(round(-reach / step), round((ROWS + reach) / step)) * step for _ in range(2))
        assert_line(u0, v0, u1, v1)


@pytest.mark.slow
def test_random_lines_are_exact() -> None:
    rng = random.Random(4)
    for _ in range(cases(6_000, 300)):
        assert_line(rng.uniform(-3, 15), rng.uniform(-3, 9), rng.uniform(-3, 15), rng.uniform(-3, 9))


def test_short_steps_are_exact() -> None:
    """As long as a robot's step, 1.3 cells at most, some from and to borders."""
    rng = random.Random(5)
    for _ in range(cases(6_000, 300)):
        u, v = rng.uniform(0, 12), rng.uniform(0, 6)
        length, angle = rng.uniform(0, 1.3), rng.uniform(0, 2 * math.pi)
        to_u, to_v = u + length * math.cos(angle), v + length * math.sin(angle)
        if rng.random() < 0.3:
            u, to_v = round(u), round(to_v)
        assert_line(u, v, to_u, to_v)


def test_paths_keep_the_order_of_first_visit() -> None:
    rng = random.Random(6)
    for _ in range(cases(500, 30)):
        points = [(rng.randint(-4, 50) / 4, rng.randint(-4, 28) / 4) for _ in range(12)]
        cells = kernel_cells(points)
        assert cells == exact_cells(points)
        assert len(set(cells)) == len(cells)


def test_a_grid_of_256_cells_fits_a_byte() -> None:
    points = [
        (0.5 + column, 0.5 + (15 if (column + up) % 2 else 0)) for column in range(16) for up in range(2)
    ]
    assert sorted(kernel_cells(points, 16, 16)) == list(range(256))


# hand-made


def test_a_line_up_the_diagonal_visits_the_diagonal_alone() -> None:
    assert kernel_cells([(0.5, 0.5), (3.5, 3.5)]) == numbered((0, 0), (1, 1), (2, 2), (3, 3))
    assert kernel_cells([(3.5, 3.5), (0.5, 0.5)]) == numbered((3, 3), (2, 2), (1, 1), (0, 0))


def test_a_line_down_the_other_diagonal_visits_that_diagonal_alone() -> None:
    """Although the corners it passes belong to the cells to their upper right."""
    assert kernel_cells([(0.5, 3.5), (3.5, 0.5)]) == numbered((0, 3), (1, 2), (2, 1), (3, 0))
    assert kernel_cells([(3.5, 0.5), (0.5, 3.5)]) == numbered((3, 0), (2, 1), (1, 2), (0, 3))


def test_a_steep_line_through_corners_goes_on_diagonally_there() -> None:
    """Slope 2 through the corners (1, 2) and (2, 4)."""
    cells = [(0, 0), (0, 1), (1, 2), (1, 3), (2, 4), (2, 5)]
    assert kernel_cells([(0.25, 0.5), (2.75, 5.5)]) == numbered(*cells)
    assert kernel_cells([(2.75, 5.5), (0.25, 0.5)]) == numbered(*cells[::-1])


def test_a_line_along_a_border_is_in_the_cells_above_or_to_the_right() -> None:
    assert kernel_cells([(0.5, 2.0), (2.5, 2.0)]) == numbered((0, 2), (1, 2), (2, 2))
    assert kernel_cells([(2.5, 2.0), (0.5, 2.0)]) == numbered((2, 2), (1, 2), (0, 2))
    assert kernel_cells([(2.0, 0.5), (2.0, 2.5)]) == numbered((2, 0), (2, 1), (2, 2))


def test_a_line_that_ends_on_a_border_visits_the_cell_that_holds_it() -> None:
    assert kernel_cells([(0.5, 0.5), (1.0, 0.5)]) == numbered((0, 0), (1, 0))
    assert kernel_cells([(1.5, 0.5), (1.0, 0.5)]) == numbered((1, 0))
    assert kernel_cells([(0.5, 0.5), (1.0, 1.0)]) == numbered((0, 0), (1, 1))
    assert kernel_cells([(1.5, 0.5), (1.0, 1.0)]) == numbered((1, 0), (1, 1))
    assert kernel_cells([(0.5, 1.5), (1.0, 1.0)]) == numbered((0, 1), (1, 1))


def test_a_line_that_starts_on_a_corner_goes_straight_into_the_next_cell() -> None:
    assert kernel_cells([(1.0, 1.0), (0.5, 0.5)]) == numbered((1, 1), (0, 0))
    assert kernel_cells([(1.0, 1.0), (1.5, 0.5)]) == numbered((1, 1), (1, 0))


def test_the_upper_and_right_borders_of_the_grid_are_outside() -> None:
    assert kernel_cells([(12.0, 3.0)]) == []
    assert kernel_cells([(3.0, 6.0)]) == []
    assert kernel_cells([(0.0, 0.0)]) == [0]
    assert kernel_cells([(11.5, 5.5), (12.0, 6.0)]) == [71]


def test_a_line_can_leave_the_grid_and_come_back() -> None:
    assert kernel_cells([(1.5, 0.5), (1.5, -2.5), (3.5, -2.5), (3.5, 0.5)]) == numbered((1, 0), (3, 0))
    assert kernel_cells([(-1.0, 3.5), (13.0, 3.5)]) == numbered(*((column, 3) for column in range(12)))


def test_standing_still_visits_nothing_more() -> None:
    assert kernel_cells([(2.0, 2.0), (2.0, 2.0)]) == numbered((2, 2))


# grid units


@pytest.mark.parametrize(("name", "cell"), [("corner", (1, 1)), ("center", (6, 3)), ("left", (1, 3))])
def test_named_starts_lie_in_the_cells_that_are_said(name: str, cell: tuple[int, int]) -> None:
    arena = ArenaSettings.model_validate({"start": name}).arena()
    u = coverage.to_grid(arena.start.x, arena.grid.x, arena.grid.cell)
    v = coverage.to_grid(arena.start.y, arena.grid.y, arena.grid.cell)
    assert (math.floor(u), math.floor(v)) == cell
    assert set(NAMED_STARTS) == {"corner", "center", "left"}
    if name == "center":
        assert (u, v) == (6.0, 3.0)
    if name == "left":
        assert v == 3.0


def test_every_border_of_the_papers_grid_is_met_from_meters() -> None:
    """(3 + k * 3) in, computed in several ways, is border k whatever the last bit."""
    grid = paper_arena().grid
    for k in range(13):
        for meters in (grid.x + k * grid.cell, (3 + 3 * k) * 0.0254, 3 * 0.0254 * (k + 1), 0.0762 * (k + 1)):
            assert coverage.to_grid(meters, grid.x, grid.cell) == float(k)


def test_only_what_is_nearer_than_the_margin_is_put_on_a_border() -> None:
    assert coverage.to_grid(2.0 + 0.9e-9, 0.0, 1.0) == 2.0
    assert coverage.to_grid(2.0 - 0.9e-9, 0.0, 1.0) == 2.0
    assert coverage.to_grid(-3.0 + 0.9e-9, 0.0, 1.0) == -3.0
    assert coverage.to_grid(2.0 + 1.1e-9, 0.0, 1.0) == 2.0 + 1.1e-9
    assert coverage.to_grid(2.0 - 1.1e-9, 0.0, 1.0) == 2.0 - 1.1e-9
    assert coverage.to_grid(1.25, 0.25, 0.5) == 2.0
    assert coverage.to_grid(1.3, 0.0, 1.0) == 1.3
