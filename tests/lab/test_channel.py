"""Messages between processes of a lab, and reports of which not all are sent."""

from __future__ import annotations

import io
import threading

import pytest

from realitygap.lab import _channel
from realitygap.lab._channel import REPORT_S, Channel, Pulses
from realitygap.lab._messages import (
    Answer,
    Failure,
    Message,
    Pulse,
    RobotPose,
    Senses,
    TrialCount,
    Work,
    from_line,
    to_line,
)
from realitygap.robot_families import load


@pytest.fixture
def sink():
    return io.StringIO()


@pytest.fixture
def clock(monkeypatch):
    """A clock that tests move, and timers that run when it has passed their time."""
    now, timers = [100.0], []

    class Timer:
        daemon = False

        def __init__(self, seconds, act, given):
            self.due, self.act = now[0] + seconds, lambda: act(*given)

        def start(self):
            timers.append(self)

    def wait(seconds):
        now[0] += seconds
        for timer in [timer for timer in timers if timer.due <= now[0]]:
            timers.remove(timer)
            timer.act()

    monkeypatch.setattr(_channel.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(_channel.threading, "Timer", Timer)
    return wait


def sent(sink: io.StringIO) -> list[Message]:
    return [from_line(line) for line in sink.getvalue().splitlines()]


@pytest.mark.parametrize(
    "message",
    [
        Answer(3, "void"),
        Answer(2, lengths={"ahead": "13 3/4"}),
        Senses({"range": [0.0, 6400.0]}, stalled=False, moves=True, cells=[12], pose=[0.1, -0.2, 3.0]),
        Failure("a name with \udcff, and \N{GREEK SMALL LETTER ALPHA}"),
        RobotPose([float("inf"), 0.0, 0.0], []),
    ],
)
def test_message_that_is_sent_is_the_one_that_comes(message):
    assert from_line(to_line(message)) == message


@pytest.mark.parametrize("line", ["", "nonsense", "[]", "{}", '{"kind":"Fly"}', '{"kind":["Stop"]}'])
def test_line_of_no_known_kind_is_refused(line):
    with pytest.raises(ValueError, match=r"kind|Expecting"):
        from_line(line)


def test_message_with_another_field_is_refused_by_its_name():
    with pytest.raises(ValueError, match=r"Pulse.*is_drivin"):
        from_line('{"kind":"Pulse","is_drivin":true}')


@pytest.mark.parametrize("work", Work.__subclasses__())
def test_work_names_the_function_that_does_it(work):
    assert callable(load(f"realitygap.lab.{work.function}"))


def test_last_of_several_reports_is_sent_after_a_while(sink, clock):
    channel = Channel(io.StringIO(), sink)
    for done in (1, 2, 3):
        channel.report(TrialCount("robot", done, 10), "robot")
        channel.report(TrialCount("sim", done, 10), "sim")
    assert sent(sink) == [TrialCount("robot", 1, 10), TrialCount("sim", 1, 10)]
    clock(REPORT_S)
    assert set(sent(sink)[2:]) == {TrialCount("robot", 3, 10), TrialCount("sim", 3, 10)}
    clock(REPORT_S)
    channel.report(TrialCount("robot", 9, 10), "robot")
    channel.report(TrialCount("robot", 10, 10), "robot", is_last=True)
    assert sent(sink)[4:] == [TrialCount("robot", 9, 10), TrialCount("robot", 10, 10)]
    clock(REPORT_S)
    assert len(sent(sink)) == 6


def test_reports_that_wait_are_sent_before_a_failure(sink, clock):
    channel = Channel(io.StringIO(), sink)
    channel.report(TrialCount("robot", 1, 10))
    channel.report(TrialCount("robot", 3, 10))
    channel.say(Failure("gone"))
    clock(REPORT_S)
    assert sent(sink) == [TrialCount("robot", 1, 10), TrialCount("robot", 3, 10), Failure("gone")]


def test_pulse_that_changes_is_sent_at_once(sink, clock):
    pulses = Pulses(Channel(io.StringIO(), sink))
    for is_driving in (True, True, False, True, True):
        pulses.tell(is_driving)
    assert sent(sink) == [Pulse(True), Pulse(False), Pulse(True)]
    clock(REPORT_S)
    assert sent(sink)[3:] == [Pulse(True)]


def test_line_that_is_no_message_ends_no_work(sink, monkeypatch):
    interrupted = threading.Event()
    monkeypatch.setattr(_channel, "interrupt", interrupted.set)
    lines = to_line(Answer(1)) + "nonsense\n" + '{"kind":"Fly"}\n' + to_line(Answer(2))
    channel = Channel(io.StringIO('{"kind":"DrawingWork"}\n' + lines), sink)
    channel.begin()
    assert interrupted.wait(60)
    assert [channel._answers.get_nowait().number for _ in range(2)] == [1, 2]
