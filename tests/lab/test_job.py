"""Answers of people to what a process asks: each to the question that it was given to."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import pytest

from realitygap.lab import _job
from realitygap.lab._calibration import CalibrationJob
from realitygap.lab._gap import GapJob
from realitygap.lab._job import Job
from realitygap.lab._messages import (
    Answer,
    Answered,
    CalibrationTrials,
    CheckWork,
    Failure,
    HandWork,
    Interrupted,
    MeetQuestion,
    Message,
    Pulse,
    TrialCount,
    from_line,
    to_line,
)
from realitygap.lab.pages._gap import _Work
from realitygap.orders import CalibrateOrder, GapOrder


class SilentChild:
    """A process that says only what a test has it say."""

    def __init__(self, work: Any, root: Any, hear: Any) -> None:
        self.told: list[Message] = []

    def tell(self, message: Message) -> None:
        self.told.append(message)


@pytest.fixture
def job(tmp_path, monkeypatch):
    monkeypatch.setattr(_job, "Child", SilentChild)
    return Job(CheckWork(""), tmp_path, lambda: None)


def ask(job: Job, number: int) -> None:
    job._hear(MeetQuestion(number=number))


def test_a_second_tap_does_not_answer_what_is_asked_next(job):
    ask(job, 1)
    assert job.answer(Answer(1))
    assert not job.answer(Answer(1))
    ask(job, 2)
    assert not job.answer(Answer(1))
    assert job.ask is not None
    assert job.answer(Answer(2, "void"))
    assert job._child.told == [Answer(1), Answer(2, "void")]


def test_a_question_that_is_asked_no_more_takes_none_with_it(job):
    ask(job, 1)
    job._hear(Answered(1))
    assert not job.answer(Answer(1))
    ask(job, 2)
    job._hear(Answered(1))
    assert job.answer(Answer(2))


INTERRUPTED_WHILE_IT_REPORTS = """
from realitygap.lab import _channel, _messages, _work

say = _channel.Channel.say

def interrupted(self, message):
    if isinstance(message, _messages.Failure):
        raise KeyboardInterrupt
    say(self, message)

_channel.Channel.say = interrupted
raise SystemExit(_work.main())
"""


@pytest.mark.slow
def test_process_interrupted_while_it_reports_a_failure_prints_no_traceback(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED_WHILE_IT_REPORTS],
        stdin=subprocess.PIPE,  # open until the end: a process whose server is gone interrupts itself
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdin is not None
        process.stdin.write(to_line(HandWork(str(tmp_path / "no-such-port"))))
        process.stdin.flush()
        assert process.wait(60) == 130
        assert process.stderr is not None
        assert process.stderr.read() == ""
        assert process.stdout is not None
        assert from_line(process.stdout.read().splitlines()[-1]) == Interrupted()


def test_robot_of_a_gap_is_silent_only_in_a_trial_without_an_answer(tmp_path, monkeypatch):
    monkeypatch.setattr(_job, "Child", SilentChild)
    now = [100.0]
    monkeypatch.setattr(_job.time, "monotonic", lambda: now[0])
    order = GapOrder(sim="sim", target="scribbler:/dev/x", n_controllers=2, trials=2)
    job = GapJob(order, tmp_path / "gap.html", tmp_path, lambda: None)
    assert job.silent_s == 0
    job._hear(Pulse(True))
    now[0] += job.SILENT_S
    assert job.silent_s == 0
    now[0] += 1
    assert job.silent_s == job.SILENT_S + 1
    job._hear(Pulse(False))
    assert job.silent_s == 0
    job._hear(Pulse(True))
    job._hear(Failure("lost", is_of_robot=True))
    now[0] += 9
    assert job.silent_s == 0


def test_closing_a_gap_shows_its_phase_and_no_negative_time(tmp_path, monkeypatch):
    """It was said to be -28 s from its end, and to have 20 of 32 trials where 20 of 20 were done."""
    monkeypatch.setattr(_job, "Child", SilentChild)
    now = [100.0]
    monkeypatch.setattr(_job.time, "monotonic", lambda: now[0])
    order = GapOrder(sim="sim", target="twin:worn.toml", n_controllers=8, trials=4)
    job = GapJob(order, tmp_path / "gap.html", tmp_path, lambda: None, closes=True)
    seen = []
    for name, total in (
        ("twin:worn.toml", 32),
        ("sim", 32),
        ("calibrating on twin:worn.toml", 20),
        ("sim:/tmp/x/fit.toml", 32),
    ):
        for done in (1, total // 2, total):
            now[0] += 8
            job._hear(TrialCount(name, done, total))
            seen.append(job.progress)
            assert 0 < job.share <= 1
    assert not any("-" in words for words in seen)
    assert seen[0] == "the twin worn: 1 of 32 trials"
    assert seen[7] == "calibrating on the twin worn: 10 of 20 trials · 9 s left"
    assert seen[-1].startswith("sim with fit: 32 of 32 trials")
    job._hear(Interrupted())
    assert job.outcome == "Stopped after sim with fit: 32 of 32 trials. They are saved."


@pytest.mark.parametrize(
    ("trials", "is_of_robot", "can_resume"), [(0, False, False), (1, False, True), (0, True, True)]
)
def test_job_that_failed_offers_to_resume_where_that_helps(
    tmp_path, monkeypatch, trials, is_of_robot, can_resume
):
    """A missing file fails again; a robot that did not answer may answer the next time."""
    monkeypatch.setattr(_job, "Child", SilentChild)
    gap = GapOrder(sim="sim", target="sim:missing.toml", n_controllers=2, trials=2)
    calibration = CalibrateOrder(what="path", robot="sim:missing.toml", out=tmp_path / "mine.toml")
    job = GapJob(gap, tmp_path / "gap.html", tmp_path, lambda: None)
    other = CalibrationJob(calibration, tmp_path, lambda: None)
    if trials:
        job._hear(TrialCount("sim", trials, 2))
        other._hear(CalibrationTrials(trials, 4, []))
    for each in (job, other):
        each._hear(Failure("It did not answer.", is_of_robot))
    work = _Work(job, job.progress, True, job.is_failed, 0.0)
    assert (work.can_resume, work.is_failed) == (can_resume, True)
    monkeypatch.setattr(CalibrationJob, "is_over", True)
    assert other.can_resume == can_resume
