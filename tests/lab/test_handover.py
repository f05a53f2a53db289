"""Control of a robot is handed over with consent, or taken from an operator who does not answer."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

from realitygap.errors import StudyError
from realitygap.lab import _lab as module
from realitygap.lab._lab import Lab, Visitor

ANNA, BEN, CARL = Visitor("a", "anna"), Visitor("b", "ben"), Visitor("c", "carl")


@pytest.fixture
def lab(tmp_path):
    """Return a lab in which anna drives a robot by hand."""
    lab = Lab(tmp_path)
    lab.stops = []
    lab.hand = SimpleNamespace(is_over=False, senses=None, stop=lambda: lab.stops.append("stop"))
    lab.take_robot(ANNA)
    return lab


def test_robot_stays_with_its_operator_until_they_answer(lab):
    lab.ask_for_robot(BEN)
    assert lab.operator is ANNA
    assert not lab.may_operate(BEN)
    with pytest.raises(StudyError, match="ben has requested control"):
        lab.ask_for_robot(CARL)
    with pytest.raises(StudyError, match="The request for control has ended"):
        lab.answer_request(BEN, yes=True)
    lab.answer_request(ANNA, yes=False)
    assert lab.operator is ANNA
    assert lab.request.state == "kept"
    with pytest.raises(StudyError, match="The request for control has ended"):
        lab.answer_request(ANNA, yes=True)


def test_robot_driven_by_hand_stops_as_it_is_handed_over(lab):
    lab.ask_for_robot(BEN)
    lab.answer_request(ANNA, yes=True)
    assert (lab.operator, lab.request, lab.stops) == (BEN, None, ["stop"])
    assert not lab.may_operate(ANNA)


def test_robot_is_taken_without_an_answer_only_while_it_stands_still(lab, monkeypatch):
    timers = []

    def note_timer(seconds, act, given):
        timer = threading.Timer(seconds, act, given)
        timers.append(timer)
        return timer

    monkeypatch.setattr(module, "threading", SimpleNamespace(Timer=note_timer))
    lab.ask_for_robot(BEN)
    with pytest.raises(StudyError, match="Request control first"):
        lab.take_over(BEN)
    (timer,) = timers
    timer.cancel()
    assert timer.interval == module.HANDOVER_S
    timer.function(*timer.args)  # the time is over
    assert lab.operator is ANNA
    lab.hand.senses = {"moves": True}
    with pytest.raises(StudyError, match="The robot is moving"):
        lab.take_over(BEN)
    with pytest.raises(StudyError, match="Request control first"):
        lab.take_over(CARL)
    lab.hand.senses = {"moves": False}
    lab.take_over(BEN)
    assert (lab.operator, lab.stops) == (BEN, ["stop"])


def test_request_ends_when_another_visitor_takes_the_robot(lab):
    lab.ask_for_robot(BEN)
    request = lab.request
    lab.take_robot(CARL)
    lab._end_request(request, "unanswered")
    with pytest.raises(StudyError, match="has ended"):
        lab.answer_request(ANNA, yes=True)
    assert lab.operator is CARL


def test_robot_that_nobody_has_needs_no_consent(lab):
    lab.hand = None
    lab.ask_for_robot(BEN)
    assert lab.operator is BEN
