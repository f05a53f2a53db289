"""Novelty of behaviors: the paper's archive, and the nearest neighbors of Lehman & Stanley (2011).

Behaviors and their distances are those of `distances`, or points of a plane.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, kernel

from .distances import Behaviors, copy_behavior, distance_of, distances_to, make_behaviors


class Archive(NamedTuple):
    """The paper's archive of at most m behaviors, and room for n individuals."""

    behaviors: Behaviors  # m
    among: NDArray[np.float64]  # (m, m) distances of the archived behaviors; negative from each to itself
    state: NDArray[np.int64]  # (2,) behaviors in the archive; place of the oldest
    place_of: NDArray[np.int64]  # (n,) room
    distance: NDArray[np.float64]  # (n, m) room
    archived: NDArray[np.float64]  # (m,) room


def make_archive(n, size, cells):
    """An empty archive."""
    return Archive(
        make_behaviors(size, cells),
        np.zeros((size, size)),
        np.zeros(2, np.int64),
        np.zeros(n, np.int64),
        np.zeros((n, size)),
        np.zeros(size),
    )


@kernel
def archive_novelty(distance, n_archive, novelty):
    """Mean distance of each individual to the archive, itself left out where it is in it.

    Args:
        distance: (n, >= n_archive) to each archived behavior; negative where that is the individual itself.
        n_archive: Behaviors in the archive.
        novelty: (n,) written; 0 where there is nothing to compare with.
    """
    for row in range(novelty.size):
        total = 0.0
        others = 0
        for k in range(n_archive):
            if distance[row, k] >= 0.0:
                total += distance[row, k]
                others += 1
        novelty[row] = total / others if others > 0 else 0.0


@kernel
def _to_archive(archive, behaviors, row, k, measure):
    """Put one behavior at place k of the paper's archive."""
    copy_behavior(behaviors, row, archive.behaviors, k)
    archive.among[k, k] = -1.0
    for other in range(archive.state[0]):
        if other != k:
            apart = distance_of(measure, archive.behaviors, k, archive.behaviors, other)
            archive.among[k, other] = apart
            archive.among[other, k] = apart


@kernel
def _bar(archive, above_all):
    """The novelty of the most novel behavior in the paper's archive, or of the least novel one."""
    size = archive.archived.size
    archive_novelty(archive.among, size, archive.archived)
    bar = archive.archived[0]
    for k in range(1, size):
        bar = max(bar, archive.archived[k]) if above_all else min(bar, archive.archived[k])
    return bar


@kernel
def paper_archive_step(behaviors, measure, archive, above_all, novelty):
    """Novelty of one generation against the paper's archive, which is then brought up to date.

    While the archive has room, the generation's behaviors are put in first, in the order of individuals, and
    then everyone is compared with the archive, itself left out. Afterwards each individual that was not put
    in, in order, replaces the archive's oldest behavior if its novelty is greater than that of the archived
    ones: of every one, or of the least novel one. Their novelty is their mean distance to one another.

    Args:
        behaviors: Of each of n individuals.
        measure: Their distance.
        archive: Changed.
        above_all: Whether a newcomer must be more novel than all, else than the least novel one.
        novelty: (n,) float64, written, in the unit of the distance.
    """
    size = archive.archived.size
    state = archive.state
    for row in range(novelty.size):
        archive.place_of[row] = -1
        if state[0] < size:
            _to_archive(archive, behaviors, row, state[0], measure)
            archive.place_of[row] = state[0]
            state[0] += 1
    for row in range(novelty.size):
        at = archive.place_of[row]
        for k in range(state[0]):
            archive.distance[row, k] = (
                archive.among[at, k]
                if at >= 0
                else distance_of(measure, behaviors, row, archive.behaviors, k)
            )
    archive_novelty(archive.distance, state[0], novelty)
    if state[0] < size:
        return
    bar = _bar(archive, above_all)
    for row in range(novelty.size):
        if archive.place_of[row] < 0 and novelty[row] > bar:
            _to_archive(archive, behaviors, row, state[1], measure)
            state[1] = (state[1] + 1) % size
            bar = _bar(archive, above_all)


@kernel
def mean_of_nearest(distance, n, nearest):
    """Return the mean of the smallest of n distances (Lehman & Stanley 2011, sparseness); 0 if there are no distances.

    Args:
        distance: (>= n,) to everyone that counts; negative for the individual itself.
        n: How many.
        nearest: (k,) room: as many are averaged over, or all of them while there are fewer.
    """
    held = 0
    for other in range(n):
        value = distance[other]
        if value < 0.0 or (held == nearest.size and value >= nearest[held - 1]):
            continue
        place = held if held < nearest.size else held - 1
        while place > 0 and nearest[place - 1] > value:
            nearest[place] = nearest[place - 1]
            place -= 1
        nearest[place] = value
        held = min(held + 1, nearest.size)
    total = 0.0
    for i in range(held):
        total += nearest[i]
    return total / held if held > 0 else 0.0


@kernel
def admit(novelty, counters, threshold, patience, entered):
    """Who enters the archive of Lehman & Stanley (2011), in the order of individuals; moves the threshold.

    Args:
        novelty: (n,) of the individuals.
        counters: (2,) int64: evaluations since the last entry; entries in a row. Changed.
        threshold: (1,) float64, changed: -5 % after `patience` evaluations without an entry, +20 % when
            more than four enter in a row.
        patience: Evaluations.
        entered: (n,) bool, written.
    """
    for row in range(novelty.size):
        entered[row] = novelty[row] > threshold[0]
        if entered[row]:
            counters[0] = 0
            counters[1] += 1
            if counters[1] > 4:
                threshold[0] *= 1.2
                counters[1] = 0
        else:
            counters[0] += 1
            counters[1] = 0
            if counters[0] >= patience:
                threshold[0] *= 0.95
                counters[0] = 0


class NearestRoom(NamedTuple):
    """Room for one generation of n individuals against an archive of at most m."""

    distance: NDArray[np.float64]  # (n + m,)
    nearest: NDArray[np.float64]  # (k,)
    entered: NDArray[np.bool_]  # (n,)


@kernel
def nearest_archive_step(behaviors, measure, patience, archive, state, counters, threshold, room, novelty):
    """Novelty of one generation by nearest neighbors in population and archive, which then takes entries.

    Args:
        behaviors: Of each of n individuals.
        measure: Their distance.
        patience: Evaluations without an entry after which the threshold falls.
        archive: Behaviors, changed; room for everyone who can enter.
        state: (>= 1,) int64: behaviors in the archive. Changed.
        counters, threshold: As in `admit`.
        room: As many neighbors count as it has room for.
        novelty: (n,) float64, written, in the unit of the distance.
    """
    n = novelty.size
    for row in range(n):
        distances_to(measure, behaviors, row, behaviors, n, room.distance)
        room.distance[row] = -1.0
        distances_to(measure, behaviors, row, archive, state[0], room.distance[n:])
        novelty[row] = mean_of_nearest(room.distance, n + state[0], room.nearest)
    admit(novelty, counters, threshold, patience, room.entered)
    for row in range(n):
        if room.entered[row]:
            copy_behavior(behaviors, row, archive, state[0])
            state[0] += 1


@inlined
def _distances(x, y, xs, ys, n, distance):
    for k in range(n):
        dx = xs[k] - x
        dy = ys[k] - y
        distance[k] = math.sqrt(dx * dx + dy * dy)


@kernel
def point_novelty(points, archive, n_archive, distance, nearest, novelty):
    """Mean distance of each point to its nearest ones among the others and the archived.

    Args:
        points: (2, n) float64, x and y.
        archive: (2, >= n_archive) float64.
        n_archive: How many points are in it.
        distance: (>= n + n_archive,) room.
        nearest: (k,) room: as many neighbors count.
        novelty: (n,) written.

    Source: Lehman & Stanley (2011), sparseness.
    """
    n = novelty.size
    for row in range(n):
        x = points[0, row]
        y = points[1, row]
        _distances(x, y, points[0], points[1], n, distance)
        _distances(x, y, archive[0], archive[1], n_archive, distance[n:])
        distance[row] = -1.0
        novelty[row] = mean_of_nearest(distance, n + n_archive, nearest)
