"""What the lab opens: nothing outside its folder."""

from __future__ import annotations

import pytest

from realitygap.errors import StudyError
from realitygap.lab._files import LONGEST_TEXT, files_outside, refuse_outside, refuse_port
from realitygap.lab._form import written_form
from realitygap.lab._gap import free_name, gap_mistakes


@pytest.mark.parametrize(
    "port",
    [
        "/dev/rfcomm0",
        "/dev/pts/3",
        "COM3",
        "scribbler:/dev/ttyUSB0",
        "socket://127.0.0.1:7001",
        "emulator://s2?fluke=2&speed=off&arena=paper",
        "ros2:/",
        "ros2:/robot1?domain=3&interface=wlan0&robot=mine.toml",
        "ros2:emulator://ros2?robot=turtlebot4",
    ],
)
def test_devices_sockets_and_emulators_are_opened(tmp_path, port):
    refuse_port(tmp_path, port)


@pytest.mark.parametrize(
    "port",
    [
        "",
        "/dev",
        "/etc/passwd",
        "/dev/../etc/passwd",
        "study.toml",
        "spy:///dev/ttyS0?file=/etc/cron.d/a",
        "alt://COM3?class=Serial",
        "socket://host:1?logging=debug",
        "emulator://s2?state=/etc/passwd",
        "emulator://s2?arena=%2fetc%2fpasswd",
        "emulator://s2?twin=../../twin.toml",
        "/robot1?domain=3",
        "ros2:/robot1?robot=/etc/passwd",
        "ros2:/a/../b",
        "ros2:emulator://ros2?body=../mine.toml",
        "ros2:emulator://ros2?robot=%2fetc%2fpasswd",
        "\x00",
    ],
)
def test_no_other_port_is(tmp_path, port):
    with pytest.raises(StudyError):
        refuse_port(tmp_path, port)


@pytest.mark.parametrize("name", ["sim:/etc/passwd", "../other", "a\x00b", "sim:link.toml"])
def test_files_outside_are_refused(tmp_path, name):
    (tmp_path / "inside").mkdir()
    (tmp_path / "inside" / "link.toml").symlink_to("/etc/passwd")
    with pytest.raises(StudyError):
        refuse_outside(tmp_path / "inside", name)


@pytest.mark.parametrize("name", ["sim", "jyro", "sim:fit.toml", "twin:twins/worn.toml", "random", "paper"])
def test_names_and_files_inside_are_not(tmp_path, name):
    refuse_outside(tmp_path, name)


def test_all_files_outside_that_a_study_names_are_mistakes_with_their_places(tmp_path):
    text = """
[arena]
file = "/etc/passwd"
[task]
kind = "python:/tmp/evil.py:run"
[[condition]]
platform = "sim:inside.toml"
[[condition]]
platform = "sim:../../fit.toml"
[condition.sim]
robot = "/elsewhere/robot.toml"
"""
    mistakes, allowed = files_outside(tmp_path, text)
    places = [each.partition(": ")[0] for each in mistakes]
    assert places == ["arena.file", "task.kind", "condition[2].platform", "condition[2].sim.robot"]
    assert allowed["condition"][0]["platform"] == "sim:inside.toml"
    assert files_outside(tmp_path, str(written_form(allowed)))[0] == []


@pytest.mark.parametrize("text", ["not toml [", "a = 1\n" * LONGEST_TEXT, "a = " + "[" * 5000])
def test_text_that_is_no_study_file_is_refused(tmp_path, text):
    with pytest.raises(StudyError):
        files_outside(tmp_path, text)


def test_titles_and_notes_may_hold_anything(tmp_path):
    text = '[study]\ntitle = "/etc/passwd: a study"\nnote = "../.."'
    assert files_outside(tmp_path, text)[0] == []


def test_all_names_that_are_unknown_are_found_before_a_gap_starts(tmp_path):
    values = {
        "target": "twin:no.toml",
        "task": "dance",
        "arena": "moon",
        "controllers": "papr",
        "reevolved": "no",
    }
    problems = gap_mistakes(tmp_path, values).problems
    assert set(problems) == set(values)
    assert problems["task"].startswith("Unknown kind 'dance'.")
    (tmp_path / "no").mkdir()
    usual = {"task": "avoid", "arena": "avoid", "controllers": "paper", "reevolved": "no"}
    assert not gap_mistakes(tmp_path, usual).problems


def test_default_name_of_a_gap_is_free(tmp_path):
    assert free_name(tmp_path, "sim", "twin:robots/worn 1.toml") == "sim-worn-1"
    (tmp_path / "gaps").mkdir()
    (tmp_path / "gaps" / "sim-jyro.sqlite").touch()
    (tmp_path / "gaps" / "sim-jyro-2.html").touch()
    assert free_name(tmp_path, "sim", "jyro") == "sim-jyro-3"


@pytest.mark.parametrize(
    "file", ["twin:nowhere.toml", "recorded:nowhere.sqlite", "sim:nowhere.toml", "jyrro"]
)
def test_platforms_that_are_not_there_are_named_together_with_wrong_numbers(tmp_path, file):
    values = {"sim": "sim:fit.toml", "target": file, "n_controllers": 0}
    (tmp_path / "fit.toml").write_text('base = "khepera"\n')  # not in the current folder
    assert set(gap_mistakes(tmp_path, values).problems) == {"target", "n_controllers"}
    (tmp_path / "fit.toml").write_text("bass = 1\n")
    problem = gap_mistakes(tmp_path, values).problems["sim"]
    assert problem.startswith("sim:fit.toml: ")
    assert str(tmp_path) not in problem
