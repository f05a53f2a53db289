"""The records of a ledger of physical trials: individuals, turns, trials, steps, and scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from realitygap.drawing import card_of

TrialState = Literal["planned", "running", "driven", "scored", "void"]
ScoreRole = Literal["score", "second", "correction"]


@dataclass(frozen=True)
class Individual:
    """One of a generation, as it is planned.

    Attributes:
        individual: its number in the generation.
        species: its species.
        parents: individuals of the generation before.
        nodes: of its genome.
        genome: the fields of the records' genome, as lists.
        key: of the random numbers.
    """

    individual: int
    species: int
    parents: Sequence[int]
    nodes: int
    genome: Mapping[str, Any]
    key: int


@dataclass(frozen=True)
class Generation:
    """A generation of a run, as it is planned."""

    condition: str
    replicate: int
    generation: int
    individuals: Sequence[Individual]


@dataclass(frozen=True)
class Turn:
    """When and with which pen an individual is driven; `code` is what an operator knows it by when scoring is blind."""

    condition: str
    replicate: int
    generation: int
    individual: int
    sheet: int
    pen: int
    code: str


@dataclass(frozen=True)
class Trial:
    """A trial as the ledger has it; `trial` is its number.

    Attributes:
        place: when its turn comes, ascending.
        attempt: 0, and one more for each trial of the individual that was void.
        cells: as entered and not undone; None before.
        is_closed: whether its generation is closed, so that its score is frozen.
    """

    trial: int
    condition: str
    replicate: int
    generation: int
    individual: int
    attempt: int
    place: int
    sheet: int
    pen: int
    code: str
    state: TrialState
    reason: str | None
    end: str | None
    problem: str | None
    n_steps: int | None
    stalls: int | None
    cells: tuple[int, ...] | None
    is_closed: bool

    def __repr__(self) -> str:
        cells = "" if self.cells is None else f", {len(self.cells)} cells"
        return f"Trial({self.trial}: {self.name}, {self.state}{cells})"

    def _repr_html_(self) -> str:
        return card_of(self).to_html()

    @property
    def name(self) -> str:
        """Which trial it is, in words."""
        again = f" (attempt {self.attempt + 1})" if self.attempt else ""
        run = f"{self.condition}, run {self.replicate}"
        return f"{run}, generation {self.generation}, individual {self.individual}{again}"


@dataclass(frozen=True)
class PhotoCount:
    """The photograph from which cells were read, for an operator to confirm.

    Attributes:
        file: its name.
        sha256: of the file, as hexadecimal digits.
        proposed: cells as they were read from it; those of the score are what was confirmed.
        doubtful: cells less than 90 % sure, crossed or not.
        is_confirmed: whether somebody said that they looked.
    """

    file: str
    sha256: str
    proposed: tuple[int, ...]
    doubtful: tuple[int, ...]
    is_confirmed: bool


PATH_PARTS = 4
"""In how many parts of a step the driven path is kept, so that arcs look like arcs."""

ROBOT = "robot"
"""Who scores a trial of which nobody counted the cells, because its task is scored by the robot's own readings."""


@dataclass(frozen=True)
class Score:
    """Cells as an operator entered them, or as an emulator's witness recorded them.

    Attributes:
        cells: crossed by the line, columns * row + column; none if `who` is `ROBOT`.
        who: entered them.
        n_ends: cells in which steps end; None where nobody saw it.
        path: (4 t + 1, 3) x [m], y [m], heading [rad] at each quarter of its t steps; None where nobody saw it.
        photo: the photograph that they were read from; None where somebody counted on paper. The ledger has it in the
            event of the score.
    """

    cells: Sequence[int]
    who: str
    n_ends: int | None = None
    path: Sequence[Sequence[float]] | None = None
    photo: PhotoCount | None = None
