"""The operator of a calibration at a terminal, who places the robot and measures the ends of paths."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

import realitygap
from realitygap._terminal import echo
from realitygap.errors import StudyError
from realitygap.trials import Operator

from ._keys import read_line

if TYPE_CHECKING:
    from realitygap.records import TrialRecord
    from realitygap.trials import Led, TrialPlan
    from realitygap.world import Arena, RobotModel

_KEYS = "Enter: continue, r: repeat the previous trial, q: stop for now: "


class CalibrationOperator(Operator):
    """Leads through the trials of a calibration.

    Args:
        arena: Arena of the robot.
        robot: Name of the robot.
        ask: Prints a question and waits for the answer; a terminal when not given.
        say: Prints.
    """

    def __init__(
        self,
        arena: Arena,
        robot: RobotModel,
        *,
        ask: Callable[[str], str] | None = None,
        say: Callable[[str], None] = echo,
    ) -> None:
        super().__init__()
        self._arena = arena
        self._robot = robot
        self._ask = ask or _ask_at_terminal
        self._say = say

    def lead(self, plan: TrialPlan, number: int, n: int) -> Led:
        """Print the place of the robot, and wait for Enter."""
        self._say(
            f"\nTrial {number + 1} of {n}: {realitygap.study.placing_words(plan, self._arena, self._robot)}"
        )
        while True:
            answer = self._ask(_KEYS).lower()
            if not answer:
                return "go"
            if answer in ("q", "quit"):
                return "stop"
            if answer in ("r", "redo") and number:
                return "redo"
            self._say(
                "There is no previous trial."
                if answer in ("r", "redo")
                else f"{answer!r} is not one of these keys."
            )

    def measure(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord | None:
        """Ask for the end of a path, unless an observer recorded it. None repeats the trial."""
        if plan.purpose == "sensors":
            means = "  ".join(f"{value:.2f}" for value in trial.readings.mean(axis=0))
            self._say(f"{len(trial.readings)} readings, on average {means}")
        if plan.purpose != "path" or len(trial.poses):
            return trial
        is_straight = plan.commands[0, 0] != 0
        questions = ["Distance ahead of its start [in]: ", "Distance to the left of its start [in]: "]
        answers: list[float | None] = [0.0, 0.0]
        if is_straight:
            answers = [self._number(question) for question in questions]
        answers.append(self._number("Total turn to the left, with full turns [degrees]: "))
        if None in answers:
            return None
        ahead, left, turned = (float(answer or 0.0) for answer in answers)
        return realitygap.study.with_ruled_end(trial, ahead, left, turned)

    def _number(self, question: str) -> float | None:
        """Return the measured number; None has the trial driven again."""
        while True:
            answer = self._ask(f"{question}(r: drive it again) ").lower()
            if answer in ("r", "redo"):
                return None
            value = realitygap.study.parse_length(answer)
            if value is not None:
                return value
            self._say(f"{answer!r} is not a number. Expected, for example, 13.75, 13 3/4, or -2.")


def _ask_at_terminal(question: str) -> str:
    if sys.stdin is None or not sys.stdin.isatty():
        raise StudyError(
            "There is no terminal in which to lead you through the trials. Name the witness of an emulator (--witness "
            "HOST:PORT), or fit what was recorded before (--from FILE)."
        )
    echo(question, nl=False)
    return read_line()
