"""A log as trials on one regular grid: commands, poses, wheels, and readings in meters, radians, and seconds."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from realitygap._named_file import NamedFileError, named_file
from realitygap.errors import LogError
from realitygap.world import RobotModel

from ._convert import Convert, converter
from ._log import Log
from ._log_map import LogMap, Part, WheelPart
from ._open import open_source
from ._resample import Grid, Held, HeldMean, Interpolated
from ._rows import ADVICE, OF_INCREMENTS, RowChecker
from ._source import RECORDED, Floats, Source, check_columns
from ._stretches import FEWEST_STEPS, stretches_of
from ._units import TIMES, unit_factor

REGULAR = 0.25
"""Share by which most intervals may differ from their median if the step is estimated from them."""
SHORTEST_S, LONGEST_S = 1e-4, 60.0
"""Time between rows of a robot's log [s]. What is beyond is in another unit."""
SAME_STEP = 0.01
"""Share by which the mean of intervals may differ from their median if no row is missing."""


def read_logs(
    path: str | Path, log_map: LogMap, robot: RobotModel, *, drop_bad_rows: bool = False
) -> Iterator[Log]:
    """Yield the trials of a log, one at a time.

    A trial is a stretch of the log, or of the rows with one value in the mapping's `trial`. It ends where something is
    unknown for longer, and where a person carried the robot.

    The file is read in parts: memory holds one trial, not the file.

    Args:
        path: The log, or the folder that the files of the mapping are in.
        log_map: Mapping of the columns.
        robot: The robot that drove: its speed and track, unless the mapping has its own.
        drop_bad_rows: True to leave out rows without numbers, or with times that do not increase.

    Raises:
        LogError: The log and the mapping do not go together, or a row has a mistake.
        MissingExtraError: The log is a bag, and the extra `import` is not installed.
    """
    path = Path(path)
    streams = _streams(path, log_map, robot, drop=drop_bad_rows)
    speed, track = _speed_and_track(log_map, robot)
    has_trial = False
    for log in _read_table(streams, log_map) if log_map.trial else _read_whole(path, streams, log_map):
        for stretch in stretches_of(log, speed, track):
            has_trial = True
            yield stretch
    if not has_trial:
        raise LogError(
            f"{path}: no stretch of {FEWEST_STEPS} steps has commands and all that was seen. Choose a longer step_s, "
            "or leave out a part of the mapping."
        )


def _read_whole(path: Path, streams: list[_Stream], log_map: LogMap) -> Iterator[Log]:
    """Yield all rows of a log."""
    assembler = _Assembler(streams, log_map)
    for group in _groups(streams):
        assembler.read(group)
    log = assembler.finish("")
    if log is None:
        raise LogError(
            f"{path} has fewer than {FEWEST_STEPS} steps. Expected a robot that drives for longer."
        )
    yield log


def _speed_and_track(log_map: LogMap, robot: RobotModel) -> tuple[float, float]:
    return log_map.speed or robot.drive.speed, log_map.track or robot.drive.track


class _Stream:
    """A part of a log: the source of its numbers, and their conversion to values."""

    def __init__(
        self, name: str, part: Part, source: Source, speed: float, track: float, *, drop: bool
    ) -> None:
        self.name, self.part, self.source = name, part, source
        self.columns = part.columns()
        self.time = part.time or source.time_of(self.columns)
        self.rate_hz = part.rate_hz or (0.0 if self.time else source.rate_hz)
        if not self.time and not self.rate_hz:
            raise LogError(
                f"[{name}] names no column of the time. Give `time`, or `rate_hz` if there is none."
            )
        self.to_s = unit_factor(f"{name}.time_unit", part.time_unit, TIMES) if part.time else 1.0
        self.speed, self._track, self._drop = speed, track, drop
        self.has_increments = isinstance(part, WheelPart) and bool(part.per)
        self.renew()

    def renew(self) -> None:
        """Forget the rows of the trial before."""
        self.convert: Convert = converter(self.part, self.speed, self._track)
        self.check = RowChecker(
            self.source.path,
            self.name,
            self.columns,
            needs_all=self.name == "commands" or self.has_increments,
            drop=self._drop and not self.has_increments,
            advice=OF_INCREMENTS if self.has_increments else ADVICE,
        )

    def resampled(self, grid: Grid) -> HeldMean | Interpolated | Held:
        """Return what puts its values on a grid."""
        kind = Interpolated if self.has_increments else _RESAMPLED[self.name]
        return kind(grid, self.convert.width)

    @property
    def needed(self) -> list[str]:
        """All columns that it reads."""
        return [*self.columns, *([self.time] if self.time else [])]

    def take(self, first: int, columns: dict[str, Floats], start: int) -> tuple[Floats, Floats]:
        """Return times [s] and values of rows; `start` is the number of the first row of the trial."""
        raw = np.stack([columns[name] for name in self.columns], 1)
        rows = first - start + np.arange(len(raw))
        times = columns[self.time] * self.to_s if self.time else rows / self.rate_hz
        times, raw = self.check(first, times + self.part.offset_s, raw)
        return times, self.convert(times, raw)


_RESAMPLED: dict[str, type[HeldMean | Interpolated | Held]] = {
    "commands": HeldMean,
    "wheels": Interpolated,
    "poses": Interpolated,
    "readings": Held,
}

_METHODS = {
    HeldMean: "mean over each step",
    Interpolated: "straight lines between rows",
    Held: "last reading before each step",
}
NO_COMMANDS = "The log has no commands: those of its trials are the speeds of the encoders."


class _Assembler:
    """Puts the streams of one trial on one grid."""

    def __init__(self, streams: list[_Stream], log_map: LogMap) -> None:
        self._streams, self._map = streams, log_map
        self._grid: Grid | None = None
        self._resampled: dict[str, HeldMean | Interpolated | Held] = {}
        self._early: list[tuple[_Stream, Floats, Floats]] = []
        self._notes: list[str] = []
        self._ends: dict[str, float] = {}

    def read(self, group: list[_Stream]) -> None:
        """Take all rows of streams of one source."""
        names = list(dict.fromkeys(name for stream in group for name in stream.needed))
        for batch in group[0].source.batches(names, group[0].part.rows):
            self.push(group, batch.first, dict(batch.columns), 1)

    def push(self, group: list[_Stream], first: int, columns: dict[str, Floats], start: int) -> None:
        """Take some rows of the trial, whose first row has the number `start`."""
        for stream in group:
            times, values = stream.take(first, columns, start)
            if not len(times):
                continue
            if self._grid is None and stream.name == self._streams[0].name:
                self._begin(stream, times)
            if self._grid is None:
                self._early.append((stream, times, values))
            else:
                self._give(stream, times, values)

    def _begin(self, stream: _Stream, times: Floats) -> None:
        """Lay the grid by the first rows of the first stream."""
        _check_unit_of_time(stream, times)
        step_s = self._map.step_s or _step_of(stream, times)
        self._grid = Grid(float(times[0]), step_s)
        for early in self._early:
            self._give(*early)
        self._early = []

    def _give(self, stream: _Stream, times: Floats, values: Floats) -> None:
        grid = self._grid
        if grid is None:
            return
        if stream.name not in self._resampled:
            self._resampled[stream.name] = stream.resampled(grid)
            usual = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
            rate = f"about {1 / usual:.3g} rows/s" if usual > 0 else "one row"
            increments = "increments, " if stream.has_increments else ""
            how = _METHODS[type(self._resampled[stream.name])]
            stamps = "" if stream.part.time or stream.time in ("", RECORDED) else f"; times of {stream.time}"
            self._notes.append(f"{stream.name}: {rate}, {increments}{how}{stamps}.")
        self._resampled[stream.name].push(times, values)
        self._ends[stream.name] = float(times[-1])

    def finish(self, name: str) -> Log | None:
        """Return the trial; None if it is too short."""
        grid, first = self._grid, self._streams[0].name
        if grid is None:
            return None
        n = grid.until(self._ends[first]) - 1
        if n < FEWEST_STEPS:
            return None
        wheels, poses, readings = (self._rows(part, n + 1) for part in ("wheels", "poses", "readings"))
        for part, rows in (("wheels", wheels), ("poses", poses), ("readings", readings)):
            if part in self._ends and not np.isfinite(rows[:, 0]).any():
                raise LogError(
                    f"No row of [{part}] is between {grid.start_s:.6g} and {self._ends[first]:.6g} s, when there are "
                    f"{first}: it ends at {self._ends[part]:.6g} s. Give the clock's offset_s, or its time_unit."
                )
        driving = self._streams[0]
        if driving.name == "commands" and not driving.has_increments:
            commands = self._rows("commands", n)
        else:
            ways = self._rows(driving.name, n + 1)
            commands = np.diff(ways, axis=0) / grid.step_s / driving.speed
        if len(wheels):
            known = wheels[np.isfinite(wheels[:, 0])]
            wheels = wheels - known[0]
        notes = [f"Steps of {grid.step_s:.4g} s.", *self._notes]
        if driving.name != "commands":
            notes.append(NO_COMMANDS)
        for stream in self._streams:
            notes += stream.check.notes
            stream.renew()
        return Log(
            *(name, grid.start_s, grid.step_s, commands),
            *(poses[:, :3], wheels, readings, poses[:, 3]),
            notes=tuple(notes),
            has_commands=driving.name == "commands",
        )

    def _rows(self, name: str, n: int) -> Floats:
        if name in self._resampled:
            return self._resampled[name].rows(n)
        return np.empty((0, {"poses": 4, "wheels": 2}.get(name, 0)))


def _check_unit_of_time(stream: _Stream, times: Floats) -> None:
    """Raise an error if the rows of a robot's log are minutes or microseconds apart."""
    usual = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    if not SHORTEST_S < usual < LONGEST_S:
        raise LogError(
            f"Rows of [{stream.name}] are {usual:.3g} s apart, expected {SHORTEST_S:g} to {LONGEST_S:g} s. Set "
            f"time_unit of [{stream.name}]: {', '.join(TIMES)}. It is {stream.part.time_unit!r} now."
        )


def _step_of(stream: _Stream, times: Floats) -> float:
    """Return the step that the times of the commands have."""
    intervals = np.diff(times)
    if not len(intervals):
        raise LogError(f"[{stream.name}] has one row, expected a robot that drives.")
    usual = float(np.median(intervals))
    low, high = np.quantile(intervals, [0.1, 0.9])
    if low < (1 - REGULAR) * usual or high > (1 + REGULAR) * usual:
        raise LogError(
            f"[{stream.name}] comes at irregular times, mostly {low:.3g} to {high:.3g} s apart. Choose the length of a "
            f"step: step_s = {usual:.3g} in the mapping."
        )
    mean = float(intervals.mean())  # less rounded, unless rows are missing
    return mean if abs(mean - usual) < SAME_STEP * usual else usual


def _streams(path: Path, log_map: LogMap, robot: RobotModel, *, drop: bool) -> list[_Stream]:
    """Return the parts of the mapping with their sources; the one that lays the grid first."""
    speed, track = _speed_and_track(log_map, robot)
    sources: dict[Path, Source] = {}
    streams = []
    for name, part in log_map.parts.items():
        try:
            folder = path if path.is_dir() else path.parent
            file = named_file(folder, part.file, or_folder=True) if part.file else path
        except NamedFileError as error:
            raise LogError(f"[{name}] of the mapping: file: {error}") from None
        if file not in sources:
            sources[file] = open_source(file, log_map.text)
        streams.append(_Stream(name, part, sources[file], speed, track, drop=drop))
    for source in sources.values():
        if source.is_table:
            needed = [name for stream in streams if stream.source is source for name in stream.needed]
            known = source.columns()
            check_columns(source, [name for name in needed if not _is_number_of(name, known)])
    return streams


def _is_number_of(name: str, known: list[str]) -> bool:
    return name not in known and name.isdecimal() and 1 <= int(name) <= len(known)


def _groups(streams: list[_Stream]) -> list[list[_Stream]]:
    """Return streams that are read together: of one table, and rows of one kind."""
    groups: list[list[_Stream]] = []
    for stream in streams:
        same = [
            group
            for group in groups
            if group[0].source is stream.source
            and stream.source.is_table
            and group[0].part.rows == stream.part.rows
        ]
        if same:
            same[0].append(stream)
        else:
            groups.append([stream])
    return groups


def _read_table(streams: list[_Stream], log_map: LogMap) -> Iterator[Log]:
    """Yield a trial for each run of rows with one value in the column of the trial."""
    groups = _groups(streams)
    if len(groups) != 1 or not streams[0].source.is_table:
        raise LogError(
            "`trial` splits the rows of one table, and the parts of this mapping are in several files, topics, or "
            "kinds of rows. Leave `trial` out, or import them one by one."
        )
    source, column = streams[0].source, log_map.trial
    known = source.columns()
    if not _is_number_of(column, known):
        check_columns(source, [column])
    names = list(dict.fromkeys([*(name for stream in streams for name in stream.needed), column]))
    assembler, current, start, n_found = _Assembler(streams, log_map), np.nan, 1, 0
    for batch in source.batches(names, streams[0].part.rows):
        marks = batch.columns[column]
        if np.isnan(marks).any():
            row = batch.first + int(np.argmax(np.isnan(marks)))
            raise LogError(f"{source.path}: row {row} has no number in {column}, which tells trials apart.")
        edges = [0, *(np.flatnonzero(np.diff(marks)) + 1), len(marks)]
        for begin, end in pairwise(edges):
            if marks[begin] != current:
                log = assembler.finish(f"{current:g}")
                if log is not None:
                    n_found += 1
                    yield log
                for stream in streams:
                    stream.renew()
                assembler, current, start = _Assembler(streams, log_map), marks[begin], batch.first + begin
            part = {name: values[begin:end] for name, values in batch.columns.items()}
            assembler.push(streams, batch.first + begin, part, start)
    log = assembler.finish(f"{current:g}")
    if log is not None:
        n_found += 1
        yield log
    if not n_found:
        raise LogError(f"{source.path} has no trial of at least {FEWEST_STEPS} steps.")
