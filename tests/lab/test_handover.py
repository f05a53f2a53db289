"""Control of a robot is handed over with consent, or taken from an operator who does not answer."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

from realitygap.errors import StudyError
from realitygap.lab import _control as module
from realitygap.lab._control import RobotControl, Visitor

ANNA, BEN, CARL = Visitor("a", "anna"), Visitor("b", "ben"), Visitor("c", "carl")


@pytest.fixture
def robot(tmp_path):
    """Return the robot of a lab, which anna drives by hand."""
    robot = RobotControl(tmp_path, threading.RLock(), lambda: None)
    robot.stops = []
    robot.hand = SimpleNamespace(
        port="COM3",
        is_over=False,
        has_met=True,
        is_lost=False,
        has_robot=True,
        robot_action="",
        stop_robot=lambda: robot.stops.append("stop"),
    )
    robot.note(robot.hand)
    robot.take(ANNA)
    return robot


def test_robot_stays_with_its_operator_until_they_answer(robot):
    robot.ask(BEN)
    assert robot.operator is ANNA
    assert not robot.may_operate(BEN)
    with pytest.raises(StudyError, match="ben has requested control"):
        robot.ask(CARL)
    with pytest.raises(StudyError, match="The request for control has ended"):
        robot.answer_request(BEN, yes=True)
    robot.answer_request(ANNA, yes=False)
    assert robot.operator is ANNA
    assert robot.request.state == "kept"
    with pytest.raises(StudyError, match="The request for control has ended"):
        robot.answer_request(ANNA, yes=True)


def test_robot_driven_by_hand_stops_as_it_is_handed_over(robot):
    robot.ask(BEN)
    robot.answer_request(ANNA, yes=True)
    assert (robot.operator, robot.request, robot.stops) == (BEN, None, ["stop"])
    assert not robot.may_operate(ANNA)


def test_robot_is_taken_without_an_answer_only_while_it_stands_still(robot, monkeypatch):
    timers = []

    def note_timer(seconds, act, given):
        timer = threading.Timer(seconds, act, given)
        timers.append(timer)
        return timer

    monkeypatch.setattr(module, "threading", SimpleNamespace(Timer=note_timer))
    robot.ask(BEN)
    with pytest.raises(StudyError, match="Request control first"):
        robot.take_over(BEN)
    (timer,) = timers
    timer.cancel()
    assert timer.interval == module.HANDOVER_S
    timer.function(*timer.args)  # the time is over
    assert robot.operator is ANNA
    robot.hand.robot_action = "It drives."
    with pytest.raises(StudyError, match="The robot is moving"):
        robot.take_over(BEN)
    with pytest.raises(StudyError, match="Request control first"):
        robot.take_over(CARL)
    robot.hand.robot_action = ""
    robot.take_over(BEN)
    assert (robot.operator, robot.stops) == (BEN, ["stop"])


def test_request_ends_when_another_visitor_takes_the_robot(robot):
    robot.ask(BEN)
    request = robot.request
    robot.take(CARL)
    robot._end_request(request, "unanswered")
    with pytest.raises(StudyError, match="has ended"):
        robot.answer_request(ANNA, yes=True)
    assert robot.operator is CARL


def test_robot_that_nobody_has_needs_no_consent(robot):
    robot.hand.has_robot = False
    robot.ask(BEN)
    assert robot.operator is BEN
