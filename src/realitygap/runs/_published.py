"""Runs of NEAT on tasks of the literature: the classical ones, and mazes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import Genome, NeatSettings, Population, decode_all, random_key
from realitygap.kernels.neat.novelty import admit, point_novelty
from realitygap.kernels.tasks import maze, run
from realitygap.tasks import ClassicalTask, MazeAgent, MazeTask
from realitygap.trials import maze_exit, maze_rules, maze_scene
from realitygap.world import Arena

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


MazeReward = Literal["novelty", "objective"]
MAZE_REWARDS: tuple[MazeReward, ...] = ("novelty", "objective")

TURN = math.tau


class Tried(NamedTuple):
    """The results of n networks in a maze.

    Attributes:
        ends: (m, 2) final positions of the first m <= n trials [m].
        solver: Index of the first network that reached the exit; -1 if none did.
    """

    ends: NDArray[np.float64]
    solver: int


class MazePath(NamedTuple):
    """The path of one network in a maze, step by step.

    Attributes:
        poses: (t + 1, 3) x, y [m] and heading [rad]; row 0 is the start.
        inputs: (t, i) inputs of the network, in the order of `MazeAgent.input_names`.
    """

    poses: NDArray[np.float64]
    inputs: NDArray[np.float64]


class MazeTrials:
    """Trials of networks in one maze, many at a time."""

    def __init__(
        self,
        arena: Arena,
        agent: MazeAgent | None = None,
        *,
        precision: Literal["single", "double"] = "single",
    ) -> None:
        """Put an agent into a maze.

        Args:
            arena: Arena with walls, a start, and a goal, whose radius is that of the exit.
            agent: The published one when not given.
            precision: Precision of the arithmetic.

        Raises:
            ValueError: The arena has no goal.
        """
        goal = maze_exit(arena)
        self.agent = agent or MazeAgent()
        self._arena = arena
        self._origin = np.array([arena.start.x, arena.start.y])
        self._exit = np.array([goal.x, goal.y]) - self._origin
        self._scene = maze_scene(arena, self.agent, precision)

    def distances_to_exit(self, ends: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distances of places (n, 2) from the exit [m]."""
        x, y = (ends - self._origin - self._exit).T
        return np.asarray(np.sqrt(x * x + y * y), np.float64)

    def try_all(self, genomes: Sequence[Genome]) -> Tried:
        """Try networks in their order, up to the block of the first that reaches the exit."""
        ends, arrived, _ = self._run(genomes, 0)
        solvers = np.flatnonzero(arrived >= 0)
        return Tried(ends, int(solvers[0]) if solvers.size else -1)

    def path(self, genome: Genome) -> MazePath:
        """Return the path of one network."""
        _, arrived, trace = self._run([genome], 1)
        n = arrived[0] + 1 if arrived[0] >= 0 else self.agent.steps
        poses = trace.poses[: n + 1, :, 0].astype(np.float64)
        poses[:, :2] += self._origin
        poses[:, 2] *= TURN
        return MazePath(poses, trace.inputs[:n, :, 0].astype(np.float64))

    def _run(
        self, genomes: Sequence[Genome], n_kept: int
    ) -> tuple[NDArray[np.float64], NDArray[np.int32], Any]:
        neat = genomes[0].rules
        networks = decode_all(genomes)
        lanes, wiring = maze.make_maze_block(self._scene, neat, networks.place.shape[1])
        trace = maze.make_maze_trace(
            self._scene.heading, neat.n_inputs, self.agent.steps if n_kept else -1, max(n_kept, 1)
        )
        n = len(genomes)
        ends = np.zeros((n, 2))
        arrived = np.full(n, -1, np.int32)
        n_tried = maze.run_maze_trials(
            self._scene,
            maze_rules(self._arena, self.agent, genomes[0].bias_value),
            neat,
            networks,
            np.arange(n, dtype=np.int32),
            lanes,
            wiring,
            ends,
            arrived,
            trace,
        )
        return ends[:n_tried] + self._origin, arrived[:n_tried], trace


class _EndsArchive:
    """Lehman & Stanley's novelty of final positions."""

    def __init__(self, task: MazeTask) -> None:
        self._neighbors = np.zeros(task.neighbors)
        self._patience = task.patience
        self._threshold = np.array([task.threshold])
        self._counters = np.zeros(2, np.int64)
        self._places = np.empty((2, 1024))
        self._n = 0

    def __len__(self) -> int:
        return self._n

    def update(self, ends: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the novelty (n,) of a generation, of which the novel ones then enter."""
        points = np.ascontiguousarray(ends.T)
        n = points.shape[1]
        novelty, entered = np.empty(n), np.empty(n, np.bool_)
        point_novelty(points, self._places, self._n, np.empty(n + self._n), self._neighbors, novelty)
        admit(novelty, self._counters, self._threshold, self._patience, entered)
        new = points[:, entered]
        while self._n + new.shape[1] > self._places.shape[1]:
            self._places = np.concatenate([self._places, np.empty_like(self._places)], axis=1)
        self._places[:, self._n : self._n + new.shape[1]] = new
        self._n += new.shape[1]
        return novelty


@dataclass(frozen=True)
class MazeRun:
    """The result of one run in a maze.

    Attributes:
        solved: True if a network reached the exit.
        evaluations: Networks tried, up to and with the one that did.
        archived: Behaviors in the archive at the end.
        ends: (evaluations, 2) final positions of the trials [m], if requested.
        solver: The network that reached the exit.
    """

    solved: bool
    evaluations: int
    archived: int
    ends: NDArray[np.float64] = field(repr=False, compare=False)
    solver: Genome | None = field(repr=False, compare=False)


def run_maze(
    task: MazeTask,
    trials: MazeTrials,
    reward: MazeReward,
    settings: NeatSettings,
    seed: int,
    replicate: int,
    *,
    keep_ends: bool = False,
    go_on: Callable[[], bool] = lambda: True,
) -> MazeRun:
    """Return one run in a maze, up to the first network that reaches the exit.

    Fitness is the novelty of where a trial ends, or how much less than the task's `far` its distance from the exit
    is.

    Args:
        task: Task with the settings of novelty search.
        trials: Trials in the maze.
        reward: Reward: novelty or objective.
        settings: NEAT's settings, those of the task among them.
        seed: Seed of the random numbers.
        replicate: Number of the run with this seed.
        keep_ends: True to store the final positions of all trials.
        go_on: Function that is asked before each generation. If it returns False, the run ends unsolved.
    """
    population = Population(len(trials.agent.input_names) - 1, 2, settings, seed=seed, replicate=replicate)
    archive = _EndsArchive(task)
    kept: list[NDArray[np.float64]] = []
    n_tried = 0
    for _ in range(settings.generations):
        if not go_on():
            break
        genomes = population.ask()
        tried = trials.try_all(genomes)
        n = tried.solver + 1 if tried.solver >= 0 else len(genomes)
        n_tried += n
        if keep_ends:
            kept.append(tried.ends[:n])
        if tried.solver >= 0:
            return _outcome(True, n_tried, archive, kept, genomes[tried.solver])
        if reward == "novelty":
            population.tell(archive.update(tried.ends))
        else:
            population.tell(task.far - trials.distances_to_exit(tried.ends))
    return _outcome(False, n_tried, archive, kept, None)


def _outcome(
    solved: bool, n_tried: int, archive: _EndsArchive, kept: list[NDArray[np.float64]], solver: Genome | None
) -> MazeRun:
    return MazeRun(solved, n_tried, len(archive), np.concatenate([np.empty((0, 2)), *kept]), solver)
