"""Files next to a ledger: lines that emulated robots drew, and cells marked for trials without a score."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realitygap._limits import MOST_JSON_BYTES, parse_json, read_file
from realitygap.records import refuse_links, write_whole

FOLDER = "lab"
"""Folder within a study's folder. Its files are no longer needed once the trials are scored."""


def keep_drawn(folder: Path, trial: int, path: Sequence[Sequence[float]]) -> None:
    """Keep the line of a trial: (t, 2 or more) x, y [m] and so on."""
    write_json(
        folder,
        folder / FOLDER / f"line-{trial}.json",
        [[round(each[0], 5), round(each[1], 5)] for each in path],
    )


def read_drawn(folder: Path, trial: int) -> list[tuple[float, float]]:
    """Return the line of a trial [m]; empty if none was kept."""
    found = read_json(folder / FOLDER / f"line-{trial}.json")
    with contextlib.suppress(TypeError, ValueError, IndexError):
        return [(float(each[0]), float(each[1])) for each in found or ()]
    return []


@dataclass(frozen=True)
class Draft:
    """Cells that a visitor has marked so far.

    Attributes:
        cells: Marked ones.
        proposal: From which they began, as `Proposal.mark` names it; empty where from none.
    """

    cells: list[int]
    proposal: str = ""


def keep_draft(folder: Path, trial: int, who: str, role: str, draft: Draft) -> None:
    """Save the cells that a visitor has marked so far."""
    values = {"cells": sorted(draft.cells), "proposal": draft.proposal}
    write_json(folder, _draft(folder, trial, who, role), values)


def read_draft(folder: Path, trial: int, who: str, role: str) -> Draft | None:
    """Return the cells that a visitor has marked so far; None before the first."""
    found = read_json(_draft(folder, trial, who, role))
    cells = found.get("cells") if isinstance(found, dict) else None
    if isinstance(cells, list) and all(type(each) is int for each in cells):
        return Draft(cells, str(found.get("proposal") or ""))
    return None


def forget_draft(folder: Path, trial: int, who: str, role: str) -> None:
    """Delete the cells that a visitor has marked, because they were entered."""
    with contextlib.suppress(OSError):
        _draft(folder, trial, who, role).unlink(missing_ok=True)


def _draft(folder: Path, trial: int, who: str, role: str) -> Path:
    mark = hashlib.blake2b(f"{role}:{who}".encode(), digest_size=6).hexdigest()
    return folder / FOLDER / f"draft-{trial}-{mark}.json"


def write_json(folder: Path, path: Path, value: Any) -> None:
    """Write a JSON file whole, in a study's folder.

    Raises:
        RecordError: It cannot be written, or a name on the way to it is a link.
    """
    refuse_links(folder, path)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, json.dumps(value).encode(), within=folder)


def read_json(path: Path) -> Any:
    """Return the value in a JSON file; None if it cannot be read."""
    try:
        return parse_json(read_file(path, MOST_JSON_BYTES, plain=True), nan=True)
    except (OSError, ValueError):
        return None
