"""The driver of the Thymio against Aseba's playground."""

import itertools
import math
import os
import random
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace

import pytest

from realitygap.errors import RecordError, RobotError, RobotStopped
from realitygap.families.thymio import Playground, Thymio
from realitygap.families.thymio._program import TICK_S
from realitygap.families.thymio.playground._playground import why_not
from realitygap.records import EndReason
from realitygap.robots import Command, RecordedRobot, read_recording
from realitygap.testing import check_robot
from realitygap.trials import run_trial
from realitygap.world import Pose, paper_arena

from .conftest import ROW, SPEED

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(why_not(SPEED)), reason=why_not(SPEED) or "-")]


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


def test_commands_move_the_robot_as_far_as_they_say():
    """At the speed of real time, because a delay of this program counts eight times at `SPEED`."""
    with (
        Playground(replace(paper_arena(), start=Pose(0.2, ROW, 0.0))) as playground,
        Thymio(playground.port, step_s=2.0) as robot,
    ):
        robot.drive(Command(1.0, 0.0))
        robot.stop()
        ahead = playground.pose()
        assert ahead.x - 0.2 == pytest.approx(0.199, rel=0.1)
        robot.step_s = 1.0
        robot.drive(Command(0.0, 0.5))
        robot.stop()
        assert playground.pose().heading - ahead.heading == pytest.approx(1.053, rel=0.15)
        assert robot.sensors()["motor.left.target"] == (0,)
        stands = playground.pose()
        time.sleep(0.2)
        assert playground.pose() == stands


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
        assert trial.end == EndReason.ABORTED
        assert len(trial.commands) < 20
        with pytest.raises(RobotStopped, match="center button"):
            robot.drive(Command(0.5, 0.0))
        playground.press(2, False)
        robot.reset()
        robot.drive(Command(0.5, 0.0))


DRIVER = """
import sys, time
from realitygap.robots import Command, RecordedRobot, read_recording
from realitygap.families.thymio import Thymio
from realitygap.families.thymio._program import TICK_S
with Thymio(sys.argv[1], step_s=0.1) as robot:
    print("driving", robot.link._guardian.process_id, flush=True)
    if sys.argv[2] == "long life":
        robot.link.expect_motion()
        robot.link.emit(0, (100, 300, 30_000))  # the program on board would stop it after ten minutes
        time.sleep(60)
    while True:
        robot.drive(Command(0.3, 1.0))
"""


def stays_put(playground):
    """Whether the robot stands for a while in which a playground that is held up would have moved it."""
    stands = playground.pose()
    for _ in range(20):
        time.sleep(0.02)
        if playground.pose() != stands:
            return False
    return True


@pytest.mark.parametrize(
    ("number", "life"),
    [
        (signal.SIGSTOP, "short life"),  # by the program on board
        (signal.SIGTERM, "short life"),  # by the driver
        (signal.SIGKILL, "long life"),  # by the guardian
    ],
)
def test_the_robot_stands_when_its_program_is_ended(playground, number, life):
    with subprocess.Popen(
        [sys.executable, "-c", DRIVER, playground.port, life], stdout=subprocess.PIPE, text=True
    ) as driver:
        try:
            stands = playground.pose()
            word, guardian = driver.stdout.readline().split()
            assert word == "driving"
            until = time.monotonic() + 30
            while playground.pose() == stands:
                assert time.monotonic() < until, "it does not drive"
                time.sleep(0.01)
            os.kill(driver.pid, number)
            if number == signal.SIGSTOP:
                os.kill(int(guardian), signal.SIGKILL)  # it would stop the robot after a second
            until = time.monotonic() + 10
            while not stays_put(playground):
                assert time.monotonic() < until, "it drives on"
        finally:
            driver.kill()


def test_resets_put_the_robot_where_they_say(playground):
    numbers = random.Random(2)
    with Thymio(playground.port) as robot:
        for _ in range(20):
            robot.drive(Command(0.0, 1.0))
            robot.stop()
            pose = Pose(
                numbers.uniform(0.2, 0.8), numbers.uniform(0.2, 0.4), numbers.uniform(-math.pi, math.pi)
            )
            playground.place(pose)
            assert playground.pose() == pytest.approx(pose, abs=1e-6)
            assert playground.path().shape == (1, 4)


@pytest.fixture
def driving(playground):
    """The playground with a robot that drives for 60 s of its time."""
    with Thymio(playground.port) as robot:
        stands = playground.pose()
        robot.link.emit(0, (300, 300, 3000))
        until = time.monotonic() + 5.0
        while playground.pose() == stands and time.monotonic() < until:
            time.sleep(0.01)
        assert playground.pose() != stands
        yield playground


def test_a_driving_robot_cannot_be_placed(driving):
    with pytest.raises(RobotError, match="it is driving"):
        driving.place(Pose(0.5, ROW, 0.0))


def test_a_playground_that_answers_late_cannot_place_a_driving_robot(driving, monkeypatch):
    """On a busy machine its program answers one question before it makes the steps that are due."""
    pose, wanted = driving.pose, Pose(0.5, ROW, 0.0)
    answers = itertools.cycle([lambda: wanted, pose, pose])
    own_thread = threading.current_thread()  # another one follows the robot
    monkeypatch.setattr(
        driving, "pose", lambda: next(answers)() if threading.current_thread() is own_thread else pose()
    )
    with pytest.raises(RobotError, match="it is driving"):
        driving.place(wanted)


def test_second_program_is_refused_and_the_first_drives_on():
    # in a playground of its own, which may crash when it finds the second connection closed
    with Playground(speed=SPEED) as own, Thymio(own.port) as robot:
        robot.drive(Command(0.0, 0.5))
        with pytest.raises(RobotError, match="does no other program use it"):
            Thymio(own.port)
        turned = own.pose()
        for _ in range(20):  # the playground may stand still while it sees to the second connection
            robot.drive(Command(0.0, 0.5))
            robot.observe()
            if own.pose() != turned:
                break
        assert own.pose() != turned


def test_speeds_are_0_when_the_robot_stands(playground):
    with Thymio(playground.port) as robot:
        robot.drive(Command(0.0, 0.5))
    until = time.monotonic() + 10
    while playground.motors() != (0.0, 0.0):
        assert time.monotonic() < until, playground.motors()
        time.sleep(0.02)


def test_the_clock_is_that_of_the_simulated_robot(playground):
    with Thymio(playground.port) as robot:

        def board_s() -> float:
            robot.sensors()
            return (robot._own["clock"] & 0xFFFF) * TICK_S

        began, board = robot.clock.now(), board_s()
        robot.clock.sleep(4.0)
        assert robot.clock.now() - began >= 4.0
        # by the clock of this computer, 4 s would be 32 s on board
        assert 1.0 < (board_s() - board) % (0x10000 * TICK_S) < 4.0 * SPEED / 2


def test_a_recording_is_played_back_as_it_was(playground, tmp_path):
    file = tmp_path / "session.jsonl"
    with Thymio(playground.port, record=file) as robot:
        robot.reset()
        seen = [robot.observe()]
        robot.drive(Command(0.5, -0.25))
        seen.append(robot.observe())
        robot.stop()
    recording = read_recording(file)
    assert recording.header["robot"]["name"] == "thymio-II"
    assert {line["name"] for line in recording.lines if line["kind"] == "wire"} == {"send", "receive"}
    with RecordedRobot(recording) as again:
        again.reset()
        assert again.observe() == seen[0]
        again.drive(Command(0.5, -0.25))
        assert again.observe().raw == seen[1].raw
    with pytest.raises(RecordError, match="exists already"):
        Thymio(playground.port, record=file)


def test_a_playground_that_ends_is_a_lost_link():
    with Playground(speed=SPEED) as own:
        robot = Thymio(own.port)
        os.kill(own.process_id, signal.SIGKILL)
        with pytest.raises(RobotError, match=r"lost|does not answer"):
            robot.clock.sleep(100.0)
        with pytest.raises(RobotError, match=r"lost|does not answer"):
            robot.observe()
        with pytest.raises(RobotError, match=r"lost|does not answer"):
            robot.close()
        assert not robot.link.is_open
        with pytest.raises(RobotError, match="was ended by the signal SIGKILL"):
            own.pose()


def test_a_playground_ends_with_the_program_that_started_it():
    program = (
        "import time\nfrom realitygap.families.thymio import Playground\n"
        "p = Playground(); print(p.process_id, flush=1); time.sleep(9)"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as starter:
        number = int(starter.stdout.readline())
        os.kill(number, 0)
        starter.kill()
    until = time.monotonic() + 10
    while time.monotonic() < until:
        try:
            os.kill(number, 0)
        except ProcessLookupError:
            return
        time.sleep(0.02)
    raise AssertionError("the playground still runs")
