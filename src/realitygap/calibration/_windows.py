"""Short windows of trials: what was observed of each, what a simulator has happen in it, and how the two differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from realitygap.records import TrialRecord
from realitygap.world import Arena, RobotModel

from ._prior import Known, robot_numbers
from ._simulate import Bools, Floats, Ints, Simulate, motor_noise, padded_commands, starts_of, step_of

CLEAR_M = 0.006  # from walls: nearer, a camera's error could hide a touch
CHANNELS = ("along", "across", "turn", "left", "right")
"""Channels of a window: end of the axle's middle, along and across the direction [m]; turn [rad]; distance of the
wheels [m]."""


@dataclass(frozen=True)
class Windows:
    """w windows of one command each, in k trials.

    Attributes:
        trials: Trials of the windows.
        trial: (w,) index of the trial.
        first: (w,) row of the pose before it; the next row is the pose after it.
        touching: (w,) True if the robot was near a wall at either end of it, or stalled.
        seen: Observations: (w, 3) poses before and after, (w, 2) distance of the wheels [m]; nan if not observed.
        commands: (k, t, 2).
        anchors: (k, t + 1, 3) poses at the starts of windows.
        step_s: [s].
    """

    trials: tuple[TrialRecord, ...]
    trial: Ints
    first: Ints
    touching: Bools
    seen: tuple[Floats, Floats, Floats]
    commands: Floats
    anchors: Floats
    step_s: float

    def only(self, which: Bools) -> Windows:
        """Return some of the windows; all trials are still simulated."""
        before, after, wheels = self.seen
        return Windows(
            self.trials, self.trial[which], self.first[which], self.touching[which],
            (before[which], after[which], wheels[which]), self.commands, self.anchors, self.step_s,
        )  # fmt: skip


@dataclass(frozen=True)
class Simulated:
    """Simulated robots (m) in windows (w): (m, w, 3) final poses, (m, w, 2) distances of the wheels [m]."""

    after: Floats
    wheels: Floats


def wrapped(angle: Floats) -> Floats:
    """Return the same angles between -pi and pi [rad]."""
    return np.asarray(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


def make_windows(trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena) -> Windows:
    """Return a window for each command.

    Raises:
        ValueError: No trial, or steps of different lengths.
    """
    step_s = step_of(trials)
    commands = padded_commands(trials)
    anchors = np.full((len(trials), commands.shape[1] + 1, 3), np.nan)
    parts = []
    outline = outline_of(robot)
    for k, trial in enumerate(trials):
        t = len(trial.commands)
        first = np.arange(t)
        poses = trial.poses if len(trial.poses) else np.full((t + 1, 3), np.nan)
        wheels = trial.wheels if len(trial.wheels) else np.full((t + 1, 2), np.nan)
        anchors[k, first] = poses[first]
        near = is_near(poses, outline, arena)
        near[:t] |= trial.stalled
        near[1 : t + 1] |= trial.stalled
        parts.append((np.full(t, k), first, near[first] | near[first + 1], poses[first], poses[first + 1],
                      wheels[first + 1] - wheels[first]))  # fmt: skip
    trial_of, first, touching, before, after, way = (
        np.concatenate(part) for part in zip(*parts, strict=True)
    )
    return Windows(
        tuple(trials), trial_of.astype(np.int64), first.astype(np.int64), touching,
        (before, after, way), commands, anchors, step_s,
    )  # fmt: skip


def outline_of(robot: RobotModel) -> Floats:
    """Return points around the body, (p, 2) [m]."""
    return np.array([point for part in robot.body for point in part.outline()])


def is_near(poses: Floats, outline: Floats, arena: Arena) -> Bools:
    """Return whether the body at each pose is near a wall, (n,); False if the pose is unknown."""
    cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    x = poses[:, :1] + outline[:, 0] * cos - outline[:, 1] * sin
    y = poses[:, 1:2] + outline[:, 0] * sin + outline[:, 1] * cos
    near = np.zeros(len(poses), np.bool_)
    for x1, y1, x2, y2 in arena.segments:
        along, beside = x2 - x1, y2 - y1
        size = max(along * along + beside * beside, 1e-12)
        at = np.clip(((x - x1) * along + (y - y1) * beside) / size, 0.0, 1.0)
        away = np.hypot(x - x1 - at * along, y - y1 - at * beside)
        near |= np.nanmin(np.where(np.isnan(away), np.inf, away), axis=1) < CLEAR_M
    return near


def simulate_windows(
    simulate: Simulate,
    robot: RobotModel,
    known: Known,
    windows: Windows,
    values: Mapping[str, Floats],
    same_noise: int | None = None,
) -> Simulated:
    """Simulate each window from the robot's observed pose at its beginning, with each of m sets of parameters.

    Without noise, where the values have none; with the same for all sets, where a key is given.
    """
    m = len(next(iter(values.values())))
    numbers = dict.fromkeys(motor_noise(robot), np.zeros(m)) | robot_numbers(known, robot, values)
    has_poses = bool(np.isfinite(windows.anchors).any())
    done = simulate(
        starts_of(windows.trials),
        windows.commands,
        numbers,
        same_noise or 0,
        anchors=windows.anchors if has_poses else None,
        keep=("poses", "wheels"),
        same_noise=same_noise is not None,
    )
    wheels = np.asarray(done.wheels, np.float64)
    return Simulated(
        np.asarray(done.poses[:, windows.trial, windows.first + 1], np.float64),
        wheels[:, windows.trial, windows.first + 1] - wheels[:, windows.trial, windows.first],
    )


def differences(
    robot: RobotModel, windows: Windows, simulated: Simulated, values: Mapping[str, Floats]
) -> Floats:
    """Return observed minus simulated values, by `CHANNELS`, (m, w, 5); nan if not observed.

    Differences are those of the axle's middle, whose place depends on the wheels but not on the heading. Half of an
    error of the turn is subtracted from the direction of motion, because that part of it is expected.
    """
    before, after, way = windows.seen
    axle = values.get("drive.axle", np.full(len(simulated.after), robot.centers()["drive.axle"]))
    seen = _moved(before, after, axle)
    made = _moved(before, simulated.after, axle)
    turn_off = wrapped(seen[..., 2] - made[..., 2])
    half = -turn_off / 2
    x = seen[..., 0] * np.cos(half) - seen[..., 1] * np.sin(half) - made[..., 0]
    y = seen[..., 0] * np.sin(half) + seen[..., 1] * np.cos(half) - made[..., 1]
    ahead = made[..., 2] / 2
    along = x * np.cos(ahead) + y * np.sin(ahead)
    across = y * np.cos(ahead) - x * np.sin(ahead)
    wheels = way - simulated.wheels
    return np.stack([along, across, turn_off, wheels[..., 0], wheels[..., 1]], axis=-1)


def _moved(before: Floats, after: Floats, axle: Floats) -> Floats:
    """Return the motion of the axle's middle in the body's earlier frame, and the turn, (m, w, 3)."""
    turn = wrapped(after[..., 2] - before[:, 2])
    offset = axle[:, None]
    dx, dy = after[..., 0] - before[:, 0], after[..., 1] - before[:, 1]
    cos, sin = np.cos(before[:, 2]), np.sin(before[:, 2])
    x = dx * cos + dy * sin + offset * (np.cos(turn) - 1.0)
    y = dy * cos - dx * sin + offset * np.sin(turn)
    return np.stack(np.broadcast_arrays(x, y, turn), axis=-1)


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
    driven = total[windows.trial, windows.first + 1] - total[windows.trial, windows.first]
    return WheelWays(driven[:, :2], driven[:, 2])


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
