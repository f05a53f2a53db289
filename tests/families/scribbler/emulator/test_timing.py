"""How long things take, on the simulated clock."""

import pytest

from .wire import ask, make, packet, say

BYTE = 10 / 38400


def time_of_answer(robot, data, n, step=1e-4, most=10.0):
    """When the last of n bytes has come [s after sending]."""
    robot.receive(bytes(data))
    begun, got = robot.now, b""
    while len(got) < n and robot.now - begun < most:
        robot.advance(step)
        got += robot.transmit()
    assert len(got) == n
    return robot.now - begun


def test_bytes_take_their_time_on_a_cable():
    # nine bytes there, nine of echo, one of answer
    assert time_of_answer(make("s2"), packet(74), 10) == pytest.approx(19 * BYTE, abs=2e-4)


def test_an_s1_echoes_while_it_receives_and_an_s2_afterwards():
    first, second = make("s1"), make("s2")
    for robot in (first, second):
        robot.receive(packet(65))
        robot.advance(5.5 * BYTE)
    assert len(first.transmit()) == 4
    assert second.transmit() == b""


def test_without_timing_answers_are_there_at_once():
    robot = make("s2", "2", timing=False)
    robot.receive(packet(113, 255, 255, 3, 16))
    assert len(robot.transmit()) == 20


@pytest.mark.parametrize("model", ["s1", "s2"])
@pytest.mark.parametrize("quiet", [111, 112])
def test_a_tone_is_answered_after_it_has_ended(model, quiet):
    robot = make(model)
    ask(robot, quiet)
    took = time_of_answer(robot, packet(113, 1, 44, 3, 16), 20)  # 300 ms
    assert 0.300 < took < 0.300 + 29 * BYTE + 0.025


def test_two_tones_take_as_long_as_one():
    assert 0.2 < time_of_answer(make("s2"), packet(114, 0, 200, 1, 184, 3, 112), 20) < 0.22


def test_a_name_is_written_byte_by_byte():
    assert 0.040 < time_of_answer(make("s2"), packet(110, *b"Rosie   "), 20) < 0.055


def test_distance_takes_its_18_tests():
    assert 0.024 < time_of_answer(make("s2"), packet(175, 0), 10) < 0.031


def test_obstacles_take_40_ms_on_a_fluke_2():
    assert 0.040 < time_of_answer(make("s2", "2"), bytes((86,)), 2) < 0.042


@pytest.mark.parametrize("fluke", ["none", "2"])
@pytest.mark.parametrize("model", ["s1", "s2"])
def test_half_a_packet_is_thrown_away_after_a_second_of_silence(model, fluke):
    robot = make(model, fluke)
    say(robot, packet(65)[:4], 1.1)
    assert len(ask(robot, 74)) == 1


@pytest.mark.parametrize("model", ["s1", "s2"])
def test_half_a_packet_waits_for_less_than_a_second(model):
    robot = make(model)
    say(robot, packet(74)[:4], 0.9)
    answer = say(robot, packet(74)[4:])
    assert len(answer) == (6 if model == "s1" else 10)  # an S1 has echoed the first four at once


def test_a_fluke_1_never_forgets_half_a_packet():
    robot = make("s2", "1")
    say(robot, packet(65))
    say(robot, packet(65)[:4], 60.0)
    assert say(robot, bytes((89, 89, 89, 89))) == b""  # swallowed as bytes of the packet
    robot.advance(2.0)  # the robot has forgotten it
    # the ninth byte is still missing for the Fluke; the robot has one byte too few
    say(robot, bytes((0,)))
    robot.advance(2.0)
    assert robot.transmit() == b""
    assert len(say(robot, bytes((89,)))) == 2
    assert len(ask(robot, 65)) == 11


def test_a_fluke_2_takes_no_commands_while_it_waits_300_ms_for_the_robot():
    robot = make("s2", "2")
    robot.receive(packet(113, 3, 232, 3, 16))  # a second
    robot.advance(0.05)
    robot.receive(bytes((89,)))
    robot.advance(0.2)
    assert len(robot.transmit()) == 9
    robot.advance(0.1)
    assert len(robot.transmit()) == 2  # the battery, after it gave up
    robot.advance(1.0)
    assert len(robot.transmit()) == 11  # what came late is passed on
    assert b"113" in say(robot, bytes((10,)))


def test_a_fluke_1_answers_while_the_robot_plays():
    robot = make("s2", "1")
    robot.receive(packet(113, 3, 232, 3, 16))
    robot.advance(0.05)
    robot.transmit()
    assert len(say(robot, bytes((89,)), 0.05)) == 2


def test_an_s1_hears_nothing_while_it_works():
    robot = make("s1")
    robot.receive(packet(113, 0, 200, 3, 16))
    robot.advance(0.05)
    lost = say(robot, packet(65), 1.0)
    assert len(lost) == 9 + 9 + 11  # both echoes, and the answer to the tone only
    robot.advance(1.0)
    assert len(ask(robot, 65)) == 11


def test_an_s2_keeps_the_next_command_while_it_works():
    robot = make("s2")
    robot.receive(packet(113, 0, 200, 3, 16) + packet(65))
    robot.advance(1.0)
    assert len(robot.transmit()) == 40


def test_the_name_is_broadcast_once_a_second_until_the_first_command():
    robot = make("s1")
    ask(robot, 98, 1)  # on an S1 this is the broadcast's switch, too
    say(robot, packet(33), 0.1)
    robot.advance(0.45)
    robot.transmit()
    robot.advance(3.0)
    assert robot.transmit() == 3 * b"IPREScribby  \0"
    answer = say(robot, packet(98, 0), 1.5)
    assert answer.endswith(b"\0") or len(answer) >= 20
    robot.transmit()
    robot.advance(5.0)
    assert robot.transmit() == b""


def test_an_s2_broadcasts_only_when_its_memory_says_so():
    robot = make("s2")
    ask(robot, 98, 1)
    say(robot, packet(33), 3.0)
    assert robot.transmit() == b""
    ask(robot, 96, 26, 1)  # beyond the data bytes: the switch of the broadcast
    say(robot, packet(33), 0.5)
    robot.transmit()
    robot.advance(2.2)
    assert b"IPREScribby  \0" in robot.transmit()


def test_a_fluke_is_silent_about_the_broadcast_before_the_first_command():
    first = make("s2", "1")
    first.memory.broadcast = 1
    first.robot.reset(0)
    first.advance(5.0)
    assert first.transmit() == b""


def test_soft_reset_is_echoed_in_part_and_stops_everything():
    robot = make("s2")
    ask(robot, 109, 200, 200)
    assert robot.wheel_speeds() != (0.0, 0.0)
    assert 0 < len(say(robot, packet(33), 3.0)) < 9
    assert robot.wheel_speeds() == (0.0, 0.0)
    assert ask(robot, 171, 1) == bytes(8)


def test_dtr_resets_a_cabled_s2_only():
    for model, fluke, stops in (("s2", "none", True), ("s1", "none", False), ("s2", "2", False)):
        robot = make(model, fluke)
        say(robot, packet(109, 180, 180))
        robot.reset_line()
        assert (robot.wheel_speeds() == (0.0, 0.0)) == stops


@pytest.mark.slow
def test_motors_run_on_for_ever():
    robot = make("s2", "2")
    robot.place((0.5, 0.3, 0.0), 1)
    say(robot, packet(109, 120, 80), 3600.0)
    assert robot.wheel_speeds() != (0.0, 0.0)
