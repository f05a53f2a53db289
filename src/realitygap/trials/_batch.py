"""The input and output of trials, on any platform."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import picture_of
from realitygap.errors import whole_number
from realitygap.evolution import Genome, paper_interface
from realitygap.kernels.math.philox import MAX_GENERATIONS, MAX_INDIVIDUALS, MAX_REPEATS, PURPOSE_NOISE
from realitygap.kernels.neat.genome import NeatRules
from realitygap.kernels.neat.network import Networks
from realitygap.tasks import TraceArrays
from realitygap.world import MOST_ROBOTS, Arena, Pose

REAL: dict[str, Any] = {"single": np.float32, "double": np.float64}


def paper_inputs(rules: NeatRules) -> tuple[str, ...]:
    """Return the inputs of the paper's networks, with the constant input if they have one."""
    return paper_interface(constant=rules.bias_input >= 0).inputs


def poses_of(poses: NDArray[np.floating], start: Pose) -> NDArray[np.float64]:
    """Return x [m], y [m], heading [rad, 0 to 2 pi] of poses (n, >= 3) in the form of kernels, (n, 3)."""
    seen = poses[:, :3].astype(np.float64) * [1.0, 1.0, math.tau] + [start.x, start.y, 0.0]
    seen[:, 2] %= math.tau
    return seen


@dataclass(frozen=True)
class TrialBatch:
    """The results of n trials in an arena of c reachable cells.

    Attributes:
        cells: (n, c) uint8; the first `n_line` of a row are the cells along the line in order of first
            visit, columns * row + column.
        n_line: (n,) cells that the line crosses; the start counts.
        n_ends: (n,) cells in which steps end; the start counts.
        n_stalls: (n,) blocked steps.
        drawn: (n, d) numbers that were drawn for each trial, in the order of `drawn_names`; none on `jyro`.
        drawn_names: (d,) dotted names of the numbers that are drawn.
    """

    cells: NDArray[np.uint8]
    n_line: NDArray[np.int32]
    n_ends: NDArray[np.int32]
    n_stalls: NDArray[np.int32]
    drawn: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0)))
    drawn_names: tuple[str, ...] = ()

    @property
    def coverage_line(self) -> NDArray[np.float64]:
        """Visited share of the reachable cells along the line, 0..1, (n,)."""
        return np.divide(self.n_line, self.cells.shape[1])

    @property
    def coverage_ends(self) -> NDArray[np.float64]:
        """Visited share of the reachable cells at the ends of steps, 0..1, (n,)."""
        return np.divide(self.n_ends, self.cells.shape[1])

    def repeated(self, times: int) -> TrialBatch:
        """Return the batch with each trial several times."""
        rows = np.repeat(np.arange(len(self.n_line)), times)
        return TrialBatch(
            self.cells[rows],
            self.n_line[rows],
            self.n_ends[rows],
            self.n_stalls[rows],
            self.drawn[rows] if self.drawn_names else self.drawn,
            self.drawn_names,
        )

    def behavior(self, k: int) -> NDArray[np.uint8]:
        """Return the cells that trial k visited along its line, in order of first visit."""
        return self.cells[k, : self.n_line[k]]


class ResultsRoom(NamedTuple):
    """Arrays for the results of n trials that a kernel writes, in the order of its arguments.

    Attributes:
        cells: (n, c) uint8, as in `TrialBatch`.
        end_cells: (n, c) uint8, the cells at the ends of steps; no rows if nobody asks for them.
        ended: (n, 2) position at the end, from the start [m].
        counts: (n, 3) cells along the line, cells at the ends of steps, and blocked steps.
    """

    cells: NDArray[np.uint8]
    end_cells: NDArray[np.uint8]
    ended: NDArray[np.float64]
    counts: NDArray[np.int32]

    @classmethod
    def of(cls, n: int, n_cells: int, *, ends: bool) -> ResultsRoom:
        """Return room for n trials."""
        cells, end_cells = (np.zeros((rows, n_cells), np.uint8) for rows in (n, n if ends else 0))
        return cls(cells, end_cells, np.zeros((n, 2)), np.zeros((n, 3), np.int32))

    def batch(
        self, drawn: NDArray[np.float64] | None = None, drawn_names: tuple[str, ...] = ()
    ) -> TrialBatch:
        """Return the results, with what was drawn for the trials."""
        n_line, n_ends, n_stalls = self.counts.T
        drawn = np.empty((0, 0)) if drawn is None else drawn
        return TrialBatch(self.cells, n_line, n_ends, n_stalls, drawn, drawn_names)


@dataclass(frozen=True)
class Trajectory:
    """A trial step by step; row 0 is the start.

    Attributes:
        step_s: Duration of a step [s].
        poses: (t + 1, 3) x [m], y [m], heading [rad, counter-clockwise from +x].
        readings: (t + 1, s) distance each sensor measures [m], without noise.
        inputs: (t, i) inputs of the network: largest noisy reading, stall, time and, if it has one, the constant.
        commands: (t, 2) commands of the network: move and turn.
        stalled: (t + 1,) True if the step was blocked.
        coverage_line, coverage_ends: Visited share of the reachable cells, 0..1.
        cells: Cells along the line in order of first visit, columns * row + column.
        sensors: (s,) names of the range sensors.
        wheels: (t + 1, 2) distance of the left and the right wheel since the start [m]; no rows on `jyro`.
        answers: (t + 1, a) readings of the sensors with their noise, 0..1; without noise on `jyro`.
        answer_names: (a,) names of these, such as `light.0`.
        drawn: (d,) numbers that were drawn for the trial, in the order of `drawn_names`.
        drawn_names: (d,) dotted names.
        others: The other robots of the trial, if several were in the arena. Coverage and cells are those of all.
    """

    step_s: float
    poses: NDArray[np.float64]
    readings: NDArray[np.float64]
    inputs: NDArray[np.float64]
    commands: NDArray[np.float64]
    stalled: NDArray[np.bool_]
    coverage_line: float
    coverage_ends: float
    cells: tuple[int, ...]
    sensors: tuple[str, ...] = ()
    wheels: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    answers: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0)))
    answer_names: tuple[str, ...] = ()
    drawn: tuple[float, ...] = ()
    drawn_names: tuple[str, ...] = ()
    others: tuple[Trajectory, ...] = ()

    @property
    def robots(self) -> tuple[Trajectory, ...]:
        """All robots of the trial: this one first."""
        return (self, *self.others)

    @property
    def n_stalls(self) -> int:
        """Number of blocked steps of all robots."""
        return sum(int(robot.stalled.sum()) for robot in self.robots)

    def __repr__(self) -> str:
        steps = f"{len(self.commands)} steps of {self.step_s:g} s, {self.n_stalls} blocked"
        return f"{type(self).__name__}({steps}, coverage {self.coverage_line:.3f})"

    def _repr_svg_(self) -> str:
        return picture_of(self).to_svg(360.0)


MOST_TEAMS = MAX_INDIVIDUALS // MOST_ROBOTS
"""Individuals of a generation at most, with several robots in an arena."""


@dataclass(frozen=True)
class NoiseKey:
    """The key of a trial's random numbers: those of one individual of one run.

    Raises:
        TypeError: One of them is not a whole number.
        ValueError: One is out of its range, beyond which numbers would repeat.
    """

    key: int
    replicate: int = 0
    generation: int = 0
    individual: int = 0
    repeat: int = 0

    def __post_init__(self) -> None:
        limits = {
            "key": 1 << 64,
            "replicate": 1 << 32,
            "generation": MAX_GENERATIONS,
            "individual": MAX_INDIVIDUALS,
            "repeat": MAX_REPEATS,
        }
        for name, limit in limits.items():
            object.__setattr__(self, name, whole_number(name, getattr(self, name), 0, limit - 1))


def counters_of_individuals(key: NoiseKey, individuals: Sequence[int]) -> NDArray[np.uint32]:
    """Return the fixed words of random numbers for any individuals of the key's run and generation, (n, 3)."""
    counters = counters_of(key, len(individuals))
    counters[:, 0] = np.array(individuals, np.uint32) << 8 | PURPOSE_NOISE
    return counters


def counters_of(key: NoiseKey, n: int = 1) -> NDArray[np.uint32]:
    """Return the fixed words of the random numbers of n individuals, starting at that of the key, (n, 3)."""
    counters = np.empty((n, 3), np.uint32)
    counters[:, 0] = np.arange(key.individual, key.individual + n) << 8 | int(PURPOSE_NOISE)
    counters[:, 1] = key.generation << 12 | key.repeat
    counters[:, 2] = key.replicate
    return counters


def counters_of_robot(counters: NDArray[np.uint32], robot: int) -> NDArray[np.uint32]:
    """Return the fixed words of the random numbers of one of several robots in each trial, (n, 3).

    Robot 0 draws what it would draw alone, and robot k what individual k * 1,048,576 further on would.

    Args:
        counters: (n, 3) those of the trials.
        robot: Number of the robot, from 0 on.

    Raises:
        ValueError: The trial of an individual from 1,048,576 on: its numbers would repeat.
    """
    if (counters[:, 0] >> 8).max(initial=0) >= MOST_TEAMS:
        raise ValueError(
            f"There are more than {MOST_TEAMS:,} individuals, the most with several robots in an arena."
        )
    words = counters.copy()
    words[:, 0] += np.uint32(robot * MOST_TEAMS << 8)
    return words


class Tried(NamedTuple):
    """The output of a platform for n trials.

    Attributes:
        batch: Batch of all trials.
        ends: (n, c) uint8, cells in which steps end, in ascending order; no rows if not requested.
        ended: (n, 2) x and y at the end, from the arena's start [m].
        trace: Every step. Its arrays have no rows if not requested.
        distances: (t + 1, s, n) distance from each range sensor to what it sees, without noise, in the unit of
            `PlatformTrials.distance_unit`; no rows if not requested.
    """

    batch: TrialBatch
    ends: NDArray[np.uint8]
    ended: NDArray[np.float64]
    trace: TraceArrays
    distances: NDArray[np.floating]


class PlatformTrials(Protocol):
    """A platform set up in an arena, ready to try networks of one kind.

    Use one of these per thread. The next call may overwrite the arrays that it returned.

    Attributes:
        arena: Arena with the numbers that the platform's settings give. A drawn number has its center.
        step_s: Duration of a step [s].
        n_steps: Number of steps of each trial.
        sensors: Names of the readings in a trace.
        distance_unit: Unit of the distances in `Tried` [m].
        drawn_names: Names of the numbers that are drawn for trials, runs, or the study.
    """

    arena: Arena
    step_s: float
    n_steps: int
    sensors: tuple[str, ...]
    distance_unit: float
    drawn_names: tuple[str, ...]

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
        """Try networks: trial k is of network `which[k]`, with the random numbers of `counters[k]`.

        Args:
            networks: Networks, at least one.
            which: (n,) int32.
            key: Key of the random numbers.
            counters: (n, 3) uint32, as `counters_of` makes them.
            ends: True to list the cells at the ends of steps.
            trace: True to store every step.
        """
        ...


def check_genomes(genomes: Sequence[Genome], inputs: Sequence[str] | None) -> None:
    """Refuse genomes that cannot be tried together, or not with these inputs (the paper's when not given).

    Raises:
        ValueError: No genome, one with other inputs or outputs, or genomes of several kinds.
    """
    if not genomes:
        raise ValueError("No genome to try, expected at least one.")
    first = kind_of(genomes[0])
    names = ["largest reading", "stall", "time"]
    if inputs is not None:
        names = [name for name in inputs if name != "bias"]
    expected = len(names)
    # Genomes of one population share their rules: few kinds need a look.
    kinds = {(id(genome.rules), genome.bias_value): k for k, genome in reversed(list(enumerate(genomes)))}
    for k in sorted(kinds.values()):
        rules = genomes[k].rules
        given = rules.n_inputs - (rules.bias_input >= 0)
        if given != expected or rules.n_outputs != 2:
            raise ValueError(
                f"A genome has {given} inputs and {rules.n_outputs} outputs, expected {expected} inputs "
                f"({', '.join(names)}; a constant one is extra) and 2 outputs (move, turn)."
            )
    for k in sorted(kinds.values()):
        for name, value in kind_of(genomes[k]).items():
            if value != first[name]:
                raise ValueError(
                    f"Genome {k} has {name} {value}, genome 0 has {first[name]}: expected genomes of one kind. Try "
                    "those of each kind in a call of their own."
                )


def kind_of(genome: Genome) -> dict[str, float]:
    """Return the common properties of all genomes of a call, which the kernels read once."""
    names = (
        "n_inputs",
        "bias_input",
        "activation",
        "activation_slope",
        "recurrent",
        "node_bias",
        "drives_wheels",
    )
    return {name: getattr(genome.rules, name) for name in names} | {"bias_value": genome.bias_value}
