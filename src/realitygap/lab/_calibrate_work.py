"""A calibration in its own process: unattended, or with an operator at a page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from realitygap.orders import CalibrateOrder
from realitygap.platforms import class_of, platform_of
from realitygap.records import NO_LINE, TrialRecord, read_observations, those_that_count
from realitygap.report import save_sensor_figure
from realitygap.study import (
    StoppedByPerson,
    make_calibration,
    parse_length,
    placing_words,
    with_ruled_end,
)
from realitygap.trials import Led, Operator, SheetObserver, TrialPlan, Verdict
from realitygap.world import INCH, Arena, Calibration, RobotModel, load_arena, load_robot

from ._channel import Channel, Message, Pulse

_QUESTIONS = {
    "ahead": "Distance ahead of the start [in]",
    "left": "Distance to the left of the start [in]",
    "turned": "Turn to the left, with all full turns [degrees]",
}


def work(channel: Channel, message: Message) -> None:
    """Drive the missing trials of a calibration, fit, and write the calibration.

    Args:
        channel: To the server.
        message: `order`, the message of a `CalibrateOrder`.
    """
    order = CalibrateOrder(**message["order"])
    out, platform = order.out or Path(), order.robot or ""
    arena, robot = load_arena(order.arena), load_robot(order.base or class_of(platform).base_robot)
    is_led = order.witness is None and platform_of(platform).needs_person
    growing = _Growing(channel, out.with_suffix(".trials.jsonl"), arena, robot)
    try:
        made = make_calibration(
            order,
            observer=_sheet_observer(channel) if is_led else None,
            operator=_PageOperator(channel, arena, robot, growing) if is_led else None,
            pulse=Pulse(channel).tell,
            tell=growing.tell,
        )
    except StoppedByPerson:
        channel.say("paused")
        return
    _tell_made(channel, made, out)


def _tell_made(channel: Channel, made: Calibration, out: Path) -> None:
    figure = ""
    if made.kind == "sensors":
        figure = save_sensor_figure(made, out.with_suffix(".svg")).read_text("utf-8")
    fitted = [each.model_dump() for each in made.fitted]
    channel.say(
        "made",
        fitted=fitted,
        notes=list(made.remarks),
        misspecified=bool(made.misspecified),
        p=made.misspecification_p,
        figure=figure,
    )


class _Growing:
    """Reports the number of trials and their readings while they are recorded."""

    def __init__(self, channel: Channel, kept: Path, arena: Arena, robot: RobotModel) -> None:
        self._channel, self._kept, self._arena, self._robot = channel, kept, arena, robot

    def tell(self, done: int, n: int) -> None:
        """Report the number of recorded trials."""
        trials = those_that_count(read_observations(self._kept).trials) if self._kept.exists() else []
        self._channel.say(
            "trials", done=done, n=n, readings=[self._point(k, each) for k, each in enumerate(trials)]
        )

    def _point(self, number: int, trial: TrialRecord) -> dict[str, Any]:
        """Return the position of a trial in the plot, and the mean reading of each sensor, 0..1."""
        at = float(number + 1)
        if trial.purpose == "sensors":
            right = max(x for wall in self._arena.walls for x in wall[::2])
            at = round((right - trial.start[0] - max(sensor.x for sensor in self._robot.range)) / INCH, 2)
        means = trial.readings.mean(axis=0) if len(trial.readings) else np.zeros(0)
        return {"at": at, "purpose": trial.purpose, "means": [round(float(mean), 4) for mean in means]}


class _PageOperator(Operator):
    """Asks an operator at a page to place the robot, and to measure with a ruler."""

    def __init__(self, channel: Channel, arena: Arena, robot: RobotModel, growing: _Growing) -> None:
        super().__init__()
        self._channel, self._arena, self._robot, self._growing = channel, arena, robot, growing

    def lead(self, plan: TrialPlan, number: int, n: int) -> Led:
        """State where the robot has to stand, and wait for the operator."""
        self._growing.tell(number, n)
        words = placing_words(plan, self._arena, self._robot)
        answer = self._channel.ask("place", text=words, trial=number, n=n).get("answer")
        if answer == "stop":
            return "stop"
        return "redo" if answer == "redo" and number else "go"

    def measure(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord | None:
        """Ask where a path ended; return None if it is to be driven again."""
        if plan.purpose != "path" or len(trial.poses):
            return trial
        is_straight = plan.commands[0, 0] != 0
        wanted = ["ahead", "left", "turned"] if is_straight else ["turned"]
        said = ""
        while True:
            questions = {name: _QUESTIONS[name] for name in wanted}
            answer = self._channel.ask("measure", questions=questions, said=said)
            if answer.get("redo"):
                return None
            given = {name: parse_length(str(answer.get(name, ""))) for name in wanted}
            if None not in given.values():
                ahead, left, turned = (float(given.get(name) or 0.0) for name in _QUESTIONS)
                return with_ruled_end(trial, ahead, left, turned)
            said = "Expected numbers such as 13.75, 13 3/4 or -2."


def _sheet_observer(channel: Channel) -> SheetObserver:
    """A person at a page, who taps the cells of trials that are drawn; the robot stands at its start already."""

    def pick(arena: Arena) -> list[int] | None:
        given = channel.ask("cells").get("cells") or []
        cells = {each for each in given if type(each) is int and 0 <= each < arena.grid.n_cells}
        return sorted(cells) or None

    def settle(problem: str, can_count: bool) -> Verdict:
        answer = channel.ask("settle", problem=problem, can_count=can_count).get("verdict")
        return "driven" if answer == "driven" else "void"

    return SheetObserver(pick, NO_LINE, settle=settle)
