"""Trials of `sim` that are set up by hand, driven command by command."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import NeatSettings
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim.lanes import SimRules, make_sim_room
from realitygap.kernels.sim.shape import make_sim_shape, sim_table
from realitygap.kernels.sim.trial import start_sim, step_sim

Number = float | NDArray[np.float64]

# A Scribbler's outline, about, and its wheels.
OUTLINE = [(0.079, 0.045), (0.063, 0.061), (-0.047, 0.069), (-0.079, 0.053),
           (-0.079, -0.053), (-0.047, -0.069), (0.063, -0.061), (0.079, -0.045)]  # fmt: skip
SCRIBBLER: dict[str, Number] = {
    "body.0.radius": 0.01,
    "contact.friction": 0.3,
    "contact.ang": 171.0,
    "drive.speed": 0.15,
    "drive.track": 0.153,
}
WIDTH, DEPTH = 1.0, 0.6


class Driven(NamedTuple):
    """What came of n robots over t commands."""

    poses: NDArray[np.float64]  # (t + 1, n, 3) x, y [m], heading [rad]
    stalled: NDArray[np.bool_]  # (t + 1, n)
    wheels: NDArray[np.float64]  # (t + 1, n, 2)
    distances: NDArray[np.float64]  # (t + 1, n, rays)
    cosines: NDArray[np.float64]  # (t + 1, n, rays) between rays and the normals of what they meet


def outline(corners: Sequence[tuple[float, float]], prefix: str = "body.0") -> dict[str, Number]:
    numbers: dict[str, Number] = {}
    for k, (x, y) in enumerate(corners):
        numbers |= {f"{prefix}.corner.{k}.x": x, f"{prefix}.corner.{k}.y": y}
    return numbers


def walls(corners: Sequence[tuple[float, float]]) -> dict[str, Number]:
    """Walls around a room."""
    numbers: dict[str, Number] = {}
    for k, (x, y) in enumerate(corners):
        to_x, to_y = corners[(k + 1) % len(corners)]
        numbers |= {
            f"arena.wall.{k}.x1": x,
            f"arena.wall.{k}.y1": y,
            f"arena.wall.{k}.x2": to_x,
            f"arena.wall.{k}.y2": to_y,
        }
    return numbers


def room(width: float = WIDTH, depth: float = DEPTH) -> dict[str, Number]:
    return walls([(0, 0), (width, 0), (width, depth), (0, depth)])


def obstacle(
    k: int, x: Number, y: Number, heading: Number, corners: Sequence[tuple[float, float]], radius: float = 0.0
) -> dict[str, Number]:
    place = {f"arena.obstacle.{k}.x": x, f"arena.obstacle.{k}.y": y, f"arena.obstacle.{k}.heading": heading}
    return {**place, f"arena.obstacle.{k}.radius": radius, **outline(corners, f"arena.obstacle.{k}")}


def drive_robots(
    numbers: Mapping[str, Number],
    commands: NDArray[np.float64],
    *,
    step_s: float = 0.5,
    dtype: type[np.floating] = np.float64,
    key: int = 1,
    first: int = 0,
    n: int | None = None,
    **structure: Any,
) -> Driven:
    """Drive n robots, at most LANES, by commands (t, 2) for all or (t, 2, n)."""
    structure = {"parts": [8], "n_walls": 4, "enclosed": True, "noisy": False, "late": False, **structure}
    shape = make_sim_shape(**structure)
    n = max(np.size(value) for value in numbers.values()) if n is None else n
    table = sim_table(shape, numbers, dtype)
    neat = NeatSettings.named("rosenzweig-remy").rules(3, 2, bias_input=-1)
    rules = SimRules(len(commands), step_s, True, 1.0, np.array([0.0, 0.0, 1.0, 1e-9], dtype))
    space = make_sim_room(shape, neat, 0, dtype)
    counters = np.zeros((n, 3), np.uint32)
    counters[:, 0] = (np.arange(n) + first) << 8 | 1
    cells = np.zeros((n, 1), np.uint8)
    lanes = space.lanes
    seen: list[list[NDArray[Any]]] = [[], [], [], [], []]

    def keep() -> None:
        pose = lanes.pose
        seen[0].append(np.stack([pose.x, pose.y, pose.heading * (2 * np.pi)], 1)[:n].astype(np.float64))
        seen[1].append(lanes.stalled[:n] > 0)
        seen[2].append(lanes.wheels.T[:n].astype(np.float64))
        seen[3].append(lanes.distances.T[:n].astype(np.float64))
        seen[4].append(lanes.rates.T[:n].astype(np.float64))

    start_sim(shape, table, rules, np.uint64(key), counters, n, space, cells)
    keep()
    for step, command in enumerate(commands):
        given = np.zeros((2, LANES), dtype)
        given[:, :n] = command if np.ndim(command) == 2 else np.asarray(command)[:, None]
        step_sim(shape, rules, np.uint64(key), n, space, cells, step, given)
        keep()
    return Driven(*(np.array(part) for part in seen))
