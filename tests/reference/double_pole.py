"""Two poles on a cart, from Lagrange's equations as a linear system, one list of six numbers at a time.

Cart of mass M at x; a pole is a uniform rod of mass m and length 2 l on a hinge, at angle a from upright:

    (M + m1 + m2) x'' + sum of m l cos(a) a''  =  force + sum of m l sin(a) a'^2
    m l cos(a) x''    + 4/3 m l^2 a''          =  m g l sin(a) - friction * a'
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

State = list[float]  # x, v, long pole's angle and speed, short pole's
Controller = Callable[[State], float]  # from the state to an output in 0..1

CART = 1.0
POLES = ((0.1, 0.5), (0.01, 0.05))  # mass, half length
FRICTION = 2e-6
GRAVITY = 9.8


def slopes(state: State, force: float) -> State:
    """The derivatives of the six variables."""
    _, v, a1, w1, a2, w2 = state
    left = np.zeros((3, 3))
    right = np.array([force, 0.0, 0.0])
    left[0, 0] = CART
    for k, ((mass, half), angle, speed) in enumerate(zip(POLES, (a1, a2), (w1, w2), strict=True), start=1):
        left[0, 0] += mass
        left[0, k] = left[k, 0] = mass * half * math.cos(angle)
        left[k, k] = 4.0 / 3.0 * mass * half**2
        right[0] += mass * half * math.sin(angle) * speed**2
        right[k] = mass * GRAVITY * half * math.sin(angle) - FRICTION * speed
    x, p1, p2 = np.linalg.solve(left, right).tolist()
    return [v, x, w1, p1, w2, p2]


def energy(state: State) -> float:
    """Kinetic and potential energy [J], the poles' as those of rods."""
    _, v, *poles = state
    total = 0.5 * CART * v**2
    for (mass, half), angle, speed in zip(POLES, poles[::2], poles[1::2], strict=True):
        across = v + half * math.cos(angle) * speed
        down = half * math.sin(angle) * speed
        total += 0.5 * mass * (across**2 + down**2) + 0.5 * mass * half**2 / 3.0 * speed**2
        total += mass * GRAVITY * half * math.cos(angle)
    return total


def moved(state: State, direction: State, by: float) -> State:
    return [a + by * b for a, b in zip(state, direction, strict=True)]


def step(state: State, force: float, seconds: float) -> State:
    """One Runge-Kutta step of fourth order."""
    first = slopes(state, force)
    second = slopes(moved(state, first, seconds / 2), force)
    third = slopes(moved(state, second, seconds / 2), force)
    fourth = slopes(moved(state, third, seconds), force)
    mean = [(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(first, second, third, fourth, strict=True)]
    return moved(state, mean, seconds)


def has_failed(state: State) -> bool:
    return abs(state[0]) > 2.4 or any(abs(angle) > math.radians(36) for angle in (state[2], state[4]))


def balance(controller: Controller, most: int, start: Sequence[float]) -> list[State]:
    """The states after each action that did not fail, two steps of 0.01 s an action."""
    state = [*start, 0.0, 0.0]
    path: list[State] = []
    while len(path) < most:
        force = (2.0 * controller(state) - 1.0) * 10.0
        for _ in range(2):
            state = step(state, force, 0.01)
        if has_failed(state):
            break
        path.append(state)
    return path


def inputs(state: State, *, velocities: bool) -> list[float]:
    scaled = [value / by for value, by in zip(state, (4.8, 2.0, 0.52, 2.0, 0.52, 2.0), strict=True)]
    return scaled if velocities else scaled[::2]


def gruau_fitness(path: Sequence[State]) -> float:
    """0.1 f1 + 0.9 f2 of a trial of at most 1,000 actions."""
    f1 = len(path) / 1000
    if len(path) <= 100:
        return 0.1 * f1
    shaking = sum(abs(x) + abs(v) + abs(a) + abs(w) for x, v, a, w, *_ in path[-100:])
    return 0.1 * f1 + 0.9 * 0.75 / shaking
