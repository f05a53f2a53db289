"""The log of a study: times, hosts, and speeds, one JSON object per line, outside the digest.

A log that cannot be written never stops a run, since no number depends on it, and never goes unmentioned: the
caller gets a `RecordWarning`, and the next line that can be written follows as if nothing had happened.
"""

from __future__ import annotations

import datetime
import errno
import json
import os
import socket
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from realitygap._limits import MOST_LINES_BYTES, parse_json, read_file
from realitygap.records._files import reading
from realitygap.records._inside import open_inside
from realitygap.records._version import RecordWarning

LOG_NAME = "log.jsonl"


def append_line(path: Path, event: Mapping[str, Any]) -> bool:
    """Append one event, with `time` (UTC) and `host` unless given; False, with a warning, when it failed.

    Raises:
        RecordError: the file is a link, a pipe or a device.
    """
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
    line = json.dumps(
        {"time": now, "host": socket.gethostname(), **event}, default=_plain, ensure_ascii=False
    )
    try:
        descriptor = open_inside(path.parent, path, os.O_RDWR | os.O_CREAT | os.O_APPEND)
        with os.fdopen(descriptor, "a+b", buffering=0) as file:
            start = b"" if _ends_a_line(file.fileno()) else b"\n"
            data = start + line.encode("utf-8", "backslashreplace") + b"\n"
            # in one call, so that lines of several processes do not mix; a full disk may take a part of it
            if file.write(data) != len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    except OSError as error:
        warnings.warn(
            f"Could not append to {path}: {error.strerror or error}. The results themselves do not need it.",
            RecordWarning,
            stacklevel=3,
        )
        return False
    return True


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Return all events, oldest first; lines torn by a crash are left out, with a warning that counts them."""
    if not path.exists():
        return []
    with reading(path):
        lines = read_file(path, MOST_LINES_BYTES, plain=True).splitlines()
    events: list[dict[str, Any]] = []
    n_torn = 0
    for line in filter(None, lines):
        try:
            event = parse_json(line, nan=True)
        except ValueError:
            event = None
        if isinstance(event, dict):
            events.append(event)
        else:
            n_torn += 1
    if n_torn:
        warnings.warn(
            f"{path}: {n_torn} lines could not be read and were left out.", RecordWarning, stacklevel=3
        )
    return events


def _ends_a_line(descriptor: int) -> bool:
    size = os.fstat(descriptor).st_size
    if size == 0:
        return True
    os.lseek(descriptor, size - 1, os.SEEK_SET)
    return os.read(descriptor, 1) == b"\n"


def _plain(value: Any) -> Any:
    """Return a NumPy scalar as Python's, and any other type that JSON does not support as text."""
    return value.item() if hasattr(value, "item") and getattr(value, "size", 1) == 1 else str(value)
