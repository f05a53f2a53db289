"""Starts of several robots in one arena."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from realitygap.world import Arena, ArenaSettings, Grid, Obstacle, Pose, paper_arena
from realitygap.world._placing import roomiest_starts

SQUARE = Arena(
    "square",
    ((0.0, 0.0, 5.0, 0.0), (5.0, 0.0, 5.0, 5.0), (5.0, 5.0, 0.0, 5.0), (0.0, 5.0, 0.0, 0.0)),
    Grid(0.0, 0.0, 1.0, 5, 5),
    Pose(0.5, 0.5, 0.7),
)


def test_each_start_is_where_there_is_most_room() -> None:
    """Worked out by hand: half the distance to (0.5, 0.5), and the walls."""
    first, second = roomiest_starts(SQUARE, 2)
    assert first == Pose(3.5, 1.5, 0.7)  # 1.5 to the wall, 1.58 is half of the way to the start
    assert second == Pose(1.5, 3.5, 0.7)  # 1.5 to the wall, 1.41 is half of the way to the second


def test_starts_keep_away_from_obstacles() -> None:
    disc = Obstacle(3.5, 2.5, 0.0, ((0.0, 0.0),), 1.0)
    (start,) = roomiest_starts(replace(SQUARE, obstacles=(disc,)), 1)
    assert disc.distance(start.x, start.y) > 0.5


@pytest.mark.parametrize("n", [1, 3, 7])
def test_starts_are_the_best_of_all_cells(n: int) -> None:
    """Against a plain search over the cells of the paper's arena."""
    arena = paper_arena()
    grid, before = arena.grid, [arena.start]
    xs, ys = (max(wall[k] for wall in arena.walls) for k in (0, 1))

    def room(x: float, y: float) -> float:
        return min([x, y, xs - x, ys - y] + [math.dist((x, y), start[:2]) / 2 for start in before])

    for start in roomiest_starts(arena, n):
        best = max(
            room(grid.x + (i + 0.5) * grid.cell, grid.y + (j + 0.5) * grid.cell)
            for i in range(grid.columns)
            for j in range(grid.rows)
        )
        assert room(start.x, start.y) == pytest.approx(best, abs=1e-6)
        before.append(start)


def test_settings_place_the_robots() -> None:
    assert ArenaSettings(robots=3).arena().others == roomiest_starts(paper_arena(), 2)
    given = ArenaSettings(robots=2, other_starts=[[0.5, 0.3, 1.0]]).arena()
    assert given.others == (Pose(0.5, 0.3, 1.0),)
    assert given.n_robots == 2
    assert given.alone == paper_arena()
    assert given.with_numbers({"arena.start.x": 0.2}).others == given.others
