"""On a robot: pytest tests/families/scribbler --port /dev/rfcomm0. It drives some centimeters; put it on the floor."""

from __future__ import annotations

import time

from realitygap.families.scribbler import Scribbler
from realitygap.robots import Command, RecordedRobot
from realitygap.testing import check_robot


def test_the_robot_keeps_the_contract_and_its_recording_too(port, tmp_path):
    check_robot(Scribbler(port, record=tmp_path / "session.jsonl", watchdog_s=2.0))
    check_robot(RecordedRobot(tmp_path / "session.jsonl"))


def test_names_and_lights_and_sound_are_as_they_were_set(port):
    with Scribbler(port) as robot:
        name = robot.name
        robot.set_name("realitygap")
        assert robot.name == "realitygap"
        robot.set_name(name)
        for which in ("left", "center", "right"):
            robot.set_led(which, 1)
        robot.beep(0.2, 880)
        robot.set_led("all", 0)
        assert robot.faults.recoveries == 0


def test_a_loop_takes_as_long_as_it_should(port):
    with Scribbler(port, step_s=0.1) as robot:
        since = robot.clock.now()
        for _ in range(10):
            robot.observe()
            robot.drive(Command(0.0, 0.0))
        assert 1.0 <= robot.clock.now() - since < 10.0


def test_a_silent_program_is_stopped(port):
    with Scribbler(port, watchdog_s=0.5, step_s=0.1) as robot:
        robot.drive(Command(0.0, 0.3))
        robot.clock.sleep(1.0)
        time.sleep(0.2)
        assert robot.link.motors_off
        assert robot.faults.watchdog_stops == 1


def test_a_fluke_shows_a_picture_and_keeps_which_end_is_ahead(port):
    with Scribbler(port) as robot:
        if robot.info.fluke == "none":
            return
        before = robot.forwardness
        for ahead in ("scribbler", "fluke", before):
            robot.set_forwardness(ahead)
            assert robot.forwardness == ahead
        assert 4 < robot.battery() < 12
        picture = robot.picture()
        assert picture.shape == (robot.picture_size.height, robot.picture_size.width, 3)
        assert picture.std() > 0
