"""The Aseba codec: exact bytes, round trips, and damaged streams."""

import contextlib
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realitygap.errors import ProtocolError, RobotError
from realitygap.families.thymio import _messages as messages
from realitygap.families.thymio._messages import Decoder, Kind, Message


@pytest.mark.parametrize(
    ("encoded", "expected"),
    [
        (messages.list_nodes(), "0200 0000 11a0 0500"),
        (messages.get_description(1), "0400 0000 10a0 0100 0500"),
        (messages.get_variables(1, 42, 19), "0600 0000 0ba0 0100 2a00 1300"),
        (messages.set_variables(1, 8, [-200, 300]), "0800 0000 0ca0 0100 0800 38ff 2c01"),
        (messages.set_bytecode(1, 0, [3, 0xFFFF, 3, 0]), "0c00 0000 01a0 0100 0000 0300 ffff 0300 0000"),
        (messages.control(Kind.RESET, 1), "0200 0000 02a0 0100"),
        (messages.control(Kind.RUN, 1), "0200 0000 03a0 0100"),
        (messages.control(Kind.STOP, 1), "0200 0000 06a0 0100"),
        (messages.user_event(0, [100, -100, 35]), "0600 0000 0000 6400 9cff 2300"),
    ],
)
def test_messages_have_the_bytes_of_the_protocol(encoded, expected):
    assert encoded == bytes.fromhex(expected)


def test_answers_are_read_from_their_bytes():
    decoder = Decoder()
    decoder.feed(bytes.fromhex("0600 0100 0590 2a00 38ff 2c01"))
    answer = decoder.next()
    assert answer == Message(1, Kind.VARIABLES, bytes.fromhex("2a0038ff2c01"))
    assert messages.variables(answer.payload) == (42, (-200, 300))
    name = b"\x09thymio-II"
    sizes = messages.words([5, 1534, 32, 620, 2, 3, 4])
    assert messages.head(name + sizes) == ("thymio-II", 5, 1534, 32, 620, 2, 3, 4)
    assert messages.named_variable(b"\x07\x00\x0fprox.horizontal") == (7, "prox.horizontal")
    assert messages.local_event(b"\x04prox\x01x") == "prox"


@given(
    st.lists(
        st.builds(
            Message,
            st.integers(0, 0xFFFF),
            st.one_of(st.sampled_from(Kind).map(int), st.integers(0, 0x7FFF)),
            st.binary(max_size=messages.MOST_PAYLOAD),
        ),
        max_size=5,
    ),
    st.integers(1, 700),
)
def test_a_stream_gives_its_messages_back_however_it_is_cut(sent, size):
    stream = b"".join(each.encoded() for each in sent)
    decoder, got = Decoder(), []
    for start in range(0, len(stream), size):
        decoder.feed(stream[start : start + size])
        while (message := decoder.next()) is not None:
            got.append(message)
    assert got == sent


@given(st.lists(st.integers(-0x8000, 0x7FFF), max_size=258))
def test_words_are_signed(values):
    assert messages.signed_words(messages.words(values)) == tuple(values)


def test_words_and_messages_that_are_too_large_are_refused():
    with pytest.raises(ValueError, match="expected -32768 to 65535"):
        messages.words([70_000])
    with pytest.raises(ValueError, match="516 or fewer"):
        Message(0, 0, bytes(517)).encoded()


def read_all(stream):
    """Read a stream as the link does, and every message in every way."""
    decoder = Decoder()
    decoder.feed(stream)
    readers = [messages.variables, messages.head, messages.named_variable, messages.local_event]
    for _ in range(len(stream) + 1):
        try:
            message = decoder.next()
        except RobotError:
            continue
        if message is None:
            return
        for read in [*readers, lambda _, of=message: messages.node_present(of)]:
            with contextlib.suppress(ProtocolError):
                read(message.payload)
    raise AssertionError("the decoder does not come to an end")


def test_ten_thousand_random_streams_end_and_raise_robot_errors_only():
    numbers = random.Random(1)
    for _ in range(10_000):
        read_all(numbers.randbytes(numbers.randrange(120)))


def test_a_fault_at_each_byte_ends_and_raises_robot_errors_only():
    answers = [
        Message(1, Kind.NODE_PRESENT, messages.words([5])),
        Message(1, Kind.DESCRIPTION, b"\x09thymio-II" + messages.words([5, 1534, 32, 620, 1, 1, 0])),
        Message(1, Kind.NAMED_VARIABLE, b"\x07\x00\x0fprox.horizontal"),
        Message(1, Kind.LOCAL_EVENT, b"\x04prox\x01x"),
        Message(1, Kind.VARIABLES, messages.words([42, *range(19)])),
    ]
    stream = b"".join(each.encoded() for each in answers)
    for place in range(len(stream)):
        before, byte, after = stream[:place], stream[place : place + 1], stream[place + 1 :]
        read_all(before + after)
        read_all(before + byte + byte + after)
        read_all(before)
        for stray in (0, 1, 0x7F, 0x90, 0xFF):
            read_all(before + bytes([stray]) + byte + after)
            read_all(before + bytes([stray]) + after)
