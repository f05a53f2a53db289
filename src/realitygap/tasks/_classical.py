"""The tasks on which Stanley & Miikkulainen (2002) published NEAT's results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class ClassicalTask:
    """A task, what NEAT has to be for it, and what was published.

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
    settings: Mapping[str, Any]
    published: Mapping[str, Any]
    source: str
    published_settings: Mapping[str, Any] = field(default_factory=dict)


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
