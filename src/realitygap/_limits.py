"""Limits on what is parsed. Every reader of a file or a message goes through this module.

A parser must fail immediately on a hostile or a broken file, with one message. Python's parsers do not: a key of 50,000
parts takes `tomllib` minutes, and nested brackets end in a `RecursionError`. So the text is scanned first.
"""

from __future__ import annotations

import errno
import json
import math
import os
import re
import stat
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

MOST_TOML_BYTES = 4_000_000
"""Maximum size of a TOML, SVG or Python file. A drawing of a large maze has some 100,000."""
MOST_JSON_BYTES = 256 << 20
"""Maximum size of a JSON file or a line of JSON. The description of a large study has some 10 MB."""
MOST_LINES_BYTES = 4 << 30
"""Maximum size of a file with a JSON value on each line."""
MOST_TABLE_BYTES = 64 << 20
"""Maximum size of a text file with a table."""
MOST_CHUNK_BYTES = 4 << 30
"""Maximum size of a Parquet file, and of its decompressed content."""
MOST_CHECKPOINT_BYTES = 8 << 30
"""Maximum size of a saved population."""
MOST_TEXT_BYTES = 1 << 28
"""Maximum size of a value in a ledger."""
MOST_VIDEO_PIXELS = 8192 * 8192
"""Maximum size of a picture in a video."""

MOST_DEPTH = 64
"""Lists and tables inside each other. Those of realitygap need 10."""
MOST_KEY_PARTS = 32
"""Parts of a dotted TOML key, such as the three of a.b.c."""
MOST_DIGITS = 300
"""Maximum number of digits of a number."""
LEAST_INTEGER, MOST_INTEGER = -(2**63), 2**64 - 1
"""Integers beyond do not fit into 64 bits."""

_PLAIN_FLAGS = sum(getattr(os, name, 0) for name in ("O_NONBLOCK", "O_CLOEXEC", "O_NOCTTY", "O_BINARY"))

_JSON_STRING = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"?', re.DOTALL)
_TOML_STRING_OR_COMMENT = re.compile(
    r'"""[^"\\]*+(?:(?:\\.|"(?!""))[^"\\]*+)*+"{0,5}'
    r"|'''[^']*+(?:'(?!'')[^']*+)*+'{0,5}"
    r'|"[^"\\\n]*+(?:\\.[^"\\\n]*+)*+"?'
    r"|'[^'\n]*+'?"
    r"|\#[^\n]*+",
    re.DOTALL,
)
_SUSPECT_NUMBER = re.compile(r"[0-9]{19}|[eE][-+]?[0-9]{3}")
"""Part of a number that may be too large; most files have none."""
_REST_OF_NUMBER = re.compile(r"[-+0-9.eE]*+")
_LONG_NUMBER = re.compile(rf"[0-9]{{{MOST_DIGITS + 1}}}")
_LONG_KEY = re.compile(rf"(?:\.[A-Za-z0-9-]*+){{{MOST_KEY_PARTS}}}")
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]|[\ud800-\udfff]")
_SHOWN = 20


_TOO_DEEP = f"its lists and tables are too deep inside each other, expected at most {MOST_DEPTH} levels"


class LimitError(ValueError):
    """A text goes beyond a limit; the message says which, and can follow "FILE: "."""


def read_file(path: Path, most: int, *, plain: bool = False) -> bytes:
    """Return the bytes of a file.

    Args:
        path: The file.
        most: The largest number of bytes that it may have.
        plain: Whether to refuse a pipe or a device. It is for names that the user did not choose.

    Raises:
        OSError: The file cannot be read, is too large, or is not plain.
    """
    with open_plain(path) if plain else path.open("rb") as file:
        status = os.fstat(file.fileno())
        is_fit = status.st_size <= most
        # the size of a pipe is not known before its end
        data = b"" if not is_fit else file.read() if stat.S_ISREG(status.st_mode) else _read_pipe(file, most)
    if not is_fit or len(data) > most:
        raise OSError(errno.EFBIG, f"it has more than {most:,} bytes", str(path))
    return data


def open_plain(path: Path) -> BinaryIO:
    """Open a file for reading, and never wait for the other end of a pipe.

    Raises:
        OSError: It cannot be read, or is a pipe, a device, or a folder.
    """
    descriptor = os.open(path, os.O_RDONLY | _PLAIN_FLAGS)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "it is not a plain file", str(path))
    return os.fdopen(descriptor, "rb")


def _read_pipe(file: BinaryIO, most: int) -> bytes:
    """Return what comes out of a pipe, at most one part more than fits."""
    parts: list[bytes] = []
    size = 0
    while size <= most and (part := file.read(1 << 16)):
        parts.append(part)
        size += len(part)
    return b"".join(parts)


def is_file(path: str | Path) -> bool:
    """Return whether there is a file at a path; False for text that cannot be a path, such as a very long one."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):
        return False


def parse_json(
    text: str | bytes,
    *,
    most: int = MOST_JSON_BYTES,
    pairs: Callable[[list[tuple[str, Any]]], Any] | None = None,
    nan: bool = False,
    large: bool = False,
) -> Any:
    """Return the value of a JSON text.

    Args:
        text: The text, or its bytes.
        most: The largest number of characters that it may have.
        pairs: Makes an object of its keys and values; a dictionary if not given.
        nan: Whether NaN and infinity, which are not JSON, are numbers.
        large: Whether an integer may be too large for 64 bits.

    Raises:
        LimitError: It goes beyond a limit.
        ValueError: It is not JSON.
    """
    _check_size(len(text), most)
    if not isinstance(text, str):
        text = bytes(text).decode(json.detect_encoding(text))
    if _may_be_deep(text) or _SUSPECT_NUMBER.search(text):
        bare = _JSON_STRING.sub("", text)
        _check_depth(bare)
        _check_numbers(bare, large=large)
    constant = None if nan else _refuse_constant
    decoder = (
        _DECODER
        if pairs is None and not nan
        else json.JSONDecoder(object_pairs_hook=pairs, parse_constant=constant)
    )
    value = decoder.decode(text)
    if _SURROGATE.search(text):
        _check_letters(value)
    return value


def parse_toml(text: str) -> dict[str, Any]:
    """Return the values of a TOML text.

    Raises:
        LimitError: It goes beyond a limit.
        ValueError: It is not TOML.
    """
    _check_size(len(text), MOST_TOML_BYTES)
    bare = _TOML_STRING_OR_COMMENT.sub("s", text).replace("_", "").replace(" ", "").replace("\t", "")
    _check_depth(bare)
    if _LONG_NUMBER.search(bare):
        raise LimitError(f"it has a number of more than {MOST_DIGITS} digits")
    if _LONG_KEY.search(bare):
        raise LimitError(f"it has a key of more than {MOST_KEY_PARTS} parts")
    values = tomllib.loads(text)
    _check_values(values)
    return values


def _check_size(size: int, most: int) -> None:
    if size > most:
        raise LimitError(f"it has {size:,} characters, expected at most {most:,}")


def _may_be_deep(text: str) -> bool:
    return text.count("[") + text.count("{") > MOST_DEPTH


def _check_depth(bare: str) -> None:
    """Raise an error if brackets outside strings are too deep inside each other."""
    if not _may_be_deep(bare):
        return
    import numpy as np

    brackets = re.sub(r"[^\[\]{}]++", "", bare).encode()
    steps = (np.frombuffer(brackets, np.uint8) & 2).astype(
        np.int8
    ) - 1  # bit 1 is set in [ and {, and not in ] and }
    if np.cumsum(steps, dtype=np.int64).max() > MOST_DEPTH:
        raise LimitError(_TOO_DEEP)


def _check_numbers(bare: str, *, large: bool) -> None:
    """Raise an error if a number outside strings is too large for 64 bits."""
    end = 0
    while (suspect := _SUSPECT_NUMBER.search(bare, end)) is not None:
        begin = suspect.start()
        while begin > end and bare[begin - 1] in "-+0123456789.eE":
            begin -= 1
        rest = _REST_OF_NUMBER.match(bare, suspect.end())
        end = suspect.end() if rest is None else rest.end()
        _check_number(bare[begin:end], large=large)


def _check_number(text: str, *, large: bool) -> None:
    if text.lstrip("-+").isdecimal():
        is_fit = (
            len(text) <= MOST_DIGITS
            if large
            else len(text) <= _SHOWN + 1 and LEAST_INTEGER <= int(text) <= MOST_INTEGER
        )
    else:
        try:
            is_fit = math.isfinite(float(text))
        except ValueError:  # not one number: the parser says so
            return
    if not is_fit:
        shown = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}... ({len(text):,} characters)"
        raise LimitError(f"the number {shown} is too large for 64 bits")


def _check_values(value: Any, depth: int = 0) -> None:
    """Raise an error for hexadecimal numbers that are too large, and for tables inside each other by dotted keys."""
    if depth > MOST_DEPTH:
        raise LimitError(_TOO_DEEP)
    if isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            _check_values(each, depth + 1)
    elif isinstance(value, int) and not LEAST_INTEGER <= value <= MOST_INTEGER:
        raise LimitError("it has an integer that is too large for 64 bits")


def _refuse_constant(name: str) -> float:
    raise LimitError(f"it has the number {name}, expected finite numbers")


def _check_letters(value: Any) -> None:
    """Raise an error for half of a letter, which no file can be written with."""
    try:
        json.dumps(value, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise LimitError("it has half of a letter (a lone surrogate)") from None


_DECODER = json.JSONDecoder(parse_constant=_refuse_constant)
