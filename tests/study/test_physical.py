"""The physical conditions of a study, with a fake robot."""

import polars as pl
import pytest

from realitygap.errors import LedgerError, RobotError, StudyError
from realitygap.records import LEDGER_NAME, SCHEMA, Ledger, ResultsFolder
from realitygap.runs import _evolution as evolution
from realitygap.study import load_study, run_study
from realitygap.trials import WitnessOperator
from tests.trials.fake_robot import FakeRobot

from .physical import drive, scored, small_study


@pytest.mark.parametrize("selection", ["coverage", "novelty", "random"])
def test_a_study_is_driven_to_its_end(tmp_path, selection):
    study = small_study(selection)
    result = drive(study, tmp_path / "r")
    assert (result.n_runs, result.n_complete, result.n_driven, result.waiting) == (1, 1, 6, "")
    frame = ResultsFolder.open(tmp_path / "r").read()
    assert frame.schema == SCHEMA
    assert frame["generation"].to_list() == [0, 0, 0, 1, 1, 1]
    coverage = [len(cells) / 72 for cells in frame["cells"]]
    assert frame["coverage_line"].to_list() == coverage
    assert (frame["novelty"].null_count() == 0) == (selection == "novelty")
    if selection == "coverage":
        assert frame["fitness"].to_list() == coverage
    again = drive(study, tmp_path / "r")
    assert again.n_driven == 0


def test_two_runs_of_a_study_are_the_same(tmp_path):
    for name in ("a", "b"):
        drive(small_study("novelty"), tmp_path / name)
    assert scored(tmp_path / "a") == scored(tmp_path / "b")
    digests = {ResultsFolder.open(tmp_path / name).digest() for name in ("a", "b")}
    assert len(digests) == 1


def test_a_lost_link_leaves_the_trial_to_the_operator(tmp_path):
    n_drives = 0

    def pull_the_plug(what: str) -> None:
        nonlocal n_drives
        n_drives += what == "drive"
        if n_drives == 8:  # one of the pre-flight, four of the first trial, the third of the second
            raise RobotError("The plug was pulled.")

    robots = []

    study = small_study()
    with pytest.raises(
        RobotError, match=r"Trial 2, step 3 of 4: The plug was pulled\..* the same command again"
    ):
        drive(study, tmp_path / "r", fault=pull_the_plug)
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        states = [trial.state for trial in ledger.trials()]
        assert states == ["scored", "running", "planned"]
        assert len(ledger.steps(2)) == 3
    robots.append(FakeRobot())
    result = drive(study, tmp_path / "r", robot=robots[0])
    assert result.n_complete == 1
    assert robots[0].motors == (0.0, 0.0)
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        void = ledger.trials(states=["void"])
        assert [(trial.trial, trial.reason) for trial in void] == [(2, "The plug was pulled.")]
    drive(study, tmp_path / "whole")
    assert scored(tmp_path / "r") == scored(tmp_path / "whole")


def test_a_trial_cut_off_may_count_as_driven(tmp_path):
    def pull_the_plug(what: str) -> None:
        if what == "drive" and next(count) == 7:
            raise RobotError("The plug was pulled.")

    count = iter(range(100))
    study = small_study()
    with pytest.raises(RobotError):
        drive(study, tmp_path / "r", fault=pull_the_plug)
    result = drive(study, tmp_path / "r", operator=WitnessOperator(in_flight="driven"))
    assert "1 driven trials wait for their scores" in result.waiting
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["scored", "driven", "scored"]


def test_emulated_and_real_trials_are_not_mixed(tmp_path):
    drive(small_study(), tmp_path / "r")
    real = FakeRobot()
    real.label = "REAL"
    with pytest.raises(LedgerError, match="are EMULATED, and this robot's would be REAL"):
        drive(small_study(replicates="2"), tmp_path / "r", robot=real)
    assert not real.is_open


def test_another_robot_is_noticed(tmp_path):
    drive(small_study(), tmp_path / "r")
    with pytest.raises(StudyError, match="another robot than before: name is 'Other', before 'Fake'"):
        drive(small_study(replicates="2"), tmp_path / "r", robot=FakeRobot(name="Other"))


def test_a_weak_battery_is_noticed(tmp_path):
    robot = FakeRobot()
    robot.volts = 5.9
    with pytest.raises(StudyError, match=r"5\.90 V under load, expected at least 6\.15 V"):
        drive(small_study(), tmp_path / "r", robot=robot)
    assert robot.motors == (0.0, 0.0)
    assert not robot.is_open


def test_changed_settings_are_refused_and_fresh_keeps_the_ledger(tmp_path):
    drive(small_study(), tmp_path / "small")
    with pytest.raises(StudyError, match=r"scribbler\.steps is 4 there, 5 here"):
        run_study(small_study(steps="5"), tmp_path / "small")
    with pytest.raises(Exception, match="ledger of physical trials"):
        run_study(small_study(steps="5"), tmp_path / "small", fresh=True)
    assert (tmp_path / "small" / LEDGER_NAME).exists()


MIXED = """
[[condition]]
name = "simulated"
noise = 0.1
"""


def test_a_mixed_study_computes_what_is_simulated_and_says_what_is_left(tmp_path):
    study = small_study(more=MIXED)
    result = run_study(study, tmp_path / "r")
    assert result.n_runs == result.n_computed == 1
    assert result.physical is not None
    assert (result.physical.n_runs, result.physical.n_complete) == (1, 0)
    drive(study, tmp_path / "r")
    folder = ResultsFolder.open(tmp_path / "r")
    frame = folder.read()
    assert frame["condition"].unique(maintain_order=True).to_list() == ["robot", "simulated"]
    assert folder.scan().collect().equals(frame)
    assert folder.read("robot", [0], ["cells"]).height == 6
    assert folder.missing_note is None
    first = frame.filter(pl.col("generation") == 0)
    genomes = {name: part["genome"].to_list() for (name,), part in first.group_by("condition")}
    assert genomes["robot"] == genomes["simulated"], "paired conditions begin with the same networks"


def test_the_papers_study_is_the_papers():
    study = load_study("paper-robot")
    assert study.about.replicates == 3
    assert len(study.trials.pens) == 8
    for condition in study.conditions:
        assert (condition.neat.population, condition.neat.generations) == (8, 5)
        platform = condition.scribbler
        assert (platform.steps, platform.wait_s, platform.reading_max) == (100, 0.5, 1700)


SHUFFLED = """
[[condition]]
name = "other"
selection = "novelty"
platform = "scribbler"

[trials]
order = "shuffled"
blind = true
pens = ["red", "blue", "green", "black"]
"""


def test_shuffled_blocks_mix_conditions_and_change_no_result(tmp_path):
    plain = SHUFFLED.split("[trials]", maxsplit=1)[0]
    drive(small_study(more=plain), tmp_path / "plain")
    titles = []

    class Listening(WitnessOperator):
        def place(self, card):
            titles.append((card.title, card.pen, card.trial.condition, card.trial.individual))
            super().place(card)

    drive(small_study(more=SHUFFLED), tmp_path / "shuffled", operator=Listening())
    assert scored(tmp_path / "plain") == scored(tmp_path / "shuffled")
    conditions = [condition for _, _, condition, _ in titles[:6]]
    assert sorted(conditions) == ["other"] * 3 + ["robot"] * 3
    assert conditions != sorted(conditions)
    assert len({title for title, *_ in titles}) == 12
    assert all(len(title) == 4 and title.isupper() for title, *_ in titles)
    assert [pen for _, pen, *_ in titles[:6]] == ["red", "blue", "green", "black", "red", "blue"]


def test_replicates_extend_a_physical_study(tmp_path):
    drive(small_study(), tmp_path / "r")
    before = scored(tmp_path / "r")
    study = small_study(replicates="2")
    result = drive(study, tmp_path / "r")
    assert (result.n_complete, result.n_driven) == (2, 6)
    assert [row for row in scored(tmp_path / "r") if row[1] == 0] == before


def test_a_ledger_of_other_numbers_is_not_gone_on_with(tmp_path, monkeypatch):
    count = iter(range(100))

    def pull_the_plug(what: str) -> None:
        if what == "drive" and next(count) == 14:
            raise RobotError("The plug was pulled.")

    with pytest.raises(RobotError):
        drive(small_study(), tmp_path / "r", fault=pull_the_plug)
    real = evolution.genome_record
    monkeypatch.setattr(
        evolution, "genome_record", lambda genome: real(genome) | {"weight": [0.0] * len(genome.connections)}
    )
    with pytest.raises(LedgerError, match="is not what this realitygap makes of the scores before it"):
        drive(small_study(), tmp_path / "r")
