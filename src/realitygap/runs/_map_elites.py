"""MAP-Elites as the selection of runs: its settings, its descriptors, and the archives of a block of runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from realitygap.evolution import MOST_CELLS, MOST_CENTROIDS, cells_of, check_width, cvt_points
from realitygap.kernels.neat import block as block_kernels
from realitygap.kernels.neat.block import RunRules, Runs
from realitygap.kernels.neat.elites import Cells, Elites, make_elites
from realitygap.kernels.neat.genome import Genomes, NeatRules, make_genomes
from realitygap.platforms import trajectories_of
from realitygap.settings import Settings, as_tuple
from realitygap.tasks import PythonDescriptor
from realitygap.trials import PlatformTrials, Tried
from realitygap.world import Arena

Floats = NDArray[np.float64]
Inputs = tuple[str, ...]

REGIONS = (3, 2)
"""Columns and rows of regions of an arena whose shares of the visited cells are descriptors."""

STAGES = 3
"""Places along a path: the last is its end."""

OWN = "own"
"""Name of the descriptor of a Python file."""

DescriptorName = Literal[
    "mean_turn", "turn_spread", "mean_move", "stall_share", "end", "path", "region_share", "own"
]


class Descriptor(NamedTuple):
    """A way to describe a trial by numbers.

    Attributes:
        names: Names of its numbers.
        ranges: Returns lowest and highest value of each in an arena.
        of: Returns the numbers, (t, d), of t trials that were tried by some trials, whose networks have these inputs.
        needs_trace: True if it needs every step.
        is_shares: True if its numbers add up to 1.
    """

    names: tuple[str, ...]
    ranges: Callable[[Arena], tuple[tuple[float, float], ...]]
    of: Callable[[Tried, PlatformTrials, Inputs], Floats]
    needs_trace: bool = False
    is_shares: bool = False


def _ended(tried: Tried, trials: PlatformTrials, inputs: Inputs) -> Floats:
    return np.add(tried.ended, trials.arena.start[:2])


def _path(tried: Tried, trials: PlatformTrials, inputs: Inputs) -> Floats:
    steps = [stage * trials.n_steps // STAGES for stage in range(1, STAGES + 1)]
    places = np.moveaxis(tried.trace.poses[steps, :2].astype(np.float64), 2, 0) + trials.arena.start[:2]
    return np.reshape(places, (len(places), -1))


def _limits(arena: Arena) -> tuple[tuple[float, float], ...]:
    return (arena.grid.x, arena.grid.right_end), (arena.grid.y, arena.grid.upper_end)


def _region_shares(tried: Tried, trials: PlatformTrials, inputs: Inputs) -> Floats:
    """Shares of the visited cells, whose sum is 1: their number itself would be coverage."""
    grid, (across, up) = trials.arena.grid, REGIONS
    row, column = np.divmod(np.arange(grid.n_cells), grid.columns)
    region = (column * across // grid.columns) + across * (row * up // grid.rows)
    cells, n = tried.batch.cells, tried.batch.n_line
    is_seen = np.arange(cells.shape[1]) < n[:, None]
    counts = np.zeros((len(n), across * up))
    np.add.at(counts, (np.nonzero(is_seen)[0], region[cells[is_seen]]), 1.0)
    return counts / np.maximum(n, 1)[:, None]


def _stall_shares(tried: Tried, trials: PlatformTrials, inputs: Inputs) -> Floats:
    return np.divide(tried.batch.n_stalls, trials.n_steps)[:, None]


def _mean_over_steps(values: NDArray[np.floating]) -> Floats:
    return np.asarray(values.mean(axis=0, dtype=np.float64)[:, None], np.float64)


def _mean_move(tried: Tried, trials: PlatformTrials, inputs: Inputs) -> Floats:
    return _mean_over_steps(np.abs(tried.trace.commands[:, 0]))


def _mean_turn(tried: Tried, trials: PlatformTrials, inputs: Inputs) -> Floats:
    return _mean_over_steps(tried.trace.commands[:, 1])


def _turn_spread(tried: Tried, trials: PlatformTrials, inputs: Inputs) -> Floats:
    return np.asarray(tried.trace.commands[:, 1].std(axis=0, dtype=np.float64)[:, None], np.float64)


def _unit(n: int) -> Callable[[Arena], tuple[tuple[float, float], ...]]:
    return lambda arena: ((0.0, 1.0),) * n


DESCRIPTORS: dict[str, Descriptor] = {
    "mean_turn": Descriptor(("mean_turn",), lambda arena: ((-1.0, 1.0),), _mean_turn, needs_trace=True),
    "turn_spread": Descriptor(("turn_spread",), _unit(1), _turn_spread, needs_trace=True),
    "mean_move": Descriptor(("mean_move",), _unit(1), _mean_move, needs_trace=True),
    "stall_share": Descriptor(("stall_share",), _unit(1), _stall_shares),
    "end": Descriptor(("end_x", "end_y"), _limits, _ended),
    "path": Descriptor(
        tuple(f"path_{axis}_{stage}" for stage in range(1, STAGES + 1) for axis in "xy"),
        lambda arena: _limits(arena) * STAGES,
        _path,
        needs_trace=True,
    ),
    "region_share": Descriptor(
        tuple(f"region_{column}_{row}" for row in range(REGIONS[1]) for column in range(REGIONS[0])),
        _unit(math.prod(REGIONS)),
        _region_shares,
        is_shares=True,
    ),
}


def _described_by(own: PythonDescriptor) -> Descriptor:
    """Return the descriptor of a Python function; numbers out of their ranges are at the ends."""

    def describe(tried: Tried, trials: PlatformTrials, inputs: Inputs) -> Floats:
        low, high = np.transpose(own.ranges)
        return np.asarray(np.clip(own.describe(trajectories_of(trials, tried, inputs)), low, high))

    return Descriptor(own.names, lambda arena: own.ranges, describe, needs_trace=True)


class ArchiveSettings(Settings):
    """The settings of MAP-Elites: what describes a trial, the cells, and how elites have children.

    `neat.population` is the number of genomes in a batch, and `neat.generations` the number of batches. NEAT's settings
    of species have no effect, because cells protect diversity.
    """

    kind: Literal["grid", "cvt"] = Field(
        "grid",
        description="Kind of cells. grid: each descriptor is divided evenly. cvt: cells around centroids that are "
        "spread evenly over all descriptors, for more than three of them (Vassiliades and others 2018).",
    )
    descriptor: Annotated[tuple[DescriptorName, ...], BeforeValidator(as_tuple)] = Field(
        ("mean_turn", "mean_move", "stall_share"),
        min_length=1,
        max_length=len(DESCRIPTORS) + 1,
        description="Numbers that describe a trial. mean_turn: mean turn command, -1..1. turn_spread: standard "
        "deviation of the turn command. mean_move: mean size of the move command. stall_share: share of blocked steps. "
        "end: x and y at the end [m]. path: x and y after each third of the trial [m]. region_share: shares of the "
        "visited cells in 3 x 2 regions of the arena. own: numbers of a Python function, which the table own names.",
    )
    cells: Annotated[tuple[int, ...], BeforeValidator(as_tuple)] = Field(
        (20, 10, 5),
        min_length=1,
        description="Cells along each number of the descriptors, in order; with cvt, the number of cells alone.",
    )
    crossover: float = Field(0.25, ge=0, le=1, description="Share of children with two parents.")
    repeats: int = Field(
        1,
        ge=1,
        le=1000,
        description="Trials of a genome each time it is tried, with different noise. Its fitness and descriptors are "
        "their means.",
    )
    retry: float = Field(
        0.25,
        ge=0,
        lt=1,
        description="Share of each batch that tries elites again, those first that were tried least. Their fitness "
        "and descriptors become the means over all their trials, and they move to the cells of these.",
    )
    depth: int = Field(
        4,
        ge=1,
        le=100,
        description="Number of genomes that a cell holds (Flageat and Cully 2020). The fittest is its elite. The next "
        "one follows if the elite is tried again and proves less fit, or belongs in another cell. With competition "
        "cells only.",
    )
    competition: Literal["cells", "dominated-novelty", "local"] = Field(
        "cells",
        description="Which genomes an archive keeps. cells: the fittest of each cell (MAP-Elites). dominated-novelty: "
        "as many as there are cells, those that are most unlike fitter ones (Bahlous-Boldi and others 2025); cells "
        "then show and measure the archive only. local: as many, by novelty and local competition (Lehman and Stanley "
        "2011).",
    )
    neighbors: int = Field(
        3,
        ge=1,
        le=100,
        description="Number of the nearest genomes whose mean distance counts: of fitter ones with competition "
        "dominated-novelty, and of all with local.",
    )

    own: PythonDescriptor | None = Field(
        None,
        description="The descriptor own: a function of a Python file, and the names and ranges of its numbers.",
        json_schema_extra={"hidden": True},
    )

    @model_validator(mode="after")
    def _cells_fit_the_descriptors(self) -> Self:
        if (OWN in self.descriptor) != (self.own is not None):
            raise ValueError(
                f"there is a descriptor {OWN!r}, expected a table [archive.own] with kind, names, and ranges"
                if self.own is None
                else f"there is a table [archive.own], expected {OWN!r} among the descriptors as well. A table of "
                "some conditions is their [condition.archive.own]"
            )
        if len(set(self.descriptor)) < len(self.descriptor):
            raise ValueError("a descriptor is there twice, expected each once")
        for name, (low, high) in zip(self.own.names, self.own.ranges, strict=True) if self.own else ():
            if any(name in each.names for each in DESCRIPTORS.values()):
                raise ValueError(
                    f"own.names has {name!r}, which is a number of realitygap. Choose another name"
                )
            check_width(low, high)
        numbers = self.names
        expected = len(numbers) if self.kind == "grid" else 1
        if len(self.cells) != expected:
            raise ValueError(
                f"cells has {len(self.cells)} numbers, expected {expected} with kind {self.kind!r} and the "
                f"descriptors {', '.join(numbers)}"
            )
        most = MOST_CELLS if self.kind == "grid" else MOST_CENTROIDS
        if min(self.cells) < 1 or self.n_cells > most:
            raise ValueError(f"cells are {self.n_cells:,} in all, expected 1 to {most:,}")
        if self.n_places > MOST_CELLS:
            raise ValueError(
                f"{self.n_cells:,} cells of depth {self.depth} hold {self.n_places:,} genomes, expected at "
                f"most {MOST_CELLS:,}. Set fewer cells or a lower depth"
            )
        if self.competition != "cells" and self.n_cells > MOST_CENTROIDS:
            raise ValueError(
                f"cells are {self.n_cells:,} in all, expected at most {MOST_CENTROIDS:,} with competition "
                f"{self.competition!r}, which compares all genomes with each other"
            )
        return self

    @model_serializer(mode="wrap")
    def _without_a_function_that_is_not_there(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        if self.own is None:  # as older conditions, whose hashes stay
            del values["own"]
        return values

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return math.prod(self.cells)

    @property
    def n_places(self) -> int:
        """Number of genomes that an archive holds."""
        return self.n_cells * (self.depth if self.competition == "cells" else 1)

    def make_elites(
        self, d: int, batch: int, n_outputs: int = 0, room: int = 0, hidden_room: int = 0
    ) -> Elites:
        """Return an empty archive of d descriptors; without genomes if there is no room for genes."""
        genomes = make_genomes(self.n_places if room else 0, n_outputs, room, hidden_room)
        if self.competition == "cells":
            elites: Elites = make_elites(self.n_cells, d, genomes, self.depth)
        else:
            local = self.competition == "local"
            elites = make_elites(self.n_cells, d, genomes, batch=batch, neighbors=self.neighbors, local=local)
        return elites

    def n_again(self, population: int) -> int:
        """Return the number of elites that a batch tries again."""
        return min(round(self.retry * population), population - 1)

    @property
    def needs_trace(self) -> bool:
        """True if a descriptor needs every step of a trial."""
        return any(each.needs_trace for each in self._descriptors)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers that describe a trial, (d,)."""
        return tuple(name for each in self._descriptors for name in each.names)

    def ranges(self, arena: Arena) -> tuple[tuple[float, float], ...]:
        """Return the lowest and the highest value of each number that describes a trial in an arena, (d, 2)."""
        return tuple(limits for each in self._descriptors for limits in each.ranges(arena))

    def describe(self, tried: Tried, trials: PlatformTrials, inputs: Inputs) -> Floats:
        """Return the numbers, (t, d), that describe what was tried by some trials, whose networks have these inputs.

        Raises:
            TaskError: A function of the user failed, or is not allowed.
        """
        return np.concatenate([each.of(tried, trials, inputs) for each in self._descriptors], axis=1)

    @property
    def _descriptors(self) -> list[Descriptor]:
        own = {} if self.own is None else {OWN: _described_by(self.own)}
        return [(DESCRIPTORS | own)[each] for each in self.descriptor]

    def cells_in(self, arena: Arena, key: int) -> Cells:
        """Return the cells in an arena as kernels read them; the centroids of a CVT depend on a key."""
        limits = np.array(self.ranges(arena), np.float64)
        if self.kind == "grid":
            return cells_of(self.cells, limits, key)
        points, first = cvt_points(self.n_cells, len(limits), key), 0
        for descriptor in self._descriptors:
            last = first + len(descriptor.names)
            if descriptor.is_shares:
                # gaps between sorted numbers are even over all shares (Devroye 1986, V.2)
                cuts = np.sort(points[:, first : last - 1], axis=1)
                points[:, first:last] = np.diff(cuts, axis=1, prepend=0.0, append=1.0)
            first = last
        return cells_of(self.n_cells, limits, key, points)


class Archives:
    """The archives of a block of runs.

    Args:
        settings: Settings of the archives.
        arena: Arena of the trials.
        key: Key of the runs' random numbers.
        n_runs: Number of runs, each with an archive.
        population: Number of genomes in a batch.
        neat: NEAT's rules.
        room, hidden_room: Genes and hidden nodes that a genome may have.
    """

    def __init__(
        self,
        settings: ArchiveSettings,
        arena: Arena,
        key: int,
        n_runs: int,
        population: int,
        neat: NeatRules,
        room: int,
        hidden_room: int,
    ) -> None:
        self._settings = settings
        self._cells = settings.cells_in(arena, key)
        d = len(self._cells.low)
        self._each: list[Elites] = [
            settings.make_elites(d, population, neat.n_outputs, room, hidden_room) for _ in range(n_runs)
        ]
        self._n_again = settings.n_again(population)
        self._again, self._tries, self._kept = np.zeros((3, n_runs, population), np.int32)

    def empty(self) -> None:
        """Forget all elites."""
        for elites in self._each:
            elites.fitness[:], elites.batch[:], elites.best[:], elites.n_filled[0] = -math.inf, -1, -1, 0
        self._again[:] = -1

    def breed(
        self,
        runs: Runs,
        genomes: Genomes,
        children: Genomes,
        descriptors: Floats,
        neat: NeatRules,
        rules: RunRules,
        key: int,
        first_replicate: int,
        generation: int,
    ) -> None:
        """Keep the elites of a batch of each run, and write their children.

        Args:
            runs: Innovations and parents are written. Parents are numbers of individuals in the run. Fitness becomes
                the mean over all trials of a genome.
            genomes: (r * n,) genomes of the batch.
            children: Written, as `genomes`; `children.full` as in `begin_runs`.
            descriptors: (r, n, d) descriptors of the genomes; overwritten as fitness.
            neat, rules: Rules of the runs.
            key, first_replicate, generation: Which random numbers.
        """
        for run, places in enumerate(descriptors):
            block_kernels.breed_elites(
                runs, genomes, children, run, places, self._again[run], self._tries[run], self._kept[run],
                self._cells, self._each[run], self._settings.crossover, self._n_again, neat, rules, np.uint64(key),
                np.int64(first_replicate + run), generation,
            )  # fmt: skip

    def tries(self, n_runs: int) -> NDArray[np.int32]:
        """Return how often the genomes of the present batch have been tried, it included, (r, n)."""
        tried = [each.tries[again] for each, again in zip(self._each, self._again[:n_runs], strict=False)]
        return np.where(self._again[:n_runs] < 0, 0, tried) + np.int32(1)
