"""A calibration: unattended, or with an operator at a page.

`CalibrationJob` is what pages see; `calibrate` runs in a process of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.errors import StudyError
from realitygap.orders import CalibrateOrder
from realitygap.platforms import base_robot_of, platform_of
from realitygap.records import NO_LINE, TrialRecord, existing_trials, read_observations, those_that_count
from realitygap.report import save_sensor_figure
from realitygap.study import (
    StoppedByPerson,
    make_calibration,
    parse_length,
    placing_words,
    with_ruled_end,
)
from realitygap.trials import Led, Operator, SheetObserver, TrialPlan, Verdict
from realitygap.world import INCH, Arena, RobotModel, load_arena, load_robot

from . import _messages as messages
from ._channel import Channel, Pulses
from ._files import check_name
from ._job import MeasuringJob, Pace
from ._mistakes import Mistakes

_LABELS = {
    "ahead": "Distance ahead of the start [in]",
    "left": "Distance to the left of the start [in]",
    "turned": "Turn to the left, with all full turns [degrees]",
}


def calibration_mistakes(root: Path, values: Mapping[str, Any]) -> Mistakes:
    """Return what is wrong in the fields of a calibration; a field that is missing is not checked."""
    mistakes = Mistakes()
    if "name" in values:
        with mistakes.in_field("name"):
            check_name(values["name"])
            out = root / f"{values['name']}.toml"
            if out.exists() and not existing_trials(out.with_suffix(".trials.sqlite")).exists():
                raise StudyError(f"There is another file {out.name}. Choose another name.")
    mistakes.in_order(CalibrateOrder, values, root)
    return mistakes


class CalibrationJob(MeasuringJob):
    """A calibration.

    Attributes:
        name: Of its files.
        order: The order.
        kind: What is calibrated.
        platform: The platform that is measured.
        n_done, n_trials: Number of trials: recorded, and total.
        readings: Point of the plot for each recorded trial.
        made: Result of the fit; None before.
    """

    STOPPED = "Stopped. Recorded trials are saved. Resume to continue."

    def __init__(self, order: CalibrateOrder, root: Path, changed: Callable[[], None]) -> None:
        self.name = "" if order.out is None else order.out.stem
        self.order = order
        self.kind = order.what
        self.n_done = self.n_trials = 0
        self._pace = Pace()
        self.readings: list[messages.ReadingPoint] = []
        self.made: messages.CalibrationMade | None = None
        super().__init__(messages.CalibrationWork(order.message()), order.robot or "", root, changed)

    @property
    def has_met(self) -> bool:
        """True if a robot has been measured."""
        return bool(self.n_trials) and bool(self.port)

    @property
    def can_resume(self) -> bool:
        """True if it has ended without a result, and not by an error before its first trial that no robot caused."""
        has_begun = self.n_done > 0 or self.is_link_lost
        return self.is_over and self.made is None and (has_begun or not self.is_failed)

    @property
    def progress(self) -> str:
        """Progress in words."""
        if self.outcome is not None:
            return self.outcome
        if not self.n_trials:
            return "Starting…"
        number = min(self.n_done + 1, self.n_trials)
        return f"Trial {number} of {self.n_trials}{self._pace.words}"

    @property
    def robot_action(self) -> str:
        """Sentence that states that a robot drives; empty while an operator is asked."""
        drives = self.has_robot and self.ask is None
        return "The robot is driving a trial of a calibration." if drives else ""

    @property
    def _done_words(self) -> str:
        return f"{self.n_done} of {self.n_trials} trials. They are saved."

    def _take(self, message: messages.Message) -> None:
        match message:
            case messages.CalibrationTrials():
                self._pace.note(message.done / max(message.n, 1))
                self.n_done, self.n_trials = message.done, message.n
                self.readings = message.readings
            case messages.CalibrationMade():
                self.made = message
                self._conclude(f"Complete. Saved as {self.name}.toml. Use it as sim:{self.name}.toml.")
            case messages.CalibrationPaused():
                self._conclude(self.STOPPED)
            case _:
                super()._take(message)


# in a process


def calibrate(channel: Channel, work: messages.CalibrationWork) -> None:
    """Drive the missing trials of a calibration, fit, and write the calibration."""
    order = CalibrateOrder(**work.order)
    out, platform = order.out or Path(), order.robot or ""
    arena, robot = load_arena(order.arena), load_robot(order.base or base_robot_of(platform))
    is_led = order.witness is None and platform_of(platform).needs_person
    growing = _Growing(channel, out.with_suffix(".trials.sqlite"), arena, robot)
    try:
        made = make_calibration(
            order,
            observer=_sheet_observer(channel) if is_led else None,
            operator=_PageOperator(channel, arena, robot, growing) if is_led else None,
            pulse=Pulses(channel).tell,
            tell=growing.tell,
        )
    except StoppedByPerson:
        channel.say(messages.CalibrationPaused())
        return
    if made.kind == "sensors":
        save_sensor_figure(made, out.with_suffix(".svg"))
    fitted = [each.model_dump() for each in made.fitted]
    channel.say(
        messages.CalibrationMade(fitted, list(made.remarks), bool(made.misspecified), made.misspecification_p)
    )


class _Growing:
    """Reports the number of trials and their readings while they are recorded."""

    def __init__(self, channel: Channel, kept: Path, arena: Arena, robot: RobotModel) -> None:
        self._channel, self._kept, self._arena, self._robot = channel, kept, arena, robot

    def tell(self, done: int, n: int) -> None:
        """Report the number of recorded trials."""
        trials = those_that_count(read_observations(self._kept).trials) if self._kept.exists() else []
        readings = [self._point(k, trial) for k, trial in enumerate(trials)]
        self._channel.say(messages.CalibrationTrials(done, n, readings))

    def _point(self, number: int, trial: TrialRecord) -> messages.ReadingPoint:
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
        choice = self._channel.ask(messages.StartQuestion(words, number, n)).choice
        if choice == "stop":
            return "stop"
        return "redo" if choice == "redo" and number else "go"

    def measure(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord | None:
        """Ask where a path ended; return None if it is to be driven again."""
        if plan.purpose != "path" or len(trial.poses):
            return trial
        is_straight = plan.commands[0, 0] != 0
        wanted = ["ahead", "left", "turned"] if is_straight else ["turned"]
        problem = ""
        while True:
            answer = self._channel.ask(
                messages.LengthsQuestion({name: _LABELS[name] for name in wanted}, problem)
            )
            if answer.choice == "redo":
                return None
            given = {name: parse_length(answer.lengths.get(name, "")) for name in wanted}
            if None not in given.values():
                ahead, left, turned = (float(given.get(name) or 0.0) for name in _LABELS)
                return with_ruled_end(trial, ahead, left, turned)
            problem = "Expected numbers such as 13.75, 13 3/4 or -2."


def _sheet_observer(channel: Channel) -> SheetObserver:
    """A person at a page, who taps the cells of trials that are drawn; the robot stands at its start already."""

    def pick(arena: Arena) -> list[int] | None:
        cells = {
            cell for cell in channel.ask(messages.CellsQuestion()).cells if 0 <= cell < arena.grid.n_cells
        }
        return sorted(cells) or None

    def settle(problem: str, can_count: bool) -> Verdict:
        choice = channel.ask(messages.RepeatQuestion(problem, can_count)).choice
        return "driven" if choice == "driven" else "void"

    return SheetObserver(pick, NO_LINE, settle=settle)
