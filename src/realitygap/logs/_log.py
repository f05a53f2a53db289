"""One trial of a log: on a regular grid, and as an observed trial."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from realitygap.errors import LogError
from realitygap.evolution import Genome
from realitygap.records import ObservationsHead, Observe, TrialRecord
from realitygap.world import Arena, Grid, Pose, load_arena

from ._log_map import LogMap
from ._source import Floats


@dataclass(frozen=True)
class Log:
    """One trial of n steps from a log.

    Attributes:
        name: Name within its file; empty if it is the only trial.
        start_s: Time of its start, by the log's clock [s].
        step_s: Length of a step [s].
        commands: (n, 2) left and right wheel during each step, as shares of full speed. If the log has no commands,
            the speeds of the encoders, which are no commands: see `has_commands`.
        poses: (n + 1, 3) x [m], y [m], heading [rad] at the start of each step and at the end; nan if unknown, and in
            the third column if the log has no headings. No rows if it has no poses.
        wheels: (n + 1, 2) distance of the left and the right wheel since the start [m]; nan if unknown. No rows if the
            log has none.
        readings: (n + 1, s) reading of each range sensor, 0 to 1; nan if unknown. No rows if the log has none.
        raw_headings: (n + 1,) headings before full turns were counted [rad]; as many rows as poses.
        notes: Notes on changes to the rows.
        has_commands: False if the log has encoders and no commands.
    """

    name: str
    start_s: float
    step_s: float
    commands: Floats
    poses: Floats
    wheels: Floats
    readings: Floats
    raw_headings: Floats
    notes: tuple[str, ...] = ()
    has_commands: bool = True

    @property
    def time_s(self) -> Floats:
        """Times of the steps, from 0, (n + 1,) [s]."""
        return np.arange(len(self.commands) + 1, dtype=np.float64) * self.step_s

    @property
    def has_heading(self) -> bool:
        """True if headings were measured."""
        return bool(len(self.poses)) and bool(np.isfinite(self.poses[:, 2]).any())

    @property
    def wheel_part(self) -> str:
        """Name of the part that `commands` are from: commands or encoders."""
        return "commands" if self.has_commands else "encoders"


FAR_M = 100.0
"""Distance of the walls of an open plane."""
SLOW = 0.2
"""Share of the typical distance of a step below which the path shows no direction."""
MOST_COMMAND = 1.0005
"""A command may be beyond full speed by the rounding of its unit."""
NO_HEADING = "The log has no headings: those of these trials are the directions of the path."


def arena_of(log_map: LogMap) -> Arena:
    """Return the arena of a log: the one that its mapping names, or an open plane."""
    if log_map.arena:
        return load_arena(log_map.arena)
    a = FAR_M
    walls = ((-a, -a, a, -a), (a, -a, a, a), (a, a, -a, a), (-a, a, -a, -a))
    return Arena("open", walls, Grid(-a, -a, 2 * a, 1, 1), Pose(0.0, 0.0, 0.0))


def head_of(path: str | Path, log_map: LogMap, robot: str, log: Log) -> ObservationsHead:
    """Return what all trials of a log have in common.

    Args:
        path: The log.
        log_map: Mapping of the log.
        robot: The robot by name or file.
        log: One of its trials.
    """
    return ObservationsHead(
        target=str(path), label=log_map.label, robot=robot, arena=arena_of(log_map).to_dict(), step_s=log.step_s,
        observe=_observe_of(log),
    )  # fmt: skip


def _observe_of(log: Log) -> Observe:
    if len(log.poses):
        return "track"
    return "encoders" if len(log.wheels) else "readings"


def trial_of(log: Log, log_map: LogMap, number: int = 0) -> TrialRecord:
    """Return a trial of a log as an observed trial.

    If the log has no commands, those of the trial are the speeds of the encoders.

    Args:
        log: One trial of a log, as `read_logs` yields it.
        log_map: Mapping of the log.
        number: Number of the trial.

    Raises:
        LogError: A command exceeds the robot's speed.
    """
    left, right = log.commands.T
    wheel = np.abs(log.commands).max(1)
    k = int(np.argmax(wheel))
    if wheel[k] > MOST_COMMAND:
        verb = "is told" if log.has_commands else "has by its encoder"
        raise LogError(
            f"At {log.time_s[k]:.4g} s a wheel {verb} {wheel[k]:.3g} times the robot's full speed. Set speed in the "
            "mapping to its full speed [m/s], or set robot to the robot that drove."
        )
    poses = log.poses
    if len(poses) and not log.has_heading:
        poses = np.column_stack([poses[:, :2], path_headings(poses[:, :2], left + right)])
    x, y, heading = poses[0] if len(poses) else np.zeros(3)
    n = len(log.commands)
    genome = _controller(log_map)
    return TrialRecord(
        start=(float(x), float(y), float(heading)),
        step_s=log.step_s,
        commands=np.clip(np.stack([(left + right) / 2, (right - left) / 2], 1), -1, 1),
        readings=log.readings[:n] if len(log.readings) else np.empty((n, 0)),
        stalled=np.zeros(n, np.bool_),
        cells=(),
        wheels=log.wheels,
        poses=poses,
        genome=genome,
        number=number,
        purpose="controller" if genome else "motion",
    )


def _controller(log_map: LogMap) -> str:
    return Genome.load(log_map.controller).to_json() if log_map.controller else ""


def path_headings(xy: Floats, forward: Floats) -> Floats:
    """Return (n + 1,) headings of a robot that moves along its heading, from its path [rad].

    The heading is interpolated in parts with little motion.

    Args:
        xy: (n + 1, 2) positions [m]; nan if unknown.
        forward: (n,) positive if the command is ahead.
    """
    steps = np.diff(xy, axis=0) * np.where(forward < 0, -1, 1)[:, None]
    way = np.hypot(*steps.T)
    moving = way[np.isfinite(way) & (way > 0)]
    if not len(moving):
        return np.zeros(len(xy))
    clear = np.flatnonzero(way > SLOW * np.median(moving))
    # the direction of a step is the heading in its middle
    direction = np.unwrap(np.arctan2(steps[clear, 1], steps[clear, 0]))
    return np.asarray(np.interp(np.arange(len(xy)), clear + 0.5, direction))
