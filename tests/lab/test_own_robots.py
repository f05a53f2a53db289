"""Emulated robots of visitors, next to the lab's robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from realitygap.errors import StudyError
from realitygap.lab import _own_robots
from realitygap.lab._control import Visitor
from realitygap.lab._lab import Lab

PORT = "emulator://s2?fluke=2"
ADA, EVE = Visitor("a", "Ada"), Visitor("e", "Eve")


class FakeHand:
    """A robot without a process."""

    def __init__(self, work: Any, *_: Any) -> None:
        self.port = work.port
        self.has_robot = self.has_met = True
        self.is_lost = self.is_over = self.is_failed = False
        self.silent_s, self.robot_action, self.label, self.outcome = 0.0, "", "EMULATED", None
        self.n_stops = 0

    def stop_robot(self) -> None:
        self.n_stops += 1

    def ask_to_end(self) -> None:
        self.has_robot, self.is_over = False, True

    def end(self) -> None:
        pass


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lab:
    monkeypatch.setattr("realitygap.lab._control.Hand", FakeHand)
    return Lab(tmp_path)


def test_visitors_have_a_robot_each_and_the_labs_robot_is_free(lab):
    lab.connect(PORT, "", ADA)
    lab.connect(PORT, "", EVE)
    assert lab.robot_of(ADA) is not lab.robot_of(EVE)
    assert lab.robot.job is None
    lab.connect("COM3", "", ADA)
    assert lab.robot.port == "COM3"
    with pytest.raises(StudyError, match="connected"):
        lab.connect("COM4", "", EVE)
    with pytest.raises(StudyError, match="connected"):
        lab.connect(PORT, "", ADA)


def test_stop_reaches_the_labs_robot_and_ones_own(lab):
    lab.connect("COM3", "", ADA)
    lab.connect(PORT, "", ADA)
    lab.connect(PORT, "", EVE)
    assert lab.stop_robots(EVE)
    stops = [control.hand.n_stops for control in (lab.robot, lab.robot_of(ADA), lab.robot_of(EVE))]
    assert stops == [1, 0, 1]


def test_visitor_without_an_own_robot_sees_that_of_the_lab(lab):
    lab.connect("COM3", "", ADA)
    assert lab.robot_of(EVE) is lab.robot
    assert not lab.robot_of(EVE).may_operate(EVE)
    lab.connect(PORT, "", EVE)
    own = lab.robot_of(EVE)
    assert own.may_operate(EVE)
    own.hand.ask_to_end()
    assert lab.robot_of(EVE) is lab.robot


def test_robots_are_bounded(lab):
    for k in range(_own_robots.MOST):
        lab.connect(PORT, "", Visitor(str(k)))
    with pytest.raises(StudyError, match="in use"):
        lab.connect(PORT, "", ADA)


def test_robot_of_a_visitor_without_a_page_ends(tmp_path, monkeypatch, lab):
    now = [0.0]
    robots = _own_robots.OwnRobots(tmp_path, lab._lock, lab.changed, lambda: now[0])
    robots.connect(PORT, "", ADA)
    robots.connect(PORT, "", EVE)
    hand = robots.of(ADA).hand
    now[0] = _own_robots.GONE_S
    robots.of(EVE)  # a page of Eve's is open
    now[0] += 1.0
    robots.end_unseen()
    assert hand.is_over
    assert robots.of(ADA) is None
    assert robots.of(EVE) is not None


def test_gap_with_an_emulated_target_leaves_the_labs_robot_free(lab):
    lab.connect("COM3", "", ADA)
    lab.robot.take_for("scribbler:emulator://s2?fluke=2", EVE)
    with pytest.raises(StudyError, match="connected"):
        lab.robot.take_for("scribbler:COM4", EVE)
    assert lab.robot.operator == ADA
