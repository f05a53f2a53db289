"""A trial of a network on a twin, as an evolution scores it and as a figure shows it."""

from __future__ import annotations

from typing import Any, Protocol

from realitygap.evolution import Network, Sense
from realitygap.robots import Command, Robot
from realitygap.world import Arena, Pose

from ._operator import cell_at
from ._physical import limited


class SeenRobot(Robot, Protocol):
    """A simulated robot of which it is known where it is."""

    arena: Arena

    @property
    def pose(self) -> Pose:
        """Where it is."""
        ...

    @property
    def visited_cells(self) -> tuple[int, ...]:
        """Cells along its line, in order of first visit."""
        ...

    @property
    def encoders(self) -> tuple[float, float]:
        """Way of its wheels [m]."""
        ...


def trial_of(
    robot: SeenRobot, network: Network, sense: Sense, n_steps: int, *, trace: bool
) -> dict[str, Any]:
    """What came of a trial, as JSON knows it: `cells` in order of first visit, `ends`, `stalls` and the last `pose`.

    `sense` computes what the network sees.

    With `trace` each step, too: `poses`, `readings`, `stalled` and `wheels` of t + 1 rows, `inputs` and `commands`
    of t.
    """
    steps: dict[str, list[Any]] = {
        name: [] for name in ("poses", "readings", "stalled", "wheels", "inputs", "commands")
    }
    robot.reset()
    for step in range(n_steps):
        _look(robot, steps)
        inputs = sense(steps["readings"][-1], steps["stalled"][-1], step)
        move, turn = (limited(float(output)) for output in network.activate(inputs))
        steps["inputs"].append(inputs)
        steps["commands"].append((move, turn))
        robot.drive(Command(move, turn))
    robot.stop()
    _look(robot, steps)
    cells = {cell_at(robot.arena.grid, x, y) for x, y, _ in steps["poses"]} - {None}
    result = {
        "cells": list(robot.visited_cells),
        "ends": sorted(cell for cell in cells if cell is not None),
        "stalls": sum(steps["stalled"][1:]),
        "pose": steps["poses"][-1],
    }
    return result | steps if trace else result


def _look(robot: SeenRobot, steps: dict[str, list[Any]]) -> None:
    seen = robot.observe()
    steps["poses"].append(tuple(robot.pose))
    steps["readings"].append(seen.readings)
    steps["stalled"].append(seen.stalled)
    steps["wheels"].append(robot.encoders)
