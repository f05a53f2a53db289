"""The operator of a robot, and the card that describes a trial to them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from realitygap.records import Observe, Score, Trial, TrialRecord
from realitygap.robots import Command, Observation, Robot
from realitygap.world import Arena

from ._observer import PortObserver
from ._preflight import Preflight
from ._target import TrialPlan

Verdict = Literal["void", "driven"]
"""Decision about a trial that was cut off: drive it again, or score it as it is."""
Led = Literal["go", "redo", "stop"]
"""Decision of a person who was asked to place the robot: the trial, the trial before again, or a stop for today."""


@dataclass(frozen=True)
class Card:
    """The information on a trial for an operator.

    Attributes:
        trial: Trial of the card.
        title: Title of the trial; a code if scoring is blind.
        pen: The color to draw with.
        n_steps: Commands in it.
        n_left: Trials still to be driven for the generation, this one included.
        key: Key of the condition's random numbers.
        arena: Arena of the trial.
        observe: Required observation level. With `readings` no person counts its cells, and with `track` the score has
            its path.
    """

    trial: Trial
    title: str
    pen: str
    n_steps: int
    n_left: int
    key: int
    arena: Arena
    observe: Observe = "cells"


class Operator:
    """A person next to a robot, who places and watches it, and reports the cells and the valid trials.

    This one is nobody: its answers were given in advance, and an observer sees what there is to see. Persons at a
    terminal or at a page are subclasses.

    Args:
        observer: Observer of the trials; None if a person counts cells later.
        in_flight: Function that decides about a trial that was cut off.
        despite_preflight: True to drive even if the pre-flight check finds a problem.
    """

    def __init__(
        self,
        observer: PortObserver | None = None,
        *,
        in_flight: Verdict = "void",
        despite_preflight: bool = False,
    ) -> None:
        self.observer = observer
        self._in_flight: Verdict = in_flight
        self._despite_preflight = despite_preflight

    @property
    def observes(self) -> Observe:
        """Highest observation level of a trial: its cells if there is no observer."""
        return "cells" if self.observer is None else self.observer.observes

    def meet(self, robot: Robot) -> None:
        """Meet a robot that was opened; next is its pre-flight, in which it turns on the spot for a moment.

        Raises:
            RobotError: The observer cannot observe it.
        """
        if self.observer is not None:
            self.observer.meet(robot)
            self.observer.ready()

    def accept(self, preflight: Preflight) -> bool:
        """Return whether to continue after the pre-flight check."""
        return self._despite_preflight or not preflight.problems

    def settle(self, card: Card, problem: str) -> Verdict:
        """Say what becomes of a trial that was cut off."""
        return self._in_flight

    def place(self, card: Card) -> None:
        """Put the robot at its start, with the pen; return when it is in place.

        Raises:
            RobotError: The observer sees another arena than the study's.
        """
        if self.observer is not None:
            plan = TrialPlan(steps=card.n_steps, number=trial_seed(card))
            self.observer.place(plan, card.arena, card.observe)

    def watch(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Called at each step; True aborts the trial."""
        if self.observer is not None:
            self.observer.look()
        return False

    def drawn(self, card: Card, record: TrialRecord) -> Score | None:
        """Return the score of a trial if it is known when the robot stops; otherwise None, and `enter` will ask."""
        if self.observer is None:
            return None
        self.observer.look()
        return self.observer.score(card.arena)

    def enter(self, cards: Sequence[Card], *, is_full: bool) -> Iterable[tuple[int, Score]]:
        """Yield number and score of each of these trials, stored one by one. A trial left out is asked for later.

        Called with the trial just driven, and once the sheet is full with all of its trials that are not scored.
        """
        return ()

    def close(self, cards: Sequence[Card]) -> Sequence[int]:
        """Return numbers of trials whose scores are taken back before a generation is closed; none closes it."""
        return ()

    def lead(self, plan: TrialPlan, number: int, n: int) -> Led:
        """Put the robot at the start of plan `number` of n. Return whether to drive, repeat, or stop."""
        return "go"

    def measure(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord | None:
        """Return the trial with what a person measured of it; None has it driven again."""
        return trial


def trial_seed(card: Card) -> int:
    """Return the 32-bit seed of an emulated trial's sensor noise; another attempt has the same."""
    trial = card.trial
    text = f"{card.key}:{trial.replicate}:{trial.generation}:{trial.individual}"
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=4).digest(), "little")


_WORDS = ("right", "up and right", "up", "up and left", "left", "down and left", "down", "down and right")
_INCH = 0.0254


def start_words(arena: Arena) -> str:
    """Describe the start of a trial: distances from the left and the lower wall, and heading."""
    start = arena.start
    left, bottom = min(wall[0] for wall in arena.walls), min(wall[1] for wall in arena.walls)
    way = round(start.heading / (math.pi / 4)) % 8
    return (
        f"{(start.x - left) / _INCH:.1f} in from the left wall, {(start.y - bottom) / _INCH:.1f} in from the lower "
        f"one, facing {_WORDS[way]}."
    )
