"""One trial of a log on a regular grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
