"""The platforms, robots, and controllers that forms offer."""

from __future__ import annotations

from pathlib import Path

import pytest

from realitygap.lab._calibration import calibration_mistakes
from realitygap.lab._choices import controller_choices, model_choices, platform_choices, port_choices
from realitygap.lab._gap import gap_mistakes
from realitygap.robots import PortGuess
from realitygap.robots.twin import sample_twin
from realitygap.runs import Condition
from realitygap.world import load_robot

PORT = PortGuess("scribbler:/dev/rfcomm7", "a Scribbler", "")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "worn.toml").write_text(sample_twin("worn", 1).to_toml())
    (tmp_path / "mine.toml").write_text('base = "scribbler-s2-fluke2"\n')
    (tmp_path / "study.toml").write_text('[study]\nname = "a-study"\n')
    (tmp_path / "elsewhere.toml").symlink_to(tmp_path / "worn.toml")
    return tmp_path


def offered(choices) -> list[str]:
    return [text for group in choices.values() for text in group]


def test_files_of_the_folder_are_offered_by_what_they_are(folder):
    choices = platform_choices(folder, "target")
    assert choices["Twins in this folder"] == {"twin:worn.toml": "twin worn"}
    assert choices["Robot files in this folder"] == {"sim:mine.toml": "sim with mine"}
    assert "twin:worn.toml" not in offered(platform_choices(folder, "simulator"))
    assert not any("study" in text or "elsewhere" in text for text in offered(choices))


def test_a_form_takes_everything_that_it_offers(folder, monkeypatch):
    monkeypatch.chdir(folder)  # processes of the lab read files there
    for spec in offered(platform_choices(folder, "simulator")):
        assert not gap_mistakes(folder, {"sim": spec}).problems, spec
    for spec in offered(platform_choices(folder, "target")):
        assert not gap_mistakes(folder, {"target": spec}).problems, spec
    for spec in offered(platform_choices(folder, "robot", [PORT])):
        assert not calibration_mistakes(folder, {"robot": spec}).problems, spec
    for spec in offered(platform_choices(folder, "study")):
        if spec != "sim:pioneer":  # larger than the arena of a condition without settings
            Condition(name="any", platform=spec)
    for robot in offered(model_choices(folder)):
        load_robot(robot)


def test_robots_at_ports_are_offered_where_a_person_can_place_them(folder):
    assert PORT.port in offered(platform_choices(folder, "robot", [PORT]))
    assert "scribbler" not in offered(platform_choices(folder, "target"))
    assert list(offered(port_choices([PORT]))) == [PORT.port]


def test_controllers_are_random_or_champions(folder):
    choices = offered(controller_choices(["of-mine"]))
    assert choices[:2] == ["random", "of-mine"]
    assert "paper" in choices
