"""Who puts the robot at its start, watches it, and says what was drawn: a person, or an emulator's witness."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from realitygap.errors import RobotError
from realitygap.records import Score, Trial
from realitygap.robots import Command, Observation, Robot
from realitygap.world import Arena, Grid, Pose

from ._physical import DrivenTrial
from ._preflight import Preflight

if TYPE_CHECKING:
    from realitygap.emulator import Witness

Verdict = Literal["void", "driven"]
"""What becomes of a trial that was cut off: driven again, or scored as it is."""


@dataclass(frozen=True)
class Card:
    """What an operator is told of a trial.

    Attributes:
        trial: Which one.
        title: What to call it; a code when scoring is blind.
        pen: The color to draw with.
        n_steps: Commands in it.
        n_left: Trials still to be driven for the generation, this one included.
        key: Of the condition's random numbers.
        arena: Where.
    """

    trial: Trial
    title: str
    pen: str
    n_steps: int
    n_left: int
    key: int
    arena: Arena


class Operator(Protocol):
    """What has to be done by hand and eye."""

    def meet(self, robot: Robot) -> None:
        """A robot was opened; next is its pre-flight, in which it turns on the spot for a moment."""
        ...

    def accept(self, preflight: Preflight) -> bool:
        """Whether to go on after the pre-flight."""
        ...

    def settle(self, card: Card, problem: str) -> Verdict:
        """What becomes of a trial that was cut off."""
        ...

    def place(self, card: Card) -> None:
        """Put the robot at its start, with the pen; returns when it stands there."""
        ...

    def watch(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Called at each step; True aborts the trial."""
        ...

    def drawn(self, card: Card, driven: DrivenTrial) -> Score | None:
        """What was drawn, where that is known as soon as the robot stands; else None, and `enter` will ask."""
        ...

    def enter(self, cards: Sequence[Card], *, is_full: bool) -> Iterable[tuple[int, Score]]:
        """Number and cells of each of these trials, kept one by one; what is left out is asked for later.

        Called with the trial just driven, and once the sheet is full with all of its trials that are not scored.
        """
        ...

    def close(self, cards: Sequence[Card]) -> Sequence[int]:
        """Whether to close a generation: the numbers of trials whose scores are taken back; none closes it."""
        ...


PREFLIGHT_POSE = Pose(0.5334, 0.3048, 0.0)
"""The middle of the paper's arena, where the robot can turn on the spot [m, rad]."""


PATH_PARTS = 4
"""In how many parts of a step the driven path is kept, so that arcs look like arcs."""


class WitnessOperator:
    """The operator of an emulated robot: nobody.

    The robot is put at the start with a sensor noise that is a function of the trial's key, so that a trial comes out
    the same however often it is driven.
    """

    who = "witness"

    def __init__(
        self,
        witness: Witness | None = None,
        *,
        in_flight: Verdict = "void",
        despite_preflight: bool = False,
    ) -> None:
        """Use a witness.

        Args:
            witness: Of the emulator; that of the robot's port when not given.
            in_flight: What becomes of a trial that was cut off.
            despite_preflight: Whether to drive whatever the pre-flight finds.
        """
        self._witness = witness
        self._in_flight = in_flight
        self._despite_preflight = despite_preflight
        self._times: list[float] = []

    @property
    def witness(self) -> Witness:
        """Of the robot that was met; one that has none is a `RobotError`."""
        if self._witness is None:
            raise RobotError(
                "This robot has no witness that would say what it drew: it is no emulator in this program. Name the "
                "port of one's witness (--witness HOST:PORT), or score its trials by hand."
            )
        return self._witness

    def meet(self, robot: Robot) -> None:
        """Take the witness that comes with the robot's port, unless there is one.

        Raises:
            RobotError: The robot would count as REAL; what a witness sees is an emulated one.
        """
        if robot.label != "EMULATED":
            raise RobotError(
                f"A robot on this port counts as {robot.label}, and a witness sees an emulated one: its cells would "
                "be taken for a robot's. Use a pseudo-terminal or a port of this machine, or leave --witness out."
            )
        own = getattr(getattr(robot, "port", None), "witness", None) or getattr(robot, "witness", None)
        self._witness = own or self._witness
        self.witness.place(PREFLIGHT_POSE, 0)

    def accept(self, preflight: Preflight) -> bool:
        """Return whether the pre-flight found no problem, or problems were accepted in advance."""
        return self._despite_preflight or not preflight.problems

    def settle(self, card: Card, problem: str) -> Verdict:
        """As said in advance; a line that was cut off is not known any more when the emulator was begun anew."""
        return self._in_flight

    def place(self, card: Card) -> None:
        """Put the robot at the start.

        Raises:
            RobotError: It drives in another arena than the study's.
        """
        refuse_other_arena(self.witness.arena(), card.arena)
        self.witness.place(card.arena.start, trial_seed(card))
        self._times = []

    def watch(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Let it drive, and note the time: a step begins where the one before ended."""
        self._times.append(self.witness.now())
        return False

    def drawn(self, card: Card, driven: DrivenTrial) -> Score:
        """The cells along the driven line."""
        times = [*self._times, self.witness.now()]
        path = self.witness.path()
        within = np.interp(
            np.arange((len(times) - 1) * PATH_PARTS + 1) / PATH_PARTS, np.arange(len(times)), times
        )
        rows = np.searchsorted(path[:, 0], within + 1e-9, side="right") - 1
        return Score(
            self.witness.cells(),
            self.who,
            n_ends=len(self.witness.cells_at(times)),
            path=path[np.maximum(rows, 0), 1:4].tolist(),
        )

    def enter(self, cards: Sequence[Card], *, is_full: bool) -> Iterable[tuple[int, Score]]:
        """Nothing: what was not seen when it was driven is not known any more."""
        return ()

    def close(self, cards: Sequence[Card]) -> Sequence[int]:
        """Close it."""
        return ()


def refuse_other_arena(there: Arena, wanted: Arena) -> None:
    """Refuse an emulated robot that drives elsewhere than it should.

    Raises:
        RobotError: Walls or cells differ.
    """
    if there.grid != wanted.grid or set(there.walls) != set(wanted.walls):
        raise RobotError(
            f"The emulated robot drives in the arena {there.name!r}, and the study is about {wanted.name!r}: other "
            "walls or cells. Start the emulator with the study's arena (--arena, or arena= in its port)."
        )


def trial_seed(card: Card) -> int:
    """The 32-bit seed of an emulated trial's sensor noise; another attempt has the same."""
    trial = card.trial
    text = f"{card.key}:{trial.replicate}:{trial.generation}:{trial.individual}"
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=4).digest(), "little")


_WORDS = ("right", "up and right", "up", "up and left", "left", "down and left", "down", "down and right")
_INCH = 0.0254


def start_words(arena: Arena) -> str:
    """Where a trial begins, for somebody with a ruler: from the left wall and the lower one, and facing where."""
    start = arena.start
    left, bottom = min(wall[0] for wall in arena.walls), min(wall[1] for wall in arena.walls)
    way = round(start.heading / (math.pi / 4)) % 8
    return (
        f"{(start.x - left) / _INCH:.1f} in from the left wall, {(start.y - bottom) / _INCH:.1f} in from the lower "
        f"one, facing {_WORDS[way]}."
    )


def cell_at(grid: Grid, x: float, y: float) -> int | None:
    """The cell that a point [m] lies in; None outside the reachable ones."""
    column, row = int((x - grid.x) // grid.cell), int((y - grid.y) // grid.cell)
    if 0 <= column < grid.columns and 0 <= row < grid.rows:
        return grid.columns * row + column
    return None
