"""Driven trials of a file, or of the ledger of a study, in files for other programs."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from realitygap.errors import RecordError, StudyError
from realitygap.logs import WHEEL_DIAMETER_MM, BagReport, write_bag
from realitygap.records import (
    LEDGER_NAME,
    OBSERVATIONS,
    Ledger,
    ObservationsHead,
    TrialRecord,
    read_observations,
    refuse_results,
    those_that_count,
    write_observations,
    write_whole,
)

from ._tracked import TrialToTrack, trial_of_file, trial_of_ledger


def export_trials(
    source: str | Path,
    out: str | Path,
    trials: Sequence[int] = (),
    *,
    wheel_diameter_mm: float = WHEEL_DIAMETER_MM,
) -> Iterator[BagReport]:
    """Write driven trials as bags of ROS 2 or as MCAP files, each with a mapping for `realitygap import`.

    Args:
        source: A file of observed trials (.jsonl), or a folder of results with a ledger.
        out: A file that ends in .mcap, or a new folder without an ending. If there are several trials, their numbers
            are added to the name: out-7.mcap.
        trials: Numbers of trials. If empty, all driven trials.
        wheel_diameter_mm: Diameter of the wheels, which converts distances to angles [mm].

    Yields:
        The bag, the mapping, and the number of messages of each trial.

    Raises:
        LogError: `out` exists already or has another ending, or a trial does not fit its robot.
        MissingExtraError: The extra `ros` is not installed.
        RecordError: The source cannot be read, or a bag cannot be written.
        StudyError: The source has no such trial, or none that was driven.
    """
    source, out = Path(source), Path(out)
    numbers = list(trials) or _driven(source)
    for number in numbers:
        name = out if len(numbers) == 1 else out.with_name(f"{out.stem}-{number}{out.suffix}")
        found = _trial(source, number)
        yield write_bag(found.trial, found.head, name, times=found.times, wheel_diameter_mm=wheel_diameter_mm)


_POSE = ("x", "y", "heading")
_COLUMNS: dict[str, pl.DataType | type[pl.DataType]] = {
    **{"trial": pl.Int64, "purpose": pl.String, "step": pl.Int64, "readings": pl.List(pl.Float64)},
    **{"stalled": pl.Boolean},
    **dict.fromkeys(("time", "move", "turn", "left", "right", *_POSE), pl.Float64),
}
"""Columns of trials in Parquet. A row is one command, and the last row of a trial the look after its last command."""


def write_trials(source: str | Path, out: str | Path, trials: Sequence[int] = ()) -> int:
    """Write driven trials into one new file of JSON lines or Parquet.

    Args:
        source: A file of observed trials (.jsonl), or a folder of results with a ledger.
        out: A file that ends in .jsonl, with a line for each trial, or in .parquet, with a row for each command.
        trials: Numbers of trials. If empty, all driven trials that count.

    Returns:
        The number of trials.

    Raises:
        RecordError: The source cannot be read, or the file exists or cannot be written.
        StudyError: The source has no such trial, none that was driven, or trials of several kinds.
    """
    source, out = Path(source), Path(out)
    refuse_results(out)
    if out.exists():
        raise RecordError(f"{out} exists already, and was not changed. Name another file.")
    head, written = _records(source, trials)
    if out.suffix == ".parquet":
        buffer = io.BytesIO()
        pl.concat([_steps(trial) for trial in written]).write_parquet(buffer)
        write_whole(out, buffer.getvalue())
    else:
        write_observations(out, head, written)
    return len(written)


def _records(source: Path, numbers: Sequence[int]) -> tuple[ObservationsHead, list[TrialRecord]]:
    """Return the common head of trials, and the trials."""
    if not source.is_dir():
        if not numbers:
            _driven(source)  # raises if there is none
        found = read_observations(source)
        driven = [trial for trial in those_that_count(found.trials) if len(trial.commands)]
        chosen = [trial_of_file(source, number).trial for number in numbers]
        return found.head, chosen or driven
    trials = [_trial(source, number) for number in numbers or _driven(source)]
    observe = min((found.trial.observe for found in trials), key=OBSERVATIONS.index)
    heads = [replace(found.head, observe=observe) for found in trials]
    for head in heads[1:]:
        if head != heads[0]:
            raise StudyError(
                f"Trials of {source} are of several kinds, such as on {heads[0].target} and {head.target}, or in "
                "several arenas. A file has one kind. Name trials of one condition."
            )
    return heads[0], [found.trial for found in trials]


def _steps(trial: TrialRecord) -> pl.DataFrame:
    """Return a row for each command of a trial, and one for the look after the last."""
    t = len(trial.commands)
    n = max(t + (len(trial.last_readings) > 0), len(trial.wheels), len(trial.poses))
    times = trial.times if len(trial.times) >= n else np.arange(n) * trial.step_s
    readings = [*trial.readings.tolist(), trial.last_readings.tolist() or None]
    stalled = [*trial.stalled.tolist(), trial.last_stalled if len(trial.last_readings) else None]

    def column(table: np.ndarray, k: int) -> list[float | None]:
        values = table[:n, k].tolist() if len(table) else []
        return [*values, *[None] * (n - len(values))]

    return pl.DataFrame(
        {
            "trial": [trial.number] * n, "purpose": [trial.purpose] * n, "step": range(n), "time": times[:n],
            "move": column(trial.commands, 0), "turn": column(trial.commands, 1),
            "readings": readings[:n], "stalled": stalled[:n],
            "left": column(trial.wheels, 0), "right": column(trial.wheels, 1),
            **{name: column(trial.poses, k) for k, name in enumerate(_POSE)},
        },
        schema=_COLUMNS,
    )  # fmt: skip


def _driven(source: Path) -> list[int]:
    """Return the numbers of all trials that were driven."""
    if source.is_dir():
        if not (source / LEDGER_NAME).exists():
            raise StudyError(
                f"{source} has no trials of a robot. For those of a simulation, save a network (realitygap export), "
                "and drive it: realitygap try champion.json --on sim --observe track -o trials.jsonl"
            )
        with Ledger.open(source / LEDGER_NAME, writable=False) as ledger:
            numbers = [trial.trial for trial in ledger.trials(states=("driven", "scored"))]
    else:
        found = those_that_count(read_observations(source).trials)
        numbers = list(dict.fromkeys(trial.number for trial in found if len(trial.commands)))
    if not numbers:
        raise StudyError(f"{source} has no trial that was driven. Drive one first.")
    return numbers


def _trial(source: Path, number: int) -> TrialToTrack:
    """Return a trial with the times of a robot, and with the poses that the ledger has of it."""
    if source.is_dir():
        found = trial_of_ledger(source, number)
        with Ledger.open(source / LEDGER_NAME, writable=False) as ledger:
            poses = ledger.record(number).poses
        is_whole = len(poses) == len(found.trial.commands) + 1
        return replace(found, trial=replace(found.trial, poses=poses)) if is_whole else found
    found = trial_of_file(source, number)
    times, t = found.trial.times, len(found.trial.commands)
    # an emulated robot may be faster than the clock that measured these times
    if len(times) < t or abs(np.median(np.diff(times)) - found.trial.step_s) > found.trial.step_s / 2:
        return found
    ends = times if len(times) > t else np.append(times, times[-1] + found.trial.step_s)
    return replace(found, times=ends - ends[0])
