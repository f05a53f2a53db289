"""A robot of each kind, emulated in this process, on which time passes only when something is done."""

import pytest

from realitygap.classroom import myro
from realitygap.classroom.myro import _robot

SETUPS = {
    "s1": ("s1", "none"),
    "s2": ("s2", "none"),
    "s1-fluke-1": ("s1", "1"),
    "s2-fluke-1": ("s2", "1"),
    "s2-fluke-2": ("s2", "2"),
}


def open_robot(model, fluke, more=""):
    """Open an emulated robot by `initialize`; gives Myro's object."""
    myro.initialize(f"emulator://{model}?fluke={fluke}&speed=off&seed=1{more}")
    return _robot.robot_or_none()


@pytest.fixture(autouse=True)
def no_robot_left():
    """Each test begins and ends without a robot."""
    yield
    robot = _robot.robot_or_none()
    if robot is not None:
        robot.close()
    assert _robot.robot_or_none() is None


@pytest.fixture(params=SETUPS, ids=list(SETUPS))
def setup(request):
    """Model and Fluke of each of the five set-ups."""
    return SETUPS[request.param]


@pytest.fixture
def robot(setup):
    """A robot of each set-up in the middle of the arena, as Myro's object."""
    opened = open_robot(*setup)
    opened.driver.port.witness.place((0.53, 0.3, 0.0), 1)
    return opened


@pytest.fixture
def full():
    """A Scribbler 2 with a Fluke 2, as Myro's object."""
    return open_robot("s2", "2")


@pytest.fixture
def witness():
    """Sees the robot that is open."""
    return lambda: _robot.robot_or_none().driver.port.witness
