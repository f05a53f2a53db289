"""The process that has locked a port, if the system provides it."""

from __future__ import annotations

import os
from pathlib import Path

LOCKS = Path("/proc/locks")


def holder_of(port: str) -> int | None:
    """Return the number of the running process that locked a port. None if it has ended or is unknown."""
    try:
        file = Path(port).stat()
        lines = LOCKS.read_text().splitlines()
    except OSError:
        return None
    place = f"{os.major(file.st_dev):02x}:{os.minor(file.st_dev):02x}:{file.st_ino}"
    for line in lines:  # such as "1: FLOCK  ADVISORY  WRITE 1234 00:1a:5 0 EOF"
        words = line.split()
        if words[1:2] == ["FLOCK"] and words[5:6] == [place] and Path(f"/proc/{words[4]}").exists():
            return int(words[4])
    return None


def holder_words(process: int | None) -> str:
    """Return a sentence that names the process with the open port, and the next step."""
    if process is None:
        return "Another program holds it; close that one."
    if process == os.getpid():
        return "This program has it open already: close that robot first."
    try:
        command = Path(f"/proc/{process}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        command = ""
    named = f" ({command.strip()[:80]})" if command.strip() else ""
    return f"Another program holds it; close that one: process {process}{named}."
