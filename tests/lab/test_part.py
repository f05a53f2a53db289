"""Parts of a page: drawn when what they show has changed, and until it is there."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import pytest

pytest.importorskip("nicegui", reason="needs the extra lab")

from realitygap.lab.pages import _part
from realitygap.lab.pages._part import Part


class Drawn:
    """As NiceGUI has it, which draws a little after it was asked to."""

    def __init__(self, draw: Callable[[], None]) -> None:
        self.draw = draw
        self.n_asked = 0

    def __call__(self) -> None:
        self.draw()

    def refresh(self) -> None:
        self.n_asked += 1


@pytest.fixture(autouse=True)
def _no_page(monkeypatch):
    monkeypatch.setattr(_part, "ui", SimpleNamespace(refreshable=Drawn))


def test_a_part_is_drawn_anew_when_it_has_changed_and_only_then():
    state, shown = ["a"], []
    part = Part(lambda: state[0], shown.append)
    part.show()
    part.look()
    assert part._refreshable.n_asked == 0
    state[0] = "b"
    part.look()
    part.look()  # it is not drawn yet
    assert part._refreshable.n_asked == 1
    part._refreshable()
    part.look()
    assert (shown, part._refreshable.n_asked) == (["a", "b"], 1)


def test_a_change_during_drawing_is_drawn_afterwards():
    state, shown = ["a"], []

    def show(now: str) -> None:
        shown.append(now)
        state[0] = "b"

    part = Part(lambda: state[0], show)
    part.show()
    part.look()
    assert part._refreshable.n_asked == 1


def test_a_failed_drawing_is_tried_again():
    state, shown = ["a"], []

    def show(now: str) -> None:
        if now == "b" and "failed" not in shown:
            shown.append("failed")
            raise ValueError("the ledger is locked")
        shown.append(now)

    part = Part(lambda: state[0], show)
    part.show()
    state[0] = "b"
    part.look()
    with pytest.raises(ValueError, match="locked"):
        part._refreshable()
    part.look()
    assert part._refreshable.n_asked == 2
    part._refreshable()
    assert shown == ["a", "failed", "b"]
