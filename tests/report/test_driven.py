"""Reports of studies with conditions that a robot drove."""

from __future__ import annotations

import re

import pytest

from realitygap.errors import LedgerError, RecordError
from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder, Score
from realitygap.report import (
    draw_coverage,
    draw_individuals,
    draw_paths,
    draw_trial,
    measure_agreement,
    summarize,
    write_report,
)
from realitygap.report._champions import retry_champions
from realitygap.study import run_study
from tests.study.physical import Unattended, drive, small_study

MORE = """
[[condition]]
name = "searching"
selection = "novelty"
platform = "scribbler"

[[condition]]
name = "simulated"
noise = 0.1

[[condition]]
name = "simulated-novelty"
selection = "novelty"
noise = 0.1
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two robot arms and two simulated ones; a trial is void, and a second run of one arm is unfinished."""
    path = tmp_path_factory.mktemp("mixed") / "small"
    study = small_study(more=MORE)
    run_study(study, path)
    drive(study, path, operator=VoidsOne())
    more = small_study(more=MORE, replicates="2")
    run_study(more, path)
    drive(more, path, operator=Leaves())
    return path


class VoidsOne(Unattended):
    """Aborts the second trial, once."""

    n_seen = 0

    def watch(self, card, step, seen, command):
        self.n_seen += 1
        super().watch(card, step, seen, command)
        return self.n_seen == 6


class Leaves(Unattended):
    """Leaves the last trials of a sheet unscored."""

    def drawn(self, card, driven):
        return None if card.trial.individual == 2 else super().drawn(card, driven)


def test_tables_say_which_arm_is_which(folder):
    summary = summarize(folder)
    assert dict(zip(summary["condition"], summary["label"], strict=True)) == {
        "robot": "EMULATED",
        "searching": "EMULATED",
        "simulated": "SIM",
        "simulated-novelty": "SIM",
    }
    assert summary["n"].to_list() == [1, 1, 2, 2]
    assert summary["ends_median"].null_count() == 0


def test_the_report_shows_the_robots_arm_beside_the_simulated_ones(folder, tmp_path):
    page = write_report(folder, tmp_path / "report.html").read_text()
    assert "robot (EMULATED): 9 trials that count, 1 void" in page
    assert "left out because unfinished: run 1 (0 of 2 generations)" in page
    assert "6 of 8 runs are complete" in page
    assert "EMULATED, n = 1" in page
    assert "driven over the robot’s own protocol, with a simulated robot behind it" in page
    for search, condition, counterpart in (("coverage", "robot", "5"), ("novelty", "searching", "8")):
        drawn = page.partition(f'id="figure-individuals-{search}"')[2].partition("</figure>")[0]
        assert f"Counterpart of the paper’s Figure {counterpart}." in drawn
        assert f"{condition}, run 0" in drawn, "as in the paper, whose Figures 5 and 8 the robot drew"


@pytest.mark.slow
def test_figures_of_conditions_on_a_robot_state_their_label(folder):
    assert "EMULATED and SIM" in draw_coverage(folder).caption
    drawing = draw_individuals(folder, "robot")
    assert "EMULATED, n = 1 run" in drawing.caption
    assert "emulator’s witness" in drawing.caption
    assert "emulator’s witness" in draw_paths(folder, "robot").caption


def test_trials_of_a_robot_are_refused_as_no_program_can_repeat_them(folder):
    with pytest.raises(RecordError, match="driven by a robot, and no program drives them again"):
        draw_trial(folder, "robot")
    problems = {each.condition: each.problem for each in retry_champions(folder)}
    assert "a robot drove it" in problems["robot"]
    assert not problems["simulated"]


@pytest.mark.slow
def test_a_correction_shows_in_reports(folder, tmp_path):
    before = ResultsFolder.open(folder).digest()
    with Ledger.open(folder / LEDGER_NAME) as ledger:
        trial = next(each for each in ledger.trials("robot", 0, 1) if each.state == "scored")
        ledger.score(trial.trial, Score(range(60), "anna"), "correction")
    assert summarize(folder)["line_median"][0] == 60 / 72
    assert ResultsFolder.open(folder).digest() != before
    page = write_report(folder, tmp_path / "report.html").read_text()
    assert "1 corrected afterwards" in page


class Person(Unattended):
    """Counts cells on paper, as somebody who cannot see where steps end."""

    def drawn(self, card, driven):
        return Score(super().drawn(card, driven).cells, "anna")


@pytest.mark.slow
def test_counts_of_a_person_have_no_ends_and_no_paths(tmp_path):
    drive(small_study(), tmp_path / "small", operator=Person())
    summary = summarize(tmp_path / "small")
    assert summary["ends_median"].to_list() == [None]
    assert summary["line_median"].null_count() == 0
    caption = draw_individuals(tmp_path / "small").caption
    assert "Shaded: the entered cells" in caption
    assert "A dot in the color of an individual marks each cell" in caption
    page = write_report(tmp_path / "small").read_text()
    assert "The paths themselves were not recorded" in page
    assert "realitygap drive STUDY.toml --port PORT --seed 1 --replicates 1 --out DIR" in page
    assert not re.search(r"[>\s]nan[<\s]", page, re.IGNORECASE)
    assert len(ResultsFolder.open(tmp_path / "small").digest()) == 64


def test_a_summary_needs_a_complete_run(tmp_path):
    drive(small_study(), tmp_path / "small", operator=Leaves())
    with pytest.raises(RecordError, match="No run on a robot is complete"):
        summarize(tmp_path / "small")


# agreement


def counted_twice(tmp_path, n, second):
    study = small_study(population=str(n), generations="1")
    drive(study, tmp_path / "small")
    with Ledger.open(tmp_path / "small" / LEDGER_NAME) as ledger:
        for trial in ledger.trials():
            ledger.score(trial.trial, Score(second(trial.cells), "ben"), "second")
    return measure_agreement(tmp_path / "small")


def test_two_who_see_the_same_agree_wholly(tmp_path):
    found = counted_twice(tmp_path, 3, lambda cells: cells[::-1])
    assert (found.n_trials, found.n_cells, found.same, found.kappa.value) == (3, 216, 1.0, 1.0)
    assert found.kappa.ends is None, "no interval of three trials"


def test_kappa_is_that_of_the_table(tmp_path):
    """By hand: one person's cells plus one more in each trial."""
    found = counted_twice(
        tmp_path, 12, lambda cells: [*cells, next(k for k in range(71, 0, -1) if k not in cells)]
    )
    with Ledger.open(tmp_path / "small" / LEDGER_NAME) as ledger:
        both = sum(len(trial.cells) for trial in ledger.trials())
    n, more = 12 * 72, 12
    observed = (n - more) / n
    expected = (both * (both + more) + (n - both) * (n - both - more)) / n**2
    assert found.kappa.value == pytest.approx((observed - expected) / (1 - expected))
    assert found.kappa.low < found.kappa.value < found.kappa.high
    assert f"{found.kappa.value:.3f}" in found.sentence


def test_agreement_needs_trials_counted_by_two_people(tmp_path):
    drive(small_study(), tmp_path / "small")
    with pytest.raises(LedgerError, match="no trial was counted by two people yet"):
        measure_agreement(tmp_path / "small")
