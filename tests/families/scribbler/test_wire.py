"""Exactly these bytes go over the wire, by the firmware's protocol, and these values come of the answers."""

from __future__ import annotations

import pytest

from realitygap.errors import RobotError
from realitygap.families.scribbler import Scribbler, SensorBlock
from realitygap.robots import Command, Robot

from .peers import INFOS, ScriptedPort, echoed, greeting


def opened(setup: str, *script: tuple[bytes, bytes]) -> tuple[Scribbler, ScriptedPort]:
    port = ScriptedPort([*greeting(INFOS[setup]), *script])
    return Scribbler(port), port


@pytest.mark.parametrize(
    ("setup", "model", "fluke", "versions", "n_sensors"),
    [
        ("s1", "s1", "none", ("2.6.2", ""), 2),
        ("s2", "s2", "none", ("1.1.5", ""), 2),
        ("s1+fluke1", "s1", "1", ("2.6.2", "2.9.1"), 3),
        ("s2+fluke1", "s2", "1", ("1.1.5", "2.9.1"), 3),
        ("s2+fluke2", "s2", "2", ("1.1.5", "3.0.5"), 3),
    ],
)
def test_each_set_up_is_told_apart_by_its_info_line(setup, model, fluke, versions, n_sensors):
    robot, port = opened(setup)
    port.check_all_said()
    assert (robot.info.model, robot.info.fluke) == (model, fluke)
    assert (robot.info.robot_version, robot.info.fluke_version) == versions
    assert robot.n_sensors == n_sensors
    assert isinstance(robot, Robot)
    assert port.clock.now() == 0.0  # nothing had to be waited for


def test_a_fluke_without_a_robot_is_known_and_asked_twice():
    port = ScriptedPort(greeting(INFOS["fluke1"]) * 2)
    robot = Scribbler(port)
    assert (robot.info.model, robot.info.fluke) == (None, "1")
    with pytest.raises(RobotError, match=r"'motors' needs a robot .* here is no robot, Fluke 1"):
        robot.motors(0, 0)
    robot.close()
    port.check_all_said()


FLUKE = [(bytes([85]), bytes([0, 0])), (bytes([86]), bytes([3, 82])), (bytes([87]), bytes([25, 0]))]
CALLS = [
    (
        "s2",
        lambda r: r.motors(0.13, -1),
        [echoed(109, 0, 112)],
        SensorBlock((1, 1), (100, 101, 102), (0, 1), False),
    ),
    (
        "s2",
        lambda r: r.motors(1, 0.5),
        [echoed(109, 150, 200)],
        SensorBlock((1, 1), (100, 101, 102), (0, 1), False),
    ),
    ("s1", lambda r: r.stop(), [echoed(108)], None),
    ("s1", lambda r: r.ir(), [echoed(73, answer=bytes([0, 1]))], (0, 1)),
    ("s1", lambda r: r.light(), [echoed(70, answer=bytes([1, 0, 2, 0, 255, 255]))], (256, 512, 65535)),
    ("s1", lambda r: r.line(), [echoed(76, answer=bytes([1, 0]))], (1, 0)),
    ("s1", lambda r: r.stall(), [echoed(79, answer=bytes([1]))], True),
    ("s2+fluke1", lambda r: r.obstacle(), FLUKE, (0, 850, 6400)),
    ("s2+fluke1", lambda r: round(r.battery(), 3), [(bytes([89]), bytes([0, 180]))], 8.579),
    ("s2", lambda r: r.distance(), [echoed(175, 0, answer=b"\x63"), echoed(175, 1, answer=b"\x07")], (99, 7)),
    ("s2", lambda r: r.mic_envelope(), [echoed(169, answer=bytes([0, 0, 1, 2]))], 258),
    ("s2", lambda r: r.ir_ex("right", 30), [echoed(172, 1, 0, 30, answer=b"\x01")], 1),
    ("s2", lambda r: r.line_ex("left"), [echoed(173, 0, 0, 0, answer=b"\x00")], 0),
    ("s1", lambda r: r.beep(0.03, 784), [echoed(113, 0, 30, 3, 16)], None),
    ("s1", lambda r: r.beep(1, 440, 880), [echoed(114, 3, 232, 1, 184, 3, 112)], None),
    ("s1", lambda r: r.set_loud(False), [echoed(112)], None),
    ("s1", lambda r: r.set_volume(1), [echoed(111)], None),
    ("s2", lambda r: r.set_s2_volume(50), [echoed(160, 50)], None),
    ("s1", lambda r: r.set_led("center", 1), [echoed(101)], None),
    ("s1", lambda r: r.set_led("all", 0), [echoed(106)], None),
    ("s1+fluke1", lambda r: r.set_led("front", 1), [(bytes([116]), b"")], None),
    ("s1+fluke1", lambda r: r.set_led("back", 0.5), [(bytes([126, 212]), b"")], None),
    ("s1", lambda r: r.name, [echoed(78, answer=b"Scribby "), echoed(64, answer=b"        ")], "Scribby"),
    (
        "s1",
        lambda r: r.set_name("Ada Lovelace"),
        [echoed(110, *b"Ada Love"), echoed(119, *b"lace    ")],
        None,
    ),
    ("s1", lambda r: r.password, [echoed(50, answer=b"YBBIRCs "), echoed(51, answer=b"        ")], "YBBIRCs"),
    ("s1", lambda r: r.set_password("x"), [echoed(55, *b"x       "), echoed(56, *b"        ")], None),
    ("s1", lambda r: r.data, [echoed(81, answer=bytes(range(8)))], tuple(range(8))),
    ("s1", lambda r: r.set_data([127] * 8), [echoed(97, *[127] * 8)], None),
    ("s1", lambda r: r.set_single_data(7, 9), [echoed(96, 7, 9)], None),
    ("s1+fluke1", lambda r: r.forwardness, [(bytes([90, 0, 0, 0, 0]), b"\xdf")], "scribbler"),
    ("s1+fluke1", lambda r: r.forwardness, [(bytes([90, 0, 0, 0, 0]), b"\xff")], "fluke"),
    (
        "s1+fluke1",
        lambda r: r.set_forwardness("fluke"),
        [(bytes([128, 1]), b""), (bytes([90, 0, 0, 0, 0]), b"\x01")],
        None,
    ),
    ("s1+fluke1", lambda r: r.set_ir_power(135), [(bytes([120, 135]), b"")], None),
    (
        "s2+fluke1",
        lambda r: r.observe(),
        [*FLUKE, echoed(79, answer=b"\x00")],
        ((0.0, 0.5, 1.0), False, (0.0, 850.0, 6400.0), {}),
    ),
    (
        "s2",
        lambda r: r.observe(),
        [echoed(175, 0, answer=b"\x63"), echoed(175, 1, answer=b"\x00"), echoed(79, answer=b"\x01")],
        ((0.0, 1.0), True, (99.0, 0.0), {}),
    ),
    ("s1", lambda r: r.observe(), [echoed(66, answer=bytes([0b01100]))], ((1.0, 0.0), True, (0.0, 1.0), {})),
    ("s1", lambda r: r.drive(Command(0.5, 0.25)), [echoed(109, 175, 125)], None),
    ("s1", lambda r: r.drive(Command(1.0, -0.5)), [echoed(109, 150, 200)], None),
]


@pytest.mark.parametrize(("setup", "call", "script", "value"), CALLS)
def test_a_call_sends_exactly_these_bytes_and_understands_the_answer(setup, call, script, value):
    robot, port = opened(setup, *script)
    assert call(robot) == value
    port.check_all_said()


def test_motors_that_a_fluke_turned_round_are_no_wrong_echo():
    turned = bytes([109, 200 - 120, 200 - 180]).ljust(9, b"\0")
    robot, port = opened("s2+fluke1", (bytes([109, 180, 120]).ljust(9, b"\0"), turned + echoed(0)[1][9:]))
    robot.motors(0.2, 0.8)
    port.check_all_said()
    assert robot.faults.recoveries == 0


def test_closing_stops_the_motors_and_then_says_nothing_more():
    robot, port = opened("s2", echoed(108))
    with robot:
        pass
    robot.close()
    robot.stop()
    port.check_all_said()
    assert not port.is_open
    with pytest.raises(RobotError, match=r"is closed\. Reopen the robot before 'sensors'"):
        robot.sensors()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: r.motors(1.5, 0), r"left is 1.5, expected -1 to 1"),
        (lambda r: r.motors(0, float("nan")), r"right is nan, expected -1 to 1"),
        (lambda r: r.drive(Command(0, 2)), r"turn is 2, expected a number from -1 to 1"),
        (lambda r: r.beep(9, 440), r"seconds is 9, expected 0 to 8.191"),
        (lambda r: r.set_name("x" * 17), r"name is .* expected at most 16 printable ASCII"),
        (lambda r: r.set_single_data(8, 0), r"position is 8, expected 0 to 7"),
        (lambda r: r.set_led("middle", 1), r"which is 'middle', expected one of left, center"),
    ],
)
def test_arguments_out_of_range_are_refused_and_nothing_is_sent(call, message):
    robot, port = opened("s2+fluke1")
    with pytest.raises(ValueError, match=message):
        call(robot)
    port.check_all_said()


@pytest.mark.parametrize(
    ("setup", "call", "who"),
    [
        ("s1", lambda r: r.distance(), "'distance' needs an S2 or S3; here is S1"),
        ("s2", lambda r: r.obstacle(), "'obstacle' needs a Fluke; here is S2"),
        ("s2", lambda r: r.set_ir_power(3), "'set_ir_power' needs a Fluke"),
    ],
)
def test_a_missing_part_is_reported_with_a_set_up_that_has_it(setup, call, who):
    robot, port = opened(setup)
    with pytest.raises(RobotError, match=who):
        call(robot)
    port.check_all_said()


S2_CALLS = [
    (lambda r: r.position, [echoed(165, answer=bytes([0, 0, 0, 9, 255, 255, 255, 254]))], (9, -2)),
    (lambda r: r.set_position(-1, 258), [echoed(166, 255, 255, 255, 255, 0, 0, 1, 2)], None),
    (lambda r: r.angle, [echoed(167, answer=bytes([255, 255, 255, 166]))], -90),
    (lambda r: r.set_angle(90), [echoed(168, 0, 0, 0, 90)], None),
    (lambda r: r.begin_path(7), [echoed(161, 1, 0, 7)], None),
    (lambda r: r.end_path(), [echoed(161, 0, 0, 0)], None),
    (lambda r: r.move_to(100, -1), [echoed(162, 3, 0, 100, 255, 255)], None),
    (lambda r: r.move_by(100, 0, "half-mm"), [echoed(162, 4, 0, 100)], None),
    (lambda r: r.turn_to(90), [echoed(164, 3, 0, 90)], None),
    (lambda r: r.turn_by(955, "units"), [echoed(164, 4, 3, 187)], None),
    (lambda r: r.arc_to(1, 2, 3), [echoed(163, 3, 0, 1, 0, 2, 0, 3)], None),
    (lambda r: r.arc_by(1, 2, -3), [echoed(163, 5, 0, 1, 0, 2, 255, 253)], None),
    (lambda r: r.encoders(), [echoed(171, 1, answer=bytes([0, 0, 1, 0, 255, 255, 255, 255]))], (256, -1)),
    (lambda r: r.encoders(zero=True), [echoed(171, 0, answer=bytes(8))], (0, 0)),
    (
        lambda r: r.motor_stats(),
        [echoed(170, answer=bytes([16, 240, 5, 0b1011, 1]))],
        (16, -16, 0.5, 2, True, True),
    ),
]


@pytest.mark.parametrize(("call", "script", "value"), S2_CALLS)
def test_a_call_of_an_s2_sends_exactly_these_bytes(call, script, value):
    robot, port = opened("s2", *script)
    assert call(robot) == value
    port.check_all_said()


FLUKE_CALLS = [
    ("s2+fluke2", lambda r: r.servo(2, 128), [(bytes([12, 2, 128]), b"")], None),
    ("s2+fluke2", lambda r: r.enable_pan(), [(bytes([13, 1, 35]), b"")], None),
    ("s2+fluke2", lambda r: r.error_log(), [(bytes([10]), b"\x00\x05hello")], "hello"),
    ("s2+fluke1", lambda r: r.send_ir_message(b"hi"), [(b"\x97\x02hi", b"")], None),
    ("s2+fluke1", lambda r: r.get_ir_message(), [(bytes([150]), b"\x00\x00")], b""),
    ("s2+fluke1", lambda r: r.set_ir_emitters(center=False), [(bytes([152, 5]), b"")], None),
    ("s2+fluke1", lambda r: r.set_white_balance(False), [(bytes([130]), b"")], None),
]


@pytest.mark.parametrize(("setup", "call", "script", "value"), FLUKE_CALLS)
def test_a_call_of_a_fluke_sends_exactly_these_bytes(setup, call, script, value):
    robot, port = opened(setup, *script)
    assert call(robot) == value
    port.check_all_said()


def test_the_robot_is_greeted_again_after_a_reset():
    script = [(bytes([124]), b"IPREScribby\0\0"), *greeting(INFOS["s2+fluke1"])]
    robot, port = opened("s2+fluke1", *script)
    robot.reset_robot()
    assert port.clock.now() == 3.0
    port.check_all_said()
    robot, port = opened("s2", (bytes([33]).ljust(9, b"\0"), bytes([33, 0, 0])), *greeting(INFOS["s2"]))
    robot.reset_robot()
    port.check_all_said()


def test_a_tone_whose_answer_a_fluke_2_swallows_is_a_tone_all_the_same():
    robot, port = opened("s2+fluke2", (echoed(113, 3, 232, 1, 184)[0], echoed(113, 3, 232, 1, 184)[0]))
    robot.beep(1, 440)
    port.check_all_said()
    assert robot.faults.recoveries == 0
