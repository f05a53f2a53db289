"""Cells that a photograph or a camera proposes for a trial; a person confirms them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from realitygap.records import PhotoCount, Score

from ._drawn import FOLDER, read_json, write_json

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
