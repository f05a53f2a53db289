"""Distances of behaviors against plain references, on seeded cases and by hand."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from realitygap.kernels.neat import distances
from tests.reference import distances as reference
from tests.reference.effort import cases

KINDS = {
    "paper": distances.PAPER,
    "ordered": distances.ORDERED,
    "jaccard": distances.JACCARD,
    "hamming": distances.HAMMING,
    "edit": distances.EDIT,
    "alignment": distances.ALIGNMENT,
}


def random_behavior(rng: random.Random, n_cells: int) -> list[int]:
    return rng.sample(range(n_cells), rng.choice([0, 1, 2, rng.randint(0, n_cells), n_cells]))


def described(measure: distances.Measure, behaviors: list[list[int]], n_cells: int) -> distances.Behaviors:
    packed = distances.make_behaviors(len(behaviors), n_cells)
    packed.marks[:] = 7  # what was there before does not matter
    for row, cells in enumerate(behaviors):
        distances.describe(measure, np.array(cells, np.uint8), len(cells), 0.25 * row, -1.0, packed, row)
    return packed


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize(("columns", "rows"), [(12, 6), (1, 9), (31, 2), (16, 16), (2, 1)])
def test_many_against_many_equal_the_reference(name: str, columns: int, rows: int) -> None:
    rng = random.Random(columns)
    n_cells = columns * rows
    measure = distances.make_measure(KINDS[name], columns, rows, True)
    plain = reference.BY_NAME[name]
    few = name in ("edit", "alignment")
    for _ in range(cases(3 if few else 10, 1)):
        one = [random_behavior(rng, min(n_cells, 40 if few else 256)) for _ in range(3)]
        other = [*one[:1], *(random_behavior(rng, n_cells) for _ in range(3))]
        found = np.empty((3, 4))
        a, b = described(measure, one, n_cells), described(measure, other, n_cells)
        distances.distances_between(measure, a, b, found)
        expected = [[plain(x, y, columns, rows) for y in other] for x in one]
        assert found == pytest.approx(np.array(expected), rel=1e-12, abs=1e-12)


def test_final_positions_are_compared_in_a_straight_line() -> None:
    measure = distances.make_measure(distances.FINAL, 12, 6, True)
    behaviors = distances.make_behaviors(3, 72)
    for row, (x, y) in enumerate([(0.0, 0.0), (0.3, 0.4), (-1.0, 0.0)]):
        distances.describe(measure, np.zeros(0, np.uint8), 0, x, y, behaviors, row)
    distance = np.empty(3)
    distances.distances_to(measure, behaviors, 0, behaviors, 3, distance)
    assert distance.tolist() == pytest.approx([0.0, 0.5, 1.0], rel=1e-15)


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        ([0, 1, 2], [0, 1, 2], 0.0),
        ([0, 1, 2], [1, 2], 1.0),  # the first cell against a gap
        ([0, 1, 2], [0, 13, 2], 1.0),  # a neighboring cell
        ([0, 1, 2], [0, 24, 2], 2.0),  # a cell 2.2 away: two gaps are cheaper
        ([0], [71], 2.0),
        ([], [3, 4], 2.0),
    ],
)
def test_alignment_has_the_expected_cost(one: list[int], other: list[int], expected: float) -> None:
    measure = distances.make_measure(distances.ALIGNMENT, 12, 6, True)
    a, b = described(measure, [one], 72), described(measure, [other], 72)
    row = np.empty(73)
    cost = distances.alignment_cost(a.marks[0], len(one), b.marks[0], len(other), measure.cost, row)
    assert cost == pytest.approx(expected)
    share = distances.distance_of(measure, a, 0, b, 0)
    assert share == pytest.approx(2 * expected / (len(one) + len(other) + expected))


def test_two_that_visit_nothing_are_equal_and_one_that_does_is_as_far_as_can_be() -> None:
    for name in ("jaccard", "alignment"):
        measure = distances.make_measure(KINDS[name], 12, 6, True)
        packed = described(measure, [[], [], [4, 5]], 72)
        found = np.empty((3, 3))
        distances.distances_between(measure, packed, packed, found)
        assert found.tolist() == [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]


def test_a_copied_behavior_is_the_behavior() -> None:
    measure = distances.make_measure(distances.JACCARD, 12, 6, True)
    packed = described(measure, [[3, 70], [5]], 72)
    to = distances.make_behaviors(2, 72)
    distances.copy_behavior(packed, 0, to, 1)
    assert to.n_cells[1] == 2
    assert to.points[1].tolist() == packed.points[0].tolist()
    assert distances.distance_of(measure, packed, 0, to, 1) == 0.0
    assert math.isclose(distances.distance_of(measure, packed, 1, to, 1), 1.0)
