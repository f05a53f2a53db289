"""The scores of trials, from their traces: arrays as `TraceArrays` has them, trials last.

Loops run over steps, and within each over trials, which lie side by side.
"""

from __future__ import annotations

import math

from realitygap.kernels.compile.decorators import inlined, kernel


@inlined
def _limited(value):
    value = value if value < 1.0 else 1.0
    return value if value > -1.0 else -1.0


@kernel
def avoid_scores(commands, readings, ranges, backward, scores):
    """Floreano & Mondada's product V (1 - sqrt(dv)) (1 - i), its mean over steps.

    Args:
        commands: (t, 2, n) move and turn; the wheels are asked for move - turn and move + turn, each within -1..1.
        readings: (t + 1, s, n) 0..1.
        ranges: (k,) which of them are of the range sensors.
        backward: Whether V counts speeds without their signs; else it is their mean, and at least 0.
        scores: (n,) float64, written: 0..1.
    """
    n_steps, _, n = commands.shape
    for trial in range(n):
        scores[trial] = 0.0
    for step in range(n_steps):
        for trial in range(n):
            move = float(commands[step, 0, trial])
            turn = float(commands[step, 1, trial])
            left = _limited(move - turn)
            right = _limited(move + turn)
            nearest = 0.0
            for k in range(ranges.size):
                nearest = max(nearest, float(readings[step + 1, ranges[k], trial]))
            speed = 0.5 * (abs(left) + abs(right)) if backward else max(0.5 * (left + right), 0.0)
            apart = 0.5 * abs(left - right)
            scores[trial] += speed * (1.0 - math.sqrt(apart)) * (1.0 - min(nearest, 1.0))
    for trial in range(n):
        scores[trial] /= max(n_steps, 1)


@inlined
def _nearest_of(x, y, places, trial):
    """Distance to the nearest of the places (n, k, 2) of a trial."""
    nearest = math.inf
    for k in range(places.shape[1]):
        dx = x - places[trial, k, 0]
        dy = y - places[trial, k, 1]
        nearest = min(nearest, dx * dx + dy * dy)
    return math.sqrt(nearest)


@kernel
def nearness_scores(poses, stalled, places, scores):
    """Compute the robots' mean nearness to the nearest of some places, reduced by the time spent blocked.

    At each step 1 - d / d0, but not below 0, with d0 the distance at the start; its mean over steps, times the share
    of steps that were not blocked.

    Args:
        poses: (t + 1, 3, n) from the start.
        stalled: (t + 1, n).
        places: (n, k, 2) float64 from the origin of the poses; a trial that starts at one is worth 0.
        scores: (n,) float64, written: 0..1.
    """
    n_steps, n = poses.shape[0] - 1, poses.shape[2]
    for trial in range(n):
        total = 0.0
        blocked = 0
        first = _nearest_of(float(poses[0, 0, trial]), float(poses[0, 1, trial]), places, trial)
        for step in range(1, n_steps + 1):
            away = _nearest_of(float(poses[step, 0, trial]), float(poses[step, 1, trial]), places, trial)
            if away < first:
                total += 1.0 - away / first
            blocked += 1 if stalled[step, trial] else 0
        steps = max(n_steps, 1)
        scores[trial] = total / steps * (1.0 - blocked / steps)


@kernel
def goal_scores(poses, goals, radii, scores):
    """Compute the share of the distance to a goal covered by the end: 1 - d / d0, or 1 if it was reached at any step.

    Args:
        poses: (t + 1, 3, n) from the start.
        goals: (n, 2) float64, of each trial, from the origin of the poses.
        radii: (n,) float64, nearer than this is there, above 0.
        scores: (n,) float64, written: at most 1, below 0 where the robot went away from it.
    """
    n_steps, n = poses.shape[0] - 1, poses.shape[2]
    for trial in range(n):
        reached = False
        first = 0.0
        away = 0.0
        for step in range(n_steps + 1):
            dx = float(poses[step, 0, trial]) - goals[trial, 0]
            dy = float(poses[step, 1, trial]) - goals[trial, 1]
            away = math.sqrt(dx * dx + dy * dy)
            if step == 0:
                first = away
            reached = reached or away < radii[trial]
        scores[trial] = 1.0 if reached else 1.0 - away / first


@inlined
def _nearest_wall(x, y, walls):
    """From a point to the nearest point of any wall (w, 4): the way there, and its length."""
    to_x = 0.0
    to_y = 0.0
    nearest = math.inf
    for w in range(walls.shape[0]):
        wall_x = walls[w, 2] - walls[w, 0]
        wall_y = walls[w, 3] - walls[w, 1]
        length = wall_x * wall_x + wall_y * wall_y
        dx = walls[w, 0] - x
        dy = walls[w, 1] - y
        if length > 0.0:
            part = min(max(-(dx * wall_x + dy * wall_y) / length, 0.0), 1.0)
            dx += part * wall_x
            dy += part * wall_y
        square = dx * dx + dy * dy
        if square < nearest:
            nearest = square
            to_x = dx
            to_y = dy
    return to_x, to_y, math.sqrt(nearest)


@kernel
def wall_scores(poses, walls, side, farthest, scores):
    """Compute the distance that robots drove along walls that were near and on one side [m].

    A step counts with its part along the nearest wall, as it lies halfway between the ends of the step, forward with
    the wall on the right side and backward with it on the wrong one; so going to and fro, or round in a circle, adds
    up to nothing.

    Args:
        poses: (t + 1, 3, n) from the start.
        walls: (w, 4) float64 from the start, at least one.
        side: 1: on the left, -1: on the right.
        farthest: Nearer than this is near.
        scores: (n,) float64, written.
    """
    n_steps, n = poses.shape[0] - 1, poses.shape[2]
    for trial in range(n):
        total = 0.0
        for step in range(n_steps):
            x = float(poses[step, 0, trial])
            y = float(poses[step, 1, trial])
            dx = float(poses[step + 1, 0, trial]) - x
            dy = float(poses[step + 1, 1, trial]) - y
            if dx == 0.0 and dy == 0.0:
                continue
            to_x, to_y, away = _nearest_wall(x + 0.5 * dx, y + 0.5 * dy, walls)
            if 0.0 < away < farthest:
                # With the wall to the left of the way, the way is to the right of the wall's direction.
                total += side * (dx * to_y - dy * to_x) / away
        scores[trial] = total
