"""Answers of people to what a process asks: each to the question that it was given to."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

from realitygap.lab import _job, _measuring_jobs
from realitygap.lab._job import Job
from realitygap.lab._measuring_jobs import SILENT_S, CalibrationJob, GapJob
from realitygap.lab.pages._gap import _Work
from realitygap.orders import CalibrateOrder, GapOrder


class SilentChild:
    """A process that says only what a test has it say."""

    def __init__(self, order: Any, root: Any, hear: Any) -> None:
        self.told: list[dict[str, Any]] = []

    def tell(self, message: dict[str, Any]) -> None:
        self.told.append(message)


@pytest.fixture
def job(tmp_path, monkeypatch):
    monkeypatch.setattr(_job, "Child", SilentChild)
    return Job({}, tmp_path, lambda: None)


def ask(job: Job, number: int) -> None:
    job._hear({"kind": "ask", "question": "place", "number": number})


def test_a_second_tap_does_not_answer_what_is_asked_next(job):
    ask(job, 1)
    assert job.answer(1)
    assert not job.answer(1)
    ask(job, 2)
    assert not job.answer(1)
    assert job.ask is not None
    assert job.answer(2, verdict="void")
    assert [each["number"] for each in job._child.told] == [1, 2]


def test_a_question_that_is_asked_no_more_takes_none_with_it(job):
    ask(job, 1)
    job._hear({"kind": "answered", "number": 1})
    assert not job.answer(1)
    ask(job, 2)
    job._hear({"kind": "answered", "number": 1})
    assert job.answer(2)


INTERRUPTED_WHILE_IT_REPORTS = """
from realitygap.lab import _channel, _work

say = _channel.Channel.say

def interrupted(self, kind, **values):
    if kind == "error":
        raise KeyboardInterrupt
    say(self, kind, **values)

_channel.Channel.say = interrupted
raise SystemExit(_work.main())
"""


@pytest.mark.slow
def test_process_interrupted_while_it_reports_a_failure_prints_no_traceback(tmp_path):
    order = json.dumps({"work": "robot", "port": str(tmp_path / "no-such-port")})
    with subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED_WHILE_IT_REPORTS],
        stdin=subprocess.PIPE,  # open until the end: a process whose server is gone interrupts itself
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdin is not None
        process.stdin.write(order + "\n")
        process.stdin.flush()
        assert process.wait(60) == 130
        assert process.stderr is not None
        assert process.stderr.read() == ""
        assert process.stdout is not None
        assert json.loads(process.stdout.read().splitlines()[-1]) == {"kind": "interrupted"}


def test_robot_of_a_gap_is_silent_only_in_a_trial_without_an_answer(tmp_path, monkeypatch):
    monkeypatch.setattr(_job, "Child", SilentChild)
    now = [100.0]
    monkeypatch.setattr(_measuring_jobs.time, "monotonic", lambda: now[0])
    order = GapOrder(sim="sim", target="scribbler:/dev/x", n_controllers=2, trials=2)
    job = GapJob(order, tmp_path / "gap.html", tmp_path, lambda: None)
    assert job.silent_s == 0
    job._hear({"kind": "pulse", "is_driving": True})
    now[0] += SILENT_S
    assert job.silent_s == 0
    now[0] += 1
    assert job.silent_s == SILENT_S + 1
    job._hear({"kind": "pulse", "is_driving": False})
    assert job.silent_s == 0
    job._hear({"kind": "pulse", "is_driving": True})
    job._hear({"kind": "error", "text": "lost", "is_of_robot": True})
    now[0] += 9
    assert job.silent_s == 0


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
        job._hear({"kind": "trials", "name": "sim", "done": trials})
        other._hear({"kind": "trials", "done": trials, "n": 4, "readings": []})
    for each in (job, other):
        each._hear({"kind": "error", "text": "It did not answer.", "is_of_robot": is_of_robot})
    work = _Work(job, job.progress, True, job.is_failed, 0.0)
    assert (work.can_resume, work.is_failed) == (can_resume, True)
    monkeypatch.setattr(CalibrationJob, "is_over", True)
    assert other.can_resume == can_resume
