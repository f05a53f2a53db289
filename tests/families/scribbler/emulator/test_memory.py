"""What a robot keeps while it is switched off."""

import pytest

from realitygap.errors import RobotError
from realitygap.families.scribbler.emulator import Emulator

from .wire import ask, packet, say


def test_name_password_data_forwardness_echo_mode_and_quiet_persist(tmp_path):
    file = tmp_path / "robot.json"
    robot = Emulator("s2", "2", state=file, timing=False)
    ask(robot, 110, *b"Rosie   ")
    ask(robot, 55, *b"secret  ")
    ask(robot, 97, 1, 2, 3, 4, 5, 6, 7, 8)
    ask(robot, 112)
    ask(robot, 160, 42)
    ask(robot, 98, 1)
    say(robot, bytes((128, 0)))
    say(robot, bytes((121, 0, 5, 0, 6, 77)))
    again = Emulator("s2", "2", state=file, timing=False)
    assert ask(again, 78) == b"Rosie   \x4e"
    assert ask(again, 50) == b"secret  \x32"
    assert ask(again, 81) == bytes((1, 2, 3, 4, 5, 6, 7, 8, 81))
    assert (again.memory.quiet, again.memory.volume) == (255, 42)
    assert say(again, packet(109, 150, 30))[:9] == packet(109, 150, 30), "Scribbler ahead"
    assert say(again, bytes((90, 0, 5, 0, 6))) == b"\x4d"


def test_without_a_file_a_robot_is_new_each_time(tmp_path):
    robot = Emulator("s2", "none", timing=False)
    ask(robot, 110, *b"Rosie   ")
    assert ask(Emulator("s2", "none", timing=False), 78) == b"Scribby "


def test_a_reset_keeps_what_is_in_memory():
    robot = Emulator("s1", "none", timing=False)
    ask(robot, 110, *b"Rosie   ")
    say(robot, packet(33), 2.0)
    assert ask(robot, 78) == b"Rosie   "


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"name": "00"}', "\x00\xff"])
def test_a_file_that_is_no_memory_gets_one_clear_message(tmp_path, text):
    file = tmp_path / "robot.json"
    file.write_text(text, encoding="latin-1")
    with pytest.raises(RobotError, match="is not the memory of an emulated robot"):
        Emulator(state=file)


def test_a_file_that_cannot_be_written_is_said_so(tmp_path):
    with pytest.raises(RobotError, match="cannot be kept"):
        Emulator(state=tmp_path / "missing" / "robot.json")
    with pytest.raises(RobotError, match=r"cannot be read \(Is a directory\)"):
        Emulator(state=tmp_path)


def test_a_robot_lives_on_when_its_file_cannot_be_written_any_more(tmp_path):
    folder = tmp_path / "robots"
    folder.mkdir()
    robot = Emulator("s2", "none", state=folder / "robot.json", timing=False)
    (folder / "robot.json").unlink()
    folder.rmdir()
    with pytest.warns(UserWarning, match="cannot be kept"):
        assert len(ask(robot, 110, *b"Rosie   ")) == 11
    assert ask(robot, 78) == b"Rosie   "


def test_unknown_models_get_one_clear_message():
    with pytest.raises(RobotError, match="s1 or s2"):
        Emulator("s4")
    with pytest.raises(RobotError, match="none, 1, 2"):
        Emulator("s2", "3")


@pytest.mark.parametrize("fluke", ["none", "1", "2"])
def test_a_robot_that_calls_out_its_name_is_switched_on_behind_any_fluke(tmp_path, fluke):
    file = tmp_path / "robot.json"
    ask(Emulator("s1", fluke, state=file, timing=False), 98, 1)
    again = Emulator("s1", fluke, state=file, timing=False)
    again.advance(1.5)
    called = b"IPREScribby  \0" * 2
    assert again.transmit() == (called if fluke == "none" else b""), "a Fluke does not relay before a packet"
