"""Stretches of a color are joined to one trace, and what is not worth its link is cut off."""

from __future__ import annotations

import numpy as np

from realitygap.vision._links import _ends, joined


def _picture(shape=(60, 200)):
    return np.zeros(shape, np.int32), np.full(shape, np.inf, np.float32)


def _draw(stretches, costs, number, row, columns, cost=0.02):
    stretches[row : row + 2, columns] = number
    costs[row : row + 2, columns] = cost


def test_two_stretches_are_joined_where_other_ink_may_hide_the_line():
    stretches, costs = _picture()
    _draw(stretches, costs, 1, 20, slice(10, 80))
    costs[20:22, 80:110] = 0.3
    _draw(stretches, costs, 2, 20, slice(110, 190))
    kept, links, _ = joined(stretches, np.array([0, 0.07, 0.08]), costs, 1)
    assert kept.tolist() == [False, True, True]
    assert links[20:22, 82:108].any(axis=0).all()


def test_a_short_stretch_far_away_is_cut_off():
    stretches, costs = _picture()
    _draw(stretches, costs, 1, 20, slice(10, 80))
    costs[20:22, 80:180] = 1.2
    _draw(stretches, costs, 2, 20, slice(180, 190))
    kept, links, _ = joined(stretches, np.array([0, 0.07, 0.01]), costs, 1)
    assert kept.tolist() == [False, True, False]
    assert not links.any()


def test_a_long_stretch_stays_though_nothing_leads_to_it():
    stretches, costs = _picture()
    _draw(stretches, costs, 1, 20, slice(10, 60))
    _draw(stretches, costs, 2, 40, slice(20, 195))
    kept, _, _ = joined(stretches, np.array([0, 0.05, 0.175]), costs, 1)
    assert kept.tolist() == [False, True, True]


def test_a_gap_in_a_loop_is_closed_though_its_ends_are_joined_the_other_way_round():
    stretches, costs = _picture((120, 120))
    angle = np.linspace(0.35, 2 * np.pi - 0.35, 2000)
    for radius in (40, 41):
        rows, columns = np.round(60 + radius * np.sin(angle)), np.round(60 + radius * np.cos(angle))
        stretches[rows.astype(int), columns.astype(int)] = 1
        costs[rows.astype(int), columns.astype(int)] = 0.02
    gap = np.linspace(-0.36, 0.36, 400)
    rows, columns = np.round(60 + 40 * np.sin(gap)).astype(int), np.round(60 + 40 * np.cos(gap)).astype(int)
    costs[rows, columns] = np.where(np.isfinite(costs[rows, columns]), costs[rows, columns], 0.4)
    _, links, _ = joined(stretches, np.array([0, 0.22]), costs, 1)
    assert links[60, 98:103].any()


def test_the_ends_of_a_line_are_seen_and_not_its_corners():
    line = np.zeros((80, 80), np.bool_)
    line[20:23, 10:60] = True
    line[20:70, 57:60] = True
    found, outward = _ends(line)
    ends = {tuple(end) for end in found.tolist()}
    assert len(ends) == 2
    assert {tuple(way) for way in np.round(outward).astype(int).tolist()} == {(0, -1), (1, 0)}
    assert min(abs(row - 21) + abs(column - 10) for row, column in ends) <= 3
    assert min(abs(row - 69) + abs(column - 58) for row, column in ends) <= 3


def test_nothing_seen_is_no_trace():
    stretches, costs = _picture()
    kept, links, _ = joined(stretches, np.zeros(1), costs, 0)
    assert not kept.any()
    assert not links.any()


def _chain(n_pieces):
    """A long link from the stretch at the start to short ones, with cheap links between these."""
    stretches, costs = _picture((60, 300))
    _draw(stretches, costs, 1, 20, slice(10, 50))
    costs[20:22, 50:150] = 0.6
    for k in range(n_pieces):
        _draw(stretches, costs, 2 + k, 20, slice(150 + 14 * k, 160 + 14 * k))
        costs[20:22, 160 + 14 * k : 164 + 14 * k] = 0.1
    return stretches, costs


def test_short_stretches_that_are_together_not_worth_a_long_link_are_cut_off():
    stretches, costs = _chain(2)
    kept, links, _ = joined(stretches, np.array([0, 0.04, 0.01, 0.01]), costs, 1)
    assert kept.tolist() == [False, True, False, False]
    assert not links.any()


def test_short_stretches_that_are_together_worth_it_stay():
    stretches, costs = _chain(10)
    kept, links, _ = joined(stretches, np.array([0, 0.04, *[0.011] * 10]), costs, 1)
    assert kept[1:].all()
    assert links[20:22, 52:148].any(axis=0).all()


def _two_ends(between, row=30):
    """A U whose upper ends face each other over a long gap; what lies there costs so much."""
    stretches, costs = _picture((120, 420))
    _draw(stretches, costs, 1, row, slice(20, 60))
    _draw(stretches, costs, 1, row, slice(360, 400))
    _draw(stretches, costs, 1, 100, slice(20, 400))
    for column in (20, 398):
        stretches[row:102, column : column + 2] = 1
        costs[row:102, column : column + 2] = 0.02
    costs[30:32, 60:360] = np.where(stretches[30:32, 60:360] > 0, 0.02, between)
    return stretches, costs


def test_ends_that_face_each_other_are_joined_a_long_way_under_other_ink():
    stretches, costs = _two_ends(0.4)
    _, links, loose = joined(stretches, np.array([0, 0.6]), costs, 1)
    assert links[30:32, 65:355].any(axis=0).all()
    assert len(loose) == 0


def test_not_where_the_ink_between_them_can_hardly_hide_the_line():
    stretches, costs = _two_ends(0.7)
    _, links, loose = joined(stretches, np.array([0, 0.6]), costs, 1)
    assert not links.any()
    assert sorted(np.round(loose / 20).astype(int).tolist()) == [[2, 3], [2, 18]]


def test_not_where_a_line_ends_by_right_at_the_start():
    stretches, costs = _two_ends(0.4)
    _, links, _ = joined(stretches, np.array([0, 0.6]), costs, 1, (31, 59))
    assert not links.any()


def test_not_where_the_way_between_them_leaves_sideways():
    stretches, costs = _two_ends(np.inf)
    for column in (54, 364):
        costs[2:30, column : column + 2] = 0.4
    costs[2:4, 54:366] = 0.3
    _, links, _ = joined(stretches, np.array([0, 0.6]), costs, 1)
    assert not links.any()


def test_a_line_that_lies_under_others_from_the_start_is_joined_to_an_end():
    stretches, costs = _picture((120, 420))
    _draw(stretches, costs, 1, 30, slice(200, 400))
    costs[30:32, 20:200] = 0.4
    stretches[31, 20] = 2
    stretches[10:90, 300:302] = 1  # the cheapest way from the start leads here, and not to the line's end
    costs[10:90, 300:302] = 0.02
    costs[88:90, 20:300] = 0.15
    costs[32:90, 20:22] = 0.15
    _, links, _ = joined(stretches, np.array([0, 0.4, 0.0]), costs, 2, (31, 20))
    assert links[30:32, 30:195].any(axis=0).all()
