"""The operator of a physical study with a camera above the robot, which scores the trials."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from realitygap.errors import RobotError
from realitygap.records import Score
from realitygap.robots import Command, Observation, Robot
from realitygap.trials import Card, DrivenTrial, Operator, Preflight, Verdict
from realitygap.world import Grid

from ._camera_attendant import Looking, seen_between
from ._tracked import score_along


class CameraOperator:
    """Scores each trial by the robot's track as soon as it stands; all else is another operator's.

    What the camera did not see is asked for as without one.

    Args:
        beside: Who places the robot and closes generations.
        camera: Who looks.
        grid: Of the arena that it looks at.
        say: Told what was not seen.
    """

    who = "camera"

    def __init__(
        self, beside: Operator, camera: Looking, grid: Grid, say: Callable[[str], None] = lambda _: None
    ) -> None:
        self._beside, self._camera, self._grid, self._say = beside, camera, grid, say
        self._times: list[float] = []

    def meet(self, robot: Robot) -> None:
        """A robot was opened."""
        self._beside.meet(robot)

    def accept(self, preflight: Preflight) -> bool:
        """Whether to go on after the pre-flight."""
        return self._beside.accept(preflight)

    def settle(self, card: Card, problem: str) -> Verdict:
        """What becomes of a trial that was cut off."""
        return self._beside.settle(card, problem)

    def place(self, card: Card) -> None:
        """Put the robot at its start, and look from then on."""
        self._beside.place(card)
        self._times = []
        self._camera.begin()

    def watch(self, card: Card, step: int, seen: Observation, command: Command) -> bool:
        """Note the time of the step."""
        self._times.append(self._camera.now())
        return self._beside.watch(card, step, seen, command)

    def drawn(self, card: Card, driven: DrivenTrial) -> Score | None:
        """The cells along the robot's line; what another says where the camera did not see it."""
        told = self._beside.drawn(card, driven)
        if told is not None or not self._times:
            return told
        if card.arena.grid != self._grid:
            self._say(f"The camera looks at another arena than trial {card.trial.trial} is in.")
            return None
        times = np.array([*self._times, self._camera.now()])
        try:
            track = seen_between(self._camera, float(times[0]), float(times[-1]))
        except RobotError as error:
            self._say(f"{error} Count its cells by hand.")
            return None
        score = score_along(track, times, self._grid, self.who)
        self._say(f"The camera counts {len(score.cells)} cells.")
        return score

    def enter(self, cards: Sequence[Card], *, is_full: bool) -> Iterable[tuple[int, Score]]:
        """What was drawn in trials that the camera did not score."""
        return self._beside.enter(cards, is_full=is_full)

    def close(self, cards: Sequence[Card]) -> Sequence[int]:
        """Whether to close a generation."""
        return self._beside.close(cards)
