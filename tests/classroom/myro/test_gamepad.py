"""Gamepads: a pipe in the place of the kernel's device, with the kernel's events."""

import os
import struct

import pytest

from realitygap.classroom.myro import MyroError, _gamepad, getGamepad, getGamepadNow, initialize, motors
from realitygap.classroom.myro._robot import robot_or_none

INIT, AXIS, BUTTON = 0x80, 0x02, 0x01


def events(*rows):
    """The bytes of events: type, number, and value. Source: joystick-api.rst, struct js_event."""
    return b"".join(struct.pack("=IhBB", 0, value, kind, place) for kind, place, value in rows)


@pytest.fixture
def device(tmp_path, monkeypatch):
    """The writing end of a gamepad with four axes, of which two are a hat, and two buttons."""
    monkeypatch.setattr(_gamepad, "_FOLDER", tmp_path)
    answers = {_gamepad._GET_NAME: b"Fake pad\0", _gamepad._GET_AXES: bytes([0, 1, 0x10, 0x11])}
    monkeypatch.setattr(_gamepad, "_ask_device", lambda file, request, size: answers[request])
    path = tmp_path / "js0"
    os.mkfifo(path)
    keep = os.open(path, os.O_RDWR)
    starts = [(AXIS, place) for place in range(4)] + [(BUTTON, place) for place in range(2)]
    os.write(keep, events(*((INIT | kind, place, 0) for kind, place in starts)))
    yield lambda *rows: os.write(keep, events(*rows))
    for gamepad in list(_gamepad._opened.values()):
        gamepad.close()
    os.close(keep)


@pytest.fixture
def later(monkeypatch):
    """Do something when a function waits for the first time, after it has read the gamepad."""
    wait = _gamepad._let_time_pass
    due = []

    def act_and_wait(seconds):
        if due:
            due.pop()()
        wait(seconds)

    monkeypatch.setattr(_gamepad, "_let_time_pass", act_and_wait)
    yield due.append
    assert not due, "the function has not waited"


def test_now_returns_one_item_or_a_dictionary(device):
    device((AXIS, 0, 32767), (AXIS, 1, -32767), (AXIS, 3, -32767), (BUTTON, 1, 1))
    assert getGamepadNow() == {
        "init": True, "name": "Fake pad", "axis": [1.0, -1.0], "ball": [], "button": [0, 1], "hat": [(0, 1)],
    }  # fmt: skip
    assert getGamepadNow("robot") == [1.0, -1.0]
    assert getGamepadNow(0, "button") == [0, 1]
    assert getGamepadNow([0], "button") == [(0, [0, 1])]
    assert getGamepadNow("count") == getGamepad("count") == 1


def test_values_are_returned_once_for_each_change(device, later):
    assert getGamepadNow("button") == [0, 0]
    later(lambda: device((BUTTON, 0, 1)))
    assert getGamepad("button", wait=0.01) == [1, 0]
    later(lambda: device((AXIS, 0, 5), (BUTTON, 0, 0)))
    assert getGamepad("button", wait=0.01) == [0, 0]  # not the pressed button again, and not the axis


def test_any_counts_a_button_that_was_let_up(device, later):
    device((BUTTON, 1, 1))
    assert getGamepadNow("button") == [0, 1]
    later(lambda: device((BUTTON, 1, 0)))
    assert getGamepad("button", "any", wait=0.01) == [0, 1]


def test_a_simulated_robot_moves_on_while_a_person_does_nothing(device, later):
    initialize("sim", speed="off", start="center")
    motors(0.5, 0.5)
    before = robot_or_none().now()
    later(lambda: device((BUTTON, 0, 1)))
    getGamepad("button", wait=0.02)
    assert 0.02 <= robot_or_none().now() - before < 0.03  # it waits once, and a message takes a millisecond


def test_a_gamepad_that_is_not_there_or_that_is_gone_has_a_message(device, monkeypatch):
    with pytest.raises(MyroError, match=r"^There is no gamepad 3: there are 1\. Connect one"):
        getGamepadNow(3, "axis")
    with pytest.raises(MyroError, match=r"the item is 'buton', expected .* Did you mean 'button'\?$"):
        getGamepadNow("buton")
    getGamepadNow()

    def fail(*_):
        raise OSError(19, "No such device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "read", fail)
        with pytest.raises(MyroError, match=r"^The gamepad Fake pad is gone\. Connect it again\.$"):
            getGamepadNow()
    assert getGamepadNow("name") == "Fake pad"  # opened again
