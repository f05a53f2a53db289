"""Whatever the bytes of a file are, they are read or refused with one message."""

from __future__ import annotations

import random
import re

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.formats import FORMATS, REFUSALS, Format

DANGEROUS = (
    b"[" * 200,
    b"{" * 200,
    b'{"a":' * 200,
    b"1" * 400,
    b"-1e999",
    b"NaN",
    b"18446744073709551616",
    b"\xff\xfe",
    b"\x00",
    b'"\\ud800"',
    b"null",
    b"[]",
    b"-1",
    b"true",
    b'"x"',
    b"a." * 100 + b"a",
)
"""Put in place of a part of a valid file."""
N_MUTATIONS = 40


def mutated(data: bytes, rng: random.Random) -> bytes:
    """Return the bytes after one to three small changes."""
    changed = bytearray(data)
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(changed) + 1)
        kind = rng.randrange(5)
        if kind == 0 and changed:
            changed[min(at, len(changed) - 1)] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del changed[at : at + rng.randint(1, 40)]
        elif kind == 2:
            changed[at:at] = rng.choice(DANGEROUS)
        elif kind == 3:
            numbers = [match.span() for match in re.finditer(rb"\d+|\"[^\"]*\"", bytes(changed[:20000]))]
            if numbers:
                begin, end = rng.choice(numbers)
                changed[begin:end] = rng.choice(DANGEROUS)
        else:
            other = rng.randrange(len(changed) + 1)
            changed[at:at] = changed[min(at, other) : max(at, other)][:200]
    return bytes(changed)


def read_or_refused(form: Format, data: bytes) -> str:
    """Return the message with which bytes are refused; empty if they can be read. Any other exception goes on."""
    try:
        form.read(data)
    except REFUSALS as error:
        return str(error) or "no message"
    return ""


@pytest.mark.parametrize("name", FORMATS)
def test_format_reads_its_example(name: str) -> None:
    assert not read_or_refused(FORMATS[name], FORMATS[name].valid)


@pytest.mark.parametrize("name", FORMATS)
def test_format_reads_or_refuses_mutations(name: str) -> None:
    rng = random.Random(name)
    form = FORMATS[name]
    for number in range(N_MUTATIONS):
        data = mutated(form.valid, rng)
        try:
            assert read_or_refused(form, data) != "no message"
        except BaseException as error:
            raise AssertionError(f"mutation {number} of {name}: {error!r}: {data[:2000]!r}") from error


@pytest.mark.parametrize("name", FORMATS)
def test_format_refuses_what_is_empty_or_foreign(name: str) -> None:
    form = FORMATS[name]
    for data in (
        b"",
        b"\x00" * 100,
        b"\xff" * 100,
        b"[" * 100_000,
        b'{"a":' * 100_000,
        b"1" * 100_000,
        b"<a>" * 10_000,
    ):
        read_or_refused(form, data)


@pytest.mark.parametrize(
    "name", [name for name in FORMATS if name.endswith((".toml", ".json", ".jsonl", ".svg", ".csv"))]
)
@settings(
    derandomize=True,
    database=None,
    max_examples=10,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.data())
def test_text_format_reads_or_refuses_a_valid_file_with_other_values(name: str, data: st.DataObject) -> None:
    valid = FORMATS[name].valid
    values = [match.span() for match in re.finditer(rb"-?\d+(?:\.\d+)?|\"[^\"]*\"|true|false", valid[:5000])]
    begin, end = data.draw(st.sampled_from(values))
    value = data.draw(
        st.sampled_from(DANGEROUS)
        | st.text(max_size=20).map(lambda text: text.encode("utf-8", "surrogatepass"))
        | st.integers().map(lambda number: str(number).encode())
        | st.floats().map(lambda number: repr(number).encode())
    )
    read_or_refused(FORMATS[name], valid[:begin] + value + valid[end:])
