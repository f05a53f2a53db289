"""Assisted estimates of a mean score on a target."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from realitygap import estimate_score
from realitygap.cli import app
from realitygap.errors import StudyError
from realitygap.orders import read_order
from realitygap.study import gap_between

SLOW = 'base = "scribbler-s2-fluke2"\n\n[drive]\ngain_left = 0.7\ngain_right = 0.75\n'
SMALL = {"n_controllers": 6, "others": 20, "trials": 2, "sim_trials": 2}


@pytest.fixture
def slow(tmp_path, monkeypatch):
    """A target that differs from the simulator, in the present folder."""
    monkeypatch.chdir(tmp_path)
    Path("slow.toml").write_text(SLOW, "utf-8")
    return "sim:slow.toml"


def test_driven_controllers_are_those_of_a_gap_whatever_the_number_of_others(slow):
    few = estimate_score("sim", slow, results="few.sqlite", **SMALL)
    many = estimate_score("sim", "recorded:few.sqlite", **SMALL | {"others": 40})
    gap = gap_between("sim", slow, n_controllers=6, trials=2)
    assert np.array_equal(few.target.values, many.target.values)
    assert np.array_equal(few.source.means, many.source.means[:26])
    assert np.array_equal(few.target.values, gap.study.target.values)


def test_a_perfect_simulator_of_more_controllers_narrows_the_interval(slow):
    found = estimate_score("sim", slow, n_controllers=20, others=200, trials=2, sim_trials=2)
    assert found.assisted.correlation > 0.5
    assert found.assisted.width_ratio < 1
    assert found.assisted.worth > 0


def test_a_resumed_estimate_drives_nothing_again(slow):
    one = estimate_score("sim", slow, results="kept.sqlite", **SMALL)
    size = Path("kept.sqlite").stat().st_size
    assert repr(estimate_score("sim", slow, results="kept.sqlite", **SMALL)) == repr(one)
    assert Path("kept.sqlite").stat().st_size == size


def test_recorded_controllers_from_elsewhere_are_refused(slow):
    estimate_score("sim", slow, results="kept.sqlite", **SMALL)
    with pytest.raises(StudyError, match="does not draw"):
        estimate_score("sim", "recorded:kept.sqlite", **SMALL, seed=2)
    with pytest.raises(StudyError, match="Use trials 2"):
        estimate_score("sim", "recorded:kept.sqlite", **SMALL | {"trials": 3})


def test_the_command_prints_both_intervals_and_its_record_repeats_it(slow):
    words = ["estimate", "sim", slow, *(f"--{name.replace('_', '-')}={n}" for name, n in SMALL.items())]
    shown = CliRunner().invoke(app, words)
    assert shown.exit_code == 0, shown.output
    assert "target alone" in shown.output
    assert "SIM" in shown.output
    as_json = CliRunner().invoke(app, [*words, "--json"])
    found = json.loads(as_json.stdout)
    assert found["controllers"] == [26, 6]
    Path("result.json").write_text(as_json.stdout, "utf-8")
    assert read_order("result.json").others == 20
