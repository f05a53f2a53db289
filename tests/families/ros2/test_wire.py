"""Messages byte by byte, as DDS-XTypes 1.3, section 7.4 (XCDR1), has them."""

from __future__ import annotations

import math
import struct

import pytest

pytest.importorskip("cyclonedds", reason="needs the Python package cyclonedds")

from realitygap.families.ros2._dds import MALFORMED, filled, n_values, plain, type_of
from realitygap.families.ros2._messages import DEFINITIONS, ODOMETRY, POSE, SCAN, TF, TWIST, TWIST_STAMPED

STAMP = {"stamp": {"sec": -2, "nanosec": 7}, "frame_id": "map"}


def cdr(order: str, parts: list[tuple[str, object]]) -> bytes:
    """Return numbers and texts as bytes: each number begins at a multiple of its size, after four bytes of header."""
    body = b""
    for kind, value in parts:
        if kind == "s":
            text = str(value).encode() + b"\0"
            body += b"\0" * (-len(body) % 4) + struct.pack(order + "I", len(text)) + text
        else:
            size = struct.calcsize(kind)
            body += b"\0" * (-len(body) % size) + struct.pack(order + kind, value)
    return (b"\0\1\0\0" if order == "<" else b"\0\0\0\0") + body


HEADER = [("i", -2), ("I", 7), ("s", "map")]
CASES = {
    TWIST: (
        {"linear": {"x": 0.25}, "angular": {"z": -1.5}},
        [("d", value) for value in (0.25, 0, 0, 0, 0, -1.5)],
    ),
    TWIST_STAMPED: (
        {"header": STAMP, "twist": {"angular": {"z": 2.0}}},
        [*HEADER, *(("d", value) for value in (0, 0, 0, 0, 0, 2.0))],
    ),
    POSE: (
        {"header": STAMP, "pose": {"position": {"x": 1.0, "y": 2.0}}},
        [*HEADER, *(("d", value) for value in (1.0, 2.0, 0, 0, 0, 0, 1.0))],
    ),
    SCAN: (
        {"header": STAMP, "angle_min": -1.0, "range_max": 3.5, "ranges": [0.5, None], "intensities": []},
        [*HEADER, *(("f", value) for value in (-1.0, 0, 0, 0, 0, 0, 3.5)),
         ("I", 2), ("f", 0.5), ("f", math.inf), ("I", 0)],
    ),
    TF: (
        {"transforms": [{"header": STAMP, "child_frame_id": "cup", "transform": {"translation": {"x": 3.0}}}]},
        [("I", 1), *HEADER, ("s", "cup"), *(("d", value) for value in (3.0, 0, 0, 0, 0, 0, 1.0))],
    ),
}  # fmt: skip


@pytest.mark.parametrize("message", CASES)
def test_bytes_are_those_of_the_standard(message):
    values, parts = CASES[message]
    assert filled(message, values).serialize() == cdr("<", parts)


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("message", CASES)
def test_both_byte_orders_are_read(message, order):
    values, parts = CASES[message]
    assert plain(message, type_of(message).deserialize(cdr(order, parts))) == plain(
        message, filled(message, values)
    )


def test_what_json_does_not_know_is_none_and_covariances_are_left_out():
    scan = plain(SCAN, filled(SCAN, {"ranges": [1.0, math.inf, math.nan]}))
    assert scan["ranges"] == [1.0, None, None]
    assert set(plain(ODOMETRY, filled(ODOMETRY, {}))["pose"]) == {"pose"}
    assert n_values(SCAN, filled(SCAN, {"ranges": [1.0] * 5, "intensities": [1.0]})) == 6


@pytest.mark.parametrize("message", DEFINITIONS)
def test_each_message_comes_back(message):
    again = type_of(message).deserialize(filled(message, {}).serialize())
    assert plain(message, again) == plain(message, filled(message, {}))


@pytest.mark.parametrize("message", [TWIST, SCAN, ODOMETRY])
@pytest.mark.parametrize("n", [3, 5, 30])
def test_cut_message_is_malformed_and_no_other_error(message, n):
    with pytest.raises(MALFORMED):
        type_of(message).deserialize(filled(message, {}).serialize()[:n])


def test_sequence_that_claims_more_than_there_is_is_malformed():
    claimed = cdr("<", [*HEADER, *(("f", 0.0) for _ in range(7)), ("I", 2**31)])
    with pytest.raises(MALFORMED):
        type_of(SCAN).deserialize(claimed)
