"""Trials that show much of a robot: of its motion, of its contact with walls, and of both together."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.trials import TrialPlan
from realitygap.world import Arena, Pose, RobotModel, distance_to_segment

from ._one_thread import one_blas_thread
from ._simulate import Floats

STEPS = 100  # of a trial
N_PLANS = 10
STILL = 3  # commands to stand before it drives: what poses scatter by then is the camera's
ROOM_M = 0.03  # kept to walls by a robot as its file has it
TOO_FAST = 1.25  # a robot may be that much faster than its file says
SPEEDS = (1.0, 0.75, 0.5, 0.33, 0.2)
SLOW = (0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.15, 0.18, 0.22, 0.26, 0.3)

Commands = list[tuple[float, float]]


def motion_plans(arena: Arena, robot: RobotModel, n: int = N_PLANS) -> list[TrialPlan]:
    """Return trials to fit a drive to: straight runs, turns in place, arcs, steps of the command, slow commands, mixed.

    The robot drives each part back immediately, so that it stays in the free space even if it differs from its file.
    There are parts for each gain, for both wheels, track and axle (straight and around), lag and delay (steps of the
    command), dead band (slow commands), noise that grows with the distance and with the time (fast and slow), and the
    battery (trials of 100 commands).

    Args:
        arena: Trials begin in the middle of the largest free place on a grid in it, along its longer side.
        robot: Robot with the numbers of its file.
        n: Number of trials. Each of the first five is of another kind.

    Raises:
        ValueError: There is no room for the robot to turn in place.
    """
    start, room = roomiest_place(arena, robot)
    reach = max(room[0] / TOO_FAST, 0.0), max(room[1] / TOO_FAST, 0.0)
    step_m = robot.centers()["drive.speed"] * robot.step_s
    kinds: list[Callable[[np.random.Generator, float, float], Commands]] = [
        _straight,
        _spin,
        _arc,
        _changes,
        _slow,
    ]
    plans = []
    for k in range(n):
        rng = np.random.default_rng(k)
        commands: Commands = [(0.0, 0.0)] * STILL
        while len(commands) < STEPS:
            kind = kinds[k] if k < len(kinds) else kinds[int(rng.integers(len(kinds)))]
            away = kind(rng, step_m, reach[0] if k in (0, 2) else reach[1])
            commands += away + [(-move, -turn) for move, turn in reversed(away)]
            if rng.random() < 0.2:
                commands.append((0.0, 0.0))
        plans.append(
            TrialPlan(
                start,
                commands=np.array(commands[:STEPS]),
                steps=STEPS,
                number=k,
                purpose="motion",
            )
        )
    return plans


def _signed(rng: np.random.Generator, value: float) -> float:
    return value if rng.random() < 0.5 else -value


def _within(speed: float, step_m: float, reach: float, most: int) -> int:
    """Return the number of steps of a speed that fit into the free space."""
    return int(np.clip(reach / max(abs(speed) * step_m, 1e-9), 1, most))


def _straight(rng: np.random.Generator, step_m: float, reach: float) -> Commands:
    speed = _signed(rng, float(rng.choice(SPEEDS)))
    return [(speed, 0.0)] * _within(speed, step_m, reach, 6)


def _spin(rng: np.random.Generator, step_m: float, reach: float) -> Commands:
    return [(0.0, _signed(rng, float(rng.choice(SPEEDS))))] * int(rng.integers(2, 7))


def _arc(rng: np.random.Generator, step_m: float, reach: float) -> Commands:
    speed, turn = _signed(rng, float(rng.uniform(0.3, 0.7))), _signed(rng, float(rng.uniform(0.1, 0.3)))
    return [(speed, turn)] * _within(speed, step_m, reach, 4)


def _changes(rng: np.random.Generator, step_m: float, reach: float) -> Commands:
    """Return commands that change at every step and can all be completed within reach."""
    most = min(1.0, reach / step_m)
    return [
        (_signed(rng, float(rng.uniform(0.2, 1.0)) * most), _signed(rng, float(rng.uniform(0.0, 0.6))))
        for _ in range(2)
    ]


def _slow(rng: np.random.Generator, step_m: float, reach: float) -> Commands:
    speed = _signed(rng, float(rng.choice(SLOW)))
    return [(speed, 0.0) if rng.random() < 0.5 else (0.0, speed)] * 2


def roomiest_place(arena: Arena, robot: RobotModel) -> tuple[Pose, tuple[float, float]]:
    """Return the place with the most free space, its heading, and the free distances along and across [m].

    Raises:
        ValueError: There is no room for the robot to turn in place.
    """
    lines = np.array(arena.segments)
    x, y = (np.unique(lines[:, [axis, axis + 2]]) for axis in (0, 1))
    sides = [np.linspace(side[0], side[-1], 41)[1:-1] for side in (x, y)]
    points = np.array([(px, py) for px in sides[0] for py in sides[1]])
    away = _away(points, lines)
    middle = np.array([(x[0] + x[-1]) / 2, (y[0] + y[-1]) / 2])
    near_middle = np.hypot(*(points - middle).T)
    best = int(np.lexsort((near_middle, -np.round(away, 4)))[0])
    at = points[best]
    across = float(away[best]) - robot.radius - ROOM_M
    if across <= 0:
        raise ValueError(
            f"Arena {arena.name!r} has no place with {robot.radius + ROOM_M:.2f} m to each side, expected one: the "
            "robot has to turn in place without touching anything."
        )
    turns = (0.0, np.pi / 2)
    lengths = [_free_line(at, heading, lines, robot.radius + ROOM_M) for heading in turns]
    which = int(np.argmax(lengths))
    return Pose(float(at[0]), float(at[1]), turns[which]), (max(lengths[which], across), across)


def _free_line(at: Floats, heading: float, lines: Floats, room: float) -> float:
    """Return the free distance straight ahead and back, with the given space to each side [m]."""
    far = np.arange(0.0, 2.0, 0.01)
    path = np.array([np.cos(heading), np.sin(heading)])
    free = [_away(at + sign * far[:, None] * path, lines) >= room for sign in (1, -1)]
    blocked = np.flatnonzero(~(free[0] & free[1]))
    return (
        float(far[blocked[0] - 1])
        if len(blocked) and blocked[0] > 0
        else float(far[-1])
        if not len(blocked)
        else 0.0
    )


def _away(points: Floats, lines: Sequence[Sequence[float]] | Floats) -> Floats:
    """Return the distance from each point to the nearest wall, (n,) [m]."""
    nearest = np.full(len(points), np.inf)
    for x1, y1, x2, y2 in lines:
        way = np.array([x2 - x1, y2 - y1])
        off = points - (x1, y1)
        at = np.clip(off @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(*(off - at[:, None] * way).T))
    return nearest


N_CONTACT = 10
PUSH = 6  # commands into a wall: some to reach it, the others to observe the motion along it
AROUND = (0.35, 0.6, 0.9)  # turns between two walls, as commands


def contact_plans(arena: Arena, robot: RobotModel, n: int = N_CONTACT) -> list[TrialPlan]:
    """Return trials to fit contact to: pushes head on and slantwise, scrapes to both sides, with either end.

    The result of an encounter is not known beforehand, so angles are random. Each trial begins at another heading, and
    after each push the robot backs off and turns by another angle.

    Args:
        arena: Arena. Trials begin at the place with the most room.
        robot: Robot with the numbers of its file.
        n: Number of trials.

    Raises:
        ValueError: There is no room for the robot to turn in place.
    """
    middle, _ = roomiest_place(arena, robot)
    plans = []
    for k in range(n):
        rng = np.random.default_rng(1000 + k)
        start = Pose(
            middle.x, middle.y, math.remainder(middle.heading + 2.399963 * k, math.tau)
        )  # golden angle
        commands: Commands = []
        while len(commands) < STEPS:
            commands += _encounter(rng)
        given = np.array(commands[:STEPS])
        plans.append(TrialPlan(start, commands=given, steps=STEPS, number=k, purpose="contact"))
    return plans


def _encounter(rng: np.random.Generator) -> Commands:
    speed = float(rng.choice([1.0, 0.6])) * (1.0 if rng.random() < 0.7 else -1.0)
    scrape = float(rng.choice([0.0, 0.0, 0.15, 0.3])) * (1.0 if rng.random() < 0.5 else -1.0)
    turn = float(rng.choice(AROUND)) * (1.0 if rng.random() < 0.5 else -1.0)
    push: Commands = [(speed, scrape)] * PUSH
    back: Commands = [(-math.copysign(0.8, speed), 0.0)] * int(rng.integers(1, 3))
    return [*push, *back, *([(0.0, turn)] * int(rng.integers(1, 4)))]


CLEAR_M = 0.015  # between a robot at its start and what is nearest [m]
LONGEST = 8  # steps of one command
TRIES = 10_000


def random_controllers(n: int, seed: int) -> list[Genome]:
    """Return n unrelated networks with a constant input, as in NEAT's first generation with the paper's settings."""
    settings = NeatSettings.named("rosenzweig-remy")
    return [Population(3, 2, settings, seed=seed, replicate=k).ask()[0] for k in range(n)]


def random_start(arena: Arena, radius: float, rng: np.random.Generator) -> Pose:
    """Return a pose in which a robot of this radius touches nothing, in whole centimeters and twelfths of a turn.

    Raises:
        ValueError: There seems to be no room for it.
    """
    grid = arena.grid
    for _ in range(TRIES):
        x = round(grid.x + rng.uniform() * grid.columns * grid.cell, 2)
        y = round(grid.y + rng.uniform() * grid.rows * grid.cell, 2)
        if _clearance(arena, x, y) > radius + CLEAR_M:
            return Pose(x, y, math.remainder(int(rng.integers(12)) * math.tau / 12, math.tau))
    raise ValueError(
        f"No place in arena {arena.name!r} where a robot of radius {radius:.3g} m touches nothing."
    )


def _clearance(arena: Arena, x: float, y: float) -> float:
    gaps = [distance_to_segment(x, y, wall) for wall in arena.walls]
    gaps += [obstacle.distance(x, y) for obstacle in arena.obstacles]
    return min(gaps, default=math.inf)


def excitation(arena: Arena, radius: float, n: int, steps: int, rng: np.random.Generator) -> list[TrialPlan]:
    """Return n trials of straight, turning, slow, and arc commands, each for 1 to 8 steps, from anywhere.

    Args:
        arena: Arena of the trials.
        radius: Distance of the robot's farthest point [m].
        n: Number of trials.
        steps: Commands in each.
        rng: Random numbers.
    """
    return [
        TrialPlan(
            start=random_start(arena, radius, rng),
            commands=_changing_commands(steps, rng),
            steps=steps,
            number=k,
            purpose="excitation",
        )
        for k in range(n)
    ]


def _changing_commands(
    steps: int, rng: np.random.Generator
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    commands = np.zeros((steps, 2))
    at = 0
    while at < steps:
        length = int(rng.integers(1, LONGEST + 1))
        side = float(rng.choice([-1.0, 1.0]))
        kind = int(rng.integers(4))
        command = (
            (side, 0.0),
            (0.0, side * rng.uniform(0.2, 1.0)),
            (rng.uniform(-1, 1), rng.uniform(-1, 1)),
            (side * rng.uniform(0.1, 1.0), rng.uniform(-0.3, 0.3)),
        )[kind]
        commands[at : at + length] = np.round(command, 2)
        at += length
    return commands


@one_blas_thread()
def next_trials(
    places: Floats, informations: Sequence[Floats], n: int, goal: Floats | None = None
) -> list[int]:
    """Return indices of the n candidates that together tell most, the one that tells most first.

    Args:
        places: (m, p) parameters of robots from the posterior.
        informations: (p, p) information of each candidate.
        n: Number of trials to choose. A candidate may be chosen again.
        goal: (m, q) quantities to predict for each robot, such as the mean coverage of controllers that were not
            tried. The choice lowers their variance. Default: it lowers the entropy of the parameters.

    Raises:
        ValueError: There is no candidate.

    Source: Bayesian experimental design for linear models, Chaloner & Verdinelli, Statistical Science 10 (1995). Around
        what is known by now, what a trial shows is taken for linear in the parameters with normal noise. Then a trial
        adds its information to the precision of the parameters, whatever comes out.
    """
    if not informations:
        raise ValueError("No trial to choose from, expected at least one candidate.")
    precision = np.linalg.inv(np.cov(places.T) + 1e-6 * np.eye(places.shape[1]))
    slopes = None if goal is None else _slopes(places, goal)
    chosen: list[int] = []
    for _ in range(n):
        left = [_unknown(precision + information, slopes) for information in informations]
        chosen.append(int(np.argmin(left)))
        precision = precision + informations[chosen[-1]]
    return chosen


def _slopes(places: Floats, goal: Floats) -> Floats:
    """Return the slopes of the goal by the parameters, (p, q), shrunk by noise."""
    off = places - places.mean(axis=0)
    p = off.shape[1]
    return np.linalg.solve(off.T @ off + len(off) * 0.05 * np.eye(p), off.T @ (goal - goal.mean(axis=0)))


def _unknown(precision: Floats, slopes: Floats | None) -> float:
    """Return the remaining uncertainty: variance of the predictions, or twice the entropy up to a constant."""
    if slopes is None:
        return -float(np.linalg.slogdet(precision)[1])
    return float(np.einsum("pq,pq->", slopes, np.linalg.solve(precision, slopes)))
