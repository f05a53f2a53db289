"""Assisted estimates of a mean score on a target."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from realitygap import estimate_score
from realitygap.cli import app
from realitygap.errors import StudyError, TableError
from realitygap.orders import EstimateOrder, OrderError, read_order
from realitygap.stats import assisted_mean
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
    assert np.array_equal(few.real, many.real)
    assert np.array_equal(few.simulated, many.simulated[:26])
    assert np.array_equal(few.real, gap.study.target.means)


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
    assert found["units"] == {"simulated": 26, "real": 6}
    Path("result.json").write_text(as_json.stdout, "utf-8")
    assert read_order("result.json").others == 20


def table(name, rows):
    Path(name).write_text(
        "controller,platform,block,trial,score\n" + "".join(f"{','.join(map(str, row))}\n" for row in rows)
    )
    return name


def of_blocks(rng, n, m):
    """Rows of two controllers in n blocks on both platforms, and in m more in simulation; B is 0.1 below A."""
    rows = []
    for block in range(n + m):
        ease = rng.uniform(0.3, 0.7)
        for controller, shift in (("A", 0.1), ("B", 0.0)):
            score = ease + shift + rng.normal(0, 0.02) * (block + 1) % 0.05
            rows.append((controller, "sim", block, 1, round(score, 4)))
            if block < n:
                rows.append((controller, "real", block, 1, round(score - 0.2 + rng.normal(0, 0.02), 4)))
    return rows


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("here")
def test_a_table_gives_the_mean_of_a_controller_and_of_a_difference_over_blocks():
    name = table("scores.csv", of_blocks(np.random.default_rng(1), 12, 100))
    one = estimate_score(name, of="A")
    assert (len(one.real), len(one.simulated)) == (12, 112)
    assert one.assisted.width_ratio < 0.7
    other = estimate_score(name, of="A", minus="B")
    assert other.assisted.estimate.low <= 0.1 <= other.assisted.estimate.high


@pytest.mark.usefixtures("here")
def test_a_table_gives_the_mean_of_controllers_as_arrays_do():
    rng = np.random.default_rng(2)
    quality = rng.uniform(0.2, 0.8, 40)
    rows = [(f"c{k}", "sim", "", t, round(q, 4)) for k, q in enumerate(quality) for t in (1, 2)]
    rows += [
        (f"c{k}", "real", "", t, round(q / 2 + t / 100, 4))
        for k, q in enumerate(quality[:10])
        for t in (1, 2)
    ]
    found = estimate_score(table("scores.csv", rows))
    real, sim = (quality[:10] / 2 + 0.015).round(4), quality.round(4)
    expected = assisted_mean(real, sim[:10], sim[10:], within=(0, 1)).estimate
    assert found.assisted.estimate.value == pytest.approx(expected.value, abs=1e-3)
    assert found.assisted.estimate.ends == pytest.approx(expected.ends, abs=1e-3)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("rows", "settings", "message"),
    [
        ([("A", "sim", "", 1, 0.5), ("A", "real", "", 1, 0.5)], {"of": "A"}, "no blocks"),
        ([("A", "sim", 1, 1, 0.5), ("A", "real", 1, 1, 0.5)], {"of": "C"}, "no controller 'C'"),
        ([("A", "sim", 1, 1, 0.5), ("B", "real", 1, 1, 0.5)], {}, "on real only"),
        ([("A", "sim", 1, 1, 50), ("A", "real", 1, 1, 0.5)], {}, "expected 0 to 1"),
        ([("A", "sim", 1, 1, 0.5)], {}, "expected two"),
    ],
)
def test_a_table_without_such_units_is_refused(rows, settings, message):
    with pytest.raises(TableError, match=message):
        estimate_score(table("scores.csv", rows), **settings)


@pytest.mark.parametrize(
    "wrong", [{"sim": "sim"}, {"sim": "t.csv", "target": "jyro"}, {"sim": "t.csv", "minus": "A"}]
)
def test_a_simulator_needs_a_target_and_a_table_has_none(wrong):
    with pytest.raises(OrderError):
        EstimateOrder(**wrong)
