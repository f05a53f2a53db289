"""What scripts of pages send is taken only in the form that they send it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("nicegui", reason="needs the extra lab")

from realitygap.lab.pages._elements import _CELLS, _PULL, _content, _inks_of

PULL = {"move": 1, "turn": -0.5, "stops": 0}


NO_PULLS = [
    *(None, [], "up", {}),
    *({**PULL, "move": move} for move in ("fast", True)),
    *({**PULL, "turn": float("nan")}, {**PULL, "stops": 0.5}, {**PULL, "more": 1}),
]


@pytest.mark.parametrize("args", NO_PULLS)
def test_pull_of_another_form_is_left_out(args):
    assert _content(SimpleNamespace(args=args), _PULL) is None


def test_pull_and_cells_are_taken_as_they_are():
    assert _content(SimpleNamespace(args=PULL), _PULL) == PULL
    assert _content(SimpleNamespace(args=[3, 1]), _CELLS) == [3, 1]


@pytest.mark.parametrize("args", [None, 3, ["3"], [True], [1.5], {"0": 1}])
def test_cells_of_another_form_are_left_out(args):
    assert _content(SimpleNamespace(args=args), _CELLS) is None


def curve(condition, search, noise):
    return {"condition": condition, "label": "SIM", "search": search, "noise": noise, "points": []}


def test_color_means_the_search_and_dashes_mean_the_noise():
    curves = [curve(f"{s}-{n}", s, n) for s in ("coverage", "novelty") for n in (0.1, 0.5, 0.8)]
    inks, keys = _inks_of(curves)
    for first, ink in zip(curves, inks, strict=True):
        for second, other in zip(curves, inks, strict=True):
            assert (ink["color"] == other["color"]) == (first["search"] == second["search"])
            assert (ink["dashes"] == other["dashes"]) == (first["noise"] == second["noise"])
    assert [key["text"] for key in keys] == ["coverage", "novelty", "noise 0.1", "noise 0.5", "noise 0.8"]


def test_conditions_that_differ_otherwise_have_a_pen_each():
    curves = [curve(name, "coverage", 0.1) for name in ("narrow", "wide")]
    inks, keys = _inks_of(curves)
    assert inks[0] != inks[1]
    assert [key["text"] for key in keys] == ["narrow", "wide"]
