"""A calibration's file, and the robot that it makes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realitygap.errors import DescriptionError
from realitygap.platforms import SimPlatform
from realitygap.world import Calibration, Distribution, Fitted, load_calibration, load_robot, read_calibration


def made(**values) -> Calibration:
    """A calibration of the track, from two draws, with other values where given."""
    track = Fitted(
        name="drive.track",
        estimate=0.15,
        low=0.14,
        high=0.16,
        prior_low=0.1,
        prior_high=0.2,
        identified=True,
        unit="m",
    )
    plain = {
        "kind": "motion",
        "robot": "scribbler-s2-fluke2",
        "target": "twin:worn.toml",
        "label": "TWIN",
        "observe": "track",
        "trials": 3,
        "date": "2026-11-21T15:00:00+00:00",
        "method": "told",
        "fitted": (track,),
        "numbers": {"drive.track": 0.15, "drive.gain_left": 1.02},
        "draws": {"drive.track": (0.149, 0.151), "drive.gain_left": (1.0, 1.04)},
    }
    return Calibration(**(plain | values))


def written(folder: Path, calibration: Calibration) -> Path:
    """Its file."""
    file = folder / "fit.toml"
    file.write_text(calibration.to_toml(), encoding="utf-8")
    return file


def test_a_calibration_survives_the_trip_through_its_file(tmp_path):
    told = made(notes=('a "quote"\x7f\n', "ü"), evidence={"rows of": [1, 2.5, {"x": [True, "y"]}]})
    assert load_calibration(written(tmp_path, told)) == told


def test_numbers_of_a_calibration_are_the_short_ones_of_its_file(tmp_path):
    """A transfer that went on read its calibration from the file, and evolved other controllers than before."""
    third = 0.1 + 0.2 / 3
    told = made(
        fitted=(Fitted(**{**made().fitted[0].model_dump(), "estimate": third - 0.01}),),
        numbers={"drive.track": third},
        draws={"drive.track": (third, 1 / 3)},
        step_s=third,
        evidence={"held_out": {"errors": {"fitted": third}}},
    )
    assert '"drive.track" = 0.166666667' in told.to_toml()
    assert load_calibration(written(tmp_path, told)) == told


def test_the_robot_of_a_calibration_has_its_numbers_and_says_where_they_come_from(tmp_path):
    robot = load_robot(written(tmp_path, made()))
    base = load_robot("scribbler-s2-fluke2")
    assert (robot.drive.track, robot.drive.gain_left) == (0.15, 1.02)
    assert robot.drive.speed == base.drive.speed
    assert robot.name == "fit"
    assert robot.sources[-1] == "fit.toml: motion of twin:worn.toml, 2026-11-21T15:00:00+00:00"


def test_a_calibration_finds_the_robot_file_that_lies_beside_it(tmp_path):
    (tmp_path / "mine.toml").write_text('base = "scribbler-s2"\n[drive]\nspeed = 0.2\n')
    robot = load_robot(written(tmp_path, made(robot="mine.toml")))
    assert (robot.drive.speed, robot.drive.track) == (0.2, 0.15)


@pytest.mark.parametrize("read", [load_calibration, read_calibration])
def test_the_robot_file_is_found_from_elsewhere_too(read, tmp_path):
    """`gap --why` and `transfer` looked for it from where they ran, when trials had been spent."""
    (tmp_path / "mine.toml").write_text('base = "scribbler-s2"\n[drive]\nspeed = 0.2\n')
    (tmp_path / "fits").mkdir()
    calibration = read(written(tmp_path / "fits", made(robot="../mine.toml")))
    assert load_robot(calibration.robot).drive.speed == 0.2
    assert SimPlatform(robot=calibration).robot.drive.speed == 0.2


def test_read_calibration_returns_none_for_other_files(tmp_path):
    plain = tmp_path / "mine.toml"
    plain.write_text('base = "scribbler-s2"\n')
    assert read_calibration(plain) is None
    assert read_calibration("scribbler-s2") is None
    assert read_calibration(tmp_path / "none.toml") is None
    assert read_calibration(written(tmp_path, made())) == made()
    with pytest.raises(DescriptionError, match=r"mine.toml is not a calibration"):
        load_calibration(plain)
    with pytest.raises(DescriptionError, match=r"There is no calibration .*none.toml"):
        load_calibration(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"realitygap calibration 1"', '"realitygap calibration 9"', "format"),
        ('kind = "motion"', 'kind = "notion"', "kind: expected 'path'"),
        ("low = 0.14", "low = 0.24", "low is 0.24, expected at most high, 0.16"),
        ("[0.149, 0.151]", "[0.149]", "expected as many of each number, got 1 to 2"),
        ("trials = 3", "trials = -3", "trials: expected at least 0"),
        ('robot = "scribbler-s2-fluke2"', 'robot = "scribbler-s2-fluke3"', "Unknown robot"),
        ('"drive.track" = 0.15', '"drive.trick" = 0.15', "drive.trick: no number of this name"),
        ('"drive.track" = 0.15', '"drive.track" = -0.15', "drive.track: expected more than 0"),
        ("trials = 3", "trials = ", "not TOML"),
    ],
)
def test_mistakes_in_the_file_are_told_with_their_place(tmp_path, old, new, says):
    file = written(tmp_path, made())
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(DescriptionError, match=says):
        load_robot(file)


def test_numbers_drawn_together_stay_together():
    distributions = [
        Distribution(choice=(1.0, 2.0, 3.0), together="a"),
        Distribution(choice=(10.0, 20.0, 30.0)),
    ]
    units = np.array([0.1, 0.5, 0.9])
    assert (distributions[0].of(units) * 10).tolist() == distributions[1].of(units).tolist()


def test_a_robot_whose_commands_lasted_longer_has_steps_of_that_length(tmp_path):
    file = written(tmp_path, made(step_s=0.83))
    assert load_robot(file).step_s == 0.83
    assert SimPlatform(robot=load_calibration(file)).command_s == 0.83
    assert load_robot("scribbler-s2-fluke2").step_s == 0.5


def test_estimate_at_the_end_of_its_prior_is_not_identified():
    """Once an e-puck's decay of 10 mm passed for 30.06 mm, identified: the least that was thought possible."""
    decay = {"name": "range.0.decay", "prior_low": 0.03, "prior_high": 0.8, "identified": True, "unit": "m"}
    bound = Fitted(estimate=0.03006, low=0.030003, high=0.0302, **decay)
    assert not bound.identified
    assert "The estimate is at an end of its prior, 0.03 to 0.8 m" in bound.advice
    assert not Fitted(estimate=0.79, low=0.77, high=0.7999, **decay).identified
    assert Fitted(estimate=0.0305, low=0.0303, high=0.0307, **decay).identified
    assert Fitted(
        estimate=0.02, low=0.01, high=0.025, **decay
    ).identified  # a fit that its prior does not cut
    share = {"name": "range.0.drop_most", "prior_low": 0.0, "prior_high": 1.0, "identified": True}
    assert Fitted(estimate=0.99, low=0.96, high=0.9999, **share).identified  # nothing is beyond 1
    assert Fitted(estimate=0.001, low=0.0, high=0.01, **share).identified


@pytest.mark.parametrize(
    ("estimate", "low", "high", "shown"),
    [
        (74.0561, 72.3212, 75.0102, ("74.06", "72.3 to 75")),
        (2.016e-08, 2.08e-05, 0.000648, ("0", "2.1e-05 to 0.000648")),  # the digits differ between processors
        (-8.005e-05, -0.0128, 0.01, ("-0.0001", "-0.0128 to 0.01")),
        (0.2, 0.2, 0.2, ("0.2", "0.2 to 0.2")),
    ],
)
def test_digits_beyond_a_hundredth_of_the_interval_are_not_shown(estimate, low, high, shown):
    fitted = Fitted(
        name="drive.gain", estimate=estimate, low=low, high=high, prior_low=-1, prior_high=99, identified=True
    )
    assert fitted.shown == shown
