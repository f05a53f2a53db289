"""Tasks of the literature with their published results: those of NEAT, and the mazes of novelty search."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class ClassicalTask:
    """A task with the settings of NEAT for it, and its published results.

    Attributes:
        name: Name in commands.
        title: Title for people.
        n_inputs: Inputs that the task gives, the constant one not counted.
        settings: NEAT's settings that belong to the task and not to a named set: population, generations,
            the constant input's value, recurrence.
        published_settings: Settings that the source changes only for this task. They are part of 'stanley-2002' here.
        published: Published results, under our names, with the number of runs `n`.
        source: Source of the published results.
    """

    name: str
    title: str
    n_inputs: int
    settings: Mapping[str, float]
    published: Mapping[str, float]
    source: str
    published_settings: Mapping[str, float] = field(default_factory=dict)


_TASKS = (
    ClassicalTask(
        "xor",
        "XOR",
        2,
        {"population": 150, "generations": 100, "bias_value": 1.0, "recurrent": False},
        {
            "n": 100,
            "solved": 100,
            "mean_evaluations": 4755,
            "sd_evaluations": 2553,
            "worst_evaluations": 13459,
            "mean_hidden": 2.35,
            "mean_connections": 7.48,
        },
        "Stanley & Miikkulainen (2002), section 4.2",
    ),
    ClassicalTask(
        "double-pole",
        "Double pole with velocities",
        6,
        {"population": 150, "generations": 1000, "bias_value": 0.5, "recurrent": False},
        {"n": 120, "solved": 120, "mean_evaluations": 3600, "sd_evaluations": 2700},
        "Stanley & Miikkulainen (2002), section 4.3, table 1",
    ),
    ClassicalTask(
        "double-pole-no-velocity",
        "Double pole without velocities",
        3,
        {"population": 1000, "generations": 100, "bias_value": 0.5, "recurrent": True},
        {
            "n": 20,
            "solved": 20,
            "mean_evaluations": 33184,
            "sd_evaluations": 21790,
            "mean_generalization": 286,
        },
        "Stanley & Miikkulainen (2002), section 4.3, table 2",
        {
            "add_link": 0.3,
            "weight_coefficient": 3.0,
            "threshold": 4.0,
            # Of the file with which Stanley's release runs this task.
            "add_node": 0.01,
            "weight_step": 1.8,
            "replaced_weight": 1.8,
            "weight_limit": 8.0,
            "survival": 0.4,
        },
    ),
)

CLASSICAL_TASKS: Mapping[str, ClassicalTask] = {task.name: task for task in _TASKS}


UNIT = 0.01
"""A unit of the published mazes [m]: the agent's radius of 8 of them is about that of the paper's robot."""


@dataclass(frozen=True)
class MazeAgent:
    """The disc that drives in the mazes; lengths [m], angles [rad], both speeds per step.

    In a step, its two outputs, each minus one half, change the turn rate and the speed, in units of `twist` and `push`.
    It moves along the previous heading and then turns. A move that would end nearer to a wall than its radius is
    refused as a whole, but the turn takes place.

    Attributes:
        steps: Number of steps.
        radius: Radius of the disc.
        rays: Directions of its range finders relative to its heading, from its center [rad].
        reach: Reach of the range finders. Their reading is the distance divided by the reach.
        push: Change of the speed in a step per unit that its second output is above one half.
        top_speed: Maximum speed, forward or backward.
        twist: Change of the turn rate in a step per unit that its first output is above one half.
        top_spin: Maximum turn rate, left or right.

    Source: Lehman & Stanley (2011), section 4; numbers as in public re-implementations.
    """

    steps: int = 400
    radius: float = 8 * UNIT
    rays: tuple[float, ...] = tuple(math.radians(turn) for turn in (-90, -45, 0, 45, 90, 180))
    reach: float = 100 * UNIT
    push: float = UNIT
    top_speed: float = 3 * UNIT
    twist: float = math.radians(1)
    top_spin: float = math.radians(3)

    @property
    def input_names(self) -> tuple[str, ...]:
        """Return the names of the network's inputs, in order."""
        ranges = tuple(f"range.{k}" for k in range(len(self.rays)))
        return (*ranges, "goal.ahead", "goal.left", "goal.behind", "goal.right", "bias")


@dataclass(frozen=True)
class MazeTask:
    """A maze with the settings of NEAT for it, and its published results.

    Attributes:
        name: Name in commands, and of the arena.
        settings: NEAT's settings that belong to the task: population and generations.
        neighbors: Nearest behaviors that novelty is averaged over.
        threshold: Novelty from which on a behavior enters the archive at first [m].
        patience: Evaluations without an entry after which the threshold falls.
        far: Distance from the exit that has fitness 0, farther than any place of the maze [m].
        published: Published results, by reward.
        source: Source of the published results.
    """

    name: str
    settings: Mapping[str, float]
    published: Mapping[str, Mapping[str, float]]
    neighbors: int = 15
    threshold: float = 6 * UNIT
    patience: int = 2500
    far: float = 300 * UNIT
    source: str = "Lehman & Stanley (2011)"


_MAZE_SETTINGS = {"population": 250, "generations": 1000}

_MAZES = (
    MazeTask(
        "maze-medium",
        _MAZE_SETTINGS,
        {
            "novelty": {"seeds": 40, "mean_evaluations": 18_274, "sd_evaluations": 20_447},
            "objective": {"seeds": 40, "mean_evaluations": 56_334, "sd_evaluations": 48_705},
        },
    ),
    MazeTask(
        "maze-hard",
        _MAZE_SETTINGS,
        {
            "novelty": {
                "seeds": 40,
                "solved": 39,
                "mean_evaluations": 35_109,
                "sd_evaluations": 30_236,
            },
            "objective": {"seeds": 40, "solved": 3},
        },
    ),
)

MAZE_TASKS: Mapping[str, MazeTask] = {task.name: task for task in _MAZES}
