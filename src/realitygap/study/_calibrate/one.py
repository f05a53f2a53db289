"""A calibration: trials on a target, kept as they end, and the fit to them."""

from __future__ import annotations

import datetime
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from realitygap._version import __version__
from realitygap.calibration import Fit, of_one_length, ruled, step_of
from realitygap.errors import RecordError, StudyError, did_you_mean
from realitygap.platforms import DEFAULT_ROBOT, SimPlatform, split_spec
from realitygap.records import (
    Ledger,
    Observations,
    Observe,
    TrialRecord,
    read_observations,
    sees,
    those_that_count,
    write_whole,
)
from realitygap.trials import Operator, Target, TrialPlan
from realitygap.world import Arena, Calibration, Fitted, RobotModel, load_robot, read_calibration

from .._kept_target import PATH, KeptTarget
from .._targets import open_trials, refuse_more_than_is_seen
from .kinds import KINDS, Kind
from .marker import is_under_camera, with_marker, without_marker
from .whole import ALL_TRIALS, LEAST_TO_CHOOSE, calibrate_all

SEED_STRIDE = 10_000
"""Distance between the numbers of trials of calibrations with different seeds."""

NO_READINGS = ("path", "motion", "contact")
"""Kinds of calibration that also work with trials without readings of range sensors."""

BY_CAMERA = ("motion", "all")
"""Kinds of calibration that fit the marker of a camera, too."""

Tell = Callable[[int, int], None]
"""Called with the number of finished trials and of all trials."""


def calibrate(
    kind: str,
    target: Target,
    *,
    robot: str | Path = DEFAULT_ROBOT,
    observe: Observe = "cells",
    budget: int | None = None,
    seed: int = 0,
    trials_file: Path | None = None,
    choose: bool = False,
    operator: Operator | None = None,
    tell: Tell | None = None,
    hold: Callable[[Ledger], object] | None = None,
) -> Calibration:
    """Run the trials of a calibration on a target, and fit a simulated robot to the observations.

    Args:
        kind: path, sensors, motion, contact or all.
        target: Target of the calibration.
        robot: Robot on which the fit builds: a name, a file, or an earlier calibration, whose numbers stay where this
            one has none.
        observe: Observation level.
        budget: Trials in all; what the kind needs when not given.
        seed: Seed of the trials and draws.
        trials_file: File in which trials are saved as they end, to resume from. Default: none.
        choose: True to choose the last trials of `all` after a first fit, as the most informative ones.
        operator: Puts the robot where it has to stand; None if the target places itself.
        tell: Called after each trial.
        hold: Called with the open file before the first trial, such as to lock a design in it.

    Raises:
        StudyError: There is no such kind, or the target, the robot and the kind do not go together.
        RobotError: The robot failed; what was recorded is kept.
        StoppedByPerson: The operator was told to stop; what was recorded is kept.
    """
    _refuse(kind, target, robot, observe, budget)
    if choose and kind != "all":
        raise StudyError(f"--choose is only for all: the trials of {kind} are fixed in advance.")
    if choose and budget is not None and budget < LEAST_TO_CHOOSE:
        raise StudyError(
            f"--budget is {budget}, but choosing the last trials needs at least {LEAST_TO_CHOOSE}, because the "
            "choice depends on the first ones. Give more, or leave out --choose."
        )
    # before a file is made, because it may refuse
    plans = [] if choose else _plans(KINDS[kind], target, robot, budget, seed)
    file = None if trials_file is None else open_trials(trials_file, target, observe, robot=str(robot))
    with KeptTarget(target, file, operator=operator) as kept:
        if file is not None and hold is not None:
            hold(file)
        if choose:
            return _chosen(kept, robot, observe, ALL_TRIALS if budget is None else budget, seed, tell)
        return _calibrated(kind, kept, robot, observe, plans, seed, tell)


def _calibrated(
    kind: str,
    target: Target,
    robot: str | Path,
    observe: Observe,
    plans: Sequence[TrialPlan],
    seed: int,
    tell: Tell | None,
) -> Calibration:
    count = _counting(len(plans), tell)
    trials = target.carry_out(plans, observe, lambda _, trial: count(trial))
    parts = _fit(
        kind, trials, robot, target.arena, observe, seed, is_under_camera(target.name, target.label, observe)
    )
    return calibration_of(
        kind, parts, robot, target.name, target.label, observe, trials, target.arena.name, seed
    )


def _chosen(
    target: Target, robot: str | Path, observe: Observe, n: int, seed: int, tell: Tell | None
) -> Calibration:
    """Return a calibration of everything whose last trials are chosen after a first fit."""
    try:
        made = calibrate_all(
            target,
            robot=load_robot(robot),
            observe=observe,
            budget=n,
            seed=seed,
            choose=True,
            keep=_counting(n, tell),
        )
    except ValueError as error:
        raise StudyError(str(error)) from error
    parts = Fit(
        made.fitted,
        made.numbers,
        made.draws,
        made.method,
        made.notes,
        made.misspecified,
        made.misspecification_p,
        made.evidence,
        made.verdict,
        made.reasons,
    )
    made_of = calibration_of(
        "all", parts, robot, target.name, target.label, observe, (), target.arena.name, seed
    )
    return made_of.model_copy(update={"trials": made.trials, "step_s": made.step_s})


def _counting(n: int, tell: Tell | None) -> Callable[[TrialRecord], None]:
    """Return a function that gets each whole trial, and reports how many of n there are."""
    numbers: set[int] = set()

    def count(trial: TrialRecord) -> None:
        numbers.add(trial.number)
        if tell is not None:
            tell(len(numbers), n)

    return count


def _refuse(kind: str, target: Target, robot: str | Path, observe: Observe, budget: int | None) -> None:
    """Raise an error if a calibration cannot run.

    Raises:
        StudyError: It cannot be.
    """
    _check_kind(kind)
    base, made = load_robot(robot), KINDS[kind]
    if budget is not None and budget < made.least:
        raise StudyError(
            f"--budget is {budget}, but a calibration of {kind} needs at least {made.least} trials."
        )
    if observe not in made.observes:
        raise _too_little_seen(kind, observe)
    refuse_more_than_is_seen(target, observe)
    refuse_other_sensors(base, target, str(robot))


def _too_little_seen(kind: str, observe: Observe) -> StudyError:
    return StudyError(
        f"{observe} alone does not identify {kind}. Record more (--observe "
        f"{' or '.join(KINDS[kind].observes)}); `calibrate all` also works with cells."
    )


def refuse_other_sensors(robot: RobotModel, target: Target, named: str = "") -> None:
    """Raise an error if a target has another number of range sensors than the robot on whose numbers a fit builds.

    Args:
        robot: The robot.
        target: The target.
        named: The user's word for the robot. Default: its name.

    Raises:
        StudyError: The numbers differ.
    """
    if len(robot.range) == target.n_sensors:
        return
    advice = "Name the robot that the target is: --base ROBOT, or a study with that robot."
    if split_spec(target.name)[0] == SimPlatform.name:
        advice = f"To simulate that robot, name the target sim:{named or robot.name}. Otherwise n{advice[1:]}"
    raise StudyError(
        f"{target.name} has {target.n_sensors} range sensors and robot {robot.name!r} {len(robot.range)}. {advice}"
    )


def calibrate_from(
    kind: str, data: Path, *, robot: str | Path | None = None, observe: Observe | None = None, seed: int = 0
) -> Calibration:
    """Fit a simulated robot to trials that were recorded before.

    Args:
        kind: As in `calibrate`.
        data: A file of observed trials.
        robot: Robot on which the fit builds. Default: the one in the file.
        observe: Observation level, to use less than was recorded.
        seed: Seed of the draws.

    Raises:
        StudyError: There is no such kind, or the file has nothing to fit it to.
        RecordError: The file cannot be read.
    """
    _check_kind(kind)
    observations = read_observations(data)
    robot = observations.head.robot if robot is None else robot
    arena = _arena_of(data, observations)
    seen = observe or observations.head.observe
    if seen not in KINDS[kind].observes:
        raise _too_little_seen(kind, seen)
    if not sees(observations.head.observe, seen):
        raise StudyError(f"--observe is {seen!r}, and {data} has no more than {observations.head.observe!r}.")
    trials = [_seen_as(trial, seen) for trial in those_that_count(observations.trials)]
    if kind not in NO_READINGS or any(trial.readings.shape[1] for trial in trials):
        _refuse_other_readings(trials, load_robot(robot))
    has_marker = is_under_camera(observations.head.target, observations.head.label, seen)
    parts = _fit(kind, trials, robot, arena, seen, seed, has_marker)
    made = calibration_of(
        kind, parts, robot, observations.head.target, observations.head.label, seen, trials, arena.name, seed
    )
    more = {"measured": measured_at(data)}
    return made.model_copy(
        update=more | ({"notes": (*made.notes, observations.problem)} if observations.problem else {})
    )


def measured_at(path: Path) -> str:
    """Return when a file of measurements was last changed, ISO 8601."""
    last = datetime.datetime.fromtimestamp(path.stat().st_mtime, datetime.UTC)
    return last.isoformat(timespec="seconds")


def _arena_of(path: Path, found: Observations) -> Arena:
    try:
        return Arena.from_dict(dict(found.head.arena))
    except (KeyError, TypeError, ValueError) as error:
        raise RecordError(
            f"{path} is damaged: its first line has no arena that can be read ({error})."
        ) from None


def _refuse_other_readings(trials: Sequence[TrialRecord], robot: RobotModel) -> None:
    others = {trial.readings.shape[1] for trial in trials if len(trial.readings)} - {len(robot.range)}
    if others:
        raise StudyError(
            f"The trials have {min(others)} range sensors and robot {robot.name!r} {len(robot.range)}. Build on the "
            "robot that it was (--base ROBOT)."
        )


def save_calibration(path: str | Path, calibration: Calibration) -> None:
    """Write a calibration, whole: the file that was there or the new one, and nothing between.

    A robot's file that it builds on is named as it is found from the folder of `path`.

    Raises:
        RecordError: It cannot be written.
    """
    path = Path(path)
    robot = calibration.robot
    if Path(robot).is_file():
        robot = os.path.relpath(Path(robot).resolve(), path.resolve().parent)
    write_whole(path, calibration.model_copy(update={"robot": robot}).to_toml().encode())


def _check_kind(kind: str) -> None:
    if kind not in KINDS:
        raise StudyError(f"Cannot calibrate {kind!r}. {did_you_mean(kind, KINDS)}")


def _plans(
    kind: Kind, target: Target, robot: str | Path, budget: int | None, seed: int
) -> Sequence[TrialPlan]:
    paced = load_robot(robot).model_copy(update={"step_s": target.step_s})
    try:
        plans = kind.plans(target.arena, paced, *([] if budget is None else [budget]))
    except ValueError as error:
        raise StudyError(str(error)) from error
    return [replace(plan, number=plan.number + SEED_STRIDE * (seed % 1000)) for plan in plans]


def _fit(
    kind: str,
    trials: Sequence[TrialRecord],
    robot: str | Path,
    arena: Arena,
    observe: Observe,
    seed: int,
    has_marker: bool,
) -> Fit:
    base = load_robot(robot)
    alike, left_out = (trials, "") if kind == "sensors" else of_one_length(trials)
    marker = None
    try:
        if has_marker and kind in BY_CAMERA:
            alike, marker = without_marker(alike, base, arena, seed)
        parts = with_marker(KINDS[kind].fit(alike, base, arena, observe, seed), marker)
    except ValueError as error:
        raise StudyError(str(error)) from error
    return replace(parts, notes=(*parts.notes, left_out)) if left_out else parts


def _seen_as(trial: TrialRecord, observe: Observe) -> TrialRecord:
    """Return a trial with no more than was to be observed."""
    if observe != "track" and len(trial.poses) and trial.purpose == PATH:
        trial = ruled(trial)
    return trial.seen_as(observe)


def calibration_of(
    kind: str,
    parts: Fit,
    robot: str | Path,
    target: str,
    label: str,
    observe: Observe,
    trials: Sequence[TrialRecord],
    arena: str,
    seed: int,
) -> Calibration:
    """Return the parts of a fit laid over an earlier calibration, where it builds on one."""
    below = read_calibration(robot)
    numbers, draws = dict(parts.numbers), {name: list(map(float, parts.draws[name])) for name in parts.draws}
    fitted, notes = parts.fitted, parts.notes
    flagged, p = parts.misspecified, parts.misspecification_p
    name = str(robot)
    _refuse_no_robot(parts, robot, target)
    step_s = round(step_of(of_one_length(trials)[0]), 4) if trials and kind != "sensors" else 0.0
    if below is not None:
        step_s = step_s or below.step_s
        name = below.robot
        numbers = {**below.numbers, **numbers}
        draws = _paired(below.draws, draws)
        fitted = (*_still_said(below.fitted, parts), *fitted)
        notes = (*notes, f"Builds on {Path(robot).name}: {below.kind} of {below.target}, {below.date}.")
        if below.misspecified and kind != "all":  # which fits all numbers anew
            flagged, p = True, min(p, below.misspecification_p)
            notes = (*notes, *below.notes)
    return Calibration(
        kind=kind,
        robot=name,
        target=target,
        label=label,
        observe=observe,
        trials=len(trials),
        step_s=step_s,
        date=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        arena=arena,
        seed=seed,
        software=f"realitygap {__version__}",
        method=parts.method,
        fitted=tuple(fitted),
        numbers=numbers,
        draws={key: tuple(values) for key, values in draws.items()},
        misspecified=flagged,
        misspecification_p=p,
        notes=tuple(notes),
        evidence=parts.evidence,
        verdict=parts.verdict,
        reasons=parts.reasons,
    )


def _still_said(below: Sequence[Fitted], parts: Fit) -> list[Fitted]:
    """Return the warnings of an earlier calibration about numbers that a later one has not refitted.

    `range.amplitude` is that of all sensors together, and `range.0.amplitude` of one; steps of a path follow from
    gains.
    """

    def of_all(name: str) -> str:
        return re.sub(r"\.\d+\.", ".", name)

    anew = {of_all(name) for name in (*(each.name for each in parts.fitted), *parts.numbers)}
    has_other_gains = "drive.gain_left" in anew
    return [
        each
        for each in below
        if of_all(each.name) not in anew and not (has_other_gains and each.name.startswith("path."))
    ]


def _refuse_no_robot(parts: Fit, robot: str | Path, target: str) -> None:
    """Raise an error if no robot can have the fitted numbers.

    Raises:
        StudyError: There can be no such robot, for example with a gain below 0.
    """
    try:
        load_robot(robot).with_numbers(parts.numbers)
    except ValueError as error:
        message = "; ".join(line.removeprefix("RobotModel.") for line in str(error).split("\n"))
        raise StudyError(
            f"The numbers fitted to {target} are not a valid robot: {message} Did it drive backward on a forward "
            "command, or turn in the wrong direction? Check which end is the front, and that left and right "
            "are not swapped. Saved trials are safe."
        ) from None


def _paired(
    below: Mapping[str, Sequence[float]], above: Mapping[str, Sequence[float]]
) -> dict[str, list[float]]:
    """Return draws of two calibrations as draws of both, row by row at random: they were fitted apart."""
    n = max((len(values) for values in (*below.values(), *above.values())), default=0)
    rng = np.random.default_rng(0)

    def spread(draws: Mapping[str, Sequence[float]]) -> dict[str, list[float]]:
        size = max((len(values) for values in draws.values()), default=1)
        rows = np.concatenate([rng.permutation(size) for _ in range(-(-n // size))])[:n]
        return {name: np.asarray(values)[rows].tolist() for name, values in draws.items()}

    return {name: values for name, values in spread(below).items() if name not in above} | spread(above)
