"""Distances, archives and novelty against the plain reference and by hand."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from realitygap.kernels.neat import distances
from realitygap.kernels.neat import novelty as novelty_kernels
from tests.reference import novelty as reference
from tests.reference.effort import COMPILED, cases

COLUMNS, ROWS = 12, 6
BY_COLUMN, BY_ROW = (
    distances.make_measure(distances.PAPER, COLUMNS, ROWS, by_column) for by_column in (True, False)
)
Cells = list[int]
Points = list[tuple[int, int]]


def sorted_places(cells: Cells, table: distances.CellTable) -> np.ndarray:
    places = np.empty(table.place.size, np.int32)
    distances.sort_cells(np.array(cells), len(cells), table, places)
    return places[: len(cells)].copy()


def points_at(places: np.ndarray, columns: int, rows: int, by_column: bool) -> Points:
    """The cells at some places."""
    pairs = [divmod(int(place), 2 * (rows if by_column else columns) - 1) for place in places]
    return pairs if by_column else [(x, y) for y, x in pairs]


def random_cells(rng: random.Random, n_cells: int) -> Cells:
    """Anything from one cell to all, in any order."""
    return rng.sample(range(n_cells), rng.choice([1, 2, rng.randint(1, n_cells), n_cells]))


def packed(behaviors: list[Cells], measure: distances.Measure) -> distances.Behaviors:
    found = distances.make_behaviors(len(behaviors), COLUMNS * ROWS)
    for k, cells in enumerate(behaviors):
        distances.describe(measure, np.array(cells, np.int64), len(cells), 0.0, 0.0, found, k)
    return found


@pytest.mark.parametrize("by_column", [True, False])
@pytest.mark.parametrize(
    ("columns", "rows"), [(12, 6), (1, 9), (5, 1), (16, 16), (1, 1), (2, 128), (400, 1), (20, 30)]
)
def test_cells_are_sorted_as_pairs(columns: int, rows: int, by_column: bool) -> None:
    rng = random.Random(1)
    table = distances.make_cell_table(columns, rows, by_column)
    for _ in range(cases(80, 10)):
        cells = random_cells(rng, columns * rows) if columns * rows > 1 else [0]
        found = points_at(sorted_places(cells, table), columns, rows, by_column)
        assert found == reference.points_of(cells, columns, x_first=by_column)


@pytest.mark.parametrize("by_column", [True, False])
@pytest.mark.parametrize(("columns", "rows"), [(12, 6), (1, 9), (16, 16)])
def test_the_difference_of_two_places_says_how_far_apart_the_cells_are(
    columns: int, rows: int, by_column: bool
) -> None:
    table = distances.make_cell_table(columns, rows, by_column)
    places = sorted_places(list(range(columns * rows)), table)
    points = points_at(places, columns, rows, by_column)
    for one, a in zip(places.tolist(), points, strict=True):
        found = table.span[table.span.size // 2 + one - places]
        assert found.tolist() == [math.sqrt((a[0] - x) ** 2 + (a[1] - y) ** 2) for x, y in points]
    assert table.span[0] == table.span.max()


@pytest.mark.parametrize("by_column", [True, False])
def test_the_distance_equals_the_reference(by_column: bool) -> None:
    rng = random.Random(2)
    table = (BY_COLUMN if by_column else BY_ROW).table
    for _ in range(cases(500, 50)):
        one, other = random_cells(rng, COLUMNS * ROWS), random_cells(rng, COLUMNS * ROWS)
        a, b = sorted_places(one, table), sorted_places(other, table)
        distance = distances.pointwise_distance(a, len(a), b, len(b), table.span)
        points = [reference.points_of(cells, COLUMNS, x_first=by_column) for cells in (one, other)]
        assert distance == pytest.approx(reference.paper_distance(*points, COLUMNS, ROWS), rel=1e-13)
        assert distance == distances.pointwise_distance(b, len(b), a, len(a), table.span)
        assert distances.pointwise_distance(a, len(a), a, len(a), table.span) == 0.0


# the paper's archive


class KernelPaperArchive:
    """The arrays that the kernel changes."""

    def __init__(self, size: int, *, above_all: bool, by_column: bool) -> None:
        self.above_all, self.by_column = above_all, by_column
        self.measure = BY_COLUMN if by_column else BY_ROW
        self.archive = novelty_kernels.make_archive(0, size, COLUMNS * ROWS)

    def update(self, behaviors: list[Cells]) -> list[float]:
        n = len(behaviors)
        novelty, distance = np.empty(n), np.empty((n, self.archive.archived.size))
        archive = self.archive._replace(place_of=np.empty(n, np.int64), distance=distance)
        novelty_kernels.paper_archive_step(
            packed(behaviors, self.measure), self.measure, archive, self.above_all, novelty
        )
        return novelty.tolist()

    def behaviors(self) -> list[Points]:
        """Oldest first."""
        n, oldest = self.archive.state.tolist()
        archived = [(oldest + k) % n for k in range(n)]
        return [
            points_at(self.archive.behaviors.marks[k, :n_cells], COLUMNS, ROWS, self.by_column)
            for k, n_cells in ((k, self.archive.behaviors.n_cells[k]) for k in archived)
        ]


@pytest.mark.parametrize("above_all", [True, False])
@pytest.mark.parametrize("size", [1, 2, 3, 8, 20])
def test_the_papers_archive_equals_the_reference(above_all: bool, size: int) -> None:
    """Generations of several sizes: below, at and above the archive's, some behaviors alike."""
    replaced = 0
    for seed in range(cases(12, 3)):
        rng = random.Random(seed)
        by_column = rng.random() < 0.5
        kernel = KernelPaperArchive(size, above_all=above_all, by_column=by_column)
        plain = reference.PaperArchive(size, COLUMNS, ROWS, above_all=above_all, x_first=by_column)
        n = rng.choice([1, 3, 8])
        pool = [random_cells(rng, COLUMNS * ROWS) for _ in range(5)]
        for _ in range(size // n + 6):
            behaviors = [rng.choice(pool) if rng.random() < 0.3 else random_cells(rng, 72) for _ in range(n)]
            full = len(plain.behaviors) == size
            before = list(plain.behaviors)
            assert kernel.update(behaviors) == pytest.approx(plain.update(behaviors), rel=1e-12)
            assert kernel.behaviors() == plain.behaviors
            replaced += full and before != plain.behaviors
    if size <= 3:  # in a long archive there is soon a behavior that no other exceeds
        assert replaced > 0


def test_the_archive_is_filled_first_and_an_individual_is_not_compared_with_itself() -> None:
    archive = KernelPaperArchive(8, above_all=True, by_column=True)
    assert archive.update([[0]]) == [0.0]  # nothing to compare with
    assert archive.update([[3], [4]]) == [
        pytest.approx((3 + 1) / 2),  # to cells 0 and 4
        pytest.approx((4 + 1) / 2),
    ]
    assert archive.behaviors() == [[(0, 0)], [(3, 0)], [(4, 0)]]


def test_two_individuals_with_one_behavior_are_compared_with_each_other() -> None:
    """Itself is the entry of that individual, not any that is alike."""
    archive = KernelPaperArchive(8, above_all=True, by_column=True)
    assert archive.update([[5], [5], [7]]) == [pytest.approx(v) for v in (1.0, 1.0, 2.0)]


@pytest.mark.parametrize(
    ("above_all", "newcomer", "enters"),
    [
        (True, [4], False),  # (4 + 3 + 6) / 3 = 4.3
        (False, [4], False),
        (True, [11], False),  # (11 + 10 + 1) / 3 = 7.3
        (False, [11], True),
        (True, [11, 71], True),  # as cell 11, and 12.1 for the cell that no other has
    ],
)
def test_newcomer_enters_if_it_is_more_novel_than_all_or_than_the_least_novel(
    above_all: bool, newcomer: Cells, enters: bool
) -> None:
    """Archived are the cells 0, 1 and 10, with mean distances to one another of 5.5, 5 and 9.5."""
    archive = KernelPaperArchive(3, above_all=above_all, by_column=True)
    archive.update([[0], [1], [10]])
    before = archive.behaviors()
    archive.update([newcomer])
    after = [*before[1:], reference.points_of(newcomer, COLUMNS)] if enters else before
    assert archive.behaviors() == after


def test_the_oldest_is_replaced_each_time_and_the_bar_is_that_of_the_archive_then() -> None:
    archive = KernelPaperArchive(2, above_all=True, by_column=True)
    archive.update([[0], [1]])
    archive.update([[5], [9]])  # mean distances 4.5 and 8.5, above 1; after 5 entered the bar is |5 - 1| = 4
    assert archive.behaviors() == [[(5, 0)], [(9, 0)]]


def test_a_newcomer_raises_the_bar_for_the_next_one() -> None:
    archive = KernelPaperArchive(2, above_all=True, by_column=True)
    archive.update([[0], [1]])
    archive.update([[11], [5]])  # 10.5 and 4.5, above 1; after 11 entered the bar is 10
    assert archive.behaviors() == [[(1, 0)], [(11, 0)]]


# nearest neighbors


def test_nearest_novelty_equals_the_reference() -> None:
    rng = random.Random(3)
    for _ in range(cases(300, 50)):
        n, m, k = rng.randint(1, 6), rng.randint(0, 9), rng.randint(1, 8)
        distance = np.array([[float(rng.randint(0, 5)) for _ in range(n + m)] for _ in range(n)])
        np.fill_diagonal(distance, -1.0)
        novelty = [novelty_kernels.mean_of_nearest(row, np.int64(n + m), np.empty(k)) for row in distance]
        expected = [reference.mean(sorted(v for v in row if v >= 0)[:k]) for row in distance.tolist()]
        assert novelty == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("patience", [1, 7, 20])
def test_the_growing_archive_equals_the_reference(patience: int) -> None:
    moved = set()
    for seed in range(cases(15, 4)):
        rng = random.Random(seed)
        n, k, generations = 4 + seed % 6, rng.randint(1, 12), 10
        start = [20.0, 400.0, 0.0, 150.0][seed % 4]
        archive = distances.make_behaviors(n * generations, COLUMNS * ROWS)
        state, counters = np.zeros(1, np.int64), np.zeros(2, np.int64)
        threshold = np.array([start])
        plain = reference.NearestArchive(
            lambda a, b: reference.paper_distance(a, b, COLUMNS, ROWS), k, start, patience
        )
        for _ in range(generations):
            behaviors = [random_cells(rng, COLUMNS * ROWS) for _ in range(n)]
            novelty = np.empty(n)
            room = novelty_kernels.NearestRoom(
                np.empty(n + n * generations), np.empty(k), np.empty(n, np.bool_)
            )
            novelty_kernels.nearest_archive_step(
                packed(behaviors, BY_COLUMN),
                BY_COLUMN,
                patience,
                archive,
                state,
                counters,
                threshold,
                room,
                novelty,
            )
            expected = plain.update([reference.points_of(cells, COLUMNS) for cells in behaviors])
            assert novelty.tolist() == pytest.approx(expected, rel=1e-12)
            assert state[0] == len(plain.behaviors)
            assert threshold[0] == pytest.approx(plain.threshold, rel=1e-12)
            for place, behavior in enumerate(plain.behaviors):
                assert (
                    points_at(archive.marks[place, : archive.n_cells[place]], COLUMNS, ROWS, True) == behavior
                )
        moved.add(int(np.sign(threshold[0] - start)))
    assert {-1, 1} <= moved or not COMPILED


def admitted(novelty: list[float], threshold: float, patience: int) -> tuple[list[bool], float]:
    entered = np.empty(len(novelty), np.bool_)
    level = np.array([threshold])
    novelty_kernels.admit(np.array(novelty), np.zeros(2, np.int64), level, patience, entered)
    return entered.tolist(), float(level[0])


def test_a_behavior_at_the_threshold_does_not_enter() -> None:
    assert admitted([6.0, 6.0001], 6.0, 100) == ([False, True], 6.0)


def test_the_threshold_rises_by_a_fifth_when_a_fifth_enters_in_a_row() -> None:
    assert admitted([9.0] * 4, 6.0, 100) == ([True] * 4, 6.0)
    entered, threshold = admitted([7.0] * 7, 6.0, 100)
    assert entered == [True] * 5 + [False] * 2  # 7 is below the 7.2 of after the fifth
    assert threshold == pytest.approx(7.2)
    assert admitted([9.0] * 4 + [0.0] + [9.0] * 4, 6.0, 100)[1] == 6.0  # not in a row


def test_the_threshold_falls_by_a_twentieth_after_so_many_without_an_entry() -> None:
    assert admitted([0.0] * 9, 6.0, 10)[1] == 6.0
    assert admitted([0.0] * 10, 6.0, 10)[1] == pytest.approx(5.7)
    assert admitted([0.0] * 20, 6.0, 10)[1] == pytest.approx(5.7 * 0.95)
    assert admitted([0.0] * 9 + [9.0] + [0.0] * 9, 6.0, 10)[1] == 6.0
