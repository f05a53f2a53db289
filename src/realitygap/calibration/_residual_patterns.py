"""The second part of the check of a fit with poses: what the differences between robot and simulator go with.

A share of the variance is small if a fault acts rarely, or if the fit counts it as noise. But noise goes with nothing.
So the differences of single commands are regressed on the time in the trial, the number of the trial, the heading, the
place, the command, and the last stall. The same regressions of robots from the posterior, in the same trials, show what
chance alone makes of them.

Source: posterior predictive checks with chosen discrepancies, Gelman, Meng & Stern, Statistica Sinica 6 (1996); the
largest of several statistics, each in units of its spread, against the largest of each simulated robot, Westfall &
Young, Resampling-Based Multiple Testing (1993). Differs: the simulated robots are not fitted again, so p is rather too
large. With enough trials, any robot differs significantly from any simulator, so the size has a limit, too. The limits
in `TOLERATED_PATTERN` are chosen on twins, see docs/explanations/inference.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.platforms import Rehearsal, SimEnsemble
from realitygap.records import TrialRecord
from realitygap.world import Arena, RobotModel

from ._one_thread import one_blas_thread
from ._prior import Floats
from ._shots import Shots, moved_by, shots_of
from ._windows import wrapped

N_SIMULATED = 200  # robots from the posterior
SIGNIFICANT = 0.025
"""Largest p of a pattern that counts."""

TOLERATED_PATTERN = {"ahead": 0.0005, "turn": 0.0005, "reading": 0.001}
"""Share of the variance of each kind of observation that may go with one thing."""

LEAST_SPREAD = {"ahead": 3e-4, "turn": 2e-3, "reading": 0.05}
"""Added to the spread of simulated robots: meters, radians, and share of a full reading."""

MOST_OFF = 4.0  # standard deviations: a larger difference counts as this one
LEAST_COMMANDS = 100
FLAT = 1e-6  # of the largest direction of a design: directions below it are left out
STALL_S = 2.0  # after a stall, what it leaves falls to 1/e
LATEST = 5  # commands ago whose reading a late reading may resemble


@dataclass(frozen=True)
class Pattern:
    """The part of the differences of one kind of observation that goes with one thing.

    Attributes:
        kind: Kind of the observations: ahead, turn, or reading.
        goes_with: What they go with, such as time.
        share: Share of the variance of the observations that goes with it, beyond chance.
        tolerated: Share up to which the fit counts as well specified.
        p: Share of simulated robots of which any pattern is as strong.
        message: The pattern in words.
    """

    kind: str
    goes_with: str
    share: float
    tolerated: float
    p: float
    message: str

    @property
    def is_too_large(self) -> bool:
        """True if the simulator cannot reproduce the observations."""
        return self.share > self.tolerated and self.p <= SIGNIFICANT


class _Situation(NamedTuple):
    """The circumstances of commands; arrays of one shape.

    Attributes:
        time: Time in the trial, -1 at its beginning to 1 at its end.
        number: Number of the trial, -1 for the first to 1 for the last.
        heading: Heading [rad].
        x, y: Place, in standard deviations from the mean place.
        after_stall: 1 at a stall, less after it, and 0 if there was none.
        move, turn: The command.
        move_before, turn_before: The command before it.
    """

    time: Floats
    number: Floats
    heading: Floats
    x: Floats
    y: Floats
    after_stall: Floats
    move: Floats
    turn: Floats
    move_before: Floats
    turn_before: Floats


class _Found(NamedTuple):
    """The regression of one kind of observation on one thing.

    Attributes:
        strengths: (1 + m,) explained sum of squares of the robot, then of each simulated one.
        share: Share of the variance that goes with it, beyond chance.
        weights: (f,) coefficients of the robot.
        size: Standard deviation of the effect, in the unit of the observation.
    """

    strengths: Floats
    share: float
    weights: Floats
    size: float


@one_blas_thread()
def residual_patterns(
    trials: Sequence[TrialRecord],
    ensemble: SimEnsemble,
    robot: RobotModel,
    arena: Arena,
    numbers: Mapping[str, Floats],
    *,
    key: int,
) -> list[Pattern]:
    """Return what the differences between observed and simulated commands go with, strongest first.

    Each command is simulated from the observed pose before it. Commands near walls are left out for motion. The list is
    empty if fewer than `LEAST_COMMANDS` remain.

    Args:
        trials: Trials with poses.
        ensemble: Simulator of the trials.
        robot: Robot of the trials.
        arena: Arena of the trials.
        numbers: (m,) draws of the robot's numbers from the posterior of single commands, by dotted name.
        key: Key of the random numbers.
    """
    shots = shots_of(trials, robot, arena)
    free = shots.known & ~shots.touching
    if free.sum() < LEAST_COMMANDS:
        return []
    m = len(next(iter(numbers.values())))
    which = np.linspace(0, m - 1, N_SIMULATED).astype(int)
    some = {name: np.asarray(value)[which] for name, value in numbers.items()}
    moved, readings = _simulated(shots, ensemble, some, key)
    step_s = float(trials[0].step_s) or ensemble.platform.step_s
    situation = _situation_of(shots, step_s)
    at = _Situation(*(column[free] for column in situation))
    found: dict[tuple[str, str], _Found] = {}
    for kind, column in (("ahead", 0), ("turn", 2)):
        seen = shots.moved[free][:, column]
        made = moved[:, free, column]
        off = wrapped(seen - made) if kind == "turn" else seen - made
        for thing, columns in MOTION_THINGS.items():
            found[kind, thing] = _regressed(kind, seen, off, columns(kind, at))
    if shots.readings.shape[2]:
        for thing, design in _designs_of_readings(shots, readings.mean(axis=0), situation).items():
            seen = shots.readings[shots.known].reshape(-1)
            off = seen - readings[:, shots.known].reshape(len(readings), -1)
            found["reading", thing] = _regressed("reading", seen, off, design)
    return _patterns(found, at, step_s)


def _simulated(
    shots: Shots, ensemble: SimEnsemble, numbers: Mapping[str, Floats], key: int
) -> tuple[Floats, Floats]:
    """Return the motion (m, k, t, 3) and the readings (m, k, t, s) of simulated robots at each command."""
    n = shots.readings.shape[2]

    def of(rehearsal: Rehearsal) -> Floats:
        moved = moved_by(rehearsal, shots.poses)
        return np.concatenate([moved, rehearsal.readings[:, :, : moved.shape[2], :n]], axis=3)

    made = ensemble.summarize(shots.play, numbers, key, of, keep=("poses", "readings"))
    return made[..., :3], made[..., 3:]


def _situation_of(shots: Shots, step_s: float) -> _Situation:
    commands = shots.play.commands
    k, t = commands.shape[:2]
    before = np.concatenate([np.zeros((k, 1, 2)), commands[:, :-1]], axis=1)
    time = np.broadcast_to(np.linspace(-1.0, 1.0, t), (k, t))
    number = np.broadcast_to(np.linspace(-1.0, 1.0, k)[:, None], (k, t))
    x, y = (_standard(shots.poses[:, :-1, axis]) for axis in (0, 1))
    step = np.arange(t)
    last = np.maximum.accumulate(np.where(shots.stalled, step, -np.inf), axis=1)
    after_stall = np.exp((last - step) * step_s / STALL_S)
    heading, both = shots.poses[:, :-1, 2], (commands, before)
    return _Situation(
        time, number, heading, x, y, after_stall, *(each[..., axis] for each in both for axis in (0, 1))
    )


def _standard(values: Floats) -> Floats:
    return np.asarray((values - np.nanmean(values)) / (np.nanstd(values) + 1e-9))


def _main(kind: str, at: _Situation) -> list[Floats]:
    """Return the commands that move the robot in one way, with those that turn it if they should not."""
    straight = [at.move, np.abs(at.move)]
    return straight if kind == "ahead" else [at.turn, *straight]


def _by_time(kind: str, at: _Situation) -> list[Floats]:
    return [at.time * column for column in _main(kind, at)]


def _by_number(kind: str, at: _Situation) -> list[Floats]:
    return [at.number * column for column in _main(kind, at)]


def _by_stall(kind: str, at: _Situation) -> list[Floats]:
    return [at.after_stall * column for column in _main(kind, at)]


def _by_lateness(kind: str, at: _Situation) -> list[Floats]:
    return [at.time * (at.move - at.move_before if kind == "ahead" else at.turn - at.turn_before)]


def _by_heading(_: str, at: _Situation) -> list[Floats]:
    """Return directions of the floor: one, which pulls or helps, and two that are opposite, such as those of boards."""
    once = [np.sin(at.heading), np.cos(at.heading)]
    twice = [np.sin(2 * at.heading), np.cos(2 * at.heading)]
    moves = [at.move, np.abs(at.move)]
    return [a * b for a in once for b in (np.ones_like(at.move), *moves)] + [
        a * b for a in twice for b in moves
    ]


def _by_place(kind: str, at: _Situation) -> list[Floats]:
    places = [at.x, at.y, at.x**2, at.y**2, at.x * at.y]
    return [a * b for a in places for b in _main(kind, at)[:2]]


def _by_command(kind: str, at: _Situation) -> list[Floats]:
    main, before = (at.move, at.move_before) if kind == "ahead" else (at.turn, at.turn_before)
    powers = [column * np.abs(column) for column in _main(kind, at)]
    return [*powers, np.abs(at.turn), at.move * at.turn, main**2 * np.abs(main), main * (before * main < 0)]


MOTION_THINGS: dict[str, Callable[[str, _Situation], list[Floats]]] = {
    "time": _by_time,
    "delay": _by_lateness,
    "trial": _by_number,
    "stall": _by_stall,
    "heading": _by_heading,
    "place": _by_place,
    "command": _by_command,
}
"""What differences of motion may go with, and the columns of its design."""


def _designs_of_readings(shots: Shots, mean: Floats, situation: _Situation) -> dict[str, list[Floats]]:
    """Return the columns of the design of readings for each thing; rows are known readings."""

    def known(values: Floats) -> Floats:
        return np.asarray(values[shots.known].reshape(-1), np.float64)

    def ago(n: int) -> Floats:
        earlier = np.concatenate([np.repeat(mean[:, :1], n, axis=1), mean[:, :-n]], axis=1)[
            :, : mean.shape[1]
        ]
        return known(earlier - mean)

    time, number, heading = (column[..., None] for column in situation[:3])
    sensors = np.eye(mean.shape[2])
    return {
        "time": [known(time * mean)],
        "trial": [known(number * mean)],
        "heading": [known(wave(heading) * mean) for wave in (np.sin, np.cos)],
        "memory": [ago(n) for n in (1, 2, 3, LATEST)],
        "sensor": [known(mean * row) for row in sensors],
    }


def _regressed(kind: str, seen: Floats, off: Floats, columns: Sequence[Floats]) -> _Found:
    """Regress the differences of the robot and of simulated ones from the mean of the simulated ones on a design.

    Args:
        kind: Kind of the observations.
        seen: (n,) observations.
        off: (m, n) observations minus those of each simulated robot.
        columns: Columns of the design, (n,) each.
    """
    mean = off.mean(axis=0)
    spread = np.sqrt(off.var(axis=0) + LEAST_SPREAD[kind] ** 2)
    every = np.clip(np.concatenate([mean[None], mean - off]) / spread, -MOST_OFF, MOST_OFF)
    design = np.stack(columns, axis=1)
    left, sizes, right = np.linalg.svd(design / spread[:, None], full_matrices=False)
    kept = sizes > FLAT * max(float(sizes[0]), 1e-12)
    on = every @ left[:, kept]
    weights = (on / sizes[kept]) @ right[kept]
    # the variance of each effect follows from the covariance of the columns
    effects = np.einsum("mf,fg,mg->m", weights, np.atleast_2d(np.cov(design.T, bias=True)), weights)
    variance = float(seen.var())
    share = float(effects[0] - effects[1:].mean()) / variance if variance else 0.0
    return _Found((on**2).sum(axis=1), share, weights[0], float(np.sqrt(max(effects[0], 0.0))))


def _patterns(found: Mapping[tuple[str, str], _Found], at: _Situation, step_s: float) -> list[Pattern]:
    strengths = np.stack([each.strengths for each in found.values()])
    chance = strengths[:, 1:]
    scores = (strengths - chance.mean(axis=1, keepdims=True)) / (chance.std(axis=1, keepdims=True) + 1e-12)
    largest = scores[:, 1:].max(axis=0)
    patterns = [
        Pattern(
            kind,
            thing,
            each.share,
            TOLERATED_PATTERN[kind],
            float((1 + (largest >= score).sum()) / (1 + len(largest))),
            _message(kind, thing, each, at, step_s),
        )
        for ((kind, thing), each), score in zip(found.items(), scores[:, 0], strict=True)
    ]
    return sorted(patterns, key=lambda pattern: pattern.share / pattern.tolerated, reverse=True)


# words


def _message(kind: str, thing: str, found: _Found, at: _Situation, step_s: float) -> str:
    if kind == "reading":
        return _message_of_reading(thing, found)
    scale, unit = (1000 / step_s, "mm/s") if kind == "ahead" else (np.degrees(1) / step_s, "degrees/s")
    typical = f"typically by {found.size * scale:.2g} {unit}"
    subject = "The speed" if kind == "ahead" else "The turning speed"
    if thing == "place":
        return f"{subject} goes with the place in the arena, {typical} beyond what the simulator has."
    if thing == "command":
        return f"{subject} follows the commands by another law than in the simulator, {typical}."
    if thing == "delay":
        how = "later" if found.weights[0] < 0 else "earlier"
        return f"Commands take effect {how} at the end of a trial than at its beginning."
    if thing == "heading":
        return _message_of_heading(kind, found, scale, unit)
    field, first, early, late = {
        "time": ("time", -1.0, "at its beginning", "at the end of a trial"),
        "trial": ("number", -1.0, "in the first trial", "in the last trial"),
        "stall": ("after_stall", 0.0, "otherwise", "just after a stall"),
    }[thing]
    columns = MOTION_THINGS[thing]

    def change(move: float, turn: float) -> float:
        ends = [
            np.stack(columns(kind, _at(move, turn, **{field: end})), axis=1) @ found.weights
            for end in (first, 1.0)
        ]
        return float((ends[1] - ends[0])[0]) * scale

    straight, turning = change(1.0, 0.0), change(0.0, 1.0)
    if kind == "ahead":
        how = "faster" if straight > 0 else "slower"
        return f"At full speed ahead, the robot is {abs(straight):.2g} mm/s {how} {late} than {early}."
    if abs(straight) >= abs(turning):
        side = "left" if straight > 0 else "right"
        return (
            f"At full speed ahead, the robot turns to the {side} by {abs(straight):.2g} degrees/s more {late} than "
            f"{early}."
        )
    how = "faster" if turning > 0 else "slower"
    return f"In place, the robot turns {abs(turning):.2g} degrees/s {how} {late} than {early}."


def _message_of_heading(kind: str, found: _Found, scale: float, unit: str) -> str:
    headings = np.arange(0.0, 2 * np.pi, np.pi / 12)
    effect = np.stack(_by_heading(kind, _at(1.0, 0.0, heading=headings)), axis=1) @ found.weights * scale
    high, low = int(effect.argmax()), int(effect.argmin())
    what = "the robot is faster" if kind == "ahead" else "the robot turns to the left"
    more = "" if kind == "ahead" else " more"
    return (
        f"At full speed ahead, {what} by {effect[high] - effect[low]:.2g} {unit}{more} at a heading of {15 * high} "
        f"degrees than at {15 * low}."
    )


def _message_of_reading(thing: str, found: _Found) -> str:
    ends = [
        max(1 + end * found.weights[0], 0.05) for end in (-1.0, 1.0)
    ]  # as shares of the simulator's readings
    change = ends[1] / ends[0] - 1
    how = "higher" if change > 0 else "lower"
    if thing == "time":
        return f"Readings are {abs(change):.0%} {how} at the end of a trial than at its beginning."
    if thing == "trial":
        return f"Readings are {abs(change):.0%} {how} in the last trial than in the first."
    if thing == "heading":
        return "Readings go with the heading of the robot, beyond the distances of walls."
    if thing == "memory":
        return (
            "Readings resemble those that the simulator has for earlier commands: they are late, or repeated."
        )
    sensor = int(np.abs(found.weights).argmax())
    how = "more" if found.weights[sensor] > 0 else "less"
    return f"Range sensor {sensor} reads {abs(found.weights[sensor]):.0%} {how} than in the simulator."


def _at(move: float, turn: float, **other: float | Floats) -> _Situation:
    """Return a situation with one command, in the middle of everything else."""
    shape: NDArray[np.float64] = np.atleast_1d(np.asarray(other.get("heading", 0.0), np.float64))
    zero = np.zeros(len(shape))
    given = {name: zero + value for name, value in other.items()}
    plain = _Situation(*(zero for _ in _Situation._fields))
    commands = {
        "move": zero + move,
        "turn": zero + turn,
        "move_before": zero + move,
        "turn_before": zero + turn,
    }
    return plain._replace(**commands, **given)
