"""Answers of people to what a process asks: each to the question that it was given to."""

from __future__ import annotations

from typing import Any

import pytest

from realitygap.lab import _job
from realitygap.lab._job import Job


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
