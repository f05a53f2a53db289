"""Mutated files of every format: each is read or refused with one of our errors, in time and in little memory."""

from __future__ import annotations

import os
import random
import resource
import signal
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.formats import Format

READ_S, WAIT_S = 20.0, 120.0
"""Processor time and real time that a reader may take [s]."""
MEMORY = 1 << 30
"""Memory that a reader may take, on top of what its process has [bytes]."""
NUMBERS = (b"0", b"-1", b"1e999", b"nan", b"9" * 30, b"4294967296", b"0.1", b"true", b'""', b"[]", b"{}")


def mutated(data: bytes, draw: random.Random) -> bytes:
    """Return bytes with one to four mutations."""
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(len(data) + 1)
        to = min(at + draw.choice((1, 2, 8, 64)), len(data))
        kind = draw.randrange(8)
        if kind == 0:
            data = data[:at] + data[to:]
        elif kind == 1:
            data = data[:at] + draw.randbytes(draw.randint(1, 16)) + data[at:]
        elif kind == 2 and data:
            at = min(at, len(data) - 1)
            data = data[:at] + bytes((data[at] ^ 1 << draw.randrange(8),)) + data[at + 1 :]
        elif kind == 3:
            data = data[:to] + data[at:]
        elif kind == 4:
            data = data[:at]
        elif kind == 5:
            data = data[:at] + draw.choice((b"\0", b"\xff", b'"', b"\n", b"{", b"]", b"=")) * 3 + data[to:]
        else:
            data = _with_other_number(data, at, draw)
    return data


def _with_other_number(data: bytes, at: int, draw: random.Random) -> bytes:
    """Return bytes in which another value takes the place of the first number after a position."""
    digits = b"0123456789.-"
    while at < len(data) and data[at] not in digits:
        at += 1
    to = at
    while to < len(data) and data[to] in digits:
        to += 1
    return data[:at] + draw.choice(NUMBERS) + data[to:]


def inject(seed: int, n: int, folder: Path) -> Iterator[str]:
    """Yield what did not hold for each of n files, over all formats in turn."""
    problems: list[str] = []
    while len(problems) < n:
        found, status = _read_forked(range(len(problems), n), seed, folder)
        problems += found
        if len(problems) < n:  # the next one ended the process
            problems.append(f"file {len(problems)} of seed {seed}: the reader ended with {status}")
    yield from problems


def file_of(seed: int, number: int, valid: bytes) -> bytes:
    """Return a mutated file."""
    return mutated(valid, random.Random(f"{seed} {number}"))


def _read_forked(numbers: range, seed: int, folder: Path) -> tuple[list[str], int]:
    """Read files in a forked process; return what did not hold for each up to its end, and how it ended.

    Formats are imported there: making their valid examples starts threads that a fork would lose.
    """
    log = folder / "log"
    log.write_text("")
    child = os.fork()
    if child == 0:
        try:
            _read_all(numbers, seed, folder, log)
            os._exit(0)
        finally:
            os._exit(1)
    _, status = os.waitpid(child, 0)
    return log.read_text("utf-8").splitlines(), os.waitstatus_to_exitcode(status)


def _read_all(numbers: range, seed: int, folder: Path, log: Path) -> None:
    """Read files, and write a line about each."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    tempfile.tempdir = str(folder)
    from tests.formats import FORMATS

    names = list(FORMATS)
    with log.open("a", encoding="utf-8") as lines:
        for number in numbers:
            name = names[number % len(names)]
            lines.write(
                _read(
                    FORMATS[name],
                    file_of(seed, number, FORMATS[name].valid),
                    f"{name}, file {number} of seed {seed}",
                )
                + "\n"
            )
            lines.flush()


def _read(form: Format, data: bytes, title: str) -> str:
    """Read a file under limits of time and memory; return what did not hold."""
    from tests.formats import REFUSALS

    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, resource.RLIM_INFINITY))
    signal.setitimer(signal.ITIMER_PROF, READ_S)  # its signal ends the process, also in compiled code
    signal.setitimer(signal.ITIMER_REAL, WAIT_S)
    try:
        form.read(data)
    except REFUSALS:
        pass
    except BaseException as error:
        return f"{title}: {type(error).__name__}: {error}".replace("\n", " ")[:300]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)
    return ""
