"""A model of a log: wheels follow commands, a body follows its wheels, and a camera or encoders see it.

The wheels and the filter of the poses are kernels (`kernels/sim/odometry.py`), so that errors of the heading grow along
the path, and one false turn is not explained by gains.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from realitygap.kernels.sim import odometry

from ._simulate import Bools, Floats

FIRST_PATH = 0.3
"""Path from which the first heading is taken if the log has none [m]."""

WHEELS = ("speed_left", "speed_right", "bias_left", "bias_right", "dead_band", "soft_dead_band", "lag")
"""Numbers of the drive, in the order of the kernel; a speed is that of the robot times a gain."""

BODY = (
    "drive.track", "drive.axle", "camera.left", "camera.heading", "drive.drift_per_m", "drive.slip",
    "drive.travel_noise_per_m", "drive.heading_noise_per_m", "drive.heading_noise_per_s", "place", "angle",
)  # fmt: skip
"""Numbers of the body, of its noise, and of the camera, in the order of the kernel."""

DEGREES = odometry.DEGREES
Numbers = Mapping[str, Floats]


@dataclass(frozen=True)
class MotionLog:
    """A recording of n times.

    Attributes:
        time_s: (n,) ascending [s].
        commands: (n, 2) command of the left and the right wheel, as shares of full speed. Each lasts until the next
            time. No rows if there are none: the encoders then show what the wheels did.
        poses: (n, 3) x [m], y [m], heading [rad]; nan if not seen.
        encoders: (n, 2) distance of the left and right wheel since the start [m]; nan if not seen.
    """

    time_s: Floats
    commands: Floats
    poses: Floats
    encoders: Floats

    def until(self, row: int) -> MotionLog:
        """Return the same log without observations from a row on."""
        poses, encoders = self.poses.copy(), self.encoders.copy()
        poses[row:] = np.nan
        if len(self.commands):
            encoders[row:] = np.nan
        return replace(self, poses=poses, encoders=encoders)

    @property
    def has_commands(self) -> bool:
        """True if the log has commands."""
        return len(self.commands) > 0

    @property
    def sees_poses(self) -> bool:
        """True if a position was observed at two times."""
        return int(np.isfinite(self.poses[:, 0]).sum()) > 1

    @property
    def sees_heading(self) -> bool:
        """True if a heading was observed."""
        return bool(np.isfinite(self.poses[:, 2]).any())

    @property
    def sees_wheels(self) -> bool:
        """True if encoders were observed at two times, next to commands."""
        return self.has_commands and bool((np.isfinite(self.encoders).all(axis=1)).sum() > 1)


def wheel_ways(log: MotionLog, numbers: Numbers) -> Floats:
    """Return the distance of each wheel since the start, shape (m, n, 2) [m].

    Args:
        log: Times with commands or encoders.
        numbers: (m,) values of `drive.*` and `encoder.*`.
    """
    if not log.has_commands:
        gains = np.stack([numbers["encoder.gain_left"], numbers["encoder.gain_right"]], axis=1)
        return np.asarray(log.encoders[None] / gains[:, None])
    at = {name.removeprefix("drive."): values for name, values in numbers.items()}
    at |= {f"speed_{side}": at["speed"] * at[f"gain_{side}"] for side in ("left", "right")}
    wheels = np.stack([at[name] for name in WHEELS], axis=1)
    ways = np.empty((len(wheels), len(log.time_s), 2))
    odometry.roll_wheels(log.time_s, log.commands, wheels, ways)
    return read_late(log, ways, at["delay"])


def read_late(log: MotionLog, ways: Floats, late: Floats) -> Floats:
    """Return the distances of wheels (m, n, 2) as they were `late` (m,) before each time [m]."""
    if not np.any(late):
        return ways
    seen = np.empty_like(ways)
    odometry.read_late(log.time_s, ways, late, seen)
    return seen


def pose_likelihood(log: MotionLog, ways: Floats, numbers: Numbers) -> tuple[Floats, Floats]:
    """Return the log likelihood of each pose, (m, n), and what it was off by, (m, n, 3) [m, m, rad].

    Args:
        log: Log of n times.
        ways: (m, n, 2) result of `wheel_ways`.
        numbers: (m,) values of `BODY` and of `camera.delay`, by which poses are late [s].
    """
    m, n = ways.shape[:2]
    seen = read_late(log, ways, numbers["camera.delay"])
    first = np.zeros(m)
    start = int(np.flatnonzero(np.isfinite(log.poses[:, 0]))[0])
    if not np.isfinite(log.poses[start, 2]):
        first = _first_heading(log, seen, numbers, start)
    bodies = np.stack([*(numbers[name] for name in BODY), first], axis=1)
    logs, off = np.empty((m, n)), np.empty((m, n, 3))
    odometry.filter_poses(log.time_s, log.poses, seen, bodies, np.empty((4, 3)), logs, off)
    return logs, off


def body_steps(ways: Floats, numbers: Numbers) -> tuple[Floats, Floats]:
    """Return the distance of the axle's middle [m] and the turn [rad] between two times, (m, n - 1) each."""
    steps = np.diff(ways, axis=1) * (1.0 - numbers["drive.slip"])[:, None, None]
    length = steps.mean(axis=2)
    turn = (steps[..., 1] - steps[..., 0]) / numbers["drive.track"][:, None]
    return length, turn + numbers["drive.drift_per_m"][:, None] * length


def _first_heading(log: MotionLog, ways: Floats, numbers: Numbers, first: int) -> Floats:
    """Return the heading that aligns the first part of the simulated path with the observed one, (m,) [rad]."""
    length, turn = body_steps(ways, numbers)
    gone = np.cumsum(np.abs(length[:, first:]).mean(axis=0))
    end = first + max(int(np.searchsorted(gone, FIRST_PATH)), 1) + 1
    length, turn = length[:, first:end], turn[:, first:end]
    heading = np.cumsum(turn, axis=1)
    path = np.cumsum(length * np.exp(1j * (heading - turn / 2)), axis=1)
    path += (numbers["camera.left"] * 1j - numbers["drive.axle"])[:, None] * (np.exp(1j * heading) - 1.0)
    seen = log.poses[first + 1 : end + 1, 0] + 1j * log.poses[first + 1 : end + 1, 1]
    seen = seen - (log.poses[first, 0] + 1j * log.poses[first, 1])
    part = np.isfinite(seen)
    return np.asarray(np.angle((np.conj(path[:, part]) * seen[part]).sum(axis=1)))


def encoder_likelihood(log: MotionLog, ways: Floats, numbers: Numbers) -> Floats:
    """Return the log likelihood of the distance since the reading before, shape (m, n).

    Args:
        log: Log of n times.
        ways: (m, n, 2) result of `wheel_ways`.
        numbers: (m,) values of `encoder.gain_*`, and `wheel_per_m`, of a distance, and `wheel`, of a reading [m].
    """
    rows = np.flatnonzero(np.isfinite(log.encoders).all(axis=1))
    gains = np.stack([numbers["encoder.gain_left"], numbers["encoder.gain_right"]], axis=1)
    predicted = np.diff(ways[:, rows], axis=1) * gains[:, None]
    off = np.diff(log.encoders[rows], axis=0)[None] - predicted
    variance = numbers["wheel_per_m"][:, None, None] ** 2 * np.abs(predicted)
    variance = variance + 2 * numbers["wheel"][:, None, None] ** 2
    logs = np.zeros(ways.shape[:2])
    density = np.log(variance) + (DEGREES + 1.0) * np.log1p(off**2 / (DEGREES * variance))
    logs[:, rows[1:]] = -0.5 * density.sum(axis=2)
    return logs


def seen_rows(log: MotionLog) -> Bools:
    """Return whether each time has an observation, (n,)."""
    wheels = np.isfinite(log.encoders).all(axis=1) if log.has_commands else False
    return np.asarray(np.isfinite(log.poses[:, 0]) | wheels)
