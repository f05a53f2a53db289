"""The physical conditions of a study, with a fake robot."""

import polars as pl
import pytest

from realitygap.errors import LedgerError, RobotError, StudyError
from realitygap.records import LEDGER_NAME, SCHEMA, Ledger, ResultsFolder, Score
from realitygap.runs import _evolution as evolution
from realitygap.study import load_study, run_study
from realitygap.trials import WitnessObserver
from tests.trials.fake_robot import FakeRobot

from .physical import Unattended, drive, scored, small_study


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
        RobotError,
        match=r"Link lost in trial 2 at step 3 of 4: The plug was pulled\..* connect it again to resume",
    ):
        drive(study, tmp_path / "r", fault=pull_the_plug)
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        states = [trial.state for trial in ledger.trials()]
        assert states == ["scored", "running", "planned"]
        assert len(ledger.record(2).commands) == 3
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
    result = drive(study, tmp_path / "r", operator=Unattended(in_flight="driven"))
    assert "1 driven trials wait for their scores" in result.waiting
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["scored", "driven", "scored"]


def test_emulated_and_real_trials_are_not_mixed(tmp_path):
    drive(small_study(), tmp_path / "r")
    real = FakeRobot()
    real.label = "REAL"
    with pytest.raises(LedgerError, match="are EMULATED, but this robot's would be REAL"):
        drive(small_study(replicates="2"), tmp_path / "r", robot=real, operator=Anybody())
    assert not real.is_open


class Anybody(Unattended):
    """Takes any robot, whatever is found."""

    def meet(self, robot):
        self.observer = WitnessObserver(robot)

    def accept(self, preflight):
        return True


def test_a_witness_does_not_score_what_counts_as_real(tmp_path):
    real = FakeRobot()
    real.label = "REAL"
    with pytest.raises(RobotError, match="counts as REAL, but a witness reports an emulated one"):
        drive(small_study(), tmp_path / "r", robot=real)
    assert not real.is_open
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        assert ledger.sittings() == []


def test_another_robot_is_noticed(tmp_path):
    drive(small_study(), tmp_path / "r")
    with pytest.raises(StudyError, match="another robot than before: name is 'Other', before 'Fake'"):
        drive(small_study(replicates="2"), tmp_path / "r", robot=FakeRobot(name="Other"))


def test_a_robot_that_was_accepted_once_is_still_another(tmp_path):
    drive(small_study(), tmp_path / "r")
    drive(small_study(replicates="2"), tmp_path / "r", robot=FakeRobot(name="Other"), operator=Anybody())
    for name, before in (("Other", "Fake"), ("Fake", "Other")):
        with pytest.raises(StudyError, match=f"name is '{name}', before '{before}'"):
            drive(small_study(replicates="3"), tmp_path / "r", robot=FakeRobot(name=name))


class Meanwhile(Unattended):
    """Somebody else writes to the ledger while the operator is asked whether to close a generation."""

    def __init__(self, path, do):
        super().__init__()
        self._path = path
        self._do = do
        self.n_asked = 0

    def close(self, cards):
        self.n_asked += 1
        if self.n_asked == 1:
            with Ledger.open(self._path / LEDGER_NAME) as ledger:
                self._do(ledger)
        return super().close(cards)


def test_a_trial_void_while_the_generation_is_closed_is_driven_again(tmp_path):
    path = tmp_path / "r"
    operator = Meanwhile(path, lambda ledger: ledger.void(2, "the paper had slipped"))
    result = drive(small_study(), path, operator=operator)
    assert (result.n_complete, result.n_driven, operator.n_asked) == (1, 7, 3)
    drive(small_study(), tmp_path / "whole")
    assert scored(path) == scored(tmp_path / "whole")


def test_a_score_taken_back_while_the_generation_is_closed_is_waited_for(tmp_path):
    path = tmp_path / "r"
    result = drive(small_study(), path, operator=Meanwhile(path, lambda ledger: ledger.undo(2)))
    assert "1 driven trials wait for their scores" in result.waiting
    with Ledger.open(path / LEDGER_NAME) as ledger:
        ledger.score(2, Score([13, 14], "anna"))
    assert drive(small_study(), path).n_complete == 1
    assert scored(path)[1][-1] == [13, 14]


def test_cells_entered_while_the_generation_is_closed_do_not_breed_what_they_were_not_asked_for(
    tmp_path, monkeypatch
):
    """Else fitness and frozen cells would differ, and the study could never be gone on with."""
    path = tmp_path / "r"
    tell = evolution.Evolution.tell

    def told_late(self, scores, cells):
        monkeypatch.setattr(evolution.Evolution, "tell", tell)
        with Ledger.open(path / LEDGER_NAME) as ledger:
            ledger.undo(1)
            ledger.score(1, Score(range(30), "anna"))
        return tell(self, scores, cells)

    monkeypatch.setattr(evolution.Evolution, "tell", told_late)
    with pytest.raises(LedgerError, match=r"Other cells of trials \[1\] were entered"):
        drive(small_study(), path)
    assert drive(small_study(), path).n_complete == 1
    assert scored(path)[0][-1] == list(range(30))


class Stops(Unattended):
    """Counts cells of a sheet afterwards, and is stopped at the second."""

    def drawn(self, card, driven):
        return None

    def enter(self, cards, *, is_full):
        if is_full:
            yield cards[0].trial.trial, Score([13], "anna")
            raise KeyboardInterrupt


def test_scores_entered_for_a_sheet_are_kept_when_the_program_is_stopped(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        drive(small_study(), tmp_path / "r", operator=Stops())
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["scored", "driven", "driven"]


class Blind(Unattended):
    """Its connection is gone when the first trial has ended."""

    def drawn(self, card, driven):
        raise RobotError("The witness has gone.")


def test_a_trial_that_the_witness_could_not_tell_of_keeps_its_steps_and_is_driven_again(tmp_path):
    with pytest.raises(RobotError, match="The witness has gone"):
        drive(small_study(), tmp_path / "r", operator=Blind())
    with Ledger.open(tmp_path / "r" / LEDGER_NAME) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["running", "planned", "planned"]
        assert len(ledger.record(1).commands) == 4
    drive(small_study(), tmp_path / "r")
    drive(small_study(), tmp_path / "whole")
    assert scored(tmp_path / "r") == scored(tmp_path / "whole")


def test_a_weak_battery_is_noticed(tmp_path):
    robot = FakeRobot()
    robot.cell_v = 5.9
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
    with pytest.raises(StudyError, match="holds trials of a robot, which are never deleted") as refused:
        run_study(small_study(steps="5"), tmp_path / "small")
    assert "--fresh" not in str(refused.value), "it would be refused, too"


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
        platform = condition.on
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

    class Listening(Unattended):
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


def test_pens_stay_while_a_sheet_is_begun(tmp_path):
    with pytest.raises(RobotError):
        drive(small_study(), tmp_path / "r", operator=Blind())
    fewer = small_study(more='[trials]\npens = ["red", "blue"]\n')
    with pytest.raises(StudyError, match="names 2 pens, and a sheet that is begun needs 3"):
        drive(fewer, tmp_path / "r")
    drive(small_study(), tmp_path / "r")
    assert (
        drive(
            small_study(more='[trials]\npens = ["red", "blue"]\n', replicates="2"), tmp_path / "r"
        ).n_complete
        == 2
    )


def test_two_pens_of_a_color_are_refused():
    with pytest.raises(StudyError, match=r"trials\.pens.*'red' is listed twice"):
        small_study(more='[trials]\npens = ["red", "blue", "red"]\n')


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
