"""The paper's arena and its starts."""

import json
import math

import pytest

from realitygap.kernels.tasks.coverage import to_grid
from realitygap.platforms import JyroPlatform
from realitygap.world import (
    INCH,
    NAMED_STARTS,
    Arena,
    ArenaSettings,
    Grid,
    is_inside,
    paper_arena,
)


def test_paper_arena_is_42_by_24_inches_with_12_by_6_reachable_cells():
    arena = paper_arena()
    xs = {x for wall in arena.walls for x in wall[::2]}
    ys = {y for wall in arena.walls for y in wall[1::2]}
    assert xs == {0.0, 42 * INCH}
    assert ys == {0.0, 24 * INCH}
    assert (arena.grid.columns, arena.grid.rows, arena.grid.n_cells) == (12, 6, 72)
    assert arena.grid.cell == pytest.approx(0.0762)
    assert arena.grid.x + 12 * arena.grid.cell == pytest.approx(39 * INCH)
    assert arena.grid.y + 6 * arena.grid.cell == pytest.approx(21 * INCH)


def test_arena_survives_the_trip_through_json():
    arena = paper_arena(NAMED_STARTS["center"])
    assert Arena.from_dict(json.loads(json.dumps(arena.to_dict()))) == arena


@pytest.mark.parametrize(("name", "cell"), [("corner", (1, 1)), ("center", (6, 3)), ("left", (1, 3))])
def test_named_starts_lie_in_the_cells_that_their_rule_names(name, cell):
    arena = ArenaSettings(start=name).arena()
    grid = arena.grid
    column = math.floor(to_grid(arena.start.x, grid.x, grid.cell))
    row = math.floor(to_grid(arena.start.y, grid.y, grid.cell))
    assert (column, row) == cell
    assert arena.start.heading == 0.0


def test_start_is_the_paper_readings_0_1905():
    assert ArenaSettings().pose() == pytest.approx((0.1905, 0.1905, 0.0))


@pytest.mark.parametrize(
    ("point", "inside"), [((0.5, 0.3), True), ((-0.1, 0.3), False), ((0.5, 0.7), False), ((2.0, 0.3), False)]
)
def test_inside_is_between_the_walls(point, inside):
    assert is_inside(paper_arena(), *point) is inside


def test_jyro_robot_is_the_paper_s():
    robot = JyroPlatform()
    assert robot.sensors.mounts == ((0.09, 0.05, 0.0), (0.09, 0.0, 0.0), (0.09, -0.05, 0.0))
    assert robot.sensors.max_range == 0.2
    assert max(math.hypot(*corner) for corner in robot.body.corners) == pytest.approx(math.hypot(0.09, 0.08))
    assert (robot.speed, robot.turn_rate, robot.steps) == (1.0, 1.0, 87)
    assert robot.label == "SIM"


def test_corners_of_a_cell_lie_within_the_grid_and_around_the_cell():
    grid = Grid(0.5, -1.0, 0.25, columns=4, rows=2)
    assert grid.corners(0) == ((0.5, -1.0), (0.75, -1.0), (0.75, -0.75), (0.5, -0.75))
    assert grid.corners(grid.n_cells - 1)[2] == (grid.right_end, grid.upper_end) == (1.5, -0.5)
    for cell in range(grid.n_cells):
        xs, ys = zip(*grid.corners(cell), strict=True)
        assert grid.cell_at(sum(xs) / 4, sum(ys) / 4) == cell
