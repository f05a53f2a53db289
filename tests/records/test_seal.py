from __future__ import annotations

import io

import polars as pl
import pytest

from realitygap.records._seal import BrokenSeal, check_seal, seal
from tests.records.rows import make_rows


@pytest.fixture(scope="module")
def parquet() -> bytes:
    buffer = io.BytesIO()
    make_rows(n=1).write_parquet(buffer)
    return buffer.getvalue()


def test_a_sealed_file_is_intact_and_reads_as_before(parquet):
    sealed = seal(parquet)
    check_seal(sealed)
    assert pl.read_parquet(io.BytesIO(sealed)).equals(make_rows(n=1))


def test_any_changed_byte_breaks_the_seal(parquet):
    sealed = bytearray(seal(parquet))
    for position in range(len(sealed)):
        sealed[position] ^= 1 << (position % 8)
        with pytest.raises(BrokenSeal):
            check_seal(bytes(sealed))
        sealed[position] ^= 1 << (position % 8)


def test_any_missing_end_breaks_the_seal(parquet):
    sealed = seal(parquet)
    for size in range(len(sealed)):
        with pytest.raises(BrokenSeal):
            check_seal(sealed[:size])


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda sealed: b"", "empty"),
        (lambda sealed: bytes(len(sealed)), "only zeros"),
        (lambda sealed: b"hello, world", "does not begin like"),
        (lambda sealed: sealed[:-100], "cut off"),
        (lambda sealed: sealed[:-9] + b"?" + sealed[-8:], "damaged"),
        (lambda sealed: sealed + sealed, "damaged"),
        (lambda sealed: b"PAR1" + bytes(100) + b"\xff\xff\xff\xffPAR1", "damaged, or was not written by"),
    ],
)
def test_the_reason_says_what_is_wrong(parquet, spoil, message):
    with pytest.raises(BrokenSeal, match=message):
        check_seal(spoil(seal(parquet)))


def test_a_parquet_file_of_others_has_no_seal(parquet):
    with pytest.raises(BrokenSeal, match="not written by realitygap"):
        check_seal(parquet)
