"""A calibration that somebody at a page is led through, on an emulator that nobody says is one with a witness."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

import pytest

from realitygap.emulator import serve_tcp
from realitygap.families.scribbler.emulator import Emulator
from realitygap.lab._calibration import CalibrationJob
from realitygap.lab._messages import Answer, LengthsQuestion, Question, StartQuestion
from realitygap.orders import CalibrateOrder
from realitygap.records import read_observations

from .test_hand import wait_for

pytestmark = pytest.mark.slow


Q = TypeVar("Q", bound=Question)


def asked(job: CalibrationJob, kind: type[Q]) -> Q:
    wait_for(lambda: job.is_over or isinstance(job.ask, kind))
    question = job.ask
    assert isinstance(question, kind), job.outcome
    return question


def answer(job: CalibrationJob, **values: Any) -> None:
    assert job.ask is not None
    assert job.answer(Answer(job.ask.number, **values))


def test_somebody_is_led_through_measures_and_stops_for_now(tmp_path: Path, forked_children: None):
    with serve_tcp(Emulator("s2"), speed=20) as server:
        robot = f"scribbler:{server.name}"
        order = CalibrateOrder(what="path", robot=robot, out=tmp_path / "mine.toml", budget=4)
        job = CalibrationJob(order, tmp_path, lambda: None)
        assert "24 in free ahead" in asked(job, StartQuestion).text
        assert job.has_robot
        answer(job, choice="go")
        assert set(asked(job, LengthsQuestion).labels) == {"ahead", "left", "turned"}
        answer(job, lengths={"ahead": "a lot", "left": "0", "turned": "0"})
        wait_for(lambda: isinstance(job.ask, LengthsQuestion) and bool(job.ask.problem))
        assert "13 3/4" in asked(job, LengthsQuestion).problem
        answer(job, lengths={"ahead": "13 3/4", "left": "-1/8", "turned": "2"})
        asked(job, StartQuestion)
        answer(job, choice="stop")
        wait_for(lambda: job.is_over)
        assert not job.is_failed
        (kept,) = read_observations(tmp_path / "mine.trials.sqlite").trials
        assert kept.end_pose is not None
        assert kept.end_pose[0] - kept.start[0] == pytest.approx(13.75 * 0.0254)
