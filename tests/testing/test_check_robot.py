"""`check_robot` passes every robot of ours, and says of a broken one what is broken."""

from __future__ import annotations

import pytest

from realitygap.errors import RobotError
from realitygap.families.scribbler import Scribbler
from realitygap.platforms import JyroRobot, SimRobot
from realitygap.robots import Command, Observation
from realitygap.testing import RobotContractError, check_robot
from realitygap.world import load_arena

from ..families.scribbler.peers import FakeScribbler
from ..robots.ports import WiredPort


@pytest.mark.parametrize("setup", ["s1", "s2", "s1+fluke1", "s2+fluke1", "s2+fluke2"])
def test_a_scribbler_keeps_the_contract(setup):
    port = WiredPort(FakeScribbler(setup))
    check_robot(Scribbler(port, watchdog_s=1.0))
    assert not port.is_open
    assert port.robot.motors == (100, 100)


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_the_simulated_robot_keeps_the_contract(noise):
    check_robot(JyroRobot(noise=noise), noise=noise)


class Broken(JyroRobot):
    """A robot that keeps the contract, until something of it is changed."""


BROKEN = [
    ("label", "TOY", "label is 'TOY', expected one of SIM, TWIN, EMULATED, REAL"),
    ("step_s", -1.0, "step_s is -1.0, expected seconds"),
    ("n_sensors", 2, "raw after reset has 3 numbers, and n_sensors is 2"),
    ("observe", lambda self: (0.0, 0.0, 0.0), "gave a tuple; return an Observation"),
    (
        "observe",
        lambda self: Observation((0.0, 2.0, 0.0), False, (0.0, 0.0, 0.0)),
        r"readings after reset has \[2.0\], expected 0 to 1; scale and limit them",
    ),
    ("channels", ("light.0",), "It has `channels` and no `select`"),
    ("drive", lambda self, command: None, r"drive\(Command\(move=1.01, turn=0.0\)\) moved the robot; call"),
    ("__enter__", lambda self: None, "__enter__ returns something else; return self"),
    ("__exit__", lambda self, *_: True, "__exit__ suppresses exceptions; return None"),
    ("close", lambda self: None, r"observe\(\) works after close\(\); raise RobotError"),
    (
        "stop",
        lambda self: 1 / 0,
        "It raised ZeroDivisionError .* raise RobotError if the robot fails",
    ),
]


@pytest.mark.parametrize(("name", "value", "message"), BROKEN)
def test_a_broken_robot_is_told_what_to_repair(name, value, message):
    robot = JyroRobot()
    robot.__class__ = type("Broken", (JyroRobot,), {name: value} if callable(value) else {})
    if not callable(value):
        setattr(robot, name, value)
    with pytest.raises(
        RobotContractError, match=f"Broken does not keep the contract of a robot:\n(.*\n)*.*{message}"
    ):
        check_robot(robot)


def test_a_robot_that_reads_what_was_not_selected_is_told():
    robot = SimRobot()
    seen = Observation((0.0,) * 3, False, (0.0,) * 3, {"light.0": 2.0})
    robot.observe = lambda: seen
    with pytest.raises(
        RobotContractError, match=r"channels after reset is \{'light.0': 2.0\}, expected a number"
    ):
        check_robot(robot)


def test_the_robot_of_sim_keeps_the_contract_with_all_its_sensors():
    check_robot(SimRobot(arena=load_arena("goal")))


def test_a_thing_without_methods_is_told_which():
    with pytest.raises(RobotContractError, match=r"It has no label, step_s, .*see realitygap.robots.Robot"):
        check_robot(object())  # type: ignore[arg-type]


def test_a_step_that_is_too_short_is_noticed():
    port = WiredPort(FakeScribbler("s2"))
    robot = Scribbler(port, step_s=0.0)
    robot.step_s = 0.5
    sleep = port.clock.sleep
    port.clock.sleep = lambda seconds: sleep(seconds / 2)  # type: ignore[method-assign]
    with pytest.raises(RobotContractError, match=r"took 0.250 s, and step_s is 0.5 s; wait for the rest"):
        check_robot(robot)


def test_an_error_of_the_robot_itself_comes_through():
    port = WiredPort(FakeScribbler("s2"))
    robot = Scribbler(port)
    port.gone = True
    with pytest.raises(RobotError, match="hung up"):
        check_robot(robot)


def test_driving_with_a_command_of_the_wrong_length_is_a_value_error():
    with JyroRobot() as robot, pytest.raises(ValueError, match="zip"):
        robot.drive((0.0,))  # type: ignore[arg-type]
    assert Command(0.0, 0.0) == (0.0, 0.0)
