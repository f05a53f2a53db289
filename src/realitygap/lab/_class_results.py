"""Results of a class, saved as lines of JSON in the lab's folder: nothing that a student drove is lost by a restart."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from realitygap._foreign_text import page_text
from realitygap._limits import parse_json
from realitygap.records import refuse_links
from realitygap.robots import Label

FILE = "class.jsonl"
LONGEST_NAME = 20
"""Largest length of a name that a student enters [letters]."""
_LONGEST_SAVED = LONGEST_NAME + 4  # with the number of a name that several students chose
_LONGEST_LINE = 1_000_000


class Drive(BaseModel):
    """A student's drive in a round.

    Attributes:
        round: Number of the round, from 1.
        student: Digest of the key of the student's browser.
        name: Name that the student chose.
        label: Label of the robot.
        cells: Cells in the order of first visits; empty if nobody observes the robot.
        counted: Number of cells that the lecturer counted on the paper; None if nobody did.
        seconds: Driven time [s].
        path: Poses x [m], y [m], heading [rad] at equal times; empty until the drive is over.
        is_over: True if the drive has ended.
        is_removed: True if the lecturer removed it from the board.
    """

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    round: int = Field(ge=1)
    student: str = Field(max_length=64)
    name: str = Field(max_length=_LONGEST_SAVED)
    label: Label = "EMULATED"
    cells: list[int] = Field(default=[], max_length=100_000)
    counted: int | None = Field(default=None, ge=0, le=100_000)
    seconds: float = 0.0
    path: list[Annotated[list[float], Field(min_length=3, max_length=3)]] = Field(
        default=[], max_length=10_000
    )
    is_over: bool = False
    is_removed: bool = False

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return len(self.cells) if self.counted is None else self.counted


def clean_name(text: str, longest: int = LONGEST_NAME) -> str:
    """Return a name as pages show it: short, in one line, without characters that control a page."""
    return " ".join(page_text(text).split())[:longest].strip()


def read_drives(root: Path) -> list[Drive]:
    """Return the last saved state of each drive, in the order of their beginnings; damaged lines are left out."""
    path = root / FILE
    refuse_links(root, path)
    drives: dict[tuple[int, str], Drive] = {}
    for line in path.read_bytes().splitlines() if path.exists() else ():
        with contextlib.suppress(ValueError):
            drive = Drive.model_validate(parse_json(line, most=_LONGEST_LINE))
            name = clean_name(drive.name, _LONGEST_SAVED)
            drives[drive.round, drive.student] = drive.model_copy(update={"name": name})
    return list(drives.values())


def save_drives(root: Path, drives: list[Drive]) -> str:
    """Append drives to the file, those that are over onto the disk; return the problem, empty if there is none."""
    text = "".join(drive.model_dump_json(exclude_none=True) + "\n" for drive in drives)
    try:
        refuse_links(root, root / FILE)
        with (root / FILE).open("ab+") as file:
            if file.tell() and file.seek(-1, os.SEEK_END) and file.read() != b"\n":
                text = "\n" + text  # a crash has cut the last line off
            file.write(text.encode())
            file.flush()
            if any(drive.is_over for drive in drives):
                os.fsync(file.fileno())
    except OSError as error:
        return f"Results cannot be saved: {error.strerror or error}. Free space, or make {FILE} writable."
    return ""
