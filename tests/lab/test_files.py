"""What the lab opens: nothing outside its folder."""

from __future__ import annotations

import pytest

from realitygap.errors import StudyError
from realitygap.lab._files import LONGEST_TEXT, refuse_files_outside, refuse_outside, refuse_port


@pytest.mark.parametrize(
    "port",
    [
        "/dev/rfcomm0",
        "/dev/pts/3",
        "COM3",
        "scribbler:/dev/ttyUSB0",
        "socket://127.0.0.1:7001",
        "emulator://s2?fluke=2&speed=off&arena=paper",
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


@pytest.mark.parametrize(
    "text",
    [
        '[arena]\nfile = "/etc/passwd"',
        '[[condition]]\nplatform = "sim:../../fit.toml"',
        '[task]\nkind = "python:/tmp/evil.py:run"',
        '[[condition]]\n[condition.sim]\nrobot = "/elsewhere/robot.toml"',
        "not toml [",
        "a = 1\n" * LONGEST_TEXT,
        "a = " + "[" * 5000,
    ],
)
def test_study_files_that_name_others_are_refused(tmp_path, text):
    with pytest.raises(StudyError):
        refuse_files_outside(tmp_path, text)


def test_titles_and_notes_may_hold_anything(tmp_path):
    refuse_files_outside(tmp_path, '[study]\ntitle = "/etc/passwd: a study"\nnote = "../.."')
