"""MAP-Elites with an ask-and-tell interface: the best genome of each cell of a space of descriptors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import RecordError, check_told_once, finite_numbers, from_extra, whole_number
from realitygap.kernels.neat import elites as kernels
from realitygap.kernels.neat.elites import Cells, Elites, make_elites
from realitygap.kernels.neat.genome import Genomes, first_genomes, make_genomes
from realitygap.kernels.neat.mutation import Innovations, make_innovations
from realitygap.records import read_checkpoint, write_checkpoint

from ._genome import Genome
from ._population import FIRST_HIDDEN_ROOM, FIRST_ROOM, random_key
from ._settings import NeatSettings
from ._tables import MOST_NUMBER, arrays_of, check_shapes, genomes_of, table_of, widened

MOST_CELLS = 1_000_000
"""Largest number of cells of a grid: with room for 40 genes each, 1 GB."""
MOST_CENTROIDS = 10_000
"""Largest number of cells of a CVT, whose distances are all computed for each genome."""
MOST_DESCRIPTOR = 1e150
"""Largest size of a descriptor, whose square is a number."""
CVT_POINTS = 20
"""Random points for each centroid of a CVT."""
CVT_ROUNDS = 20
"""Rounds of Lloyd's algorithm."""


class Elite(NamedTuple):
    """The best genome of a cell.

    Attributes:
        cell: Number of its cell; of a grid, in row-major order of the descriptors.
        fitness: Mean of its fitness, over all that was told.
        descriptor: (d,) means of its descriptors.
        batch: Number of the batch in which it was told last.
        genome: The genome.
        tries: How often it was told.
    """

    cell: int
    fitness: float
    descriptor: NDArray[np.float64]
    batch: int
    genome: Genome
    tries: int


class MapElites:
    """An archive of elites by MAP-Elites, for any task: `ask` for genomes, `tell` their fitness and descriptors.

        archive = MapElites(n_inputs=4, n_outputs=2, cells=(20, 10), ranges=((-1, 1), (0, 1)), seed=1)
        for _ in range(100):
            genomes = archive.ask()
            archive.tell([fitness_of(genome) for genome in genomes], [descriptor_of(genome) for genome in genomes])

    The first batch is NEAT's first genomes. Each later one is made of elites that are drawn with equal chances, by
    NEAT's crossover and mutation (Mouret & Clune 2015, with other variation). Settings of species have no effect,
    because cells protect diversity. Parents are elites of before the batch. So the archive is a function of the
    seed, the settings, and what was told, on any machine, also if it was saved and loaded in between.

    If fitness is noisy, elites are lucky ones: try them again before you trust them. With `retry`, a share of each
    batch are elites again, those first that were told least often, and means count. With `depth`, cells hold more
    genomes than their elite, which follow when it proves less fit (Flageat & Cully 2020, without their choice of
    parents).

    With `neighbors`, there are no cells: the archive keeps those genomes that differ most from fitter ones, in parts of
    the ranges (dominated novelty search, Bahlous-Boldi and others 2025). Of equally fit genomes one counts as fitter,
    so that copies do not fill it: one that is held before one of the batch, and then that in the first place. An
    elite's `cell` is then its place. With `local` as well, the archive keeps the first by novelty and local competition
    (Lehman & Stanley 2011): the mean distance to the nearest of all, and how many of these are less fit, as two
    objectives of NSGA-II. The authors compare with an archive of novel genomes as well, and have genotypic diversity
    in place of crowding, which archives that follow from rows cannot have.

    Attributes:
        settings: NEAT's settings; `population` is the size of a batch.
        share: Share of children with two parents.
        retry: Share of a batch that are elites again.
        depth: Genomes that a cell holds.
        neighbors: Neighbors of novelty; 0 for cells.
        local: True for novelty and local competition.
        ranges: Lowest and highest value of each descriptor.
        cells: Cells along each descriptor of a grid, or the number of cells of a CVT.
        batch: Number of the present batch.
    """

    def __init__(
        self,
        n_inputs: int,
        n_outputs: int,
        cells: int | Sequence[int],
        ranges: Sequence[tuple[float, float]],
        settings: NeatSettings | None = None,
        *,
        crossover: float = 0.25,
        retry: float = 0.0,
        depth: int = 1,
        neighbors: int = 0,
        local: bool = False,
        seed: int = 0,
        replicate: int = 0,
        bias: bool = True,
        key: int | None = None,
    ) -> None:
        """Make an empty archive, and the first batch.

        Args:
            n_inputs: Inputs that the task gives, >= 1.
            n_outputs: Outputs that it reads, >= 1.
            cells: Cells along each descriptor, for a grid; or one number, for that many cells of a CVT, whose centroids
                depend on the seed.
            ranges: Lowest and highest value of each of d descriptors. One out of its range counts as at the end.
            settings: NEAT's settings, 'default' if not given.
            crossover: Share of children with two parents, 0 to 1.
            retry: Share of each batch that are elites again, for noisy tasks, 0 to less than 1.
            depth: Genomes that a cell holds, >= 1.
            neighbors: For an archive without cells, of as many genomes as `cells` says: number of the nearest fitter
                genomes whose mean distance counts. 0 for cells.
            local: With neighbors, True for novelty and local competition, in which the nearest count, fitter or not.
            seed: Seed of the random numbers, 0 to 2**63 - 1.
            replicate: Number of the run with this seed, 0 to 2**32 - 1.
            bias: True for a constant input, which is the last one.
            key: Key of the random numbers, which replaces the seed's, 0 to 2**64 - 1.

        Raises:
            TypeError: A number is not a whole one, or the settings are something else.
            ValueError: A number is out of its range, a range is empty, or there are too many cells.
        """
        self._n_inputs = whole_number("n_inputs", n_inputs, 1)
        n_outputs = whole_number("n_outputs", n_outputs, 1)
        self._replicate = whole_number("replicate", replicate, 0, 2**32 - 1)
        seed = whole_number("seed", seed, 0, 2**63 - 1)
        self._key = np.uint64(random_key(seed) if key is None else whole_number("key", key, 0, 2**64 - 1))
        if not isinstance(settings, NeatSettings | None):
            raise TypeError(
                f"settings is {settings!r}, expected NeatSettings, such as NeatSettings.named('default')."
            )
        self.settings = settings or NeatSettings()
        self.share = float(finite_numbers("crossover", crossover))
        if not 0 <= self.share <= 1:
            raise ValueError(f"crossover is {crossover}, expected 0 to 1.")
        self.retry = float(finite_numbers("retry", retry))
        if not 0 <= self.retry < 1:
            raise ValueError(f"retry is {retry}, expected 0 to less than 1.")
        self.depth = whole_number("depth", depth, 1)
        self.neighbors = whole_number("neighbors", neighbors, 0, MOST_CENTROIDS)
        if self.neighbors and isinstance(cells, Sequence):
            raise ValueError(
                f"cells is {cells}, expected one number of genomes with neighbors = {neighbors}."
            )
        self.local = bool(local)
        if self.local and not self.neighbors:
            raise ValueError("local is True, expected neighbors >= 1 with it.")
        if self.neighbors and self.depth > 1:
            raise ValueError(f"depth is {depth}, expected 1 with neighbors = {neighbors}.")
        limits = _checked_ranges(ranges)
        self.ranges = tuple(map(tuple, limits.tolist()))
        if self.neighbors:
            whole_number("cells", cells, 1, MOST_CENTROIDS)
        self._space = cells_of(1 if self.neighbors else cells, limits, int(self._key))
        self.cells = tuple(map(int, cells)) if isinstance(cells, Sequence) else int(cells)
        if self.n_cells * self.depth > MOST_CELLS:
            raise ValueError(
                f"There are {self.n_cells:,} cells for {self.depth:,} genomes each, expected at most {MOST_CELLS:,} "
                "genomes."
            )
        self._rules = self.settings.rules(n_inputs + bias, n_outputs, bias_input=n_inputs if bias else -1)
        self.batch = 0
        self._asked: int | None = None
        n = self.settings.population
        room = self._rules.n_first_genes + FIRST_ROOM
        hidden_room = self._rules.start_hidden + FIRST_HIDDEN_ROOM
        self._genomes: Genomes = make_genomes(n, n_outputs, room, hidden_room)
        self._innovations: Innovations = make_innovations(self._rules, n)
        for array in self._innovations[1:]:  # room that is not read yet, but saved
            array[:] = 0
        self._elites: Elites = make_elites(
            self.n_cells,
            len(self.ranges),
            make_genomes(self.n_cells * self.depth, n_outputs, room, hidden_room),
            self.depth,
            batch=n,
            neighbors=self.neighbors,
            local=self.local,
        )
        self._parents, self._again = np.full((n, 2), -1, np.int32), np.full(n, -1, np.int32)
        first_genomes(self._genomes, self._rules, self._key, self._replicate, 0)

    @cached_property
    def _cells(self) -> Cells:
        """Cells for measures; without cells, those of a CVT, whose centroids take long to spread."""
        if not self.neighbors:
            return self._space
        return cells_of(self.cells, np.array(self.ranges), int(self._key))

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return self.cells if isinstance(self.cells, int) else math.prod(self.cells)

    @property
    def centroids(self) -> NDArray[np.float64] | None:
        """Centroids of a CVT in the units of the descriptors, (c, d); None for a grid."""
        if isinstance(self.cells, tuple):
            return None
        low, high = np.array(self.ranges).T
        return np.asarray(low + self._cells.centroids * (high - low), np.float64)

    def __len__(self) -> int:
        return int(self._elites.n_filled[0])

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} of {self.n_cells} cells, batch {self.batch})"

    @property
    def parents(self) -> NDArray[np.int32]:
        """The cells of each genome's parents, (n, 2); -1 for a missing parent."""
        return np.where(self._parents < 0, -1, self._parents // self.depth).astype(np.int32)

    def ask(self) -> list[Genome]:
        """Return the genomes of this batch, in the order in which `tell` wants what they did."""
        self._asked = self.batch
        value = float(self.settings.bias_value)
        return [Genome(self._genomes, row, self._rules, value) for row in range(self.settings.population)]

    def tell(self, fitness: ArrayLike, descriptors: ArrayLike) -> None:
        """Take the fitness and the descriptors of this batch, keep new elites, and make the next batch.

        Args:
            fitness: (n,) finite; more is fitter. A genome that is held stays where another is only as fit.
            descriptors: (n, d) finite.

        Raises:
            RuntimeError: The batch for which `ask` was last called has been told.
            TypeError: Something else than real numbers.
            ValueError: Another shape, or a value that is not finite. The archive stays as it is.
        """
        n, d = self.settings.population, len(self.ranges)
        check_told_once(self._asked, self.batch)
        values = np.array(finite_numbers("fitness", fitness), order="C")
        places = np.array(finite_numbers("descriptors", descriptors), order="C")
        if values.shape != (n,):
            raise ValueError(
                f"fitness has shape {values.shape}, expected ({n},): one number for each genome asked."
            )
        if (np.abs(places) > MOST_DESCRIPTOR).any():
            raise ValueError(
                f"descriptors has {np.abs(places).max():.3g}, expected at most {MOST_DESCRIPTOR:g} in size."
            )
        if places.shape != (n, d):
            raise ValueError(
                f"descriptors has shape {places.shape}, expected ({n}, {d}): {d} numbers for each genome asked."
            )
        tries, kept = np.empty((2, n), np.int32)
        kernels.place_elites(
            self._genomes, values, places, self._again, tries, self._space, self._elites, self.batch, kept
        )
        room, hidden_room = self._genomes.innovation.shape[1], self._genomes.hidden.shape[1]
        while True:
            children = make_genomes(n, self._rules.n_outputs, room, hidden_room)
            innovations = Innovations._make(array.copy() for array in self._innovations)
            kernels.vary_elites(
                self._elites,
                self.share,
                min(round(self.retry * n), n - 1),
                self._rules,
                innovations,
                self._key,
                self._replicate,
                self.batch + 1,
                children,
                self._parents,
                self._again,
            )
            if not children.full[0]:
                break
            room, hidden_room = 2 * room, 2 * hidden_room
            wide = widened(self._elites.genomes, self._rules.n_outputs, room, hidden_room)
            self._elites = self._elites._replace(genomes=wide)
        self._genomes, self._innovations = children, innovations
        self.batch += 1

    def cells_of(self, descriptors: ArrayLike) -> NDArray[np.int64]:
        """Return the number of the cell of each of n descriptors, (n, d).

        Raises:
            TypeError: Something else than real numbers.
            ValueError: Another shape, or a value that is not finite.
        """
        places = np.ascontiguousarray(finite_numbers("descriptors", descriptors))
        if places.ndim != 2 or places.shape[1] != len(self.ranges):
            raise ValueError(f"descriptors has shape {places.shape}, expected (n, {len(self.ranges)}).")
        return place_in_cells(places, self._cells)

    def elites(self) -> list[Elite]:
        """Return the elites in the order in which their cells were filled."""
        held, value = self._elites, float(self.settings.bias_value)
        return [
            Elite(
                int(place) // self.depth,
                float(held.fitness[place]),
                held.descriptors[place].copy(),
                int(held.batch[place]),
                Genome(held.genomes, int(place), self._rules, value),
                int(held.tries[place]),
            )
            for place in held.best[held.filled[: len(self)]]
        ]

    @property
    def fitness(self) -> NDArray[np.float64]:
        """Fitness of the elite of each cell, in the shape of the grid or (c,); NaN for an empty cell."""
        best = self._elites.best
        values = np.where(best < 0, np.nan, self._elites.fitness[best])
        return values if isinstance(self.cells, int) else values.reshape(self.cells)

    @property
    def coverage(self) -> float:
        """Share of cells that are filled."""
        return len(self) / self.n_cells

    def qd_score(self, offset: float = 0.0) -> float:
        """Return the sum of the elites' fitness above an offset.

        Args:
            offset: Fitness that counts as 0, such as the lowest one that is possible; otherwise an elite of negative
                fitness lowers the score.
        """
        return float(np.nansum(self.fitness - offset))

    def to_ribs(self) -> Any:
        """Return the elites as an archive of pyribs, for its figures and emitters; see `ribs_archive`.

        Raises:
            MissingExtraError: pyribs is not installed.
        """
        elites = self.elites()
        return ribs_archive(
            self._cells,
            [elite.genome for elite in elites],
            np.array([elite.fitness for elite in elites]),
            np.array([elite.descriptor for elite in elites]).reshape(len(elites), -1),
        )

    def save(self, path: str | Path) -> None:
        """Write a checkpoint. An existing file is replaced once the new one is complete.

        Args:
            path: The file, a NumPy .npz whatever its name.

        Raises:
            RecordError: It cannot be written; a file that was there is as it was.
        """
        about = {
            "n_inputs": self._n_inputs,
            "n_outputs": self._rules.n_outputs,
            "bias": self._rules.bias_input >= 0,
            "settings": self.settings.model_dump(mode="json"),
            "cells": self.cells,
            "ranges": self.ranges,
            "crossover": self.share,
            "retry": self.retry,
            "depth": self.depth,
            "neighbors": self.neighbors,
            "local": self.local,
            "key": int(self._key),
            "replicate": self._replicate,
            "batch": self.batch,
        }
        write_checkpoint(Path(path), "map-elites", about, self._arrays())

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Return the archive that `save` wrote.

        Raises:
            RecordError: There is no such file, it is cut off or damaged, or no checkpoint of an archive.
            RecordVersionError: A version wrote it whose numbers may differ.
        """
        about, arrays = read_checkpoint(Path(path), "map-elites")
        try:
            archive = cls(
                about["n_inputs"],
                about["n_outputs"],
                about["cells"],
                about["ranges"],
                NeatSettings(**about["settings"]),
                crossover=about["crossover"],
                retry=about["retry"],
                depth=about["depth"],
                neighbors=about["neighbors"],
                local=about["local"],
                replicate=about["replicate"],
                bias=about["bias"],
                key=about["key"],
            )
            archive._restore(arrays)
            archive.batch = whole_number("batch", about["batch"], 0, MOST_NUMBER)
        except (IndexError, KeyError, OverflowError, RecordError, TypeError, ValueError) as error:
            raise RecordError(
                f"{path} is a checkpoint, but not one of an archive as this version has it ({error})."
            ) from error
        return archive

    def _arrays(self) -> dict[str, NDArray[Any]]:
        """Return all that changes from batch to batch, by name; views."""
        held = self._elites
        tables = {"genomes": self._genomes, "innovations": self._innovations, "elites.genomes": held.genomes}
        parts = {f"elites.{name}": array for name, array in held._asdict().items() if name != "genomes"}
        return arrays_of(tables) | parts | {"parents": self._parents, "again": self._again}

    def _restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Put `_arrays` back; only the room for genes may differ.

        Raises:
            RecordError: A genome is not one that evolution can make.
            ValueError: Names, types, sizes or numbers do not fit.
        """
        check_shapes(arrays, self._arrays(), self._rules.n_outputs)
        counters = arrays["innovations.counters"]
        genomes = genomes_of(self._genomes, "genomes", arrays, self._rules, counters)
        used = np.flatnonzero(arrays["elites.batch"] >= 0).tolist()
        held = genomes_of(self._elites.genomes, "elites.genomes", arrays, self._rules, counters, used)
        if held.innovation.shape != (self.n_cells * self.depth, genomes.innovation.shape[1]):
            raise ValueError("elites and children have different room")
        finite_numbers("fitness", arrays["elites.fitness"][used])
        finite_numbers("descriptors", arrays["elites.descriptors"])
        self._genomes, self._innovations = genomes, table_of(self._innovations, "innovations", arrays)
        elites = table_of(self._elites, "elites", arrays)._replace(genomes=held)
        if not _agree(elites, arrays["again"], self.depth):
            raise ValueError("cells and their elites do not agree")
        self._elites, self._parents, self._again = elites, arrays["parents"], arrays["again"]


def _agree(elites: Elites, again: NDArray[np.int32], depth: int) -> bool:
    """Return whether the parts of an archive that was read name each other rightly."""
    n_cells = len(elites.best)
    fitness = np.where(elites.batch < 0, -math.inf, elites.fitness).reshape(n_cells, depth)
    filled, n_filled = np.flatnonzero(fitness.max(axis=1) > -math.inf), int(elites.n_filled[0])
    order, best = elites.filled[: max(n_filled, 0)], elites.best[filled]
    are_free = np.delete(elites.best, filled) == -1
    return bool(
        np.array_equal(elites.fitness.reshape(n_cells, depth), fitness)
        and np.array_equal(np.sort(order), filled)
        and np.array_equal(elites.rank[order], np.arange(n_filled))
        and are_free.all()
        and np.array_equal(best // depth, filled)
        and np.array_equal(elites.fitness[best], fitness.max(axis=1)[filled])
        and (elites.tries[elites.batch >= 0] > 0).all()
        and np.isin(again, [-1, *best]).all()
    )


def _checked_ranges(ranges: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    """Return the ranges, (d, 2)."""
    limits = finite_numbers("ranges", ranges)
    if limits.ndim != 2 or limits.shape[1:] != (2,) or not len(limits):
        raise ValueError(
            f"ranges has shape {limits.shape}, expected (d, 2): lowest and highest of each descriptor."
        )
    for low, high in limits:
        if not low < high:
            raise ValueError(f"A range is {low:g} to {high:g}, expected the lowest value first.")
        check_width(low, high)
    return limits


def check_width(low: float, high: float) -> None:
    """Raise an error if a range is too wide or too narrow to be divided.

    Raises:
        ValueError: It is.
    """
    if not 1 / MOST_DESCRIPTOR <= float(high) - float(low) <= MOST_DESCRIPTOR:
        raise ValueError(
            f"A range is {low:g} to {high:g}, expected a width from {1 / MOST_DESCRIPTOR:g} to {MOST_DESCRIPTOR:g}."
        )


def cells_of(
    cells: int | Sequence[int],
    limits: NDArray[np.float64],
    key: int,
    points: NDArray[np.float64] | None = None,
) -> Cells:
    """Return cells as kernels read them.

    Args:
        cells: Cells along each descriptor of a grid, or the number of cells of a CVT.
        limits: (d, 2) lowest and highest value of each descriptor.
        key: Key of the centroids.
        points: Points of the unit cube over which the centroids of a CVT are spread. Default: random ones.

    Raises:
        TypeError: A number is not a whole one.
        ValueError: There are too many cells, or not as many numbers as descriptors.
    """
    low, high = np.ascontiguousarray(limits.T)
    d = len(limits)
    if not isinstance(cells, Sequence):
        n = whole_number("cells", cells, 1, MOST_CENTROIDS)
        points = cvt_points(n, d, key) if points is None else points
        return Cells(low, high, np.ones(d, np.int64), spread_centroids(n, points))
    size = tuple(whole_number(f"cells[{k}]", n, 1, MOST_CELLS) for k, n in enumerate(cells))
    if len(size) != d:
        raise ValueError(
            f"cells has {len(size)} numbers, and ranges has {d}: expected one for each descriptor."
        )
    if math.prod(size) > MOST_CELLS:
        raise ValueError(f"The grid has {math.prod(size):,} cells, expected at most {MOST_CELLS:,}.")
    return Cells(low, high, np.array(size, np.int64), np.empty((0, d)))


def place_in_cells(descriptors: NDArray[np.float64], cells: Cells) -> NDArray[np.int64]:
    """Return the number of the cell of each of n descriptors, (n, d), in memory row by row."""
    found = np.empty(len(descriptors), np.int64)
    kernels.cells_of(descriptors, cells, found)
    return found


def ribs_archive(
    cells: Cells, genomes: Sequence[Genome], fitness: NDArray[np.float64], descriptors: NDArray[np.float64]
) -> Any:
    """Return an archive of pyribs whose solutions are genomes: its `GridArchive` or `CVTArchive`.

    Measures of a grid are the descriptors, and those of a CVT are the descriptors as parts of their ranges, because
    pyribs takes distances in the units of the measures.

    Args:
        cells: Cells of the archive.
        genomes: n elites.
        fitness: (n,) their fitness.
        descriptors: (n, d) their descriptors.

    Raises:
        MissingExtraError: pyribs is not installed.
    """
    archives = from_extra("ribs.archives", "qd")
    d = len(cells.low)
    settings: dict[str, Any] = {"solution_dim": (), "solution_dtype": object}
    if len(cells.centroids):
        archive = archives.CVTArchive(centroids=cells.centroids, ranges=[(0.0, 1.0)] * d, **settings)
        measures = np.clip((descriptors - cells.low) / (cells.high - cells.low), 0.0, 1.0)
    else:
        ranges = list(zip(cells.low, cells.high, strict=True))
        archive = archives.GridArchive(dims=cells.size.tolist(), ranges=ranges, epsilon=0.0, **settings)
        measures = descriptors
    if len(genomes):
        solutions = np.empty(len(genomes), object)
        solutions[:] = genomes
        archive.add(solutions, fitness, measures)
    return archive


def cvt_centroids(n: int, d: int, key: int = 0) -> NDArray[np.float64]:
    """Return n centroids of a centroidal Voronoi tessellation of the unit cube, (n, d).

    Lloyd's algorithm on random points, as Vassiliades, Chatzilygeroudis & Mouret (2018) use k-means. Sums have one
    order, so that centroids are the same on any machine.

    Args:
        n: Number of centroids.
        d: Number of dimensions.
        key: Seed of the points.
    """
    return spread_centroids(n, cvt_points(n, d, key))


def cvt_points(n: int, d: int, key: int) -> NDArray[np.float64]:
    """Return random points of the unit cube for n centroids, (n * `CVT_POINTS`, d)."""
    return np.random.Generator(np.random.Philox(key=key)).random((n * CVT_POINTS, d))


def spread_centroids(n: int, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return n centroids of points of the unit cube, (m, d), by Lloyd's algorithm, (n, d)."""
    d = points.shape[1]
    centroids = points[:n].copy()
    unit = Cells(np.zeros(d), np.ones(d), np.ones(d, np.int64), centroids)
    for _ in range(CVT_ROUNDS):
        found = place_in_cells(points, unit._replace(centroids=centroids))
        count = np.bincount(found, minlength=n)
        sums = np.stack([np.bincount(found, points[:, k], n) for k in range(d)], axis=1)
        centroids = np.where(count[:, None] > 0, sums / np.maximum(count, 1)[:, None], centroids)
    return centroids
