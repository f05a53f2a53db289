"""Aseba's own compiler and virtual machine, from the Debian package `aseba`, for programs of a Thymio."""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

VARIABLES = {
    "_id": 1,
    "event.source": 1,
    "event.args": 32,
    "button.center": 1,
    "prox.horizontal": 7,
    "prox.ground.delta": 2,
    "motor.left.target": 1,
    "motor.right.target": 1,
    "timer.period": 2,
}
EVENTS = ("button.center", "prox", "timer0")
OFFSETS = {name: sum(list(VARIABLES.values())[:k]) for k, name in enumerate(VARIABLES)}
FIRST_FREE = sum(VARIABLES.values())
ROOM = (1534, FIRST_FREE + 512, 32)
START = 0xFFFF
SOURCE = Path(__file__).with_name("machine.cpp")


def why_not() -> str:
    """Return why there is no compiler here; empty if there is one."""
    if missing := [name for name in ("g++", "localedef") if shutil.which(name) is None]:
        return f"needs {' and '.join(missing)}"
    there = Path("/usr/include/aseba/compiler/compiler.h").exists()
    return "" if there else "needs the Debian package aseba"


@cache
def built(folder: Path) -> Path:
    """Return the program that holds the compiler; it needs a locale that may be missing."""
    program = folder / "machine"
    libraries = ["-lasebacompiler", "-lasebacommon", "-lasebavm"]
    subprocess.run(
        ["g++", "-O1", "-I/usr/include/aseba", SOURCE, "-o", program, *libraries], check=True, timeout=120
    )
    locale = ["localedef", "-i", "en_US", "-f", "UTF-8", str(folder / "en_US.UTF-8")]
    subprocess.run(locale, check=True, timeout=60, capture_output=True)
    return program


def source_of(aesl: str) -> str:
    """Return the text of the only program in a file of Aseba Studio."""
    (node,) = ElementTree.fromstring(aesl).findall("node")
    assert node.text is not None
    return node.text


@dataclass
class Compiled:
    """What the compiler and the machine answered."""

    n_variables: int
    depth: int
    words: list[int]
    answers: list[list[int]]


def run(
    text: str,
    commands: list[str],
    folder: Path,
    variables: dict[str, int] | None = None,
    events: tuple[str, ...] = EVENTS,
    room: tuple[int, int, int] = ROOM,
) -> Compiled:
    """Compile a program and carry out commands: `put OFFSET VALUE`, `event NUMBER`, `get OFFSET COUNT`."""
    variables = VARIABLES if variables is None else variables
    program = built(folder)
    file = folder / "program.txt"
    file.write_text(text)
    lines = [
        f"room {' '.join(map(str, room))}",
        *(f"variable {name} {size}" for name, size in variables.items()),
        *(f"event {name}" for name in events),
        "program",
        *commands,
    ]
    done = subprocess.run(
        [program, file],
        input="\n".join(lines) + "\n",
        text=True,
        capture_output=True,
        timeout=60,
        env={**os.environ, "LOCPATH": str(folder)},
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    first, *answers = done.stdout.splitlines()
    n_variables, depth, *words = map(int, first.split())
    return Compiled(n_variables, depth, words, [list(map(int, line.split())) for line in answers])


def local(event: str) -> int:
    """Return the number of a local event."""
    return 0xFFFE - EVENTS.index(event)
