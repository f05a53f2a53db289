"""Strategies that make the simulator agree with the target first: calibrated, posterior, and recommended."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from realitygap.errors import StudyError
from realitygap.platforms import SimPlatform
from realitygap.records import Observe, write_whole
from realitygap.runs import Condition
from realitygap.trials import Target
from realitygap.world import Calibration, RobotModel, load_calibration, load_robot

from .._calibrate.hold_out import FITTED, NOMINAL, POSTERIOR
from .._calibrate.one import refuse_other_sensors
from .._calibrate.whole import calibrate_all
from .attempt import Attempt, allow_trials
from .noise import needs_sim
from .simulated import Champion
from .uncalibrated import best_on_target

SELECTING = 2
"""One trial in so many is kept for choosing among champions where calibrating is on the budget: a fit that is a little
wrong costs less where its champions are tried, and one by half of the trials is hardly worse."""

Numbers = Literal["calibrated", "posterior", "recommended"]
"""The numbers of a calibration with which a simulator runs."""

_RECOMMENDED = {FITTED: "calibrated", POSTERIOR: "posterior", NOMINAL: "nominal", "": "posterior"}
"""Numbers to simulate with, by `Calibration.recommended`."""


def calibrated(attempt: Attempt) -> Champion:
    """Evolve in the simulator with the fitted numbers, and choose by the trials that are left, as `select` does."""
    return best_on_target(attempt, attempt.champions(fitted(attempt, "calibrated")))


def posterior(attempt: Attempt) -> Champion:
    """Evolve with a robot of the posterior for each trial, and choose by the trials that are left, as `select` does."""
    return best_on_target(attempt, attempt.champions(fitted(attempt, "posterior")))


def recommended(attempt: Attempt) -> Champion:
    """Evolve with the numbers that the calibration recommends, and choose by the trials that are left."""
    return best_on_target(attempt, attempt.champions(fitted(attempt, "recommended")))


def fitted(attempt: Attempt, numbers: Numbers) -> Condition:
    """Return the condition on the simulator that was calibrated to the target, on the budget."""
    needs_sim(attempt.condition, numbers)
    calibration, base = attempt.calibration(attempt.condition, attempt.left)
    attempt.target.spent += calibration.trials
    return fitted_condition(attempt.condition, calibration, numbers, base)


def fitted_condition(
    condition: Condition, calibration: Calibration, numbers: Numbers, base: RobotModel | None = None
) -> Condition:
    """Return the condition on a simulator that was calibrated.

    Args:
        condition: A condition on platform `sim`; the robot's numbers that it sets itself stay.
        calibration: The fit.
        numbers: `calibrated`: the estimate. `posterior`: a draw for each trial. `recommended`: the one of these that
            predicted held-out trials best, or the numbers that the fit started from if they did; draws of the
            posterior if no trial was held out.
        base: The robot on whose numbers the fit builds; as the calibration names it if not given.
    """
    keep = ("steps", "step_s", "contact", "noise", "noisy_reading", "precision", "set")
    platform = needs_sim(condition, numbers)
    old = {name: getattr(platform, name) for name in keep}
    kind = numbers if numbers != "recommended" else _RECOMMENDED[calibration.recommended]
    robot = base or load_robot(calibration.robot)
    if kind != "nominal":
        robot = robot.with_numbers(calibration.numbers)
    fitted = {
        "robot": robot.model_copy(update=calibration.step),
        "draws": {} if kind == "nominal" else dict(calibration.draws),
        "randomize": "posterior" if kind == "posterior" else "no",
    }
    return condition.model_copy(update={"on": SimPlatform(**{**old, **fitted}), "name": numbers})


@dataclass(frozen=True)
class Calibrating:
    """Reads the calibration that was given, or makes one on the budget; all strategies that calibrate share it.

    Attributes:
        target: Observed target.
        folder: Folder of calibrations and their trials.
        first_number: Number of the first trial.
        replicate: Replicate of the transfer.
        seed: Seed of the trials' commands, and of the fit.
        observe: Observation level.
        file: Given calibration; None if there is none.
        tell: Called with the progress in words.
    """

    target: Target
    folder: Path
    first_number: int
    replicate: int
    seed: int
    observe: Observe
    file: Path | None
    tell: Callable[[str], None]

    def __call__(self, condition: Condition, left: int) -> tuple[Calibration, RobotModel]:
        """Return the calibration for a budget of `left` trials, and the robot on whose numbers it builds."""
        if self.file is None:
            return self._on_budget(condition, left - left // SELECTING), needs_sim(
                condition, "calibrated"
            ).robot
        calibration = load_calibration(self.file)
        return calibration, load_robot(calibration.robot)

    def refuse(self, condition: Condition, left: int) -> None:
        """Raise an error if there can be no calibration for a budget of `left` trials.

        Raises:
            StudyError: The one that was given took more trials than that, or the target has other sensors than the
                robot of the condition.
        """
        if self.file is None:
            if left:
                refuse_other_sensors(needs_sim(condition, "calibrated").robot, self.target)
        elif (trials := load_calibration(self.file).trials) > left:
            raise StudyError(
                f"{self.file} took {trials} trials, more than a budget of {left}. Give a larger budget, or a "
                "calibration of fewer trials."
            )

    def _on_budget(self, condition: Condition, n: int) -> Calibration:
        """Return a calibration by n trials, or the one that is there."""
        name = f"{n}-{self.observe}-{self.replicate}"
        path = self.folder / f"{name}.toml"
        if path.exists():
            return load_calibration(path)
        self.tell(f"calibrating by {n} trials, {self.observe} observed")
        trials = self.folder / f"{name}.sqlite"
        with allow_trials(self.target, trials, n, self.first_number, observe=self.observe) as kept:
            try:
                calibration = calibrate_all(
                    kept,
                    robot=needs_sim(condition, "calibrated").robot,
                    observe=self.observe,
                    budget=n,
                    seed=self.seed,
                )
            except ValueError as error:
                raise StudyError(f"{error} The trials are saved in {trials}.") from error
        write_whole(path, calibration.to_toml().encode(), within=self.folder)
        return calibration
