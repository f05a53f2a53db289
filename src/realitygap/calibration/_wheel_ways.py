"""How far wheels drive in each window, and what a late command changes of it: what noise of `sim` grows with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from realitygap.world import RobotModel

from ._handles import Known, robot_numbers
from ._simulate import Floats, Simulate, motor_noise, plain_numbers, starts_of
from ._windows import Windows

LEAST_LAG = 1e-6  # [s] what stands for none


@dataclass(frozen=True)
class WheelWays:
    """Of w windows and both wheels.

    Attributes:
        way: (w, 2) there and back added up [m]: the way until a command is heard, and the way after it.
        late: (w, 2) what a second of delay of the window's own commands changes [m/s].
        carried: (w, 2) what a second of delay of the command before changes, by the speed that is left of it [m/s].
    """

    way: Floats
    late: Floats
    carried: Floats


def wheel_ways(
    simulate: Simulate, robot: RobotModel, known: Known, windows: Windows, values: Mapping[str, Floats]
) -> WheelWays:
    """With one set of parameters, from what the wheels would drive without delay and lag.

    A wheel keeps its old target until the command is heard, and nears each exponentially, as in `kernels._sim_drive`.
    """
    prompt = {**values, "drive.delay": np.zeros(1), "drive.lag": np.zeros(1)}
    numbers = dict.fromkeys(motor_noise(robot), np.zeros(1)) | robot_numbers(known, robot, prompt)
    done = simulate(starts_of(windows.trials), windows.commands, numbers, 0, keep=("wheels",))
    target = np.diff(np.asarray(done.wheels[0], np.float64), axis=1) / windows.step_s
    now = plain_numbers(robot)
    delay, lag = (
        float(values[name][0]) if name in values else now[name] for name in ("drive.delay", "drive.lag")
    )
    ways = np.stack(_rolled(target, delay, max(lag, LEAST_LAG), windows.step_s))
    total = np.concatenate([np.zeros_like(ways[:, :, :1]), np.cumsum(ways, axis=2)], axis=2)
    return WheelWays(*(total[:, windows.trial, windows.last] - total[:, windows.trial, windows.first]))


def _rolled(target: Floats, delay: float, lag: float, step_s: float) -> tuple[Floats, Floats, Floats]:
    """(k, t, 2) ways, and what lateness of a step and of the one before it changes; from targets [m/s]."""
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
    change = -np.diff(padded, axis=1)[:, : target.shape[1]]
    faded = np.exp(-last / lag)
    carried = np.zeros_like(change)
    carried[:, 1:] = change[:, :-1] * faded * (1.0 - np.exp(-step_s / lag))
    return way, change * (1.0 - faded), carried
