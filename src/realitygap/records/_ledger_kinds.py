"""The records of a ledger of physical trials: individuals, turns, trials, steps, and scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from realitygap.drawing import ShownAsCard
from realitygap.errors import LedgerError
from realitygap.settings import shown

TrialState = Literal["planned", "running", "driven", "scored", "void"]
ScoreRole = Literal["score", "second", "correction"]


@dataclass(frozen=True)
class Individual:
    """One planned individual of a generation.

    Attributes:
        individual: Number in the generation.
        species: Species.
        parents: Parents in the generation before.
        nodes: Nodes of its genome.
        genome: Fields of the records' genome, as lists.
        key: Key of the random numbers.
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
    """An individual's place in the order of trials, with its pen; `code` replaces its name if scoring is blind."""

    condition: str
    replicate: int
    generation: int
    individual: int
    sheet: int
    pen: int
    code: str


@dataclass(frozen=True)
class Trial(ShownAsCard):
    """A trial as the ledger has it; `trial` is its number.

    Attributes:
        condition: Condition of a study; empty if a command drove the trial, which has a purpose instead.
        place: Place in the order of trials, ascending.
        attempt: 0, and one more for each trial of the individual that was void.
        cells: Cells as entered and not undone; None before.
        is_closed: True if its generation is closed, so that its score is frozen.
        purpose: Purpose of a trial of a command, as in `TrialRecord`; empty in a study.
        controller: Number of its controller in the ledger, from 1 on; None in a study, if commands were given, or while
            the design of the trials is blind.
        arm: Code of its arm if the design is blind and its cells are not known; `blind` if they are. Empty if the
            design is not blind.
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
    purpose: str = ""
    controller: int | None = None
    arm: str = ""

    def __repr__(self) -> str:
        cells = "" if self.cells is None else f", {len(self.cells)} cells"
        return f"Trial({self.trial}: {self.name}, {self.state}{cells})"

    @property
    def name(self) -> str:
        """Name of the trial in words."""
        again = f" (attempt {self.attempt + 1})" if self.attempt else ""
        if not self.condition:
            controller = "" if self.controller is None else f", controller {self.controller}"
            controller = f", {self.arm}" if self.arm else controller
            return f"{self.purpose}{controller}{again}"
        run = f"{self.condition}, run {self.replicate}"
        return f"{run}, generation {self.generation}, individual {self.individual}{again}"


@dataclass(frozen=True)
class DrivenTrial:
    """A trial of a command with what a locked design says of it.

    Attributes:
        trial: Its number in the ledger.
        number: Number of the trial on its platform.
        controller: SHA-256 of its controller.
        state: Its state.
        reason: Reason why it is void; empty if it is not.
        battery_v: Battery voltage at its start [V]; None if unknown.
    """

    trial: int
    number: int
    controller: str
    state: TrialState
    reason: str
    battery_v: float | None


@dataclass(frozen=True)
class PhotoCount:
    """The photograph from which cells were read, for an operator to confirm.

    Attributes:
        file: Name.
        sha256: Hash of the file, as hexadecimal digits.
        proposed: Cells as they were read from it. The score has the confirmed cells.
        doubtful: Cells less than 90 % sure, crossed or not.
        is_confirmed: True if a person confirmed the cells.
    """

    file: str
    sha256: str
    proposed: tuple[int, ...]
    doubtful: tuple[int, ...]
    is_confirmed: bool


PLAN_EVENT = "comparison planned"
"""Event that has the plan of a comparison."""


@dataclass(frozen=True)
class PlannedComparison:
    """The plan of a comparison, as the ledger has it.

    Attributes:
        plan: The last plan.
        first: The plan that was stored before the first trial; None if there was none.
    """

    plan: Mapping[str, Any]
    first: Mapping[str, Any] | None


PATH_PARTS = 4
"""Number of parts of a step in a stored path, so that arcs look like arcs."""

ROBOT = "robot"
"""Name of the scorer if no person counted cells, because the robot's own readings score the task."""

OBSERVER = "observer"
"""Name of the scorer if the cells are those of the person, camera, or witness that observed a trial of a command."""


@dataclass(frozen=True)
class Score:
    """Cells as an operator entered them, or as an emulator's witness recorded them.

    Attributes:
        cells: Cells that the line crosses, columns * row + column; none if `who` is `ROBOT`.
        who: Person who entered them.
        n_ends: Number of cells in which steps end; None if unknown.
        path: (4 t + 1, 3) x [m], y [m], heading [rad] at each quarter of its t steps; None if unknown.
        photo: Photograph from which they were read; None if a person counted on paper. The ledger has it in the event
            of the score.
    """

    cells: Sequence[int]
    who: str
    n_ends: int | None = None
    path: Sequence[Sequence[float]] | None = None
    photo: PhotoCount | None = None


def checked_cells(cells: Sequence[int], n_cells: int) -> list[int]:
    """Return the cells that a line crosses, each once.

    Raises:
        LedgerError: There is none, or one is outside the grid.
    """
    unique = list(dict.fromkeys(int(cell) for cell in cells))
    outside = [cell for cell in unique if not 0 <= cell < n_cells]
    if outside:
        raise LedgerError(
            f"Cell {outside[0]} is outside the grid: expected numbers from 0 to {n_cells - 1}. Nothing was entered."
        )
    if not unique:
        raise LedgerError(
            "No cell is marked. Mark each cell that the line crosses, then save. Nothing was saved."
        )
    return unique


def settings_of_condition(description: Mapping[str, Any], name: str) -> Any:
    """Return the settings of a condition of a ledger, from the description of its study.

    Raises:
        LedgerError: The study has no such condition.
    """
    for condition in description["conditions"]:
        if condition["name"] == name:
            return condition["settings"]
    raise LedgerError(
        f"The ledger has trials of condition {shown(name)}, but study.json has no such condition. Restore both files "
        "from the same copy."
    )
