"""The archives as Python sees them, and the paper's distance by hand."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest

from realitygap.evolution import (
    NearestArchive,
    NoveltySettings,
    PaperArchive,
    largest_cell_distance,
    sorted_cells_distance,
)
from tests.reference import novelty as reference
from tests.reference.effort import cases

LARGEST = math.sqrt(11**2 + 5**2)  # from corner to corner of 12 x 6 cells


def cells(*points: tuple[int, int]) -> list[int]:
    return [12 * y + x for x, y in points]


def test_the_distance_of_two_cells_is_that_of_their_places() -> None:
    assert sorted_cells_distance(cells((0, 0)), cells((3, 4))) == 5.0
    assert sorted_cells_distance(cells((0, 0)), cells((11, 5))) == LARGEST == largest_cell_distance(12, 6)


def test_cells_are_paired_in_sorted_order() -> None:
    """(0,0) with (0,1), (2,0) with (1,0): 1 + 1, whatever the order in which they were visited."""
    one, other = cells((2, 0), (0, 0)), cells((1, 0), (0, 1))
    assert sorted_cells_distance(one, other) == 2.0
    assert sorted_cells_distance(one[::-1], other) == 2.0
    # By y first: (0,0) with (1,0), (2,0) with (0,1).
    assert sorted_cells_distance(one, other, sort="y-then-x") == pytest.approx(1.0 + math.sqrt(5.0))


def test_every_cell_that_only_the_longer_behavior_has_counts_with_the_largest_distance() -> None:
    assert sorted_cells_distance(cells((4, 4)), cells((4, 4), (5, 4), (6, 4))) == 2 * LARGEST
    assert sorted_cells_distance([], cells((4, 4), (5, 4))) == 2 * LARGEST
    assert sorted_cells_distance([], []) == 0.0


def test_a_cell_more_at_the_low_end_moves_a_behavior_farther_than_one_at_the_high_end() -> None:
    """The paper's own remark (its section 4): (0,0) puts the identical cells out of line, (11,5) does not."""
    behavior = [(x, 2) for x in range(1, 11)]
    low = sorted_cells_distance(cells(*behavior), cells((0, 0), *behavior))
    high = sorted_cells_distance(cells(*behavior), cells(*behavior, (11, 5)))
    assert high == LARGEST
    assert low == pytest.approx(math.sqrt(1 + 4) + 9 + LARGEST)


def test_repeats_do_not_matter() -> None:
    assert sorted_cells_distance([5, 5, 7, 5], [7, 5]) == 0.0


def test_random_distances_equal_the_reference() -> None:
    rng = random.Random(1)
    for _ in range(cases(200, 40)):
        columns, rows = rng.choice([(12, 6), (3, 3), (1, 7)])
        one, other = (rng.choices(range(columns * rows), k=rng.randint(1, 30)) for _ in range(2))
        for sort in ("x-then-y", "y-then-x"):
            points = [reference.points_of(b, columns, x_first=sort == "x-then-y") for b in (one, other)]
            assert sorted_cells_distance(one, other, columns=columns, rows=rows, sort=sort) == pytest.approx(
                reference.paper_distance(*points, columns, rows), rel=1e-13
            )


@pytest.mark.parametrize("cell", [-1, 72])
def test_a_cell_outside_the_grid_is_refused(cell: int) -> None:
    with pytest.raises(ValueError, match=f"names cell {cell}, expected 0 to 71"):
        sorted_cells_distance([cell], [3])
    with pytest.raises(ValueError, match="12 columns and 6 rows"):
        PaperArchive().update([[3], [cell]])


# the paper's archive


@pytest.mark.parametrize("enter", ["above-all", "above-least"])
def test_the_papers_archive_equals_the_reference(enter: str) -> None:
    for seed in range(cases(20, 4)):
        rng = random.Random(seed)
        columns, rows, size = rng.choice([(12, 6, 8), (4, 4, 3)])
        sort = rng.choice(["x-then-y", "y-then-x"])
        settings = NoveltySettings(enter=enter, archive_size=size, sort=sort)
        archive = PaperArchive(settings, columns=columns, rows=rows)
        plain = reference.PaperArchive(
            size, columns, rows, above_all=enter == "above-all", x_first=sort == "x-then-y"
        )
        for _ in range(12):
            behaviors = [
                rng.choices(range(columns * rows), k=rng.randint(1, 25)) for _ in range(rng.randint(1, 9))
            ]
            assert archive.update(behaviors).tolist() == pytest.approx(plain.update(behaviors), rel=1e-12)
            assert len(archive) == len(plain.behaviors)


def test_an_individual_that_visits_nothing_has_a_behavior_too() -> None:
    assert PaperArchive().update([[], [0]]).tolist() == [LARGEST, LARGEST]


# nearest neighbors


def test_the_nearest_archive_equals_the_reference() -> None:
    moved = set()
    for seed in range(cases(40, 10)):
        rng = random.Random(seed)
        k, patience, start = rng.randint(1, 20), rng.choice([3, 10]), [0.05, 0.4][seed % 2]
        archive = NearestArchive(k=k, threshold=start, patience=patience)
        plain = reference.NearestArchive(math.dist, k, start, patience)
        for _ in range(10):
            behaviors = [[rng.random(), rng.random()] for _ in range(rng.randint(1, 12))]
            assert archive.update(behaviors).tolist() == pytest.approx(plain.update(behaviors), rel=1e-12)
            assert [list(b) for b in archive.behaviors] == plain.behaviors
            assert archive.threshold == pytest.approx(plain.threshold)
        assert len(archive) == len(plain.behaviors)
        moved.add(int(np.sign(archive.threshold - start)))
    assert {-1, 1} <= moved


def test_any_distance_can_be_given() -> None:
    archive = NearestArchive(lambda one, other: float(np.abs(one - other).sum()), k=1, threshold=2.0)
    assert archive.update([[0.0, 0.0], [1.0, 1.0], [5.0, 0.0]]).tolist() == [2.0, 2.0, 5.0]
    assert [b.tolist() for b in archive.behaviors] == [[5.0, 0.0]]


def test_one_individual_and_an_empty_archive_have_nothing_to_compare_with() -> None:
    assert NearestArchive().update([[1.0, 2.0]]).tolist() == [0.0]


def test_the_archive_keeps_what_was_told_when_the_array_changes() -> None:
    behaviors = np.array([[0.0], [100.0]])
    archive = NearestArchive(threshold=1.0)
    archive.update(behaviors)
    behaviors[:] = 7.0
    assert [b.tolist() for b in archive.behaviors] == [[0.0], [100.0]]


def test_wrong_behaviors_are_refused() -> None:
    archive = NearestArchive(threshold=1.0)
    archive.update([[0.0, 0.0], [9.0, 9.0]])
    assert len(archive) == 2
    with pytest.raises(ValueError, match="3 columns, expected 2"):
        archive.update([[1.0, 2.0, 3.0]])
    with pytest.raises(ValueError, match=r"shape \(2,\), expected \(n, d\)"):
        archive.update([1.0, 2.0])
    with pytest.raises(ValueError, match="finite"):
        archive.update([[1.0, math.nan]])
    with pytest.raises(ValueError, match="k is 0"):
        NearestArchive(k=0)
    assert archive.update(np.empty((0, 2))).tolist() == []  # nobody was tried: an index error once


def test_wrong_settings_are_refused() -> None:
    for wrong in [{"archive_size": 0}, {"neighbors": 0}, {"patience": 0}, {"threshold": -1}, {"size": 3}]:
        with pytest.raises(ValueError, match=next(iter(wrong))):
            NoveltySettings(**wrong)


@pytest.mark.parametrize("cells", [[1.7], ["1"], [None]])
def test_a_cell_is_a_whole_number(cells: list[Any]) -> None:
    """1.7 was taken for cell 1."""
    with pytest.raises(TypeError, match="expected whole numbers"):
        sorted_cells_distance(cells, [1])
    with pytest.raises(TypeError, match="expected whole numbers"):
        PaperArchive().update([cells])
