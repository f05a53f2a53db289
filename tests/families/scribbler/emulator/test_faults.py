"""What goes wrong on purpose."""

import pytest

from realitygap.errors import RobotError
from realitygap.families.scribbler.emulator import Emulator, Faults

from .wire import packet, say


def test_faults_are_read_as_on_the_command_line():
    faults = Faults.parse("drop=0.001, delay=0.05,hangup=60,sag=0.2")
    assert faults == Faults(drop=0.001, delay=0.05, hangup=60, sag=0.2)
    assert Faults.parse("") == Faults()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("drob=1", "Did you mean 'drop'"),
        ("drop=x", "expected a number"),
        ("drop=2", "expected 0 to 1"),
        ("sag=-1", "sag"),
    ],
)
def test_a_wrong_fault_gets_one_clear_message(text, says):
    with pytest.raises(RobotError, match=says):
        Faults.parse(text)


def conversation(seed, **faults):
    robot = Emulator("s2", "2", seed=seed, faults=Faults(**faults))
    return [say(robot, packet(65), 1.5) for _ in range(300)]


def test_dropped_bytes_are_as_many_as_asked_for_and_the_same_for_a_seed():
    # a byte lost on the way to the robot costs an answer; shares of bytes that came back alone are within 5 sigma
    first, again, other = (conversation(seed, drop=0.02) for seed in (1, 1, 2))
    assert first == again
    assert first != other
    assert any(len(answer) < 20 for answer in first)
    whole = sum(len(answer) == 20 for answer in first) / 300
    assert 0.4 < whole < 0.75  # 0.98 ** 29 = 0.56


def test_faults_add_and_flip_bytes_of_answers():
    assert any(len(answer) > 20 for answer in conversation(1, extra=0.01))
    flipped = conversation(1, flip=0.01)
    assert any(len(answer) == 20 and answer[:9] != packet(65) for answer in flipped)


def test_delays_are_at_most_as_long_as_asked_for():
    robot = Emulator("s2", "2", faults=Faults(delay=0.05))
    late = []
    for _ in range(100):
        robot.receive(packet(74))
        begun = robot.now
        got = b""
        while len(got) < 10:
            robot.advance(0.001)
            got += robot.transmit()
        late.append(robot.now - begun)
        robot.advance(1.0)
    assert max(late) <= 3 * 0.05 + 0.01  # there, echo and answer
    assert max(late) > 0.06
    assert min(late) < 0.06


def test_delayed_bytes_keep_their_order():
    robot = Emulator("s2", "none", faults=Faults(delay=0.3))
    robot.receive(packet(65))
    robot.receive(packet(74, 1, 2, 3))
    robot.advance(5.0)
    answer = robot.transmit()
    assert answer[:9] == packet(65)
    assert answer[20:29] == packet(74, 1, 2, 3)


def test_a_hang_up_takes_the_link_away_and_the_robot_drives_on():
    robot = Emulator("s2", "2", seed=4, faults=Faults(hangup=5.0))
    robot.place((0.5, 0.3, 0.0), 1)
    robot.receive(packet(109, 120, 80))
    away, steps = 0, 4000
    for _ in range(steps):
        robot.advance(0.05)
        away += not robot.is_connected
    assert robot.link.n_hang_ups > 10
    assert 0.15 < away / steps < 0.45  # two seconds in seven, on average
    assert robot.wheel_speeds() != (0.0, 0.0)
    while robot.is_connected:
        robot.advance(0.05)
    assert say(robot, packet(65), 0.05) == b""


def volts(robot):
    return int.from_bytes(say(robot, bytes((89,)), 0.3), "big") / 20.9813


def test_the_supply_sags_under_load():
    robot = Emulator("s2", "2", faults=Faults(sag=0.2))
    robot.place((0.5, 0.3, 0.0), 1)
    resting = volts(robot)
    say(robot, packet(109, 200, 0), 0.5)
    assert volts(robot) == pytest.approx(resting * 0.785, abs=0.1)
    say(robot, packet(108), 0.5)
    assert volts(robot) == pytest.approx(resting, abs=0.1)


def test_bluetooth_drops_out_when_it_sags_too_far_and_the_robot_does_what_it_was_told():
    robot = Emulator("s2", "2", faults=Faults(sag=0.5))
    robot.place((0.5, 0.3, 0.0), 1)
    assert len(say(robot, packet(65))) == 20
    say(robot, packet(109, 200, 0), 1.0)
    assert say(robot, packet(108), 0.1) == b""
    robot.advance(10.0)
    assert robot.wheel_speeds() != (0.0, 0.0)
    robot.place((0.5, 0.3, 0.0), 1)  # the operator lifts it and switches the motors off
    robot.advance(4.0)
    assert len(say(robot, packet(65))) == 20


def test_the_battery_drains_faster_with_motors():
    idle, busy = (Emulator("s2", "2") for _ in range(2))
    busy.place((0.5, 0.3, 0.0), 1)
    say(busy, packet(109, 200, 0), 600.0)
    say(busy, packet(108), 1.0)
    say(idle, packet(108), 601.0)
    assert volts(busy) < volts(idle) < 9.1
    idle.advance(24 * 3600.0)
    assert volts(idle) == pytest.approx(6.0, abs=0.05)
