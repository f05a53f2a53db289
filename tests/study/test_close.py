"""A gap before and after a calibration: the same controllers, trials that no fit saw, and nothing driven twice."""

import json
import os
import re
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from realitygap.errors import RealityGapError, RecordError, StudyError
from realitygap.gap import GapSide, measure_change
from realitygap.orders import CloseOrder, read_order
from realitygap.records import Ledger, read_observations, trial_to_dict
from realitygap.report import write_closed_gap
from realitygap.study import amend_design, close_gap, design_report
from tests.forks import fork_context

pytestmark = pytest.mark.slow

SLOW = 'base = "scribbler-s2-fluke2"\n\n[drive]\ngain_left = 0.7\ngain_right = 0.75\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("slow.toml").write_text(SLOW)
    return tmp_path


def close(out: str, **more: object):
    settings = {"what": "path", "budget": 4, "n_controllers": 6, "trials": 2, "seed": 3} | more
    return close_gap("sim", "sim:slow.toml", out=out, **settings)


def close_until(folder: Path, moment: str) -> None:
    """Close a gap, and end as a power cut does at the second trial of a part."""

    def die(name: str, done: int, total: int) -> None:
        if name == moment and done == 2:
            os.kill(os.getpid(), signal.SIGKILL)

    os.chdir(folder)
    close("killed", tell=die)


def test_other_sensors_are_refused_before_the_gap_is_measured(folder):
    with pytest.raises(RealityGapError, match="7 range sensors"):
        close_gap("sim", "sim:thymio", out="other", n_controllers=6, trials=2)
    assert not (folder / "other").exists()


def test_the_same_controllers_and_trials_of_the_target_are_measured_before_and_after(folder):
    closed = close("closed")
    before, after = closed.before.study, closed.after.study
    assert [each.name for each in before.controllers] == [each.name for each in after.controllers]
    assert np.array_equal(before.target.values, after.target.values)
    assert after.result.rms.value < before.result.rms.value
    assert closed.change.rms.value == pytest.approx(after.result.rms.value - before.result.rms.value)
    assert closed.verdict.startswith("The calibration ")
    trials = read_observations(folder / "closed" / "fit.trials.sqlite").trials
    assert len(trials) == 6 * 2 + 4  # all trials of the target, each once
    fitted = [trial for trial in trials if trial.purpose == "path"]
    assert len(fitted) == closed.calibration.trials == 4


def test_the_page_shows_both_gaps_and_the_controller_in_motion_before_and_after(folder):
    page = write_closed_gap(close("closed"), folder / "report.html").read_text("utf-8")
    motions = re.findall(r'<script type="application/json">(.*?)</script>', page, re.DOTALL)
    before, after = (json.loads(data)["trials"] for data in motions)
    assert before[1]["poses"] == after[1]["poses"]  # the same trial on the target
    assert before[0]["poses"] != after[0]["poses"]
    assert "Measures before the calibration." in page
    order = read_order(folder / "report.html")
    assert isinstance(order, CloseOrder)
    assert order == read_order(folder / "closed")


@pytest.mark.skipif(sys.platform == "win32", reason="kills processes")
@pytest.mark.parametrize("moment", ["sim:slow.toml", "calibrating on sim:slow.toml", "sim:killed/fit.toml"])
def test_killed_work_resumes_with_the_same_result_and_drives_nothing_twice(folder, moment):
    process = fork_context().Process(target=close_until, args=(folder, moment))
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    resumed, whole = close("killed"), close("whole")
    assert resumed.change == whole.change
    assert resumed.verdict == whole.verdict
    assert len(read_observations(folder / "killed" / "fit.trials.sqlite").trials) == 6 * 2 + 4


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"sim": "jyro"}, "close calibrates sim"),
        ({"target": "jyro"}, "cannot calibrate to jyro"),
        ({"target": "recorded:trials.sqlite"}, "realitygap calibrate path"),
        ({"target": "scribbler:/dev/rfcomm0"}, "without an operator"),
        ({"budget": 1}, "needs at least 2 trials"),
        ({"what": "contact", "observe": "cells"}, "alone does not identify contact"),
        ({"target": "twin:nowhere.toml"}, "nowhere.toml"),
    ],
)
def test_what_cannot_be_closed_is_refused_before_a_trial(folder, settings, text):
    with pytest.raises(RealityGapError, match=re.escape(text)):
        close_gap(**{"sim": "sim", "target": "sim:slow.toml", "what": "path", "out": "closed"} | settings)
    assert not (folder / "closed").exists()


def test_a_folder_of_other_settings_is_refused(folder):
    close("closed", n_controllers=2)
    with pytest.raises(RealityGapError, match=r"other settings \(trials\)"):
        close("closed", n_controllers=2, trials=3)


def test_another_margin_uses_the_same_trials(folder):
    first = close("closed", n_controllers=5)
    trials = stored("closed")
    again = close("closed", n_controllers=5, margin=0.5)
    assert stored("closed") == trials
    assert again.after.study.result.rms == first.after.study.result.rms
    assert again.after.study.result.equivalence != first.after.study.result.equivalence


def test_a_locked_design_holds_all_three_parts_until_it_is_amended(folder):
    def notes(out: str, **more: object) -> tuple[str, ...]:
        return close(out, n_controllers=2, **more).after.study.result.notes

    locked = notes("closed", lock=True)
    assert "Deviations from the locked plan: none." in locked
    report = design_report("closed")
    assert report.design.design["command"] == "close"
    assert report.progress == "8 scored trials"  # 2 controllers in 2 trials, and 4 trials of the calibration
    assert any(report.design.sha256 in note for note in locked)
    assert notes("closed") == locked
    with pytest.raises(StudyError, match=r"margin is 0\.5"):
        notes("closed", margin=0.5)
    amend_design("closed", "a margin that matters", {"margin": "0.5"})
    assert any("a margin that matters" in note for note in notes("closed", margin=0.5))
    with Ledger.open(Path("closed/fit.trials.sqlite")) as trials:
        trials.void(2, "the robot was touched")
    assert any("fit.trials.sqlite" in deviation for deviation in design_report("closed").deviations)
    assert not any("locked" in note for note in notes("plain"))
    with pytest.raises(RecordError, match="before the first one"):
        notes("plain", lock=True)


def stored(folder: str) -> list[dict[str, object]]:
    return [trial_to_dict(trial) for trial in read_observations(f"{folder}/fit.trials.sqlite").trials]


def test_a_folder_of_something_else_is_left_alone(folder):
    Path("results").mkdir()
    Path("results", "report.html").write_text("mine")
    with pytest.raises(RealityGapError, match="has other files"):
        close("results")
    with pytest.raises(RealityGapError, match="is a file, expected a folder"):
        close("results/report.html")
    assert [path.name for path in Path("results").iterdir()] == ["report.html"]
    assert Path("results", "report.html").read_text() == "mine"


def test_the_change_is_that_of_the_same_controllers():
    rng = np.random.default_rng(1)
    quality = rng.uniform(0.2, 0.6, (12, 1))
    before, after, target = (
        GapSide(name, "SIM", quality + shift + rng.normal(0, 0.01, (12, 6)))
        for name, shift in (("before", 0.1), ("after", 0.02), ("target", 0.0))
    )
    change = measure_change(before, after, target)
    assert change.rms.low < -0.08 < change.rms.high < 0
    assert change.level.low < -0.08 < change.level.high < 0
    none = measure_change(before, before, target).rms
    assert (none.value, none.low, none.high) == (0, 0, 0)
