"""Robots drawn from a calibration: one row of its draws for each trial, the same wherever the trial is computed."""

from __future__ import annotations

import pytest

from realitygap.errors import StudyError
from realitygap.platforms import SimPlatform, SimRobot
from realitygap.records import ResultsFolder
from realitygap.robots import Command
from realitygap.runs import Condition, replay
from realitygap.study import load_study, run_study
from realitygap.trials import NoiseKey
from realitygap.world import Calibration

pytestmark = pytest.mark.slow

ROWS = 7
TRACK = tuple(0.150 + 0.001 * k for k in range(ROWS))
GAIN = tuple(1.0 + 0.01 * k for k in range(ROWS))


@pytest.fixture
def calibration() -> Calibration:
    """Draws of two numbers that grow together."""
    return Calibration(
        kind="motion",
        robot="scribbler-s2-fluke2",
        target="told",
        label="SIM",
        observe="track",
        trials=0,
        date="2026-11-21",
        method="told",
        numbers={"drive.track": 0.153, "drive.gain_left": 1.03},
        draws={"drive.track": TRACK, "drive.gain_left": GAIN},
    )


def drawn_of(platform: SimPlatform, key: NoiseKey) -> tuple[float, float]:
    """Track and left gain of a trial."""
    drawn = SimRobot(platform, noise_key=key).drawn
    return drawn["drive.track"], drawn["drive.gain_left"]


def test_a_trial_draws_one_row_for_all_numbers(calibration):
    platform = SimPlatform(robot=calibration, randomize="posterior")
    rows = {drawn_of(platform, NoiseKey(3, individual=k)) for k in range(40)}
    assert rows <= set(zip(TRACK, GAIN, strict=True))
    assert (
        len(rows) == ROWS
    )  # chance alone misses one of seven in 40 trials in 1.5 % of keys; this key does not


def test_draws_can_hold_for_a_run_or_the_study(calibration):
    keys = [NoiseKey(3, replicate=run, individual=k) for run in range(12) for k in range(2)]

    def rows(per: str) -> list[tuple[float, float]]:
        platform = SimPlatform(robot=calibration, randomize="posterior", randomize_per=per)
        return [drawn_of(platform, key) for key in keys]

    assert len(set(rows("study"))) == 1
    by_run = rows("run")
    assert by_run[::2] == by_run[1::2]
    assert len(set(by_run)) > 1


def test_the_estimate_drives_without_randomize(calibration):
    platform = SimPlatform(robot=calibration)
    assert platform.model.drive.track == 0.153
    assert SimRobot(platform).drawn == {}
    assert "draws" not in platform.model_dump(mode="json")


def test_settings_replace_samples_of_the_posterior(calibration):
    platform = SimPlatform(robot=calibration, randomize="posterior", set={"drive.track": 0.2})
    assert set(SimRobot(platform).drawn) == {"drive.gain_left"}
    assert platform.model.drive.track == 0.2


def test_a_robot_of_no_calibration_cannot_be_drawn():
    with pytest.raises(ValueError, match="comes from no calibration with draws"):
        SimRobot(SimPlatform(randomize="posterior"))
    with pytest.raises(ValueError, match="expected 'no' or 'posterior'"):
        SimPlatform(randomize="prior")


def test_conditions_without_it_keep_the_hash_that_they_had():
    condition = Condition(name="a", platform="sim")
    assert not {"randomize", "randomize_per", "draws"} & set(condition.settings()["sim"])


STUDY = """
[study]
name = "drawn"
replicates = 3

[neat]
population = 4
generations = 2

[platform.sim]
steps = 40
randomize = "posterior"

[[condition]]
name = "drawn"
platform = "sim:fit.toml"
"""


def test_records_of_a_study_have_what_was_drawn_and_need_no_file(calibration, tmp_path):
    (tmp_path / "fit.toml").write_text(calibration.to_toml())
    (tmp_path / "study.toml").write_text(STUDY)
    run_study(load_study(tmp_path / "study.toml"), tmp_path / "results")
    (tmp_path / "fit.toml").unlink()
    folder = ResultsFolder.open(tmp_path / "results")
    about = folder.description["conditions"][0]
    place = [about["drawn"].index(name) for name in ("drive.track", "drive.gain_left")]
    allowed = set(zip(TRACK, GAIN, strict=True))
    seen = set()
    for row in folder.read("drawn").iter_rows(named=True):
        replay(about, row)
        seen.add(tuple(row["drawn"][k] for k in place))
    assert seen <= allowed
    assert len(seen) > 2


def test_a_robot_that_is_stepped_drives_the_trial_of_a_population(calibration):
    platform = SimPlatform(robot=calibration, randomize="posterior", steps=30)
    commands = [Command(1.0, 0.1 * (k % 5)) for k in range(30)]
    poses = []
    for _ in range(2):
        with SimRobot(platform, noise_key=NoiseKey(5, individual=2)) as robot:
            for command in commands:
                robot.drive(command)
            poses.append(robot.pose)
    assert poses[0] == poses[1]
    with SimRobot(SimPlatform(robot=calibration, steps=30), noise_key=NoiseKey(5, individual=2)) as robot:
        for command in commands:
            robot.drive(command)
        assert robot.pose != poses[0]


def test_randomize_can_be_said_of_a_study(calibration, tmp_path):
    (tmp_path / "fit.toml").write_text(calibration.to_toml())
    file = tmp_path / "study.toml"
    file.write_text(STUDY.replace('randomize = "posterior"\n', ""))
    plain, drawn = (load_study(file, randomize=how).conditions[0] for how in (None, "posterior"))
    assert plain.on.randomize == "no"
    assert drawn.on.randomize == "posterior"
    assert set(drawn.drawn_names) == {"drive.track", "drive.gain_left"}
    assert drawn.hash() != plain.hash()
    with pytest.raises(StudyError, match="no condition of this study has one"):
        load_study("paper", randomize="posterior")
    with pytest.raises(StudyError, match="expected no or posterior"):
        load_study(file, randomize="prior")
