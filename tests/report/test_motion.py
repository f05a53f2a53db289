"""Trials of results in motion: those of a study, and those that an emulator's witness saw."""

import numpy as np
import pytest
from PIL import Image

from realitygap.errors import RecordError
from realitygap.playback import MovingTrial
from realitygap.records import LEDGER_NAME, Ledger
from realitygap.report import choose_moving, watch, write_movie
from realitygap.study import drive_study
from tests.study.physical import small_study


@pytest.fixture(scope="module")
def emulated(tmp_path_factory):
    study = small_study("coverage", steps="12")
    return drive_study(
        study, "emulator://s2?fluke=2&speed=off", tmp_path_factory.mktemp("emulated") / "a"
    ).folder


def test_a_trial_moves_as_the_emulator_s_witness_saw_it(emulated, tmp_path):
    _, (trial,) = choose_moving([emulated], generation=1, individual=0)
    row = emulated.read("robot").row(3, named=True)
    assert (row["generation"], row["individual"]) == (1, 0)
    assert trial.label == "EMULATED"
    assert trial.n_steps == 12
    assert trial.parts == 4
    assert set(trial.cells) == set(row["cells"])
    assert trial.step_s == pytest.approx(0.6, abs=0.2), "0.5 s and the time on the wire"
    with Ledger.open(emulated.path / LEDGER_NAME, writable=False) as ledger:
        (which,) = [
            each.trial for each in ledger.trials("robot") if (each.generation, each.individual) == (1, 0)
        ]
        record = ledger.record(which)
    reach = trial.shape.reach[0]
    np.testing.assert_allclose(trial.rays[4 * 3], (1 - record.readings[3]) * reach)
    assert trial.stalled[::4][:12].tolist() == record.stalled.tolist()
    path = write_movie(emulated, tmp_path / "a.gif", generation=1, individual=0, speed=4, width=320)
    with Image.open(path) as image:
        assert image.info["comment"].startswith(b"realitygap: EMULATED")


def test_a_robot_that_nobody_saw_has_no_movie(emulated, tmp_path, monkeypatch):
    monkeypatch.setattr("realitygap.report._motion.driven_paths", lambda *args: {})
    with pytest.raises(RecordError, match="were driven by a robot, and no program drives them again"):
        write_movie(emulated, tmp_path / "a.gif")


def test_titles_say_what_differs(tiny_study):
    title, trials = choose_moving([tiny_study], each="generation", condition="novelty", replicate=2)
    assert title == "novelty, run 2: the best of each generation"
    assert [trial.title for trial in trials] == ["generation 0", "generation 1", "generation 2"]
    rows = tiny_study.read("novelty", [2])
    for k, trial in enumerate(trials):
        best = rows.filter(rows["generation"] == k)["coverage_line"].max()
        assert len(trial.cells) / 72 == best
    title, trials = choose_moving([tiny_study, tiny_study], condition="novelty")
    assert (title, [trial.title for trial in trials]) == ("2 studies", ["tiny", "tiny"])


def test_watching_takes_what_movies_take(tiny_study):
    widget = watch(tiny_study, each="individual", condition="turn")
    assert len(widget.trials) == 8
    assert widget.scene["title"].startswith("turn, run ")
    _, trials = choose_moving([tiny_study])
    assert isinstance(trials[0], MovingTrial)
    assert watch(trials).trials == watch(tiny_study).trials
    with pytest.raises(TypeError, match="given together"):
        watch([tiny_study, trials[0]])
    with pytest.raises(ValueError, match="Unknown each 'run'"):
        watch(tiny_study, each="run")
