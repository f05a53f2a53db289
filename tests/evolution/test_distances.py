"""Distances by name: what they say of themselves is so, whatever the behaviors."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realitygap.evolution import (
    DISTANCES,
    NearestArchive,
    NoveltyArchive,
    NoveltySettings,
    PaperArchive,
    behavior_distance,
)
from tests.reference import distances as reference
from tests.reference import novelty as plain_novelty
from tests.reference.effort import cases

COLUMNS, ROWS = 4, 3
LISTS = st.lists(st.integers(0, COLUMNS * ROWS - 1), max_size=8, unique=True)
POSITIONS = st.tuples(*2 * [st.integers(-2000, 2000).map(lambda millimeters: millimeters / 1000)])
ROUNDING = 1e-12  # of sums of a dozen distances
CELLS = [name for name, each in DISTANCES.items() if each.compares == "cells"]


def matrix(name: str, behaviors: list[Any]) -> np.ndarray:
    return DISTANCES[name].distances(behaviors, columns=COLUMNS, rows=ROWS)


@pytest.mark.parametrize("name", DISTANCES)
@given(data=st.data())
def test_distances_that_claim_to_be_metrics_are_metrics(name: str, data: st.DataObject) -> None:
    """Of three behaviors: 0 means equal, both ways are the same, and no way over the third is shorter."""
    assert DISTANCES[name].is_metric
    kind = LISTS if DISTANCES[name].compares == "cells" else POSITIONS
    behaviors = data.draw(st.lists(kind, min_size=3, max_size=3))
    found = matrix(name, behaviors)
    assert (found >= 0).all()
    assert np.array_equal(found, found.T) or np.allclose(found, found.T, rtol=ROUNDING, atol=0)
    for i in range(3):
        for k in range(3):
            assert (found[i, k] == 0) == (what_counts(name, behaviors[i]) == what_counts(name, behaviors[k]))
            for by in range(3):
                assert found[i, k] <= found[i, by] + found[by, k] + ROUNDING


def what_counts(name: str, behavior: Any) -> Any:
    """Of a behavior, what the distance looks at: cells in order of first visit, the set of them, or the position."""
    if DISTANCES[name].compares == "position":
        return tuple(behavior)
    return list(behavior) if DISTANCES[name].needs_order else set(behavior)


def test_an_alignment_divided_by_the_longer_length_would_be_no_metric() -> None:
    """Why its share is taken of 2 d / (n + m + d): over the third behavior the way would be shorter."""
    one, other, third = [0, 1], [1, 2], [0, 1, 2]

    def naive(a: list[int], b: list[int]) -> float:
        return reference.edit(a, b, COLUMNS, ROWS) / max(len(a), len(b))

    assert naive(one, other) == 1.0 > naive(one, third) + naive(third, other) == pytest.approx(2 / 3)
    edit, share = DISTANCES["edit"], DISTANCES["alignment"]
    for distance in (edit, share):
        found = distance.distances([one, other, third], columns=COLUMNS, rows=ROWS)
        assert found[0, 1] <= found[0, 2] + found[2, 1]


@pytest.mark.parametrize("name", CELLS)
@given(behavior=LISTS, other=LISTS, shuffle=st.randoms(use_true_random=False))
def test_order_matters_to_those_that_say_so_alone(
    name: str, behavior: list[int], other: list[int], shuffle: random.Random
) -> None:
    if not DISTANCES[name].needs_order:
        mixed = list(behavior)
        shuffle.shuffle(mixed)
        found = DISTANCES[name].distances([behavior, mixed], [other], columns=COLUMNS, rows=ROWS)
        assert found[0] == found[1]


@pytest.mark.parametrize("name", [name for name in CELLS if DISTANCES[name].needs_order])
def test_the_way_back_is_another_behavior_where_order_matters(name: str) -> None:
    assert matrix(name, [[0, 1, 2], [2, 1, 0]])[0, 1] > 0


@pytest.mark.parametrize("name", CELLS)
def test_they_equal_the_references(name: str) -> None:
    rng = random.Random(5)
    for _ in range(cases(20, 4)):
        one, other = (rng.choices(range(72), k=rng.randint(0, 25)) for _ in range(2))
        found = DISTANCES[name].distances([one], [other])[0, 0]
        assert found == pytest.approx(reference.BY_NAME[name](one, other, 12, 6), rel=1e-12)


def test_final_positions_may_be_any_pairs() -> None:
    found = DISTANCES["final"].distances([(0.0, 0.0), (3.0, 4.0)], [(0.0, 1.0)])
    assert found.tolist() == [[1.0], [pytest.approx(math.sqrt(18))]]
    with pytest.raises(ValueError, match=r"shape \(1, 3\), expected \(n, 2\): where each trial"):
        DISTANCES["final"].distances([(0.0, 0.0, 1.0)])
    with pytest.raises(ValueError, match="finite"):
        DISTANCES["final"].distances([(0.0, math.nan)])


def test_a_wrong_cell_and_a_wrong_name_are_refused() -> None:
    with pytest.raises(ValueError, match="names cell 72, expected 0 to 71"):
        DISTANCES["edit"].distances([[72]])
    with pytest.raises(TypeError, match="expected whole numbers"):
        DISTANCES["jaccard"].distances([[0.5]])
    with pytest.raises(ValueError, match=r"Unknown distance 'jacard'\. Did you mean 'jaccard'\?"):
        behavior_distance("jacard")


@pytest.mark.parametrize("name", DISTANCES)
def test_a_distance_says_what_it_is(name: str) -> None:
    found = behavior_distance(name)
    assert found.name == name
    assert found.description.endswith(".")
    assert found.source
    assert found.cost


# archives with any distance


def behaviors_of(rng: random.Random, name: str, n: int) -> list[Any]:
    if name == "final":
        return [(rng.random(), rng.random()) for _ in range(n)]
    return [rng.sample(range(72), rng.randint(1, 20)) for _ in range(n)]


def plain_distance(name: str) -> Any:
    if name == "final":
        return math.dist
    return lambda one, other: reference.BY_NAME[name](one, other, 12, 6)


@pytest.mark.parametrize("name", DISTANCES)
def test_the_short_archive_takes_any_distance(name: str) -> None:
    """By the reference, whose own distance is replaced."""
    rng = random.Random(3)
    settings = NoveltySettings(distance=name, archive_size=3, enter="above-least")
    archive, compiled = PaperArchive(settings), NoveltyArchive(settings)
    plain = plain_novelty.PaperArchive(3, 12, 6, above_all=False, x_first=True)
    distance = plain_distance(name)
    plain.distance = lambda one, other: distance(one[0], other[0])  # type: ignore[method-assign]
    for _ in range(cases(6, 3)):
        behaviors = behaviors_of(rng, name, 4)
        expected = update(plain, behaviors)
        assert archive.update(behaviors).tolist() == pytest.approx(expected, rel=1e-12)
        assert compiled.update(behaviors).tolist() == pytest.approx(expected, rel=1e-12)
    assert len(archive) == len(compiled) == 3


def update(plain: plain_novelty.PaperArchive, behaviors: list[Any]) -> list[float]:
    """The reference reads cells into points first; here each behavior stays as it is, in a list of its own."""
    keep = plain_novelty.points_of
    plain_novelty.points_of = lambda cells, *_, **__: [cells]  # type: ignore[assignment]
    try:
        return plain.update(behaviors)
    finally:
        plain_novelty.points_of = keep


@pytest.mark.parametrize("name", DISTANCES)
def test_the_growing_archive_takes_any_distance(name: str) -> None:
    rng = random.Random(4)
    start = {"paper": 60.0, "ordered": 60.0, "jaccard": 0.9, "hamming": 15.0, "edit": 15.0, "alignment": 0.9}
    settings = NoveltySettings(
        kind="lehman-stanley", distance=name, neighbors=4, patience=5, threshold=start.get(name, 0.2)
    )
    archive = NoveltyArchive(settings)
    plain = plain_novelty.NearestArchive(plain_distance(name), 4, settings.threshold, 5)
    for _ in range(cases(8, 3)):
        behaviors = behaviors_of(rng, name, 5)
        assert archive.update(behaviors).tolist() == pytest.approx(plain.update(behaviors), rel=1e-12)
        assert len(archive) == len(plain.behaviors)
    assert 0 < len(archive) < 40


def test_positions_of_any_object_archive_are_those_of_the_compiled_one() -> None:
    rng = random.Random(6)
    settings = NoveltySettings(kind="lehman-stanley", distance="final", threshold=0.3, neighbors=3)
    one, other = NoveltyArchive(settings), NearestArchive(k=3, threshold=0.3)
    for _ in range(4):
        points = behaviors_of(rng, "final", 6)
        assert one.update(points).tolist() == pytest.approx(other.update(points).tolist(), rel=1e-12)


def test_the_papers_distance_is_not_named_in_settings_and_others_are() -> None:
    """Conditions of before keep their hash."""
    assert "distance" not in NoveltySettings().model_dump(mode="json")
    assert NoveltySettings(distance="jaccard").model_dump(mode="json")["distance"] == "jaccard"


def test_a_threshold_in_cells_is_not_taken_for_a_share() -> None:
    with pytest.raises(
        ValueError, match=r"threshold is not given, expected one with distance 'jaccard' \(0 to 1\)"
    ):
        NoveltySettings(kind="lehman-stanley", distance="jaccard")
    assert NoveltySettings(kind="lehman-stanley").threshold == 6.0
