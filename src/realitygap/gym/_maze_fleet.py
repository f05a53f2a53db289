"""The discs of the published mazes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import NeatSettings
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.tasks import maze
from realitygap.platforms import Array, Outline
from realitygap.tasks import MazeAgent
from realitygap.trials import NoiseKey, maze_rules, maze_scene
from realitygap.world import Arena

MAZE_ACTIONS = ("turn", "speed")
"""Names of the agent's two outputs."""
CORNERS = 24
"""Corners of the polygon that a picture shows for a disc."""


class MazeFleet:
    """A `Fleet` of the published agent, which sees its range finders and in which quarter the exit is.

    Commands are the agent's two outputs, turning and speeding up, each -1..1.

    Raises:
        ValueError: The arena has no goal.
    """

    step_s = 0.1

    def __init__(self, arena: Arena, n: int) -> None:
        agent = MazeAgent()
        self.arena, self.n_steps, self.agent = arena, agent.steps, agent
        turns = [math.tau * k / CORNERS for k in range(CORNERS)]
        disc = tuple((agent.radius * math.cos(turn), agent.radius * math.sin(turn)) for turn in turns)
        self.outline = Outline((disc,), tuple((0.0, 0.0, ray) for ray in agent.rays))
        self._n = n
        self._scene = maze_scene(arena, agent)
        self._rules = maze_rules(arena, agent, 0.0)
        # Outputs of this activation lie in -1..1, as commands do.
        neat = NeatSettings.named("default", activation="tanh")
        self._neat = neat.rules(len(self.input_names), 2)
        n_blocks = -(-n // LANES)
        self._blocks = [maze.make_maze_block(self._scene, self._neat, 0)[0] for _ in range(n_blocks)]
        self.cells = np.zeros((n, 0), np.uint8)
        self.counts = np.zeros((n, 2), np.int32)

    @property
    def input_names(self) -> tuple[str, ...]:
        """The agent's inputs, in order."""
        return tuple(name for name in self.agent.input_names if name != "bias")

    @property
    def stalled(self) -> NDArray[np.bool_]:
        """See `Fleet.stalled`. The agent does not sense it."""
        return np.zeros(self._n, np.bool_)

    @property
    def ranges(self) -> Array:
        """See `Fleet.ranges`."""
        return 1.0 - self._seen[:, : len(self.agent.rays)]

    def number(self, name: str, value: float) -> Array:
        """See `Fleet.number`. No number is drawn here."""
        return np.full(self._n, float(value))

    def bounds(self) -> NDArray[Any]:
        """See `Fleet.bounds`."""
        return np.repeat([[0.0], [1.0]], len(self.input_names), axis=1)

    def start(self, key: NoiseKey) -> None:
        """See `Fleet.start`. Nothing is random here."""
        self._step = 0
        for lanes in self._blocks:
            maze._start(self._scene, lanes)
        self._look()

    def step(self, commands: Array) -> None:
        """See `Fleet.step`. A robot at the exit stays there."""
        commands = np.clip(commands, -1.0, 1.0)
        for block, lanes in enumerate(self._blocks):
            part = commands[block * LANES : (block + 1) * LANES]
            lanes.values[self._neat.n_inputs : self._neat.n_inputs + 2, : len(part)] = part.T
            maze.drive_maze(self._scene, self._rules, self._neat, lanes, self._step)
        self._step += 1
        self._look()

    def _look(self) -> None:
        for lanes in self._blocks:
            maze.observe_maze(self._scene, self._rules, self._neat, lanes)
        self._seen = self._gathered([lanes.values[: self._neat.n_inputs] for lanes in self._blocks])

    def observe(self) -> Array:
        """See `Fleet.observe`."""
        return self._seen

    def facts(self) -> dict[str, Array]:
        """See `Fleet.facts`. The result also has `arrived`, (n,): 1 if the robot has reached the exit."""
        poses = [np.stack([lanes.x, lanes.y, lanes.heading]) for lanes in self._blocks]
        start = self.arena.start
        pose = self._gathered(poses) * [1.0, 1.0, math.tau] + [start.x, start.y, 0.0]
        pose[:, 2] %= math.tau
        arrived = self._gathered([lanes.arrived[None] for lanes in self._blocks])[:, 0]
        readings = self._seen[:, : len(self.agent.rays)] * self.agent.reach
        return {"pose": pose, "readings": readings, "arrived": (arrived >= 0).astype(np.float64)}

    def close(self) -> None:
        """See `Fleet.close`. There is nothing to close here."""

    def _gathered(self, blocks: list[NDArray[Any]]) -> Array:
        """Return numbers of each block, (m, LANES), as (n, m)."""
        return np.concatenate(blocks, axis=1)[:, : self._n].T.astype(np.float64)
