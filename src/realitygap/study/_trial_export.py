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
    open_ledger,
    refuse_blind,
    refuse_results,
    write_observations,
    write_whole,
)

from ._tracked import TrialToTrack, trial_in


def export_trials(
    source: str | Path,
    out: str | Path,
    trials: Sequence[int] = (),
    *,
    wheel_diameter_mm: float = WHEEL_DIAMETER_MM,
) -> Iterator[BagReport]:
    """Write driven trials as bags of ROS 2 or as MCAP files, each with a mapping for `realitygap import`.

    Args:
        source: A folder of results with a ledger, or a file of trials.
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
    out = Path(out)
    found = _driven_trials(Path(source), trials)
    for each in found:
        name = out if len(found) == 1 else out.with_name(f"{out.stem}-{each.number}{out.suffix}")
        yield write_bag(each.trial, each.head, name, times=each.times, wheel_diameter_mm=wheel_diameter_mm)


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
        source: A folder of results with a ledger, or a file of trials.
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
    found = _driven_trials(source, trials)
    written = [each.trial for each in found]
    if out.suffix == ".parquet":
        buffer = io.BytesIO()
        pl.concat([_steps(each) for each in found]).write_parquet(buffer)
        write_whole(out, buffer.getvalue())
    else:
        write_observations(out, _common_head(source, found), written)
    return len(written)


def _common_head(source: Path, found: Sequence[TrialToTrack]) -> ObservationsHead:
    """Return the head of trials of one kind, which says how much all of them have."""
    levels = [level for each in found for level in (each.head.observe, each.trial.observe)]
    observe = min(levels, key=OBSERVATIONS.index)
    heads = [replace(each.head, observe=observe) for each in found]
    for head in heads[1:]:
        if head != heads[0]:
            raise StudyError(
                f"Trials of {source} are of several kinds, such as on {heads[0].target} and {head.target}, or in "
                "several arenas. A file has one kind. Name trials of one condition."
            )
    return heads[0]


def _steps(driven: TrialToTrack) -> pl.DataFrame:
    """Return a row for each command of a trial, and one for the look after the last."""
    trial = driven.trial
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
            "trial": [driven.number] * n, "purpose": [trial.purpose] * n, "step": range(n), "time": times[:n],
            "move": column(trial.commands, 0), "turn": column(trial.commands, 1),
            "readings": readings[:n], "stalled": stalled[:n],
            "left": column(trial.wheels, 0), "right": column(trial.wheels, 1),
            **{name: column(trial.poses, k) for k, name in enumerate(_POSE)},
        },
        schema=_COLUMNS,
    )  # fmt: skip


def _driven_trials(source: Path, numbers: Sequence[int]) -> list[TrialToTrack]:
    """Return driven trials with the times of a robot, and with their poses; all that count if none is named."""
    if source.is_dir() and not (source / LEDGER_NAME).exists():
        raise StudyError(
            f"{source} has no trials of a robot. For those of a simulation, save a network (realitygap export), "
            "and drive it: realitygap try champion.json --on sim --observe track -o trials.sqlite"
        )
    with open_ledger(source, writable=False) as ledger:
        refuse_blind(ledger)
        if not numbers:
            trials = ledger.trials(states=("driven", "scored"))
            numbers = [
                trial.trial
                for trial in trials
                if trial.n_steps and (trial.condition or trial.state == "scored")
            ]
        if not numbers:
            raise StudyError(f"{source} has no trial that was driven. Drive one first.")
        return [_with_times_and_poses(ledger, source, number) for number in numbers]


def _with_times_and_poses(ledger: Ledger, source: Path, number: int) -> TrialToTrack:
    found = trial_in(ledger, source, number)
    times, t = found.trial.times, len(found.trial.commands)
    if ledger.trial(number).condition:
        poses = ledger.record(number).poses
        return replace(found, trial=replace(found.trial, poses=poses)) if len(poses) == t + 1 else found
    # an emulated robot may be faster than the clock that measured these times
    if len(times) < max(t, 2) or abs(np.median(np.diff(times)) - found.trial.step_s) > found.trial.step_s / 2:
        return found
    ends = times if len(times) > t else np.append(times, times[-1] + found.trial.step_s)
    return replace(found, times=ends - ends[0])
