"""Byte for byte what the protocol document says, for each set-up."""

import pytest

from realitygap.families.scribbler.opcodes import (
    FLUKE_2_COMMANDS,
    FLUKE_COMMANDS,
    ROBOT_ANSWERS,
    S2_ANSWERS,
    SENSOR_BLOCK,
    Op,
)

from .wire import SET_UPS, ask, long, make, packet, say, signed, word

INFO_REQUEST = b"P" + b" " * 8
S1_LINE = b"Robot-Version:2.6.2,Robot:Scribbler,Mode:Serial\n"
S2_LINE = b"Robot-Version:1.1.5,Robot:Scribbler2,Mode:Serial\n"
INFO = {
    ("s1", "none"): INFO_REQUEST + S1_LINE,
    ("s2", "none"): S2_LINE,
    ("s1", "1"): INFO_REQUEST + b"fluke:2.9.1," + S1_LINE,
    ("s2", "1"): b"fluke:2.9.1," + S2_LINE,
    ("s1", "2"): INFO_REQUEST + b"fluke:3.0.5," + S1_LINE,
    ("s2", "2"): b"fluke:3.0.5," + S2_LINE,
}
CHANGING = {Op.SOFT_RESET, Op.GET_INFO}


@pytest.fixture(params=[True, False], ids=["timing on", "timing off"])
def timing(request):
    return request.param


@pytest.mark.parametrize(("model", "fluke"), SET_UPS)
def test_info_line_is_that_of_the_set_up(model, fluke, timing):
    robot = make(model, fluke, timing=timing)
    for _ in range(2):  # as Myro asks
        assert say(robot, INFO_REQUEST) == INFO[model, fluke]


@pytest.mark.parametrize(("model", "fluke"), SET_UPS)
def test_every_command_of_the_robot_is_echoed_and_answered_in_full(model, fluke, timing):
    robot = make(model, fluke, timing=timing)
    say(robot, bytes((128, 0))) if fluke != "none" else None  # Scribbler ahead: the echo is what was sent
    answers = dict(ROBOT_ANSWERS) | (dict(S2_ANSWERS) if model == "s2" else {})
    for op, length in answers.items():
        if op not in CHANGING:
            assert len(ask(robot, op, seconds=2.0)) == length, op


@pytest.mark.parametrize("model", ["s1", "s2"])
def test_unknown_commands_are_echoed_and_not_answered(model):
    for op in sorted(set(range(256)) - set(ROBOT_ANSWERS) - set(S2_ANSWERS)):
        assert ask(make(model), op, 1, 2, 3, 4, 5, 6, 7, 8) == b"", op


def test_an_s1_does_not_know_the_commands_of_an_s2():
    for op in sorted(S2_ANSWERS):
        assert ask(make("s1"), op) == b"", op


def test_the_filler_is_echoed_as_it_came():
    sent = bytes((65, 9, 8, 7, 6, 5, 4, 3, 2))
    assert say(make("s2"), sent)[:9] == sent


@pytest.mark.parametrize("model", ["s1", "s2"])
def test_names_passwords_and_data_at_first(model):
    robot = make(model)
    assert ask(robot, Op.GET_NAME1) + ask(robot, Op.GET_NAME2) == b"Scribby         "
    password = {"s1": b"Scribby         ", "s2": b"YBBIRCs         "}[model]
    assert ask(robot, Op.GET_PASS1) + ask(robot, Op.GET_PASS2) == password
    assert ask(robot, Op.GET_DATA) == bytes((127, 127, 127, 127, 0, 0, 0, 0))


@pytest.mark.parametrize(
    ("set_ops", "get_ops"),
    [((Op.SET_NAME1, Op.SET_NAME2), (Op.GET_NAME1, Op.GET_NAME2)), ((55, 56), (50, 51)), ((97,), (81,))],
)
@pytest.mark.parametrize("model", ["s1", "s2"])
def test_stored_values_are_read_back(model, set_ops, get_ops):
    robot = make(model)
    for number, (put, get) in enumerate(zip(set_ops, get_ops, strict=True)):
        value = bytes(range(100 + 10 * number, 108 + 10 * number))
        assert len(ask(robot, put, *value)) == SENSOR_BLOCK
        assert ask(robot, get) == value


def test_single_data_is_not_bounded():
    robot = make("s2")
    ask(robot, 96, 5, 42)
    assert ask(robot, Op.GET_DATA)[5] == 42
    ask(robot, 96, 8, ord("X"))  # the password follows the data
    assert ask(robot, Op.GET_PASS1)[:2] == b"XB"
    assert len(ask(robot, 96, 255, 1)) == SENSOR_BLOCK


@pytest.mark.parametrize("model", ["s1", "s2"])
def test_echo_mode_adds_the_opcode_to_every_answer(model):
    robot = make(model)
    assert len(ask(robot, 98, 1)) == 12
    assert ask(robot, 65)[11:] == b"\x41"
    assert ask(robot, 74)[1:] == b"\x4a"
    name = ask(robot, Op.GET_NAME1)
    assert name == b"Scribby " + (b"S" if model == "s1" else b"\x4e")  # an S1's buffer holds the data by then
    assert len(ask(robot, 98, 0)) == 11
    assert len(ask(robot, 65)) == 11


def test_info_has_an_opcode_after_it_in_echo_mode():
    robot = make("s2")
    ask(robot, 98, 1)
    assert say(robot, INFO_REQUEST) == S2_LINE + b"P"


def test_the_sensor_block_is_the_single_readings():
    robot = make("s2", timing=False)
    block = ask(robot, 65)
    assert block[:2] == ask(robot, 73) == ask(robot, 71) + ask(robot, 72)
    assert block[8:10] == ask(robot, 76) == ask(robot, 74) + ask(robot, 75)
    assert block[10:] == ask(robot, 79)
    lights = [int.from_bytes(block[k : k + 2], "big") for k in (2, 4, 6)]
    assert lights == pytest.approx([32768] * 3, rel=0.02)
    assert [int.from_bytes(ask(robot, op), "big") for op in (67, 68, 69)] == pytest.approx(lights, rel=0.03)
    binary = ask(robot, 66)[0]
    assert binary == block[0] << 4 | block[1] << 3 | block[10] << 2 | block[8] << 1 | block[9]


def test_light_of_an_s1_is_at_most_5000():
    block = ask(make("s1"), 65)
    assert int.from_bytes(block[2:4], "big") == pytest.approx(2500, rel=0.02)


def test_leds_are_set_one_by_one_and_together():
    robot = make("s2", timing=False)

    def leds():
        left, _, right = robot.robot.leds(robot.now_ns)  # the center one blinks by itself
        return left, right

    for op, expected in [
        (99, (1, 0)),
        (103, (1, 1)),
        (100, (0, 1)),
        (104, (0, 0)),
        (105, (1, 1)),
        (106, (0, 0)),
    ]:
        ask(robot, op, seconds=0)
        assert leds() == expected, op
    ask(robot, 107, 1, 0, 3)
    assert leds() == (1, 1)


def test_state_has_the_pins_and_on_an_s2_the_light_spoils_them():
    robot = make("s1", timing=False)
    ask(robot, 107, 1, 0, 1, seconds=0)
    pins, out = ask(robot, 77, seconds=0)
    assert pins == 1 << 3 | 1 << 6
    assert out & 0b101 == 0b101
    second = make("s2", timing=False)
    bits = int.from_bytes(ask(second, 77, seconds=0), "little")
    assert bits & 0xFF != 1 << 3 | 1 << 6  # levels of 8 bits over what should be single ones


def test_the_center_led_toggles_after_every_command_and_once_a_second():
    robot = make("s2", timing=False)
    first = robot.robot.leds(robot.now_ns)[1]
    ask(robot, 65, seconds=0)
    assert robot.robot.leds(robot.now_ns)[1] != first
    robot.advance(1.5)
    assert robot.robot.leds(robot.now_ns)[1] == first


# behind a Fluke


@pytest.mark.parametrize("fluke", ["1", "2"])
def test_fluke_ahead_swaps_and_turns_the_wheels_of_the_motor_command_only(fluke):
    robot = make("s2", fluke)
    echo = say(robot, packet(109, 150, 30))[:9]
    assert echo == packet(109, 200 - 30, 200 - 150)
    assert say(robot, packet(65))[:9] == packet(65)
    say(robot, bytes((128, 0)))
    assert say(robot, packet(109, 150, 30))[:9] == packet(109, 150, 30)
    assert say(robot, bytes((90, 0, 0, 0, 0))) == b"\xdf"
    say(robot, bytes((128, 1)))
    assert say(robot, packet(109, 150, 30))[:9] == packet(109, 170, 50)
    assert say(robot, bytes((90, 0, 0, 0, 0))) == b"\x01"


def test_bytes_above_200_wrap_when_they_are_turned():
    assert say(make("s2", "1"), packet(109, 0, 255))[:9] == packet(109, (200 - 255) & 0xFF, 200)


@pytest.mark.parametrize("fluke", ["1", "2"])
def test_every_command_of_the_fluke_takes_its_arguments_and_gives_its_answer(fluke):
    commands = FLUKE_COMMANDS if fluke == "1" else FLUKE_2_COMMANDS
    for op, (n_arguments, n_answer) in commands.items():
        if op in (Op.SET_PASSTHROUGH, Op.PASS_BYTE, Op.GET_IMAGE):
            continue
        robot = make("s2", fluke, timing=False)
        given = [1] * n_arguments
        answer = say(robot, bytes((op, *given)), 3.0)
        if n_answer >= 0:
            assert len(answer) == n_answer, op
        else:
            assert answer, op
        robot.transmit()
        assert len(ask(robot, 65)) == 11, f"after {op!r} it is out of step"


def test_pictures_have_the_size_of_the_camera():
    assert len(say(make("s1", "1", timing=False), b"\x53")) == 256 * 192
    robot = make("s2", "2", timing=False)
    assert len(say(robot, b"\x53")) == 1280 * 800
    say(robot, bytes((11, 71)))
    assert len(say(robot, b"\x53")) == 427 * 266


def test_a_fluke_answers_its_version_and_its_robot():
    assert say(make("s1", "1"), bytes((142,))) == b"fluke:2.9.1\n"
    assert say(make("s2", "2"), bytes((142,))) == b"fluke:3.0.5\n"
    for model, name in (("s1", b"SCRIBBLER-1\n"), ("s2", b"SCRIBBLER-2\n")):
        robot = make(model, "1")
        assert say(robot, bytes((156,)), 4.0) == name
        assert len(ask(robot, 65)) == 11


def test_the_fluke_ends_the_info_line_for_a_silent_robot():
    robot = make("s2", "1")
    robot.overload()
    assert say(robot, INFO_REQUEST, 0.2) == b"fluke:2.9.1"
    robot.advance(0.2)
    assert robot.transmit() == b"\n"


def test_battery_is_in_volts_times_twenty_point_nine_eight_one_three():
    value = int.from_bytes(say(make("s2", "2"), bytes((89,))), "big")
    assert value / 20.9813 == pytest.approx(9.0, abs=0.1)


def test_obstacles_are_high_near_a_wall_and_in_steps_on_a_fluke_2():
    far, near = make("s2", "1"), make("s2", "1")
    near.place((1.0668 - 0.089 - 0.03, 0.3, 0.0), 1)
    far.place((0.3, 0.3, 0.0), 1)
    for op in (85, 86, 87):
        assert signed(say(near, bytes((op,)))) > 4500
    assert signed(say(far, bytes((86,)))) < 1000
    second = make("s2", "2")
    second.place((1.0668 - 0.089 - 0.12, 0.3, 0.0), 1)
    values = {signed(say(second, bytes((op,)))) for op in (85, 86, 87) * 10}
    assert all(value % 640 == 0 and 0 <= value <= 6400 for value in values)
    assert len(values) > 2


def test_ir_power_decides_how_far_a_fluke_sees():
    robot = make("s2", "1")
    robot.place((1.0668 - 0.089 - 0.12, 0.3, 0.0), 1)
    readings = []
    for power in (125, 135, 145):
        say(robot, bytes((120, power)))
        readings.append(signed(say(robot, bytes((86,)))))
    assert readings[0] < 1000 < readings[1] < 4500 < readings[2]


def test_ir_messages_are_words_with_their_length():
    robot = make("s2", "2")
    assert say(robot, bytes((150,))) == b"\0\0"
    robot.fluke.heard = b"hello"
    assert say(robot, bytes((150,))) == b"\0\x05hello"
    assert say(robot, bytes((150,))) == b"\0\0"
    assert say(robot, b"\x97\x03abc") == b""
    assert list(robot.fluke.sent) == [b"abc"]


def test_serial_memory_is_written_read_and_erased():
    robot = make("s1", "1")
    assert say(robot, bytes((90, 1, 2, 0, 7))) == b"\xff"
    say(robot, bytes((121, 1, 2, 0, 7, 99)))
    assert say(robot, bytes((90, 1, 2, 0, 7))) == b"\x63"
    say(robot, bytes((125, 1, 2)))
    assert say(robot, bytes((90, 1, 2, 0, 7))) == b"\xff"


def test_a_fluke_2_sets_leds_and_servos_and_returns_its_log():
    robot = make("s2", "2")
    assert say(robot, bytes((116, 126, 200, 12, 1, 77, 13, 1, 0x23))) == b""
    assert (robot.fluke.front_led, robot.fluke.back_led, robot.fluke.servos[1]) == (True, 200, 77)
    assert say(robot, bytes((10,))) == b"\0\0"
    say(robot, bytes((117,)))
    assert not robot.fluke.front_led


def test_opcodes_of_a_fluke_2_are_packets_for_a_fluke_1():
    assert say(make("s2", "1"), packet(11, 213)) == packet(11, 213)  # echoed by the robot, unknown to it


def test_maintenance_commands_are_swallowed():
    robot = make("s2", "1", timing=False)
    for data in (
        (132, 1, 2, 3, 4),
        (132, 9),
        (139, 2, 0, 0),
        (140, 5),
        (141, 10),
        (155, 0, 3, 1, 2, 3),
        (40, 0, 0),
    ):
        say(robot, bytes(data))
    say(robot, bytes(7), 2.0)  # two of nine bytes came by 139: the robot forgets them after a second
    robot.transmit()
    robot = make("s2", "1", timing=False)
    for data in ((132, 1, 2, 3, 4), (132, 9), (140, 5), (141, 10), (155, 0, 3, 1, 2, 3), (40, 0, 0), (43,)):
        assert say(robot, bytes(data)) == b""
    assert len(ask(robot, 65)) == 11


def test_passthrough_hands_everything_on():
    robot = make("s2", "1", timing=False)
    say(robot, bytes((134, 1)))
    sent = packet(89)  # a Fluke would answer its battery
    assert say(robot, sent) == sent


# the S2 alone


def test_position_and_angle_are_what_was_set():
    robot = make("s2")
    assert len(ask(robot, 166, *long(-123), *long(456))) == 11
    answer = ask(robot, 165)
    assert (signed(answer[:4]), signed(answer[4:])) == (-123, 456)
    assert len(ask(robot, 168, *long(-90))) == 11
    assert signed(ask(robot, 167)) == -90


def test_encoders_are_cleared_after_reading_only_when_asked():
    robot = make("s2")
    ask(robot, 109, 200, 200)
    ask(robot, 108)
    first = ask(robot, 171, 1)
    assert ask(robot, 171, 1) == first
    assert signed(first[:4]) > 100
    assert ask(robot, 171, 0) == first
    assert ask(robot, 171, 1) == bytes(8)


def test_motor_statistics_are_in_the_order_of_the_firmware():
    robot = make("s2")
    ask(robot, 109, 200, 0, seconds=0.5)
    left, right, since, packed, ready = ask(robot, 170, seconds=0.1)
    # 12 counts in 20 ms
    assert (left - 256, right) == pytest.approx((-60, 60), abs=2)
    assert (since, packed & 3 != 0, ready) == (0, True, 1)
    ask(robot, 108, seconds=2.0)
    left, right, since, packed, ready = ask(robot, 170)
    assert (left, right, packed & 3, ready) == (0, 0, 0, 1)
    assert since >= 19


@pytest.mark.parametrize("kind", range(16))
def test_every_type_of_motion_is_answered(kind):
    robot = make("s2")
    for op, values in (
        (162, [*word(10), *word(0)]),
        (163, [*word(10), *word(10), *word(50)]),
        (164, word(10)),
    ):
        assert len(ask(robot, op, kind, *values, seconds=10.0)) == 11


def test_distance_is_near_0_at_a_wall_and_99_where_nothing_is():
    robot = make("s2")
    robot.place((0.3, 0.3, 0.0), 1)
    assert ask(robot, 175, 0) == b"\x63"
    robot.place((1.0668 - 0.0895, 0.3, 0.0), 1)
    near = ask(robot, 175, 1)[0]
    assert near < 15
    assert ask(robot, 71) == b"\0"
    assert ask(robot, 172, 0, 0, 100) == b"\x01"  # the highest threshold sees nothing


def test_an_s2_sets_its_volume_and_measures_sound():
    robot = make("s2")
    assert len(ask(robot, 160, 55)) == 11
    assert robot.memory.volume == 55
    assert 0 <= signed(ask(robot, 169)) < 5000


def test_over_current_silences_the_s2_until_a_reset():
    robot = make("s2", "2")
    ask(robot, 65)
    say(robot, packet(109, 200, 200))
    robot.overload()
    assert robot.wheel_speeds() == (0.0, 0.0)
    assert say(robot, packet(65), 2.0) == b""
    say(robot, bytes((124,)), 3.0)
    assert len(ask(robot, 65)) == 11
