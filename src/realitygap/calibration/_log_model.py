"""A model of a log: wheels follow commands, a body follows its wheels, and a camera or encoders see it.

Poses are filtered by an extended Kalman filter, so that errors of the heading grow along the path, and one false
turn is not explained by gains.

Source: Särkkä (2013), Bayesian Filtering and Smoothing, sections 5.2 and 12.2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ._simulate import Bools, Floats

LEAST_LAG = 1e-6
"""A lag below this is none [s]."""

LEAST_ROOM = 1e-6
"""Minimum of 1 - soft dead band, by which commands are divided."""

FIRST_TURN = 0.3
"""Standard deviation of the first heading, which positions alone show only later [rad]."""

FIRST_PATH = 0.3
"""Path from which the first heading is taken [m]."""


@dataclass(frozen=True)
class MotionLog:
    """A recording of n times.

    Attributes:
        time_s: (n,) ascending [s].
        commands: (n, 2) command of the left and the right wheel, as shares of full speed. Each lasts until the next
            time.
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
        poses[row:], encoders[row:] = np.nan, np.nan
        return replace(self, poses=poses, encoders=encoders)

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
        """True if encoders were observed at two times."""
        return bool((np.isfinite(self.encoders).all(axis=1)).sum() > 1)


@dataclass(frozen=True)
class Tracked:
    """A filtered log for m sets of numbers.

    Attributes:
        poses: (m, n, 3) predicted before each time's own observation.
        log_likelihood: (m,) log likelihood of the poses.
    """

    poses: Floats
    log_likelihood: Floats


def wheel_steps(log: MotionLog, numbers: Mapping[str, Floats]) -> Floats:
    """Return the distance of each wheel between two times, shape (m, n - 1, 2) [m].

    A command is late by the delay, and a speed nears it within the lag, as in kernels/sim/drive.py. A command that
    changes between two times because of the delay counts with its mean.

    Args:
        log: Times and commands.
        numbers: (m,) values of `drive.*`.
    """
    at = {name.removeprefix("drive."): values[:, None] for name, values in numbers.items()}
    time = log.time_s
    steps = []
    for wheel, side in enumerate(("left", "right")):
        asked = log.commands[None, :, wheel]
        size = np.abs(asked)
        soft = at["soft_dead_band"]
        moved = np.where(size > at["dead_band"], size, 0.0)
        moved = np.maximum(moved - soft, 0.0) / np.maximum(1.0 - soft, LEAST_ROOM)
        target = at["speed"] * at[f"gain_{side}"] * np.sign(asked) * moved
        target = target + np.where(moved > 0, at[f"bias_{side}"], 0.0)
        steps.append(_rolled(_delayed(target, time, at["delay"]), time, at["lag"]))
    return np.stack(steps, axis=-1)


def _delayed(target: Floats, time: Floats, delay: Floats) -> Floats:
    """Return mean targets between two times of late commands, (m, n - 1)."""
    lasts = np.diff(time)
    if not np.any(delay):
        return np.broadcast_to(target[:, :-1], (len(target), len(lasts)))
    total = np.concatenate([np.zeros((len(target), 1)), np.cumsum(target[:, :-1] * lasts, axis=1)], axis=1)
    late = np.broadcast_to(np.clip(time - delay, time[0], None), total.shape)
    reached = np.stack([np.interp(times, time, row) for times, row in zip(late, total, strict=True)])
    return np.asarray(np.diff(reached, axis=1) / lasts)


def _rolled(target: Floats, time: Floats, lag: Floats) -> Floats:
    """Return (m, n - 1) distances of wheels that near their targets exponentially [m]."""
    slow = np.maximum(lag, LEAST_LAG)
    lasts = np.diff(time)
    left = np.exp(-lasts / slow)
    if not np.any(lag > LEAST_LAG):
        return target * lasts
    steps, speed = np.empty_like(target), np.zeros(len(target))
    for k in range(target.shape[1]):
        short = speed - target[:, k]
        steps[:, k] = target[:, k] * lasts[k] + short * slow[:, 0] * (1.0 - left[:, k])
        speed = target[:, k] + short * left[:, k]
    return steps


def track(
    log: MotionLog, steps: Floats, numbers: Mapping[str, Floats], noise: Mapping[str, Floats]
) -> Tracked:
    """Filter the poses of a log.

    Args:
        log: Log of n times. Rows without a position are predicted.
        steps: (m, n - 1, 2) result of `wheel_steps`.
        numbers: (m,) values of `drive.*`.
        noise: (m,) `travel_per_m`, `heading_per_m`, `heading_per_s`, `place` and `angle`.
    """
    m, n = steps.shape[:2]
    n += 1
    lasts = np.diff(log.time_s)
    keep = (1.0 - numbers["drive.slip"])[:, None]
    left, right = steps[..., 0] * keep, steps[..., 1] * keep
    length = (left + right) / 2
    turn = (right - left) / numbers["drive.track"][:, None] + numbers["drive.drift_per_m"][:, None] * length
    way = (np.abs(steps[..., 0]) + np.abs(steps[..., 1])) / 2
    travel = noise["travel_per_m"][:, None] ** 2 * way + 1e-12
    heading = noise["heading_per_m"][:, None] ** 2 * way
    heading = heading + noise["heading_per_s"][:, None] ** 2 * lasts * (way > 1e-3 * lasts) + 1e-12
    first = int(np.flatnonzero(np.isfinite(log.poses[:, 0]))[0])
    axle = numbers["drive.axle"]
    state = np.zeros((m, 3))
    state[:, 2] = log.poses[first, 2]
    if not np.isfinite(log.poses[first, 2]):
        state[:, 2] = _first_heading(log, length, turn, first)
    state[:, 0] = log.poses[first, 0] + axle * np.cos(state[:, 2])
    state[:, 1] = log.poses[first, 1] + axle * np.sin(state[:, 2])
    place, angle = noise["place"] ** 2, noise["angle"] ** 2
    spread = np.zeros((m, 3, 3))
    spread[:, 0, 0] = spread[:, 1, 1] = place
    spread[:, 2, 2] = angle if np.isfinite(log.poses[first, 2]) else FIRST_TURN**2
    predicted, logs = np.empty((m, n, 3)), np.zeros(m)
    predicted[:, : first + 1] = state[:, None]
    for k in range(first, n - 1):
        state, spread = _moved(state, spread, length[:, k], turn[:, k], travel[:, k], heading[:, k])
        predicted[:, k + 1] = state
        seen = log.poses[k + 1]
        if np.isfinite(seen[0]):
            state, spread, one = _updated(state, spread, seen, axle, place, angle)
            logs += one
    predicted[..., 0] -= axle[:, None] * np.cos(predicted[..., 2])
    predicted[..., 1] -= axle[:, None] * np.sin(predicted[..., 2])
    return Tracked(predicted, logs)


def _first_heading(log: MotionLog, length: Floats, turn: Floats, first: int) -> Floats:
    """Return the heading that aligns the first part of the simulated path with the observed one, (m,) [rad]."""
    heading = np.concatenate([np.zeros((len(turn), 1)), np.cumsum(turn[:, first:], axis=1)], axis=1)
    middle = heading[:, :-1] + turn[:, first:] / 2
    path = np.cumsum(length[:, first:] * np.exp(1j * middle), axis=1)
    seen = (log.poses[first + 1 :, 0] - log.poses[first, 0]) + 1j * (
        log.poses[first + 1 :, 1] - log.poses[first, 1]
    )
    gone = np.cumsum(np.abs(length[:, first:]).mean(axis=0))
    part = np.isfinite(seen) & (gone <= max(FIRST_PATH, gone[0]))
    return np.asarray(np.angle((np.conj(path[:, part]) * seen[part]).sum(axis=1)))


def _moved(
    state: Floats, spread: Floats, length: Floats, turn: Floats, travel: Floats, heading: Floats
) -> tuple[Floats, Floats]:
    """Drive an arc, with noise of its length and of its turn."""
    middle = state[:, 2] + turn / 2
    chord = length * np.sinc(turn / (2 * np.pi))
    cosine, sine = np.cos(middle), np.sin(middle)
    new = state + np.stack([chord * cosine, chord * sine, turn], axis=1)
    a, b = -chord * sine, chord * cosine
    p = spread.copy()
    p[:, 0] += a[:, None] * spread[:, 2]
    p[:, 1] += b[:, None] * spread[:, 2]
    q = p.copy()
    q[:, :, 0] += a[:, None] * p[:, :, 2]
    q[:, :, 1] += b[:, None] * p[:, :, 2]
    half = np.stack([a / 2, b / 2, np.ones_like(a)], axis=1)
    along = np.stack([cosine, sine, np.zeros_like(cosine)], axis=1)
    q += travel[:, None, None] * along[:, :, None] * along[:, None, :]
    q += heading[:, None, None] * half[:, :, None] * half[:, None, :]
    return new, q


def _updated(
    state: Floats, spread: Floats, seen: Floats, axle: Floats, place: Floats, angle: Floats
) -> tuple[Floats, Floats, Floats]:
    """Take the observations of one time, one after the other: their errors are independent."""
    logs = np.zeros(len(state))
    for axis in range(3 if np.isfinite(seen[2]) else 2):
        off, by_heading = seen[axis] - state[:, axis], np.zeros(len(state))
        if axis == 2:
            off = np.mod(off + np.pi, 2 * np.pi) - np.pi
        else:  # the body's origin is seen, and the middle of its axle moves
            cosine, sine = np.cos(state[:, 2]), np.sin(state[:, 2])
            off = off + axle * (sine if axis else cosine)
            by_heading = axle * (-cosine if axis else sine)
        row = spread[:, axis] + by_heading[:, None] * spread[:, 2]
        variance = row[:, axis] + by_heading * row[:, 2] + (angle if axis == 2 else place)
        gain = row / variance[:, None]
        state = state + gain * off[:, None]
        spread = spread - gain[:, :, None] * row[:, None, :]
        logs -= 0.5 * (off**2 / variance + np.log(2 * np.pi * variance))
    return state, spread, logs


def encoder_likelihood(log: MotionLog, steps: Floats, noise: Mapping[str, Floats]) -> Floats:
    """Return the log likelihood of the distances between encoder readings, shape (m,).

    Args:
        log: Log of n times.
        steps: (m, n - 1, 2) result of `wheel_steps`.
        noise: (m,) `wheel_per_m`, of a distance, and `wheel`, of a reading [m].
    """
    rows = np.flatnonzero(np.isfinite(log.encoders).all(axis=1))
    total = np.concatenate([np.zeros_like(steps[:, :1]), np.cumsum(steps, axis=1)], axis=1)
    off = np.diff(log.encoders[rows], axis=0)[None] - np.diff(total[:, rows], axis=1)
    way = np.abs(np.diff(total[:, rows], axis=1))
    variance = noise["wheel_per_m"][:, None, None] ** 2 * way + 2 * noise["wheel"][:, None, None] ** 2
    return np.asarray(-0.5 * (off**2 / variance + np.log(2 * np.pi * variance)).sum(axis=(1, 2)))


def seen_rows(log: MotionLog) -> Bools:
    """Return whether each time has an observation, (n,)."""
    return np.asarray(np.isfinite(log.poses[:, 0]) | np.isfinite(log.encoders).all(axis=1))
