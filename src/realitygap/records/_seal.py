"""A seal inside a Parquet file, by which every damaged byte is found before the file is decoded.

A Parquet decoder cannot be trusted with damaged input: seen in polars, one flipped bit in a data page aborted
the whole process, and one in the column statistics made a filtered scan leave out rows without a word. So
16 bytes of mark and 32 bytes of sha256 over all other bytes are put between the data pages and the footer.
That spot belongs to nobody: the footer is found from the file's end and everything else by its distance from
the file's start, so any Parquet reader opens a sealed file.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

_MAGIC = b"PAR1"
_MARK = b"realitygap seal\n"
_SEAL_SIZE = len(_MARK) + hashlib.sha256().digest_size
_TAIL_SIZE = 8
"""The footer's length, as 4 little-endian bytes, and `_MAGIC`."""


class BrokenSeal(Exception):  # noqa: N818 - says what happened; never leaves this package
    """The bytes are not those that were sealed; the text says what is wrong, as the end of "the file ..."."""


def seal(parquet: bytes) -> bytes:
    """Return the bytes of a Parquet file with a seal before its footer."""
    footer = _footer_start(parquet)
    return b"".join((parquet[:footer], _MARK, hashlib.sha256(parquet).digest(), parquet[footer:]))


def check_seal(sealed: bytes) -> None:
    """Return when the bytes are as they were sealed.

    Raises:
        BrokenSeal: they are cut off, changed, or were never sealed.
    """
    if not sealed.strip(b"\0"):
        raise BrokenSeal("is empty or holds only zeros" if sealed else "is empty")
    if not sealed.startswith(_MAGIC):
        raise BrokenSeal("does not begin like a Parquet file")
    if len(sealed) < len(_MAGIC) + _SEAL_SIZE + _TAIL_SIZE or not sealed.endswith(_MAGIC):
        raise BrokenSeal("is cut off: the end of a Parquet file is missing")
    footer = _footer_start(sealed)
    start = footer - _SEAL_SIZE
    if start < len(_MAGIC) or sealed[start : start + len(_MARK)] != _MARK:
        raise BrokenSeal("is damaged, or was not written by realitygap: its seal is missing")
    view = memoryview(sealed)
    found = hashlib.sha256(view[:start])
    found.update(view[footer:])
    if found.digest() != sealed[start + len(_MARK) : footer]:
        raise BrokenSeal("is damaged: its bytes are not those that were written")


def check_ends(path: Path) -> None:
    """Return when a file begins and ends as a sealed one, in a time that does not depend on its length.

    Raises:
        BrokenSeal: it does not.
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        head = file.read(len(_MAGIC))
        n_bytes = file.seek(0, os.SEEK_END)
        file.seek(max(n_bytes - _TAIL_SIZE, 0))
        tail = file.read()
        start = n_bytes - _TAIL_SIZE - int.from_bytes(tail[:4], "little") - _SEAL_SIZE
        file.seek(max(start, 0))
        mark = file.read(len(_MARK))
    if head != _MAGIC or tail[4:] != _MAGIC or mark != _MARK:
        raise BrokenSeal("does not begin and end like a chunk")


def _footer_start(parquet: bytes) -> int:
    return len(parquet) - _TAIL_SIZE - int.from_bytes(parquet[-_TAIL_SIZE:-4], "little")
