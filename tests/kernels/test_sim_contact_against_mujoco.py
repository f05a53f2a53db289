"""The contact `slide` ends where MuJoCo has the same push end: fitted to a servo, and as it is for wheels that slip."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize

from realitygap.evolution import NeatSettings
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim.lanes import SimRules, make_sim_room
from realitygap.kernels.sim.shape import make_sim_shape, sim_table
from realitygap.kernels.sim.trial import start_sim, step_sim

pytest.importorskip("mujoco", reason="needs MuJoCo: pip install 'realitygap[twin]'")

from tests.reference.pushed_body import Push, PushedBody, Wheels

pytestmark = pytest.mark.slow

CORNERS = [(0.079, -0.05), (0.079, 0.05), (0.06, 0.0695), (-0.06, 0.0695),
           (-0.079, 0.05), (-0.079, -0.05), (-0.06, -0.0695), (0.06, -0.0695)]  # fmt: skip
RADIUS = 0.01
FRICTION = 0.3
SPEED, TRACK = 0.3, 0.153  # at full command [m/s], [m]
STEP_S = 0.02
NEAR_THE_BOUNDARY = math.radians(5)


def _aligns_by(push: Push) -> float:
    """How far the first contact is from the border between aligning and stalling [rad].

    Of the corner that touches first: the wall's force, tilted by friction, passes the axle on one side or the other.
    """
    cos, sin = math.cos(push.heading), math.sin(push.heading)
    x, y = max(CORNERS, key=lambda corner: sin * corner[0] + cos * corner[1])
    x, y = x + RADIUS * sin, y + RADIUS * cos
    return abs(math.atan2(x, abs(y)) - abs(push.heading) - math.atan(FRICTION))


def _pushes(n: int, seed: int, turn: float = 4.0) -> list[Push]:
    rng = np.random.default_rng(seed)
    pushes = []
    while len(pushes) < n:
        speed = rng.uniform(0.05, 0.15)
        push = Push(
            y=-rng.uniform(0.11, 0.14),
            heading=math.radians(rng.uniform(3, 87)),
            speed=speed,
            turn=rng.uniform(-turn, turn) * speed,
            seconds=STEP_S * int(rng.integers(50, 125)),
        )
        if _aligns_by(push) > NEAR_THE_BOUNDARY:
            pushes.append(push)
    return pushes


def _ends(pushes: list[Push], friction: float, lat: float, ang: float, saturation: float = 0.0) -> np.ndarray:
    """(n, 3) where `slide` has them end: x, y [m], heading [rad]; at most LANES of them."""
    shape = make_sim_shape(parts=[8], contact="slide", n_walls=4, enclosed=True)
    walls = [(-5, -9, 5, -9), (5, -9, 5, 0), (5, 0, -5, 0), (-5, 0, -5, -9)]
    numbers = {"body.0.radius": RADIUS, "drive.speed": SPEED, "drive.track": TRACK}
    numbers |= {"contact.friction": friction, "contact.long": 1.0, "contact.lat": lat, "contact.ang": ang}
    numbers["contact.saturation"] = saturation
    for k, (x, y) in enumerate(CORNERS):
        numbers |= {f"body.0.corner.{k}.x": x, f"body.0.corner.{k}.y": y}
    for k, ends in enumerate(walls):
        numbers |= {
            f"arena.wall.{k}.{name}": float(end)
            for name, end in zip(("x1", "y1", "x2", "y2"), ends, strict=True)
        }
    numbers |= {
        "arena.start.x": 0.0,
        "arena.start.y": np.array([push.y for push in pushes]),
        "arena.start.heading": np.array([push.heading for push in pushes]),
    }
    table = sim_table(shape, numbers, np.float64)
    neat = NeatSettings.named("rosenzweig-remy").rules(3, 2, bias_input=-1)
    last = max(round(push.seconds / STEP_S) for push in pushes)
    rules = SimRules(last, STEP_S, True, 1.0, np.array([0.0, 0.0, 1.0, 1e-9]))
    room = make_sim_room(shape, neat, 0, np.float64)
    cells = np.zeros((len(pushes), 1), np.uint8)
    counters = np.zeros((len(pushes), 3), np.uint32)
    start_sim(shape, table, rules, np.uint64(1), counters, len(pushes), room, cells)
    commands = np.zeros((2, LANES))
    commands[0, : len(pushes)] = [push.speed / SPEED for push in pushes]
    commands[1, : len(pushes)] = [push.turn * TRACK / 2 / SPEED for push in pushes]
    ends = np.zeros((len(pushes), 3))
    pose = room.lanes.pose
    for step in range(last):
        step_sim(shape, rules, np.uint64(1), len(pushes), room, cells, step, commands)
        for k, push in enumerate(pushes):
            if step + 1 == round(push.seconds / STEP_S):
                ends[k] = pose.x[k], pose.y[k], math.tau * pose.heading[k]
    return ends


def _errors(
    pushes: list[Push], truth: np.ndarray, friction: float, lat: float, ang: float, saturation: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    parts = [
        _ends(pushes[k : k + LANES], friction, lat, ang, saturation) for k in range(0, len(pushes), LANES)
    ]
    off = np.concatenate(parts) - truth
    return np.hypot(off[:, 0], off[:, 1]), np.abs(np.remainder(off[:, 2] + math.pi, math.tau) - math.pi)


def test_a_pushed_body_ends_where_mujoco_has_it_end() -> None:
    """Fitted to 40 pushes, tried on 100 others. Seeds are fixed, and nothing else is random."""
    body = PushedBody(CORNERS, RADIUS, FRICTION)
    known = _pushes(40, seed=1)
    truth = np.array([body.end_of(push) for push in known])

    def cost(at: np.ndarray) -> float:
        places, turns = _errors(known, truth, abs(at[0]), math.exp(at[1]), math.exp(at[2]))
        return float(np.mean(np.minimum(places / 0.01, 5) + np.minimum(turns / math.radians(3), 5)))

    first = np.array([0.2, 0.0, 5.0])
    steps = np.vstack([first, first + np.diag([0.1, -1.0, 1.0])])
    fitted = minimize(cost, first, method="Nelder-Mead", options={"maxfev": 90, "initial_simplex": steps}).x
    assert abs(fitted[0]) == pytest.approx(FRICTION, abs=0.05)

    unseen = _pushes(100, seed=2)
    ends = np.array([body.end_of(push) for push in unseen])
    places, turns = _errors(unseen, ends, abs(fitted[0]), math.exp(fitted[1]), math.exp(fitted[2]))
    assert int(((places < 0.01) & (turns < math.radians(3))).sum()) >= 95


def test_wheels_whose_grip_gives_out_leave_a_body_where_mujoco_has_it() -> None:
    """Nothing is fitted: `sim` is told the wheels' arm and slip. Seeds are fixed, and nothing else is random."""
    wheels = Wheels()
    body = PushedBody(CORNERS, RADIUS, FRICTION, wheels)
    pushes = _pushes(100, seed=3, turn=12.0)
    ends = np.array([body.end_of(push) for push in pushes])

    def n_right(saturation: float) -> int:
        places, turns = _errors(pushes, ends, FRICTION, 1.0, 1 / wheels.arm**2, saturation)
        return int(((places < 0.01) & (turns < math.radians(3))).sum())

    found = {saturation: n_right(saturation) for saturation in (0.0, 1 / wheels.slip)}
    assert found[1 / wheels.slip] >= 95, found
    assert found[0.0] < 70, found
