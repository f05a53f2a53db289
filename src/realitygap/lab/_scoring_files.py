"""Files next to a ledger for people who score: lines that emulated robots drew, drafts, and proposals of cells."""

from __future__ import annotations

import contextlib
import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from realitygap._limits import MOST_JSON_BYTES, parse_json, read_file
from realitygap.records import PhotoCount, Score, refuse_links, write_whole

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


Kind = Literal["photo", "track"]
KINDS: tuple[Kind, ...] = ("photo", "track")
MOST = 5
"""Proposals of a kind that are kept of a trial; older ones are forgotten."""


@dataclass(frozen=True)
class Proposal:
    """Cells of a trial as something saw them.

    Attributes:
        kind: What saw them.
        mark: By which a count that began from it names it: of a photograph the SHA-256.
        source: The photograph's or the video's file, or the camera.
        time: When it was made [s since 1970].
        cells: Crossed as far as can be said.
        sure: How sure that is of each cell of the grid, 0.5 to 1; empty where that is not known.
        doubtful: Cells to look at, crossed or not.
        lines: Pieces of its line, (x, y) [m] each.
        n_ends: Cells in which steps end; None where nobody saw it.
        path: (x, y, heading) at each quarter of a step, as a ledger keeps it; None where nobody saw it.
        said: What has to be said of it, such as why it may be wrong; empty where nothing has.
        told: The note that goes into the ledger with it; empty for none.
        is_spoiled: Whether it must not be taken without looking: another line of this pen is on the sheet.
    """

    kind: Kind
    mark: str
    source: str
    time: float
    cells: list[int]
    sure: list[float] = field(default_factory=list)
    doubtful: list[int] = field(default_factory=list)
    lines: list[list[list[float]]] = field(default_factory=list)
    n_ends: int | None = None
    path: list[list[float]] | None = None
    said: str = ""
    told: str = ""
    is_spoiled: bool = False

    @property
    def is_usable(self) -> bool:
        """True if a count may start from it automatically."""
        return bool(self.cells) and not self.is_spoiled

    @property
    def name(self) -> str:
        """Name to show."""
        return f"the photo {self.source}" if self.kind == "photo" else f"the track of {self.source}"

    def score(self, cells: Sequence[int], who: str) -> Score:
        """Return the score for the ledger: confirmed cells, and the proposal that they began with."""
        if self.kind == "photo":
            seen = PhotoCount(
                self.source, self.mark, tuple(self.cells), tuple(self.doubtful), is_confirmed=True
            )
            return Score(list(cells), who, photo=seen)
        return Score(list(cells), who, n_ends=self.n_ends, path=self.path)


def keep_proposal(folder: Path, trial: int, proposal: Proposal) -> None:
    """Save a proposal for a trial of the study in a folder; it replaces an earlier one with its mark."""
    before = [each for each in _of_kind(folder, trial, proposal.kind) if each.mark != proposal.mark]
    kept = [*before, proposal][-MOST:]
    write_json(folder, _place(folder, trial, proposal.kind), [asdict(each) for each in kept])


def read_proposals(folder: Path, trial: int) -> list[Proposal]:
    """Return the proposals for a trial, the last one first."""
    found = [each for kind in KINDS for each in _of_kind(folder, trial, kind)]
    return sorted(found, key=lambda each: each.time, reverse=True)


def _of_kind(folder: Path, trial: int, kind: Kind) -> list[Proposal]:
    found: Any = read_json(_place(folder, trial, kind))
    try:
        return [Proposal(**each) for each in found or ()]
    except TypeError:  # of another version, or damaged: it can be read anew
        return []


def _place(folder: Path, trial: int, kind: Kind) -> Path:
    return folder / FOLDER / f"{kind}-{trial}.json"


def track_proposal(seen: Score, mark: str, source: str, told: str, said: str = "") -> Proposal:
    """The proposal of a camera for a trial.

    Args:
        seen: Its cells and path.
        mark: By which it is known.
        source: The video's file, or the camera.
        told: The note for the ledger.
        said: What has to be said of it.
    """
    path = [[round(float(part), 5) for part in row] for row in seen.path or ()]
    return Proposal(
        kind="track",
        mark=mark,
        source=source,
        time=time.time(),
        cells=sorted(seen.cells),
        lines=[[row[:2] for row in path]],
        n_ends=seen.n_ends,
        path=path,
        said=said,
        told=told,
    )
