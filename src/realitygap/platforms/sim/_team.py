"""Trials of several robots of the platform `sim` in one arena, many in one call."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.math.stack import stack
from realitygap.kernels.neat.genome import NeatRules
from realitygap.kernels.neat.network import Networks
from realitygap.kernels.sim.lanes import make_sim_room, make_sim_trace
from realitygap.kernels.sim.team import Team, run_team_trials
from realitygap.tasks import TraceArrays
from realitygap.trials import REAL, Draws, ResultsRoom, Tried, counters_of_robot
from realitygap.world import MOST_ROBOTS, Arena, Obstacle, check_drawn_starts

from ._scene import SimScene, sim_scene
from ._settings import ARENA, SimSettings
from ._trials import sensor_names, sim_rules


class SimTeam:
    """Several robots of the platform `sim` in one arena, ready to try networks of one kind; a `PlatformTrials`.

    A trial is that of a `SimWorld`: in each step the robots move one after the other, then all look. Cells are those
    that any of them visits. Steps are kept for each robot: column k * r + j of a trace is robot j of r in trial k.

    Args:
        platform: The robots as simulated.
        arena: Arena with the starts of all robots.
        rules: NEAT's, of which only the network's kind counts.
        inputs: Names of what networks see, in order.
        noise: The paper's a, on top of the robots' own noise.
        bias_value: Value of the constant input.

    Raises:
        ValueError: As `team_scenes`.
    """

    distance_unit = 1.0

    def __init__(
        self,
        platform: SimSettings,
        arena: Arena,
        rules: NeatRules,
        *,
        inputs: Sequence[str],
        noise: float,
        bias_value: float,
    ) -> None:
        self.scenes = team_scenes(platform, arena, inputs, noise)
        first = self.scenes[0]
        own = first.arena.obstacles[: len(arena.obstacles)]
        self.arena = replace(first.arena, obstacles=own, others=arena.others)
        self.n_steps = platform.steps
        self.step_s = platform.command_s
        self.sensors = sensor_names(first.shape)
        self._draws = Draws(first.numbers)
        self.drawn_names = self._draws.names
        self._rules = rules
        self._dtype = REAL[platform.precision]
        self._team = Team(
            stack([scene.shape for scene in self.scenes]),
            stack([sim_rules(scene, bias_value) for scene in self.scenes]),
            np.array([scene.origin for scene in self.scenes]),
            len(arena.obstacles),
            len(platform.model.body),
        )

    def carry_out(
        self,
        networks: Networks,
        which: NDArray[np.int32],
        key: int,
        counters: NDArray[np.uint32],
        *,
        ends: bool = False,
        trace: bool = False,
    ) -> Tried:
        """See `PlatformTrials.carry_out`. `which` may also be (n, r), the network of each robot."""
        n, n_robots = len(which), len(self.scenes)
        each = np.stack([counters_of_robot(counters, robot) for robot in range(n_robots)])
        drawn = [self._draws.draw(key, words) for words in each]
        shape = self.scenes[0].shape
        room = make_sim_room(shape, self._rules, networks.place.shape[1], self._dtype)
        steps = make_sim_trace(
            shape, self._rules.n_inputs, self.n_steps if trace else -1, n if trace else 1, self._dtype
        )
        kept = stack([steps] * n_robots)
        results = ResultsRoom.of(n, self.arena.grid.n_cells, ends=ends)
        run_team_trials(
            self._team,
            np.stack(list(self._tables(drawn))),
            self._rules,
            networks,
            np.ascontiguousarray(np.broadcast_to(which.reshape(n, -1), (n, n_robots)).T),
            np.uint64(key),
            each,
            stack([room] * n_robots),
            *results,
            kept,
        )
        batch = results.batch(drawn[0], self.drawn_names)
        first = self.scenes[0].origin
        for robot, scene in enumerate(self.scenes):
            kept.poses[robot, :, :2] += np.subtract(scene.origin, first).astype(self._dtype)[:, None]
        poses, readings, inputs, commands, stalled, wheels, distances = (_in_columns(part) for part in kept)
        arrays = TraceArrays(poses, readings, inputs, commands, stalled, wheels)
        return Tried(batch, results.end_cells, results.ended, arrays, distances)

    def _tables(self, drawn: Sequence[NDArray[np.float64]]) -> Iterator[NDArray[np.floating]]:
        """Yield (p, n) the numbers of each robot, or (p, 1) if none is drawn; draws of the arena are the first's."""
        shared = [k for k, name in enumerate(self.drawn_names) if name.startswith(ARENA)]
        for scene, values in zip(self.scenes, drawn, strict=True):
            table = scene.table(scene.fixed)
            if self.drawn_names:
                values[:, shared] = drawn[0][:, shared]
                table = np.repeat(table, len(values), axis=1)
                rows = [scene.rows[name] for name in self.drawn_names]
                table[rows] = scene.rows_of(dict(zip(self.drawn_names, values.T, strict=True)))
            yield table


def team_scenes(platform: SimSettings, arena: Arena, inputs: Sequence[str], noise: float) -> list[SimScene]:
    """Return the scene of each robot: the outlines of the others are its last obstacles.

    Raises:
        ValueError: As `sim_scene`; there are too many robots, they do not fit at their starts, or starts or outlines
            are drawn.
    """
    if arena.n_robots > MOST_ROBOTS:
        raise ValueError(f"There are {arena.n_robots} robots, expected at most {MOST_ROBOTS} in one arena.")
    starts = arena.starts
    outlines = [
        tuple(Obstacle(*start, part.corners, part.radius) for part in platform.model.body) for start in starts
    ]
    for (first, one), (second, other) in itertools.combinations(enumerate(outlines), 2):
        if any(part.overlaps(met) for part in one for met in other):
            raise ValueError(
                f"robots {first} and {second} overlap at their starts ({starts[first].x:.3f}, {starts[first].y:.3f}) "
                f"and ({starts[second].x:.3f}, {starts[second].y:.3f}). Lower arena.robots, or set arena.other_starts"
            )
    scenes = []
    for robot, start in enumerate(starts):
        others = tuple(part for k, outline in enumerate(outlines) if k != robot for part in outline)
        surroundings = replace(arena, start=start, others=(), obstacles=(*arena.obstacles, *others))
        scene = sim_scene(platform, surroundings, inputs, noise)
        drawn = [name for name in scene.drawn_names if name.startswith((f"{ARENA}start.", "body."))]
        if drawn:
            raise ValueError(
                f"{', '.join(drawn)}: drawn, expected plain numbers with several robots in the arena"
            )
        try:
            check_drawn_starts(scene.arena, scene.robot)
        except ValueError as error:
            raise ValueError(f"robot {robot}: {str(error).rstrip('.')}") from None
        scenes.append(scene)
    return scenes


def _in_columns(part: NDArray[Any]) -> NDArray[Any]:
    """Return (r, t, ..., n) as (t, ..., n * r), with the robots of a trial next to each other."""
    return np.ascontiguousarray(
        np.moveaxis(part, 0, -1).reshape(*part.shape[1:-1], len(part) * part.shape[-1])
    )
