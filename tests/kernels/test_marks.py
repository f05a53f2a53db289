"""Cells marked in lanes, against exact fractions and against the one-line kernels."""

from __future__ import annotations

import itertools
import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from realitygap.kernels.math.lanes import LANES, Line
from realitygap.kernels.tasks import marks
from tests.reference.coverage import cell_of, cells_on_line, first_visits
from tests.reference.effort import cases

Path = list[tuple[float, float]]
SNAP = {np.float32: 1e-5, np.float64: 1e-9}


def marked(paths: list[Path], columns: int, rows: int, real: type) -> list[tuple[list[int], set[int]]]:
    """Of each path, a lane each: cells along the line in order of first visit, and cells of its points."""
    assert len(paths) <= LANES
    line = Line(*np.zeros((len(Line._fields), LANES), real))
    words = rows * -(-columns // 32)
    visited, ends = (np.zeros((words, LANES), np.uint32) for _ in range(2))
    room, fresh = np.zeros((3, LANES), np.uint32), np.zeros((words + words // rows, LANES), np.uint32)
    any_fresh, n_line = np.zeros(LANES, np.uint32), np.zeros(LANES, np.int32)
    cells = np.zeros((len(paths), columns * rows), np.uint8)
    grid = np.array([0, 0, 1, SNAP[real]], real)
    points = np.array([path + [path[-1]] * (max(map(len, paths)) - len(path)) for path in paths], real)
    line.to_u[: len(paths)], line.to_v[: len(paths)] = points[:, 0].T
    for k in [0, *range(points.shape[1])]:
        x, y = np.zeros((2, LANES), real)
        x[: len(paths)], y[: len(paths)] = points[:, k].T
        marks.place_line(grid, x, y, line)
        marks.mark_line(line, grid[3], columns, rows, room, visited, fresh, any_fresh)
        marks.mark_ends(line, columns, rows, ends)
        marks.list_fresh(
            line, columns, rows, fresh, any_fresh, np.int64(len(paths)), cells, np.int64(0), n_line
        )
    found = []
    for lane in range(len(paths)):
        order = cells[lane, : n_line[lane]].tolist()
        assert len(order) == marks.count_cells(visited, lane)
        listed = np.zeros(columns * rows, np.uint8)
        marks.list_cells(ends, lane, columns, rows, listed)
        found.append((order, set(listed[: marks.count_cells(ends, lane)].tolist())))
    return found


def exact(path: Path, columns: int, rows: int) -> tuple[list[int], set[int]]:
    lines = [cells_on_line(*a, *b) for a, b in itertools.pairwise(path)]
    start = [cell_of(*path[0])]
    line = first_visits(start + [cell for cells in lines for cell in cells], columns, rows)
    return line, set(first_visits([cell_of(*point) for point in path], columns, rows))


def check(paths: list[Path], columns: int, rows: int, real: type) -> None:
    for k in range(0, len(paths), LANES):
        part = paths[k : k + LANES]
        for path, found in zip(part, marked(part, columns, rows, real), strict=True):
            assert found == exact(path, columns, rows), path


@pytest.mark.parametrize("real", [np.float32, np.float64])
@pytest.mark.parametrize("size", [(12, 6), (32, 3), (33, 2), (100, 2), (1, 9), (5, 1)])
@pytest.mark.parametrize("step", [1 / 2, 1 / 4, 1 / 64])
def test_paths_on_a_lattice_are_exact(step: float, size: tuple[int, int], real: type) -> None:
    """Short and long lines, many along borders, through corners, ending on borders, some outside the grid."""
    columns, rows = size
    rng = random.Random(round(1 / step) + columns)

    def point() -> tuple[float, float]:
        return (
            round(rng.uniform(-3, columns + 3) / step) * step,
            round(rng.uniform(-3, rows + 3) / step) * step,
        )

    check([[point() for _ in range(rng.randint(1, 4))] for _ in range(cases(640, 64))], columns, rows, real)


def test_random_paths_are_exact() -> None:
    rng = random.Random(5)
    paths = []
    for _ in range(cases(1_280, 64)):
        u, v = rng.uniform(0, 12), rng.uniform(0, 6)
        path = [(u, v)]
        for _ in range(8):
            length, angle = rng.uniform(0, 1.5), rng.uniform(0, math.tau)
            u, v = u + length * math.cos(angle), v + length * math.sin(angle)
            path.append((u, v))
        paths.append(path)
    check(paths, 12, 6, np.float64)


halves = st.tuples(st.integers(-4, 28), st.integers(-4, 16)).map(lambda p: (p[0] / 2, p[1] / 2))


@given(st.lists(halves, min_size=1, max_size=5))
@hypothesis_settings(max_examples=cases(300, 30), deadline=None, derandomize=True)
def test_a_path_and_its_mirror_images_visit_as_many_cells_between_corners(path: Path) -> None:
    """Moved off the borders by a quarter, so that no cell's own border is on one side only."""
    moved = [(u + 0.25, v + 0.25) for u, v in path]
    images = [moved, [(12 - u, v) for u, v in moved], [(u, 6 - v) for u, v in moved], moved[::-1]]
    found = marked(images, 12, 6, np.float64)
    assert len({len(line) for line, _ in found}) == 1
    assert set(found[0][0]) == set(found[3][0])


def test_a_lane_does_not_depend_on_its_neighbors() -> None:
    rng = random.Random(6)
    paths = [[(rng.uniform(-1, 13), rng.uniform(-1, 7)) for _ in range(5)] for _ in range(LANES)]
    together = marked(paths, 12, 6, np.float32)
    assert together == [marked([path], 12, 6, np.float32)[0] for path in paths]


@pytest.mark.parametrize("real", [np.float32, np.float64])
def test_a_position_that_is_no_number_marks_nothing(real: type) -> None:
    paths = [[(0.5, 0.5), (math.nan, 0.5), (1.5, 0.5)], [(0.5, 0.5), (0.5, math.nan), (1.5, 0.5)]]
    assert marked(paths, 12, 6, real)[1] == ([0], {0, 1})
    assert marked(paths, 12, 6, real)[0][1] == {0, 1}


@pytest.mark.parametrize("real", [np.float32, np.float64])
@pytest.mark.parametrize("far", [math.inf, -math.inf, 1e30, -1e30])
def test_a_position_far_beyond_the_grid_lists_what_it_marks(far: float, real: type) -> None:
    for path in ([(0.5, 3.5), (0.5, far), (1.5, 0.5)], [(0.5, 3.5), (far, 3.5)], [(0.5, 3.5), (far, far)]):
        ((order, ends),) = marked([path], 12, 6, real)  # it compares both
        assert order[0] == 36
        assert ends <= {36, 1}
