"""The paper's calibration of the path, and what it forgot: the length of a full step, and its turn.

The robot drives five steps straight ahead at full speed, and turns for five steps on the spot. A ruler tells where it
ends. The paper drove straight only: 13.75 in against 19.7 in of its simulation, which are 70 steps for 100 of the
robot's (it took 87, as if the simulated path had four steps).

Source: Rosenzweig & Remy, section 2.2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.records import TrialRecord
from realitygap.trials import TrialPlan
from realitygap.world import Arena, Fitted, Pose, RobotModel

from ._fit import Fit
from ._one_thread import one_blas_thread
from ._posterior import N_DRAWS
from ._prior import ENDS, is_identified
from ._ruler import EXACT, Moved, moved_in

Array = NDArray[np.float64]

PATH_STEPS = 5
"""Full-speed commands of a trial (section 2.2)."""

REST_STEPS = 2
"""Number of commands in which the robot comes to rest, so that a ruler, a camera, and the simulation find it there."""

REPEATS = 5
"""Default number of repeats of each of the two paths."""

ROBOT_STEPS = 100
"""Commands of a trial on the paper's robot."""

JYRO_STEP = 0.1
"""Length of a full step in the paper's simulation [m] (19.7 in are five)."""


STANDS = 1e-3
"""Way of five full steps below which a robot stood still [m]."""

GAIN_SPREAD, UNEVEN_SPREAD, TRACK_SPREAD = 0.29, 0.115, 0.17
"""Standard deviations of what is thought possible of gain, of their difference, and of the track, as shares."""

METHOD = (
    "Full-speed paths, straight and turning (Rosenzweig & Remy, section 2.2): ways and turns against those of the "
    "simulated robot; Student's intervals from repeats and from the step to which was read."
)

STRAIGHT, TURNING = (1.0, 0.0), (0.0, 1.0)

Simulate = Callable[[TrialRecord], Moved]
"""A function that simulates a trial with the same start and commands, without noise."""


def path_plans(arena: Arena, n: int = 2 * REPEATS) -> list[TrialPlan]:
    """Return n plans, at least 2, that alternate between straight paths and turns on the spot."""
    xs = [x for wall in arena.walls for x in wall[::2]] or [0.0, 1.0]
    ys = [y for wall in arena.walls for y in wall[1::2]] or [0.0, 1.0]
    middle = (min(ys) + max(ys)) / 2
    starts = {
        STRAIGHT: Pose(arena.start.x, middle, 0.0),
        TURNING: Pose((min(xs) + max(xs)) / 2, middle, 0.0),
    }
    kinds = [STRAIGHT, TURNING]
    return [
        TrialPlan(
            start=starts[kinds[k % 2]],
            commands=np.array([kinds[k % 2]] * PATH_STEPS + [(0.0, 0.0)] * REST_STEPS),
            number=k,
            purpose="path",
        )
        for k in range(n)
    ]


@one_blas_thread()
def fit_path(
    trials: Sequence[TrialRecord],
    simulate: Simulate,
    robot: RobotModel,
    rng: np.random.Generator,
) -> Fit:
    """Fit the gains of the wheels and the track from the ends of paths.

    Args:
        trials: Trials of `path_plans`, with poses, the pose of their end, or encoders.
        simulate: The robot on whose numbers the fit builds.
        robot: Description of the simulated robot.
        rng: Random numbers.

    Returns:
        The fit: the wheels' gains and the track, as scale factors of the simulated distance and turn. So the lag and
        the delay of the robot's file stay. Intervals are Student's, from the spread of repeats and the resolution of
        the readings.

    Raises:
        ValueError: No trial drove straight at full speed, or the robot stood still in all that should have, or turned
            not at all.
    """
    straight = _Measured.of(trials, STRAIGHT, robot)
    turning = _Measured.of(trials, TURNING, robot)
    if not straight.moved:
        raise ValueError(
            "There is no straight path: expected trials of full-speed commands straight ahead, move = 1 and "
            "turn = 0, with a measured end."
        )
    if all(abs(moved.way) < STANDS for moved in straight.moved):
        raise ValueError(
            "The robot stood still on all straight paths, expected one that drives at full speed. Is it switched on, "
            "are its batteries full, and do its wheels turn?"
        )
    ways = [moved.way for moved in straight.moved]
    way = _mean(ways, straight.length_step, GAIN_SPREAD * abs(ways[0]), N_DRAWS, rng)
    unknown = UNEVEN_SPREAD * abs(ways[0]) / robot.drive.track
    veer = _mean([moved.turned for moved in straight.moved], straight.angle_step, unknown, N_DRAWS, rng)
    expected, base = simulate(straight.trials[0]), (robot.drive.gain_left + robot.drive.gain_right) / 2
    gain = base * way / expected.way
    track, turn = np.full(N_DRAWS + 1, robot.drive.track), None
    if turning.moved and not straight.by_encoders:
        if all(abs(moved.turned) < STANDS / robot.drive.track for moved in turning.moved):
            raise ValueError(
                "The robot did not turn in any trial with a full-speed turn, expected one with wheels that "
                "turn in opposite directions."
            )
        turns = [moved.turned for moved in turning.moved]
        turn = _mean(turns, turning.angle_step, TRACK_SPREAD * abs(turns[0]), N_DRAWS, rng)
        track = robot.drive.track * (gain / base) * simulate(turning.trials[0]).turned / turn
    uneven = robot.drive.gain_right - robot.drive.gain_left
    uneven = uneven + (veer - expected.turned) * track * base / expected.way
    kept = _of_a_robot(gain - uneven / 2, gain + uneven / 2, track)
    way, gain, uneven, track = way[kept], gain[kept], uneven[kept], track[kept]
    turn = None if turn is None else turn[kept]
    numbers = {"drive.gain_left": gain - uneven / 2, "drive.gain_right": gain + uneven / 2}
    rows = _rows(straight, way, expected.way, gain, uneven)
    notes = [_in_jyro_steps(rows[1])]
    if not turning.moved:
        notes.append("In no trial it turned on the spot.")
    if turn is None:
        rows.append(_unknown_track(robot))
        if turning.moved:
            notes.append("Encoders measure the distance of the wheels, not the turn of the robot.")
    else:
        numbers["drive.track"] = track
        rows += _rows_of_turning(turning, turn, track, robot)
    return Fit(
        tuple(rows),
        {name: float(values[0]) for name, values in numbers.items()},
        {name: values[1:] for name, values in numbers.items()},
        METHOD,
        tuple(notes),
        evidence={
            "straight_m": [moved.way for moved in straight.moved],
            "straight_turned_rad": [moved.turned for moved in straight.moved],
            "turned_rad": [moved.turned for moved in turning.moved],
        },
    )


@dataclass(frozen=True)
class _Measured:
    """The trials of one kind, and how each moved."""

    trials: list[TrialRecord]
    moved: list[Moved]

    @property
    def n_commands(self) -> int:
        """Number of full-speed commands in each trial."""
        return len(_driven(self.trials[0]))

    @classmethod
    def of(cls, trials: Sequence[TrialRecord], command: tuple[float, float], robot: RobotModel) -> _Measured:
        alike = [trial for trial in trials if len(_driven(trial)) and bool(np.all(_driven(trial) == command))]
        measured = [(trial, moved_in(trial) or _by_encoders(trial, robot)) for trial in alike]
        kept = [(trial, moved) for trial, moved in measured if moved is not None]
        return cls([trial for trial, _ in kept], [moved for _, moved in kept])

    @property
    def by_encoders(self) -> bool:
        """True if only encoders observed it."""
        return any(trial.end_pose is None and not len(trial.poses) for trial in self.trials)

    @property
    def length_step(self) -> float:
        return max((moved.length_step for moved in self.moved), default=EXACT)

    @property
    def angle_step(self) -> float:
        return max((moved.angle_step for moved in self.moved), default=EXACT)


def _driven(trial: TrialRecord) -> Array:
    """Return the commands of a trial up to those in which it comes to rest, (t, 2)."""
    moving = np.flatnonzero(np.any(trial.commands != 0, axis=1))
    return trial.commands[: moving[-1] + 1] if len(moving) else trial.commands[:0]


def _by_encoders(trial: TrialRecord, robot: RobotModel) -> Moved | None:
    """Fit the distances of the wheels, with the track of the robot file; None without encoders."""
    if not len(trial.wheels):
        return None
    left, right = trial.wheels[-1] - trial.wheels[0]
    turned = float(right - left) / robot.drive.track
    half = turned / 2
    chord = float(left + right) / 2 * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
    return Moved(float(chord * np.cos(half)), float(chord * np.sin(half)), turned)


def _mean(
    values: Sequence[float], step: float, unknown: float, n_draws: int, rng: np.random.Generator
) -> Array:
    """Return the mean, and draws of it, (1 + n,).

    Repeats that all read the same are as uncertain as what they were read to; one alone is as uncertain as `unknown`,
    the standard deviation of what was thought possible.
    """
    n = len(values)
    if n == 1:
        spread = unknown * rng.standard_normal(n_draws)
    else:
        variance = max(float(np.var(values, ddof=1)), step**2 / 12)
        spread = rng.standard_t(n - 1, size=n_draws) * np.sqrt(variance / n)
    mean: Array = np.mean(values) + np.concatenate([[0.0], spread])
    return mean


def _of_a_robot(*numbers: Array) -> NDArray[np.intp]:
    """Return rows of numbers (1 + n,): the first, and the draws above 0, as the numbers of a robot are positive.

    The others, of which few repeats have some, are left to these.
    """
    whole = 1 + np.flatnonzero(np.all(np.stack(numbers)[:, 1:] > 0, axis=0))
    n = len(numbers[0]) - 1
    return np.concatenate([[0], np.resize(whole, n) if len(whole) else 1 + np.arange(n)])


def _rows(straight: _Measured, way: Array, expected: float, gain: Array, uneven: Array) -> list[Fitted]:
    """Return the rows for straight paths."""
    repeats, step = len(straight.moved), way / straight.n_commands
    return [
        _row("path.step_length", step, "m", (0.01, 0.2), repeats),
        _row("path.jyro_steps", ROBOT_STEPS * step / JYRO_STEP, "", (10.0, 200.0), repeats),
        _row("path.sim_steps", ROBOT_STEPS * way / expected, "", (50.0, 150.0), repeats),
        _row("drive.gain", gain, "", (0.5, 1.5), repeats),
        _row("drive.asymmetry", -uneven, "", (-0.2, 0.2), repeats),  # left less right, as everywhere
    ]


def _rows_of_turning(turning: _Measured, turn: Array, track: Array, robot: RobotModel) -> list[Fitted]:
    """Return the rows for turns on the spot."""
    repeats, step = len(turning.moved), turn / turning.n_commands
    return [
        _row("path.step_turn", step, "rad", (0.0, 3.2), repeats),
        _row("drive.track", track, "m", _track_prior(robot), repeats),
    ]


def _track_prior(robot: RobotModel) -> tuple[float, float]:
    return 0.7 * robot.drive.track, 1.3 * robot.drive.track


def _in_jyro_steps(steps: Fitted) -> str:
    return (
        f"{ROBOT_STEPS} steps of the robot are as long as {steps.estimate:.1f} ({steps.low:.1f} to {steps.high:.1f}) "
        f"of {JYRO_STEP:g} m each, a full step of the paper's simulation. The paper took 87; its own lengths make it "
        "70."
    )


def _row(name: str, values: Array, unit: str, prior: tuple[float, float], repeats: int) -> Fitted:
    low, high = np.quantile(values[1:], ENDS)
    identified = repeats > 1 and is_identified(high - low, (ENDS[1] - ENDS[0]) * (prior[1] - prior[0]))
    return Fitted(
        name=name,
        estimate=float(values[0]),
        low=float(low),
        high=float(high),
        prior_low=prior[0],
        prior_high=prior[1],
        identified=bool(identified),
        unit=unit,
        advice="" if identified else "Drive the path at least three more times: repeats show the precision.",
    )


def _unknown_track(robot: RobotModel) -> Fitted:
    low, high = _track_prior(robot)
    return Fitted(
        name="drive.track",
        estimate=robot.drive.track,
        low=low,
        high=high,
        prior_low=low,
        prior_high=high,
        identified=False,
        unit="m",
        advice="Turn on the spot at full speed, and measure by how much.",
    )
