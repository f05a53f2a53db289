"""A robot evolves for any task, and nobody counts cells for one that does not need them."""

import pytest

from realitygap.errors import RecordError, RobotError, StudyError
from realitygap.records import LEDGER_NAME, ROBOT, Ledger, ResultsFolder
from realitygap.report import summarize, summarize_tasks, write_report
from realitygap.study import parse_study

from .physical import Unattended, drive, scored

pytestmark = pytest.mark.slow

STUDY = """
[study]
name = "small"
replicates = 1
[neat]
population = 3
generations = 2
[task]
kind = "{kind}"
inputs = ["obstacle", "stall", "time", "bias"]
[platform.scribbler]
steps = 4
[[condition]]
name = "robot"
platform = "scribbler"
"""


def study_of(kind):
    return parse_study(STUDY.format(kind=kind), "small.toml")


class Person(Unattended):
    """Places the robot, and sees no poses; fails if it is asked for cells."""

    @property
    def observes(self):
        return "cells"

    def drawn(self, card, driven):
        assert card.pen == "none"

    def enter(self, cards, *, is_full):
        raise AssertionError("nobody has to count")


def rows_of(path):
    return ResultsFolder.open(path).read().sort("generation", "individual")


def test_avoidance_is_scored_by_the_robots_own_readings(tmp_path):
    result = drive(study_of("avoid"), tmp_path / "r", operator=Person())
    assert (result.n_complete, result.waiting) == (1, "")
    rows = rows_of(tmp_path / "r")
    assert rows["fitness"].to_list() == rows["task_fitness"].to_list()
    assert rows["fitness"].n_unique() > 2
    assert rows["coverage_line"].null_count() == rows.height
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        assert {score["who"] for score in ledger.scores()} == {ROBOT}
        record = ledger.record(1)
        assert len(record.commands) == 4
        assert len(record.times) == 5
        assert len(record.last_readings) == record.readings.shape[1]
    assert summarize_tasks(tmp_path / "r").select("n", "label").rows() == [(1, "EMULATED")]
    assert summarize(tmp_path / "r")["line_median"].to_list() == [None]
    with pytest.raises(RecordError, match="Nobody counted the cells of robot"):
        write_report(tmp_path / "r", tmp_path / "r.html")


def test_a_witness_scores_the_way_along_walls_and_its_cells(tmp_path):
    drive(study_of("wall"), tmp_path / "r")
    rows = rows_of(tmp_path / "r")
    assert rows["coverage_line"].null_count() == 0
    assert rows["task_fitness"].n_unique() > 1
    drive(study_of("wall"), tmp_path / "again")
    assert scored(tmp_path / "r") == scored(tmp_path / "again")


def test_nobody_who_sees_poses_is_an_error_before_the_robot_drives(tmp_path):
    with pytest.raises(StudyError, match=r"task 'wall' is scored by its poses.*Use a camera"):
        drive(study_of("wall"), tmp_path / "r", operator=Person())
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        assert ledger.sittings() == []


def test_a_trial_that_was_cut_off_is_driven_again_for_another_task(tmp_path):
    count = iter(range(100))

    def pull_the_plug(what):
        if what == "drive" and next(count) == 7:
            raise RobotError("The plug was pulled.")

    with pytest.raises(RobotError):
        drive(study_of("avoid"), tmp_path / "r", fault=pull_the_plug)
    drive(study_of("avoid"), tmp_path / "r", operator=Unattended(in_flight="driven"))
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        assert len(ledger.trials(states=["void"])) == 1
    drive(study_of("avoid"), tmp_path / "whole")
    assert rows_of(tmp_path / "r")["fitness"].to_list() == rows_of(tmp_path / "whole")["fitness"].to_list()


def test_novelty_wants_cells(tmp_path):
    text = STUDY.format(kind="avoid") + 'selection = "novelty"\n'
    with pytest.raises(StudyError, match="expected 'fitness' with platform 'scribbler'"):
        parse_study(text, "small.toml")
