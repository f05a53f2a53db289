"""Properties that hold of all bytes and values."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realitygap.errors import ProtocolError
from realitygap.families.scribbler import _codec as codec
from realitygap.families.scribbler.opcodes import ROBOT_ANSWERS, S2_ANSWERS, Op

from .peers import INFOS

FLAGS = st.integers(0, 1)
WORDS = st.integers(0, 65535)


@given(st.floats(-1, 1), st.floats(-1, 1))
def test_motors_are_nine_bytes_with_the_right_wheel_first(left, right):
    data = codec.motors(left, right).data
    assert len(data) == 9
    assert data[0] == 109
    assert data[1] == int((right + 1) * 100)
    assert data[2] == int((left + 1) * 100)
    assert max(data[1:3]) <= 200
    assert not any(data[3:])


@given(st.floats(-1, 1), st.floats(-1, 1))
def test_an_echo_is_the_packet_or_the_packet_turned_round_and_nothing_else(left, right):
    sent = codec.motors(left, right).data
    turned = bytes([109, 200 - sent[2], 200 - sent[1]]) + sent[3:]
    assert codec.is_echo(sent, sent)
    assert codec.is_echo(sent, turned)
    for at in range(9):
        other = bytearray(sent)
        other[at] ^= 0x15
        assert codec.is_echo(sent, bytes(other)) == (bytes(other) == turned)


@given(st.tuples(FLAGS, FLAGS), st.tuples(WORDS, WORDS, WORDS), st.tuples(FLAGS, FLAGS), st.booleans())
def test_a_sensor_block_comes_out_as_it_went_in(ir, light, line, stall):
    data = struct.pack(">BBHHHBBB", *ir, *light, *line, stall)
    assert codec.sensor_block(data) == (ir, light, line, stall)


@given(st.binary(min_size=11, max_size=11))
def test_a_sensor_block_with_a_flag_beyond_1_is_refused(data):
    if max(data[0], data[1], *data[8:]) > 1:
        with pytest.raises(ProtocolError, match="a byte was lost or added"):
            codec.sensor_block(data)
    else:
        codec.sensor_block(data)


@given(st.integers(-(1 << 31), (1 << 31) - 1), st.integers(-(1 << 31), (1 << 31) - 1))
def test_signed_numbers_come_out_as_they_went_in(one, other):
    assert codec.signed_longs(struct.pack(">ii", one, other)) == (one, other)
    assert codec.signed_long(struct.pack(">i", one)) == one


@given(st.text(st.characters(min_codepoint=33, max_codepoint=126), max_size=16))
def test_a_name_comes_out_as_it_went_in(name):
    data = codec.name_bytes("name", name)
    assert len(data) == 16
    assert codec.text(data) == name


@pytest.mark.parametrize("setup", INFOS)
def test_the_info_lines_of_all_set_ups_are_plain_and_any_letter_less_is_not(setup):
    line = INFOS[setup]
    assert codec.is_plain_info(line)
    found = codec.info_line(line)
    assert found.model == ({"s1": "s1", "s2": "s2"}.get(setup[:2]))
    assert found.fluke == (setup[-1] if "fluke" in setup else "none")
    for at in range(len(line) - 1):
        less = line[:at] + line[at + 1 :]
        if codec.is_plain_info(less):  # one of several blanks
            assert codec.info_line(less) == found, less


def test_names_of_older_boards_are_understood():
    assert codec.info_line(b"dongle:1.9,api:2.0,robot:scribbler,mode:serial\n") == ("s1", "1", "2.0", "1.9")
    assert codec.info_line(b"Fluke:3.0.5,Robot:Scribbler3,Robot-Version:1,Mode:Serial\n")[:2] == ("s2", "2")
    with pytest.raises(ProtocolError, match="calls itself 'roomba'"):
        codec.info_line(b"Robot:Roomba,Mode:Serial\n")


def test_every_command_of_a_robot_with_an_answer_can_be_asked():
    for op, n_bytes in (ROBOT_ANSWERS | S2_ANSWERS).items():
        if op != Op.GET_INFO:
            request = codec.robot_request("x", op)
            assert len(request.data) == 9
            assert request.answer == n_bytes
