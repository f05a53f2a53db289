"""The driver of the Thymio against Aseba's playground."""

import math
import os
import random
import signal
import subprocess
import sys
import time

import pytest

from realitygap.emulator import Playground, why_not
from realitygap.errors import RobotError, RobotStopped
from realitygap.robots import Command
from realitygap.robots.thymio import Thymio
from realitygap.testing import check_robot
from realitygap.trials import EndReason, run_trial
from realitygap.world import Pose

pytestmark = [pytest.mark.long, pytest.mark.skipif(bool(why_not()), reason=why_not() or "-")]
ROW = 0.3048


@pytest.fixture(scope="module")
def shared():
    with Playground() as started:
        yield started


@pytest.fixture
def playground(shared):
    shared.press(2, False)
    shared.place(Pose(0.2, ROW, 0.0))
    return shared


def test_the_robot_is_found_and_labeled_emulated(playground):
    with Thymio(playground.port) as robot:
        assert (robot.info.name, robot.info.node, robot.info.firmware) == ("thymio-II", 1, 11)
        assert robot.label == "EMULATED"
        with pytest.raises(RobotError, match="no reading of its battery"):
            robot.battery()


def test_a_wall_ahead_is_read_as_enki_computes_it(playground):
    playground.place(Pose(0.9473, ROW, 0.0))
    time.sleep(0.1)
    with Thymio(playground.port) as robot:
        assert robot.observe().raw == pytest.approx((2419, 3424, 3704, 3424, 2418, 0, 0), abs=15)


def test_commands_move_the_robot_as_far_as_they_say(playground):
    with Thymio(playground.port, step_s=2.0) as robot:
        robot.drive(Command(1.0, 0.0))
        robot.stop()
        ahead = playground.pose
        assert ahead.x - 0.2 == pytest.approx(0.199, rel=0.05)
        robot.step_s = 1.0
        robot.drive(Command(0.0, 0.5))
        robot.stop()
        assert playground.pose.heading - ahead.heading == pytest.approx(1.053, rel=0.08)
        assert robot.sensors()["motor.left.target"] == (0,)
        stands = playground.pose
        time.sleep(0.2)
        assert playground.pose == stands


def test_it_keeps_the_contract_of_a_robot(playground):
    check_robot(Thymio(playground.port))


def test_the_button_ends_a_trial_until_the_robot_is_armed_again(playground):
    with Thymio(playground.port) as robot:
        trial = run_trial(
            robot,
            lambda seen, step: Command(0.5, 0.0),
            20,
            look=lambda step: playground.press(2) if step == 3 else None,
        )
        assert trial.end is EndReason.ABORTED
        assert len(trial.steps) < 20
        with pytest.raises(RobotStopped, match="center button"):
            robot.drive(Command(0.5, 0.0))
        playground.press(2, False)
        robot.reset()
        robot.drive(Command(0.5, 0.0))


DRIVER = """
import sys
from realitygap.robots import Command
from realitygap.robots.thymio import Thymio
with Thymio(sys.argv[1], step_s=0.1) as robot:
    print("driving", flush=True)
    while True:
        robot.drive(Command(0.3, 1.0))
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM])
def test_the_robot_stands_when_its_program_is_ended(playground, number):
    with subprocess.Popen(
        [sys.executable, "-c", DRIVER, playground.port], stdout=subprocess.PIPE, text=True
    ) as driver:
        try:
            assert driver.stdout.readline() == "driving\n"
            time.sleep(0.5)
            before = playground.pose
            time.sleep(0.1)
            assert playground.pose != before
            os.kill(driver.pid, number)
            time.sleep(0.6)
            stands = playground.pose
            time.sleep(0.3)
            assert playground.pose == stands
        finally:
            driver.kill()


def test_resets_put_the_robot_where_they_say(playground):
    numbers = random.Random(2)
    with Thymio(playground.port) as robot:
        for _ in range(5):
            robot.drive(Command(0.0, 1.0))
            robot.stop()
            time.sleep(0.1)
            pose = Pose(
                numbers.uniform(0.2, 0.8), numbers.uniform(0.2, 0.4), numbers.uniform(-math.pi, math.pi)
            )
            playground.place(pose)
            time.sleep(0.06)
            assert playground.pose == pytest.approx(pose, abs=1e-5)


def test_a_playground_that_ends_is_a_lost_link():
    with Playground() as own, Thymio(own.port) as robot:
        os.kill(own.process_id, signal.SIGKILL)
        began = time.monotonic()
        with pytest.raises(RobotError, match=r"lost|does not answer"):
            robot.clock.sleep(10.0)
        assert time.monotonic() - began < 2.5
        robot.link.close()
