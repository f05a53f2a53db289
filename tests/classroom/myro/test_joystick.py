"""Myro's joystick: a panel that drives the robot in use."""

import IPython.display
import pytest

import realitygap.classroom.myro as myro
from realitygap.classroom.myro import MyroError, _gamepad, initialize
from realitygap.classroom.myro._robot import robot_or_none
from tests.classroom.test_panel import tell

NAMES = ["joyStick", "Joystick", "joystick", "gamepad"]


@pytest.fixture
def panels(monkeypatch):
    """The panels that are shown, as in a notebook, for a simulated robot."""
    shown = []
    monkeypatch.setattr(_gamepad, "notebook_shell", lambda: object())
    monkeypatch.setattr(IPython.display, "display", shown.append)
    initialize("sim", speed="off", start="center", view="off")
    yield shown
    robot_or_none().close()


@pytest.mark.parametrize("name", NAMES)
def test_it_drives_while_it_is_held_and_is_shown_where_it_is(panels, name):
    getattr(myro, name)()
    (panel,) = panels
    simulation = robot_or_none().simulation
    before, svg = simulation.pose(), panel.widget.svg
    for _ in range(3):
        tell(panel, "drive", ahead=1.0, turn=0.0)
    tell(panel, "release")
    assert simulation.pose().x > before.x + 0.02
    assert panel.widget.svg != svg
    assert simulation.witness.motors() == (0, 0)
    assert panel.widget.title == "Scribby"


def test_without_a_robot_or_a_notebook_the_message_says_what_to_do(monkeypatch):
    with pytest.raises(MyroError, match=r"^gamepad\(\) needs a robot"):
        myro.gamepad()
    initialize("sim", speed="off")
    with pytest.raises(
        MyroError, match=r"^joystick\(\) needs a notebook, such as JupyterLab\. Elsewhere, drive"
    ):
        myro.joystick()
    robot_or_none().close()
