"""The import of a log: its trials in a file of observed trials, and a report on them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from realitygap.errors import LogError
from realitygap.records import TrialRecord, write_observations
from realitygap.world import RobotModel, load_robot, robot_names

from ._clock_offset import ClockOffset
from ._files import MappedLog
from ._log import NO_HEADING, Log, head_of, trial_of
from ._log_map import LogMap
from ._mistakes import Mistake, diagnose
from ._read import read_logs

MOST_DIAGNOSED = 20
"""Trials of a log that are searched for mistakes; those after them have the same."""


@dataclass(frozen=True)
class ImportReport:
    """The results of an import.

    Attributes:
        n_trials: Trials that were written.
        n_steps: Their steps.
        step_s: Length of a step [s].
        observe: Observation level of the trials.
        notes: Notes on changes to the rows.
        mistakes: Mistakes that contradict the mapping, one of each kind.
        offset: Delay of poses after commands in the longest trial; None if the log does not show it.
    """

    n_trials: int = 0
    n_steps: int = 0
    step_s: float = 0.0
    observe: str = ""
    notes: tuple[str, ...] = ()
    mistakes: tuple[Mistake, ...] = ()
    offset: ClockOffset | None = None


def robot_of(log_map: LogMap, base: str | None = None) -> tuple[str, RobotModel]:
    """Return the robot that drove a log: its name or file, and its numbers with those of the mapping.

    Args:
        log_map: The mapping.
        base: Robot that replaces the one of the mapping.

    Raises:
        LogError: Neither names a robot.
        DescriptionError: There is no such robot.
    """
    name = base or log_map.robot
    if not name:
        raise LogError(
            f"The mapping does not name the robot that drove. Set robot in it, or give `realitygap import "
            f"--base ROBOT`, or `realitygap calibrate --base ROBOT`: {', '.join(robot_names())}, or a file."
        )
    given = {"drive.speed": log_map.speed, "drive.track": log_map.track}
    return name, load_robot(name).with_numbers({key: value for key, value in given.items() if value})


def import_log(
    path: str | Path,
    out: str | Path,
    log_map: LogMap,
    *,
    base: str | None = None,
    drop_bad_rows: bool = False,
) -> ImportReport:
    """Write the trials of a log into a file of observed trials.

    Args:
        path: The log.
        out: The file to write, such as trials.jsonl; one that is there is replaced.
        log_map: The mapping of the log.
        base: The robot that drove, by name or file.
        drop_bad_rows: True to leave out rows with mistakes.

    Raises:
        LogError: The log and the mapping do not go together, or a row has a mistake; nothing is written.
        RecordError: The file cannot be written.
    """
    return import_logs([MappedLog(Path(path), log_map, "")], out, base=base, drop_bad_rows=drop_bad_rows)


def import_logs(
    logs: Sequence[MappedLog], out: str | Path, *, base: str | None = None, drop_bad_rows: bool = False
) -> ImportReport:
    """Write the trials of several logs of one robot into a file of observed trials; see `import_log`.

    Args:
        logs: The logs, as `mapped_logs` returns them.
        out: The file to write.
        base: The robot that drove, by name or file.
        drop_bad_rows: True to leave out rows with mistakes.
    """
    name, robot = robot_of(logs[0].log_map, base)
    trials = (
        (trial, log.log_map)
        for log in logs
        for trial in read_logs(log.path, log.log_map, robot, drop_bad_rows=drop_bad_rows)
    )
    first, log_map = next(trials)
    report = _GrowingReport(first, robot)
    head = head_of(target_of([log.path for log in logs]), log_map, name, first)
    write_observations(out, head, _trials(chain([(first, log_map)], trials), report))
    return report.report


def target_of(paths: Sequence[str | Path]) -> str:
    """Return the name of logs for reports: that of the log, or of the first one and the number of the others."""
    return str(paths[0]) if len(paths) == 1 else f"{paths[0]} and {len(paths) - 1} more"


class _GrowingReport:
    """A report that grows while trials pass by."""

    def __init__(self, first: Log, robot: RobotModel) -> None:
        self._speed, self._track = robot.drive.speed, robot.drive.track
        parts = ("commands", "wheels", "poses", "readings")
        seen = [
            name for name in parts if len(getattr(first, name)) and (name != "commands" or first.has_commands)
        ]
        notes = (NO_HEADING,) if len(first.poses) and not first.has_heading else ()
        self.report = ImportReport(step_s=first.step_s, observe=", ".join(seen), notes=notes)
        self._n, self._longest = 0, 0

    def look(self, log: Log) -> None:
        """Search a trial for mistakes."""
        self._n += 1
        if self._n > MOST_DIAGNOSED:
            return
        self.report = replace(self.report, notes=tuple(dict.fromkeys(self.report.notes + log.notes)))
        diagnosis = diagnose(log, self._speed, self._track)
        known = {mistake.kind for mistake in self.report.mistakes}
        more = tuple(mistake for mistake in diagnosis.mistakes if mistake.kind not in known)
        self.report = replace(self.report, mistakes=self.report.mistakes + more)
        if diagnosis.offset is not None and len(log.commands) > self._longest:
            self._longest = len(log.commands)
            self.report = replace(self.report, offset=diagnosis.offset)

    def count(self, trial: TrialRecord) -> None:
        """Count a trial that is written."""
        report = self.report
        self.report = replace(
            report, n_trials=report.n_trials + 1, n_steps=report.n_steps + len(trial.commands)
        )


def _trials(trials: Iterable[tuple[Log, LogMap]], report: _GrowingReport) -> Iterator[TrialRecord]:
    for number, (log, log_map) in enumerate(trials):
        report.look(log)
        trial = trial_of(log, log_map, number)
        report.count(trial)
        yield trial
