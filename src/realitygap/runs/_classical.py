"""Runs of NEAT on a classical task."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from realitygap.evolution import NeatSettings, random_key
from realitygap.kernels.tasks import run
from realitygap.tasks import ClassicalTask

# Room for genes and hidden nodes beyond the first ones; doubled and run again where it was not enough.
FIRST_ROOM = 128
FIRST_HIDDEN_ROOM = 32

_NUMBERS = {
    "xor": run.XOR,
    "double-pole": run.DOUBLE_POLE,
    "double-pole-no-velocity": run.DOUBLE_POLE_NO_VELOCITY,
}


@dataclass(frozen=True)
class TaskRun:
    """The result of one run on a classical task.

    Attributes:
        solved: True if a network solved the task.
        evaluations: Networks tried, up to and with the one that did.
        generations: Begun.
        n_hidden: Number of hidden nodes of the solver; 0 if there is none.
        n_connections: Number of its enabled connections.
        generalization: Starts of 625 that it passed; 0 in other tasks than the one without velocities.
    """

    solved: bool
    evaluations: int
    generations: int
    n_hidden: int
    n_connections: int
    generalization: int


def run_task(task: ClassicalTask, settings: NeatSettings, seed: int, replicate: int) -> TaskRun:
    """Return one run on a classical task, in one call of a kernel.

    Args:
        task: Task to solve.
        settings: NEAT's settings, those of the task among them.
        seed: Seed of the random numbers.
        replicate: Number of the run with this seed.
    """
    bias_input = task.n_inputs
    neat = settings.rules(task.n_inputs + 1, 1, bias_input=bias_input)
    rules = run.TaskRules(
        _NUMBERS[task.name], settings.population, settings.generations, float(settings.bias_value)
    )
    room = neat.n_first_genes + FIRST_ROOM
    hidden_room = neat.start_hidden + FIRST_HIDDEN_ROOM
    outcome = np.zeros(run.N_OUTCOMES, np.int64)
    key = np.uint64(random_key(seed))
    while True:
        space = run.make_task_room(rules, neat, room, hidden_room)
        if run.run_task(rules, neat, key, replicate, space, outcome):
            break
        room, hidden_room = 2 * room, 2 * hidden_room
    return TaskRun(
        solved=bool(outcome[run.SOLVED]),
        evaluations=int(outcome[run.EVALUATIONS]),
        generations=int(outcome[run.N_GENERATIONS]),
        n_hidden=int(outcome[run.N_HIDDEN]),
        n_connections=int(outcome[run.N_ENABLED]),
        generalization=int(outcome[run.GENERALIZATION]),
    )
