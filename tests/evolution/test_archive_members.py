"""Whose behaviors an archive holds."""

from __future__ import annotations

import numpy as np

from realitygap.evolution import NoveltyArchive, NoveltySettings, archive_members, behavior_distance
from tests.reference.novelty import PaperArchive, points_of


def test_an_archive_fills_in_order_and_then_the_oldest_gives_way_to_the_novel():
    settings = NoveltySettings(archive_size=3)
    near, far = [[0], [1], [0, 1]], [[66, 67, 68, 69, 70, 71]]
    assert archive_members([near[:2], [near[2], *far], [near[0]]], settings) == [
        [(0, 0), (0, 1)],
        [(1, 1), (0, 1), (1, 0)],
        [(1, 1), (0, 1), (1, 0)],
    ]


def test_the_first_of_individuals_that_behave_alike_is_named():
    assert archive_members([[[5], [5], [6]]], NoveltySettings(archive_size=3)) == [[(0, 0), (0, 0), (0, 2)]]


def test_the_papers_archive_holds_whom_the_plain_one_holds():
    rng = np.random.default_rng(2)
    lists = [[rng.permutation(72)[: rng.integers(1, 30)].tolist() for _ in range(8)] for _ in range(7)]
    plain = PaperArchive(8, 12, 6, above_all=False, x_first=True)
    members = archive_members(lists, NoveltySettings(enter="above-least"))
    for behaviors, held in zip(lists, members, strict=True):
        plain.update(behaviors)
        here = sorted(points_of(lists[generation][k], 12) for generation, k in held)
        assert here == sorted(plain.behaviors)


def test_nearest_neighbors_keep_all_that_were_novel_by_any_distance():
    rng = np.random.default_rng(1)
    lists = [[rng.permutation(72)[: rng.integers(1, 40)].tolist() for _ in range(8)] for _ in range(6)]
    for name, threshold in (("jaccard", 0.5), ("hamming", 5.0), ("edit", 5.0)):
        settings = NoveltySettings(kind="lehman-stanley", distance=name, threshold=threshold)
        archive, novelties = NoveltyArchive(settings), []
        for behaviors in lists:
            novelties.append(archive.update(behaviors))
        members = archive_members(lists, settings)
        assert len(members[-1]) == len(archive)
        assert set(members[0]) == {(0, k) for k in np.flatnonzero(novelties[0] > threshold)}
        assert members[-1][: len(members[0])] == members[0]
        packed = [lists[generation][individual] for generation, individual in members[-1]]
        again = behavior_distance(name).distances([lists[0][0]], packed)
        assert again.shape == (1, len(archive))


def test_positions_are_behaviors_too():
    settings = NoveltySettings(kind="lehman-stanley", distance="final", threshold=0.1)
    found = archive_members([[(0.1, 0.1), (0.9, 0.5)], [(0.1, 0.1), (0.5, 0.1)]], settings)
    assert found == [[(0, 0), (0, 1)], [(0, 0), (0, 1), (1, 0), (1, 1)]]
