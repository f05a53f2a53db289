"""The distances of wheels in each window, with which the noise of `sim` grows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from realitygap.world import RobotModel

from ._handles import Known, robot_numbers
from ._simulate import Floats, Simulate, motor_noise, starts_of
from ._windows import Windows

LEAST_LAG = 1e-6  # [s] what stands for none
STANDS = 1e-3  # [m/s] of the wheels, below which no noise goes on, as in kernels/sim/drive.py
N_DELAYS = 9  # between the least and the most that a command may be late


@dataclass(frozen=True)
class WheelWays:
    """Distances of wheels in w windows, averaged over the delay of commands.

    Attributes:
        way: (w, 2) total distance of both wheels, forward and backward [m]: before a command takes effect, and after
            it.
        moving_s: (w,) time in which a wheel turns, in whole steps [s].
    """

    way: Floats
    moving_s: Floats


def wheel_ways(
    simulate: Simulate,
    robot: RobotModel,
    known: Known,
    windows: Windows,
    values: Mapping[str, Floats],
    jitter: float,
) -> WheelWays:
    """Compute the wheels' distances with one set of parameters and a jitter [s].

    They follow from the wheels' motion without delay and lag. A wheel keeps its old target until a command takes
    effect, and approaches each target exponentially, as in `kernels.sim.drive`.
    """
    prompt = {**values, "drive.delay": np.zeros(1), "drive.lag": np.zeros(1)}
    numbers = dict.fromkeys(motor_noise(robot), np.zeros(1)) | robot_numbers(known, robot, prompt)
    done = simulate(starts_of(windows.trials), windows.commands, numbers, 0, keep=("wheels",))
    target = np.diff(np.asarray(done.wheels[0], np.float64), axis=1) / windows.step_s
    now = robot.centers()
    delay, lag = (
        float(values[name][0]) if name in values else now[name] for name in ("drive.delay", "drive.lag")
    )
    delays = np.maximum(delay + jitter * np.linspace(-1.0, 1.0, 2 * N_DELAYS + 1)[1::2], 0.0)
    ways = np.stack([_rolled(target, late, max(lag, LEAST_LAG), windows.step_s) for late in delays])
    moving = windows.step_s * (ways.mean(axis=-1, keepdims=True) > STANDS * windows.step_s)
    steps = np.concatenate([ways, moving], axis=-1).mean(axis=0)
    total = np.concatenate([np.zeros_like(steps[:, :1]), np.cumsum(steps, axis=1)], axis=1)
    found = total[windows.trial, windows.first + 1] - total[windows.trial, windows.first]
    return WheelWays(found[:, :2], found[:, 2])


def _rolled(target: Floats, delay: float, lag: float, step_s: float) -> Floats:
    """Return distances from targets [m/s], (k, t, 2)."""
    whole = int(delay / step_s)
    first = delay - whole * step_s
    last = step_s - first
    padded = np.concatenate([np.zeros_like(target[:, :1])] * (whole + 1) + [target], axis=1)
    way = np.empty_like(target)
    speed = np.zeros_like(target[:, 0])
    for k in range(target.shape[1]):
        steps = np.zeros_like(speed)
        for time, to in ((first, padded[:, k]), (last, padded[:, k + 1])):
            left = np.exp(-time / lag)
            steps += np.abs(to * time + (speed - to) * lag * (1.0 - left))
            speed = to + (speed - to) * left
        way[:, k] = steps
    return way
