"""Driven trials as bags of ROS 2 or MCAP files: those of a file, or of the ledger of a study."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from realitygap.errors import StudyError
from realitygap.logs import WHEEL_DIAMETER_MM, BagReport, write_bag
from realitygap.records import LEDGER_NAME, Ledger, read_observations, those_that_count

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
