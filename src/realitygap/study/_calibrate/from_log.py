"""A calibration of a drive to the trials of a log that another program wrote."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from realitygap.calibration import (
    LogPrediction,
    MotionLog,
    MotionLogFit,
    PathErrors,
    Steps,
    fit_motion_logs,
    look_up_motion,
    motion_log,
    path_errors,
    summary_of,
)
from realitygap.errors import StudyError
from realitygap.logs import Diagnosis, Log, MappedLog, diagnose, mapped_logs, read_logs, robot_of, target_of
from realitygap.platforms import JyroPlatform
from realitygap.records import Observe
from realitygap.world import Calibration, RobotModel

from .hold_out import FITTED, NOISE, NOMINAL, TABLE, Compared, HoldOut, chosen_parts
from .one import calibration_of, measured_at

BLOCKS = 4
"""Parts of a log, each of which is fitted in its first half and predicted in its second."""
FEWEST_STEPS = 20
"""Minimum number of steps of a log: fewer say nothing about a half that is held out."""
NOISE_DRAWS = 40
N_SPEEDS = 3
LEFT_OUT = " The others are too short, stand still, or show no poses or encoders."
FITTED_MISTAKES = ("clock", "heading offset")
HARMLESS = ("half track", "double track", *FITTED_MISTAKES)
"""Mistakes that a fit survives: they are noted, unless its camera shows them."""

Floats = NDArray[np.float64]
Trial = tuple[Log, int]
"""A trial, and the index of its file: the camera of all trials of a file is the same."""


def calibrate_from_log(
    path: str | Path | Sequence[str | Path],
    *,
    map_file: str | Path | None = None,
    base: str | Path | None = None,
    hold_out: HoldOut = 0.5,
    seed: int = 0,
    step_s: float | None = None,
    drop_bad_rows: bool = False,
) -> Calibration:
    """Fit the drive of a robot to logs of commands, with poses or encoders.

    Args:
        path: The log; or several logs of one robot, folders of logs, and patterns, the trials of which count alike.
        map_file: Mapping of all logs. Default: that next to each log, or a guess by the names of its columns.
        base: The robot that drove, by name or file; as the mapping says if not given.
        hold_out: The part that the fit does not see. A share: the end of each trial; a trial that is too short is seen
            wholly. blocks: each trial is cut into four, each is fitted in its first half and predicted in its second,
            and the numbers are those of a fit to everything.
        seed: Seed of the draws.
        step_s: Length of a step, in place of the mapping's [s].
        drop_bad_rows: Whether rows with mistakes are left out.

    Raises:
        StudyError: The log shows too little, or wheels and poses do not go together.
        LogError: The log cannot be read.
    """
    mapped = mapped_logs(path, map_file, step_s=step_s)
    path = target_of([each.path for each in mapped])
    log_map = mapped[0].log_map
    name, robot = robot_of(log_map, None if base is None else str(base))
    trials, n_logs = _usable(path, mapped, robot, drop_bad_rows=drop_bad_rows)
    logs = [log for log, _ in trials]
    longest = max(logs, key=lambda log: len(log.commands))
    diagnosis = diagnose(longest, robot.drive.speed, robot.drive.track)
    _refuse_mistakes(path, diagnosis)
    fit, compared = _fit(path, trials, robot, hold_out, seed)
    rows = dict.fromkeys(note for log in logs for note in log.notes)
    origins = ", ".join(dict.fromkeys(each.origin for each in mapped))
    notes = [f"Mapping: {origins}.", *rows, *_notes(diagnosis), *fit.notes]
    if n_logs > 1:
        notes.append(f"The fit uses {len(logs)} of {n_logs} trials.{LEFT_OUT if len(logs) < n_logs else ''}")
    given = {"drive.speed": log_map.speed, "drive.track": log_map.track}
    parts = chosen_parts(
        replace(fit, notes=tuple(notes)), compared, {key: value for key, value in given.items() if value}
    )
    observe: Observe = "track" if len(longest.poses) else "encoders"
    arena = log_map.arena or "open"
    made = calibration_of("motion", parts, name, path, log_map.label, observe, (), arena, seed)
    more = {"trials": len(logs), "step_s": round(longest.step_s, 4), "measured": measured_at(mapped[0].path)}
    return made.model_copy(update=more)


def _usable(
    path: str, mapped: Sequence[MappedLog], robot: RobotModel, *, drop_bad_rows: bool
) -> tuple[list[Trial], int]:
    """Return the trials of logs that a fit can use, and the number of all.

    Raises:
        StudyError: None can be used; the message names what the longest lacks.
    """
    every = [
        (log, file)
        for file, each in enumerate(mapped)
        for log in read_logs(each.path, each.log_map, robot, drop_bad_rows=drop_bad_rows)
    ]
    longest = max((log for log, _ in every), key=lambda log: len(log.commands), default=None)
    if longest is None or not any(len(log.poses) or len(log.wheels) for log, _ in every):
        raise StudyError(
            f"{path} has commands alone. Expected poses or encoders, too: add [poses] or [wheels] to the mapping."
        )
    if len(longest.commands) < FEWEST_STEPS:
        raise StudyError(
            f"{path} has {len(longest.commands)} steps of {longest.step_s:.3g} s, expected at least {FEWEST_STEPS}. "
            "Record more, or choose a shorter step_s."
        )
    usable = []
    error = None
    for log, file in every:
        try:
            _motion_log(log)
        except ValueError as problem:
            error = problem if log is longest else error
        else:
            if len(log.commands) >= FEWEST_STEPS:
                usable.append((log, file))
    if not usable:
        raise StudyError(f"{path}: {error}")
    return usable, len(every)


def _refuse_mistakes(path: str, diagnosis: Diagnosis) -> None:
    """Raise an error if wheels and poses contradict each other.

    Raises:
        StudyError: They contradict each other; the message has every mistake.
    """
    messages = [mistake.message for mistake in diagnosis.mistakes if mistake.kind not in HARMLESS]
    if messages:
        raise StudyError(f"{path} cannot be fitted as its mapping has it. {' '.join(messages)}")


def _notes(diagnosis: Diagnosis) -> list[str]:
    notes = [
        f"Check ({mistake.kind}): {mistake.message}"
        for mistake in diagnosis.mistakes
        if mistake.kind not in FITTED_MISTAKES
    ]
    offset = diagnosis.offset
    if offset is not None:
        notes.append(f"Poses follow commands by {offset}, a robot's lag and delay included.")
    return notes


def _fit(
    path: str, trials: Sequence[Trial], robot: RobotModel, hold_out: HoldOut, seed: int
) -> tuple[MotionLogFit, Compared | None]:
    """Return the fit to all trials, and the errors on the parts that a fit did not see."""
    try:
        if hold_out != "blocks":
            fit = _fit_to(trials, robot, hold_out, seed)
            made = [
                (log, prediction)
                for (log, _), prediction in zip(trials, fit.by_log, strict=True)
                if prediction is not None
            ]
            return fit, _compared(made, robot, "trials", seed)
        made = [block for log, _ in trials for block in _blocks(log, robot, seed)]
        if not made:
            n = max(len(log.commands) for log, _ in trials)
            raise ValueError(
                f"The longest trial has {n} steps, too few for {BLOCKS} blocks. Hold out a share."
            )
        return _fit_to(trials, robot, 0.0, seed), _compared(made, robot, "blocks", seed)
    except ValueError as error:
        raise StudyError(f"{path}: {error}") from None


def _blocks(log: Log, robot: RobotModel, seed: int) -> list[tuple[Log, LogPrediction]]:
    """Return predictions of the second half of each part of a trial; none if its parts are too short."""
    made = []
    for first, end in pairwise(np.linspace(0, len(log.commands), BLOCKS + 1).astype(int)):
        part = _part(log, int(first), int(end))
        try:
            (prediction,) = _fit_to([(part, 0)], robot, 0.5, seed).by_log
        except ValueError:
            continue
        if prediction is not None:
            made.append((part, prediction))
    return made


def _part(log: Log, first: int, end: int) -> Log:
    rows = slice(first, end + 1)
    wheels = log.wheels[rows] - log.wheels[first] if len(log.wheels) else log.wheels
    return replace(
        log, commands=log.commands[first:end], poses=log.poses[rows], wheels=wheels, readings=log.readings[rows],
        raw_headings=log.raw_headings[rows],
    )  # fmt: skip


def _arrays(log: Log) -> tuple[Floats, Floats, Floats | None]:
    """Return times, commands with the last one once more, and poses, without headings if the log has none."""
    commands = np.concatenate([log.commands, log.commands[-1:]])
    if not len(log.poses):
        return log.time_s, commands, None
    return log.time_s, commands, log.poses if log.has_heading else log.poses[:, :2]


def _motion_log(log: Log) -> MotionLog:
    time_s, commands, poses = _arrays(log)
    return motion_log(
        time_s,
        commands if log.has_commands else None,
        poses=poses,
        encoders=log.wheels if len(log.wheels) else None,
    )


def _fit_to(trials: Sequence[Trial], robot: RobotModel, hold_out: float, seed: int) -> MotionLogFit:
    files = sorted({file for _, file in trials})
    cameras = [files.index(file) for _, file in trials]
    return fit_motion_logs(
        [_motion_log(log) for log, _ in trials], robot, cameras=cameras, hold_out=hold_out, seed=seed
    )


def _compared(
    made: Sequence[tuple[Log, LogPrediction]], robot: RobotModel, parts: str, seed: int
) -> Compared | None:
    """Return the errors of the fit on all parts that it did not see, next to those of simpler predictions."""
    paths = [_path_errors(log, robot, prediction, seed) for log, prediction in made if prediction.errors]
    if paths:
        errors = summary_of(paths, parts, seed)
        return Compared(errors.measure, "m", errors.n, errors.mean, errors.more, intervals=errors.intervals)
    return _joined([_wheel_errors(log, robot, prediction, seed) for log, prediction in made], parts)


def _path_errors(log: Log, robot: RobotModel, prediction: LogPrediction, seed: int) -> PathErrors:
    """Return the errors of the fit next to those of simpler predictions, with the same camera."""
    time_s, commands, poses = _arrays(log)
    nominal = prediction.nominal
    rng = np.random.default_rng(seed)
    scale = robot.drive.speed * np.diff(time_s)[:, None]
    noisy = {}
    for k in range(NOISE_DRAWS):
        ways = scale * _noise(rng, (len(time_s) - 1, 2))
        noisy[f"{NOISE} {k}"] = replace(
            nominal,
            length=nominal.length + ways.mean(1),
            turn=nominal.turn + (ways[:, 1] - ways[:, 0]) / robot.drive.track,
        )
    table = look_up_motion(time_s, commands, poses if poses is not None else np.empty(0), prediction.split)
    made: dict[str, Steps] = {FITTED: prediction.fitted, NOMINAL: nominal, **noisy}
    errors = path_errors(_motion_log(log), made | ({} if table is None else {TABLE: table}), prediction.split)
    return PathErrors(
        errors.lasts_s,
        _without_draws(errors.off),
        tuple(replace(each, errors=_without_draws(each.errors)) for each in errors.horizons),
    )


def _without_draws(errors: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return errors by prediction, with the mean of the draws of noise."""
    draws = np.mean([errors[name] for name in errors if name.startswith(f"{NOISE} ")], axis=0)
    plain = {name: errors[name] for name in (FITTED, NOMINAL)} | {NOISE: draws}
    return plain | ({TABLE: errors[TABLE]} if TABLE in errors else {})


def _noise(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Return the paper's uniform noise on the wheels. The paper itself has it on sensors only."""
    return np.asarray(JyroPlatform.default_noise * rng.uniform(-1, 1, shape))


def _wheel_errors(log: Log, robot: RobotModel, prediction: LogPrediction, seed: int) -> Compared:
    """Return the errors of the wheels' speeds by the fit, next to those of simpler predictions."""
    held_out = prediction.wheels
    if held_out is None:
        raise ValueError("The log has poses and no errors of wheels.")
    _, commands, _ = _arrays(log)
    errors = {FITTED: held_out.fitted, NOMINAL: held_out.nominal}
    more = {key: {FITTED: values[1], NOMINAL: values[0]} for key, values in held_out.more.items()}
    errors |= _wheel_baselines(log, robot, commands, prediction.split, seed)
    return Compared(held_out.measure, held_out.unit, held_out.n, errors, more)


def _wheel_baselines(
    log: Log, robot: RobotModel, commands: Floats, split: int, seed: int
) -> dict[str, float]:
    """Return errors of wheel speeds by uniform noise and by seen speeds at similar commands [m/s]."""
    speeds = np.diff(log.wheels, axis=0) / log.step_s
    nominal = commands[:-1] * robot.drive.speed
    noise = _noise(np.random.default_rng(seed), nominal.shape) * robot.drive.speed
    looked_up = np.empty_like(speeds)
    for wheel in range(2):
        known = np.flatnonzero(np.isfinite(speeds[: split - 1, wheel]))
        for k, command in enumerate(commands[:-1, wheel]):
            near = known[np.argsort(np.abs(commands[known, wheel] - command), kind="stable")[:N_SPEEDS]]
            looked_up[k, wheel] = speeds[near, wheel].mean() if len(near) else np.nan
    return {
        name: float(np.sqrt(np.nanmean((predicted - speeds)[split:] ** 2)))
        for name, predicted in ((NOISE, nominal + noise), (TABLE, looked_up))
    }


def _joined(errors: Sequence[Compared], parts: str) -> Compared | None:
    """Return the mean errors of the wheels in several trials or blocks, weighted by observations."""
    if not errors:
        return None
    if len(errors) == 1 and parts == "trials":
        return errors[0]
    n = sum(each.n for each in errors)

    def mean(rows: list[tuple[int, float]]) -> float:
        return sum(weight * value for weight, value in rows) / sum(weight for weight, _ in rows)

    first = errors[0]
    means = {name: mean([(each.n, each.errors[name]) for each in errors]) for name in first.errors}
    more = {
        key: {name: mean([(each.n, each.more[key][name]) for each in errors]) for name in first.more[key]}
        for key in first.more
    }
    return Compared(f"{first.measure}, mean of {len(errors)} {parts}", first.unit, n, means, more)
