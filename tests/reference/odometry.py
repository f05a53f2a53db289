"""Wheels that follow commands, and a Kalman filter of poses, written for the eye: one robot, matrices, small steps."""

from __future__ import annotations

import math

import numpy as np

DEGREES = 5.0
FIRST_TURN = 0.3


def ways_of(times, commands, *, speed, bias, dead_band, soft, lag, n=2000):
    """Distance of one wheel at each time, by Euler steps of its speed."""
    way, at, ways = 0.0, 0.0, [0.0]
    for k in range(len(times) - 1):
        asked = commands[k]
        size = abs(asked) if abs(asked) > dead_band else 0.0
        size = max(size - soft, 0.0) / (1.0 - soft)
        target = math.copysign(size * speed, asked) + bias if size > 0 else 0.0
        step = (times[k + 1] - times[k]) / n
        for _ in range(n):
            before = at
            at = target + (at - target) * math.exp(-step / lag) if lag > 0 else target
            way += step * (before + at) / 2 if lag > 0 else step * at
        ways.append(way)
    return np.array(ways)


def log_likelihoods(times, poses, ways, body):
    """Log likelihood of each row's pose, (n,); `body` has the kernel's numbers by name."""
    seen = np.array([-body["axle"], body["left"]])
    place, angle = body["place"] ** 2, body["angle"] ** 2

    def observed(state):
        c, s = math.cos(state[2]), math.sin(state[2])
        return np.array(
            [
                state[0] + seen[0] * c - seen[1] * s,
                state[1] + seen[0] * s + seen[1] * c,
                state[2] + body["zero"],
            ]
        )

    first = int(np.flatnonzero(np.isfinite(poses[:, 0]))[0])
    has_heading = np.isfinite(poses[first, 2])
    heading = poses[first, 2] - body["zero"] if has_heading else body["first"]
    state = np.array([0.0, 0.0, heading])
    state[:2] = poses[first, :2] - observed(state)[:2]
    spread = np.diag([place, place, angle if has_heading else FIRST_TURN**2])
    logs = np.zeros(len(times))
    for k in range(first, len(times) - 1):
        left, right = (ways[k + 1] - ways[k]) * (1 - body["slip"])
        length, turn = (left + right) / 2, (right - left) / body["track"] + body["drift"] * (left + right) / 2
        way, lasts = (abs(left) + abs(right)) / 2, times[k + 1] - times[k]
        middle = state[2] + turn / 2
        chord = length * np.sinc(turn / (2 * np.pi))
        f = np.eye(3)
        f[0, 2], f[1, 2] = -chord * math.sin(middle), chord * math.cos(middle)
        along = np.array([math.cos(middle), math.sin(middle), 0.0])
        about = np.array([f[0, 2] / 2, f[1, 2] / 2, 1.0])
        travel = body["travel"] ** 2 * way + 1e-12
        wander = body["heading_per_m"] ** 2 * way + 1e-12
        wander += body["heading_per_s"] ** 2 * lasts if way > 1e-3 * lasts else 0.0
        state = state + np.array([chord * math.cos(middle), chord * math.sin(middle), turn])
        spread = f @ spread @ f.T + travel * np.outer(along, along) + wander * np.outer(about, about)
        if not np.isfinite(poses[k + 1, 0]):
            continue
        n = 3 if np.isfinite(poses[k + 1, 2]) else 2
        c, s = math.cos(state[2]), math.sin(state[2])
        h = np.eye(3)
        h[0, 2], h[1, 2] = -seen[0] * s - seen[1] * c, seen[0] * c - seen[1] * s
        errors = poses[k + 1] - observed(state)
        errors[2] = (errors[2] + math.pi) % (2 * math.pi) - math.pi
        moved = np.zeros(3)
        for axis in range(n):
            off = errors[axis] - h[axis] @ moved
            total = h[axis] @ spread @ h[axis] + (angle if axis == 2 else place)
            gain = spread @ h[axis] / total
            moved = moved + gain * off
            spread = spread - np.outer(gain, h[axis] @ spread)
            logs[k + 1] -= 0.5 * math.log(total) + (DEGREES + 1) / 2 * math.log(
                1 + off**2 / (DEGREES * total)
            )
        state = state + moved
    return logs
