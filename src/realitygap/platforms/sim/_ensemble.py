"""Many robots that differ in their numbers, each in the same trials: what fits of `sim` are made of."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap._process import usable_processors
from realitygap.errors import finite_numbers, whole_number
from realitygap.evolution import Genome, NeatSettings, Population, decode_all
from realitygap.kernels.math.philox import PURPOSE_NOISE
from realitygap.kernels.neat.genome import NeatRules
from realitygap.kernels.neat.network import Networks
from realitygap.kernels.sim.lanes import make_sim_room
from realitygap.kernels.sim.replay import Rehearsed, rehearse
from realitygap.kernels.sim.shape import half_width
from realitygap.trials import Draws, check_genomes
from realitygap.world import Arena, Distribution

from ._platform import SimPlatform
from ._scene import IN_PARTS, SimScene, largest, own_half, parts_of_step, sim_scene
from ._trials import sim_rules

CHUNK_BYTES = 32_000_000  # of the memory of one thread
START = ("arena.start.x", "arena.start.y", "arena.start.heading")
KEPT = ("poses", "readings", "stalled", "wheels", "commands")
"""Values that can be stored for every step."""

Values = Mapping[str, ArrayLike]
T = TypeVar("T")
F = TypeVar("F", bound=np.generic)
Finely = tuple[int, int]
"""Parts of a step, and of its beginning while the previous command still has effect."""


@dataclass(frozen=True)
class Rehearsal:
    """Robots (m) in k trials of t commands; row 0 is the start.

    Values that are not stored have no steps. Simulated values are in single precision, observed poses
    and wheels in double.

    Attributes:
        poses: (m, k, t + 1, 3) x [m], y [m], heading [rad, -pi to pi]; before the robot was put back to an anchor.
        readings: (m, k, t + 1, s) readings of the range sensors, 0..1. Row k is from before command k.
        stalled: (m, k, t + 1) bool, True if the robot was blocked, in the same rows.
        wheels: (m, k, t + 1, 2) distance of the left and the right wheel since the start [m], as measured by encoders
            if the robot has some.
        commands: (m, k, t, 2) move and turn.
        cells: (m, k, c) bool, True for each cell of the arena's grid on the line.
    """

    poses: NDArray[np.float32 | np.float64]
    readings: NDArray[np.float32]
    stalled: NDArray[np.bool_]
    wheels: NDArray[np.float32 | np.float64]
    commands: NDArray[np.float32]
    cells: NDArray[np.bool_]

    @property
    def coverage(self) -> NDArray[np.float64]:
        """Return the visited share of the cells, 0..1, (m, k)."""
        return np.asarray(self.cells.mean(axis=2))


@dataclass(frozen=True)
class Play:
    """Trials that all robots of an ensemble are to do.

    Attributes:
        starts: (k, 3) x [m], y [m], heading [rad].
        n_steps: Commands in each.
        commands: (k, n_steps, 2) move and turn; no rows if controllers drive.
        genomes: Genome of each trial, if controllers drive.
        anchors: (k, n_steps + 1, 3) poses to which the robot is put back before a step; nan as x for none; no rows for
            never. The wheels, the queue of commands, and averages continue. So each command can be predicted from the
            observed pose before it (multiple shooting).
    """

    starts: NDArray[np.float64]
    n_steps: int
    commands: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0, 2)))
    genomes: tuple[Genome, ...] = ()
    anchors: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0, 3)))

    def __post_init__(self) -> None:
        k = len(self.starts)
        shapes = {
            "starts": (self.starts.shape, (k, 3)),
            "commands": (self.commands.shape, (k, self.n_steps, 2)),
            "anchors": (self.anchors.shape, (k, self.n_steps + 1, 3)),
        }
        if self.genomes:
            del shapes["commands"]
            if len(self.genomes) != k:
                raise ValueError(f"Got {len(self.genomes)} genomes and {k} starts, expected one for each.")
            if len({genome.interface for genome in self.genomes}) > 1:
                raise ValueError(
                    "The genomes have different inputs or outputs, expected genomes of one kind."
                )
        if not len(self.anchors):
            del shapes["anchors"]
        for name, (came, expected) in shapes.items():
            if came != expected:
                raise ValueError(f"{name} has shape {came}, expected {expected}.")
        if k == 0 or self.n_steps < 1:
            raise ValueError(
                f"Got {k} trials of {self.n_steps} commands, expected at least one of one command."
            )


class SimEnsemble:
    """The platform `sim` in an arena, ready to be tried with many sets of its numbers.

    A step of each robot is cut into as many parts, in which contact is looked for, as `sim` cuts it for a robot of
    these numbers.

    Args:
        platform: The robot as simulated, with what no set says otherwise; of what it draws for each trial, each trial
            draws its own.
        arena: Arena of the trials.
        ranges: Least and most of the numbers that sets will give, by dotted name: so that queues of commands have the
            same length, and what a number can switch on is on, in every call. Numbers outside extend them.
        threads: Number of threads. Default: all processors that may be used.

    Raises:
        ValueError: A number that robot or arena does not have, or that cannot be so.
    """

    def __init__(
        self,
        platform: SimPlatform,
        arena: Arena,
        *,
        ranges: Mapping[str, tuple[float, float]] | None = None,
        threads: int | None = None,
    ) -> None:
        self.platform = platform
        self.arena = arena
        self.threads = usable_processors() if threads is None else whole_number("threads", threads, 1)
        self._ranges = {name: (float(low), float(high)) for name, (low, high) in (ranges or {}).items()}
        self._scenes: dict[tuple[object, ...], SimScene] = {}
        self._own = self._make_scene(("stall",), {})
        numbers = self._own.robot.numbers()
        self._most = {name: largest(numbers[name]) for name in IN_PARTS}
        self._no_genome = Population(3, 2, NeatSettings.named("default"), bias=False).ask()[0]
        self._scene(("stall",))

    def replay(
        self,
        starts: ArrayLike,
        commands: ArrayLike,
        values: Values,
        key: int,
        *,
        anchors: ArrayLike | None = None,
        keep: Sequence[str] = KEPT,
        same_noise: bool = False,
    ) -> Rehearsal:
        """Simulate the same commands with all robots.

        Args:
            starts: (k, 3) x [m], y [m], heading [rad].
            commands: (k, t, 2) move and turn, limited to -1..1.
            values: Numbers by dotted name, each (m,) or, if trials differ, (m, k); none for one robot with its own
                numbers.
            key: Key of the random numbers.
            anchors: Poses to which robots are put back, as in `Play`.
            keep: Names among `KEPT` of the values to store.
            same_noise: True if all robots draw the same random numbers. Otherwise each draws its own.

        Raises:
            ValueError: Arrays that do not fit, or a number that cannot be so.
        """
        given = finite_numbers("commands", commands)
        play = Play(
            finite_numbers("starts", starts).reshape(-1, 3),
            given.shape[1] if given.ndim == 3 else 0,
            given,
            anchors=np.empty((0, 0, 3)) if anchors is None else np.asarray(anchors, np.float64),
        )
        return _gathered(list(self._parts(play, values, key, keep, same_noise, _as_it_is)))

    def drive(
        self,
        genomes: Sequence[Genome],
        starts: ArrayLike,
        n_steps: int,
        values: Values,
        key: int,
        *,
        keep: Sequence[str] = KEPT,
        same_noise: bool = False,
    ) -> Rehearsal:
        """Simulate the same controllers with all robots: genome j from start j in trial j.

        Arguments and errors as in `replay`; also of genomes as in `try_genomes`.
        """
        play = Play(
            finite_numbers("starts", starts).reshape(-1, 3),
            whole_number("n_steps", n_steps, 1),
            genomes=tuple(genomes),
        )
        return _gathered(list(self._parts(play, values, key, keep, same_noise, _as_it_is)))

    def summarize(
        self,
        play: Play,
        values: Values,
        key: int,
        of: Callable[[Rehearsal], NDArray[F]],
        *,
        keep: Sequence[str] = KEPT,
        same_noise: bool = False,
    ) -> NDArray[F]:
        """Return the summary `of` of the trials, (m, ...), for some robots at a time, so that memory stays constant.

        Args:
            play: The trials.
            of: Called from several threads with some of the robots; must answer a row for each of them.
        """
        return _in_order(self._parts(play, values, key, keep, same_noise, of), _n_robots(values))

    def _parts(
        self,
        play: Play,
        values: Values,
        key: int,
        keep: Sequence[str],
        same_noise: bool,
        of: Callable[[Rehearsal], T],
    ) -> Iterator[tuple[NDArray[np.int64], T]]:
        """Yield the indices of some robots and what `of` makes of them, until all robots are done."""
        if unknown := sorted(set(keep) - set(KEPT)):
            raise ValueError(f"Cannot keep {', '.join(unknown)}, expected some of {', '.join(KEPT)}.")
        given = _in_columns(values, len(play.starts))
        first = (play.genomes or (self._no_genome,))[0]
        inputs = first.interface.inputs
        check_genomes(play.genomes or (first,), inputs)
        scene = self._scene(inputs, given)
        networks = decode_all(play.genomes or (first,))
        work = _Work(
            scene,
            self._own,
            play,
            given,
            first.rules,
            first.bias_value,
            networks,
            key,
            tuple(keep),
            same_noise,
        )
        m = _n_robots(given)
        size = max(1, CHUNK_BYTES // (work.bytes_of_trial * len(play.starts)))
        size = max(1, min(size, -(-m // self.threads)))
        chunks = [
            (finely, robots[at : at + size])
            for finely, robots in self._cut_alike(given, m)
            for at in range(0, len(robots), size)
        ]

        def compute(chunk: tuple[Finely, NDArray[np.int64]]) -> tuple[NDArray[np.int64], T]:
            finely, robots = chunk
            return robots, of(work.carry_out(robots, finely))

        if self.threads == 1 or len(chunks) == 1:
            yield from map(compute, chunks)
            return
        with ThreadPoolExecutor(self.threads, thread_name_prefix="ensemble") as pool:
            yield from pool.map(compute, chunks)

    def _cut_alike(
        self, given: Mapping[str, NDArray[np.float64]], m: int
    ) -> list[tuple[Finely, NDArray[np.int64]]]:
        """Return the m robots by the parts of their steps: robots that differ in them have different scenes."""
        most = {name: np.full(m, value) for name, value in self._most.items()}
        most |= {name: np.abs(given[name]).max(axis=1) for name in most if name in given}
        halves = [self._half(given, number) for number in range(len(self._own.robot.body))]
        parts = np.stack(parts_of_step(self._own.robot, most, self.platform.command_s, halves), axis=1)
        kinds, which = np.unique(parts, axis=0, return_inverse=True)
        return [
            ((int(substeps), int(late)), np.flatnonzero(which.reshape(-1) == k))
            for k, (substeps, late) in enumerate(kinds)
        ]

    def _half(self, given: Mapping[str, NDArray[np.float64]], number: int) -> NDArray[np.float64]:
        """Return the half width of a part of the body, (m,) or (1,) [m]; the smallest if trials differ."""
        body = self._own.robot.body[number]
        names = [f"body.{number}.corner.{k}.{axis}" for k in range(len(body.corner)) for axis in "xy"]
        own = [value for corner in body.corner for value in (corner.x, corner.y)]
        if given.keys().isdisjoint([*names, f"body.{number}.radius"]):
            return own_half(self._own.robot, number).reshape(1)
        each = [given.get(name, np.full((1, 1), value)) for name, value in zip(names, own, strict=True)]
        corners = np.stack(np.broadcast_arrays(*each), axis=-1)
        radius = given.get(f"body.{number}.radius", np.full((1, 1), body.radius))
        half: NDArray[np.float64] = half_width(corners.reshape(*corners.shape[:-1], -1, 2), radius)
        return np.asarray(half.min(axis=1))

    def _scene(
        self, inputs: tuple[str, ...], given: Mapping[str, NDArray[np.float64]] | None = None
    ) -> SimScene:
        """Return robot and arena whose structure serves all these numbers."""
        ranges = dict(self._ranges)
        for name, value in (given or {}).items():
            if not np.isfinite(value).all():
                raise ValueError(f"{name}: expected finite numbers, got one that is not.")
            low, high = ranges.get(name, (np.inf, -np.inf))
            ranges[name] = (min(low, float(value.min())), max(high, float(value.max())))
        which = (inputs, *sorted(ranges.items()))
        if which not in self._scenes:
            self._scenes[which] = self._make_scene(inputs, ranges)
        return self._scenes[which]

    def _make_scene(self, inputs: tuple[str, ...], ranges: Mapping[str, tuple[float, float]]) -> SimScene:
        drawn = {name: Distribution(uniform=ends) for name, ends in ranges.items() if name not in START}
        fields = {name: getattr(self.platform, name) for name in SimPlatform.model_fields}
        platform = SimPlatform(**{**fields, "precision": "single", "set": {**self.platform.set, **drawn}})
        return sim_scene(platform, self.arena, inputs, 0.0)


@dataclass(frozen=True)
class _Work:
    """Trials in the form that the kernel reads."""

    scene: SimScene
    own: SimScene  # with the numbers as the platform has them, where no set says otherwise
    play: Play
    given: Mapping[str, NDArray[np.float64]]  # (m, k) or (m, 1) of each number
    neat: NeatRules
    bias_value: float
    networks: Networks
    key: int
    keep: tuple[str, ...]
    same_noise: bool

    @property
    def bytes_of_trial(self) -> int:
        sizes = {"poses": 12, "readings": 4 * self._n_sensors, "stalled": 1, "wheels": 8, "commands": 8}
        kept = (self.play.n_steps + 1) * sum(sizes[name] for name in self.keep)
        return kept + 4 * self.scene.shape.n_rows + self.scene.arena.grid.n_cells

    @property
    def _n_sensors(self) -> int:
        return int(self.scene.shape.row_range.size)

    def carry_out(self, robots: NDArray[np.int64], finely: Finely) -> Rehearsal:
        """Run the trials of some of the robots."""
        scene, play = self.scene, self.play
        shape = scene.shape._replace(substeps=finely[0], late_substeps=finely[1])
        m, k = len(robots), len(play.starts)
        counters = self._counters(robots)
        kept = self._room_for(m * k)
        rehearse(
            shape,
            self._table(robots, counters),
            sim_rules(scene, self.bias_value)._replace(n_steps=play.n_steps),
            self.neat,
            self.networks,
            np.tile(np.arange(k if play.genomes else 1, dtype=np.int32), m if play.genomes else m * k),
            self._commands,
            np.tile(np.arange(k, dtype=np.int32), m),
            self._anchors,
            np.uint64(self.key),
            counters,
            make_sim_room(shape, self.neat, self.networks.place.shape[1], np.float32),
            kept,
        )
        return self._named(kept, m, k)

    def _counters(self, robots: NDArray[np.int64]) -> NDArray[np.uint32]:
        k = len(self.play.starts)
        counters = np.zeros((len(robots) * k, 3), np.uint32)
        counters[:, 0] = np.tile(np.arange(k) << 8 | int(PURPOSE_NOISE), len(robots))
        counters[:, 2] = 0 if self.same_noise else np.repeat(robots, k)
        return counters

    def _table(self, robots: NDArray[np.int64], counters: NDArray[np.uint32]) -> NDArray[np.float32]:
        """Return the numbers of the trials of some robots, a column for each trial, (p, n)."""
        k, rows = len(self.play.starts), self.scene.rows
        table = np.repeat(self._column, len(counters), axis=1)
        drawn = dict(zip(self._draws.names, self._draws.draw(self.key, counters).T, strict=True))
        starts = {
            name: np.tile(start, len(robots)) for name, start in zip(START, self.play.starts.T, strict=True)
        }
        values = {**drawn, **starts}
        table[[rows[name] for name in values]] = self.scene.rows_of(values)
        for names, numbers in self._given_rows:
            repeats = k // numbers.shape[2]
            table[[rows[name] for name in names]] = np.repeat(numbers[:, robots], repeats, axis=2).reshape(
                len(names), -1
            )
        return table

    @cached_property
    def _given_rows(self) -> list[tuple[tuple[str, ...], NDArray[np.float32]]]:
        """Names and (d, m, 1) or (d, m, k) numbers, as the table has them."""
        shapes = {value.shape for value in self.given.values()}
        by_shape = [[name for name, value in self.given.items() if value.shape == shape] for shape in shapes]
        return [
            (tuple(names), self.scene.rows_of({name: self.given[name] for name in names}).astype(np.float32))
            for names in by_shape
        ]

    @cached_property
    def _draws(self) -> Draws:
        """Return the numbers that the platform samples for each trial, if no set gives them."""
        own = {name: value for name, value in self.own.numbers.items() if name in self.scene.rows}
        return Draws({name: value for name, value in own.items() if name not in self.given})

    @cached_property
    def _column(self) -> NDArray[np.float32]:
        """Return the numbers of a trial without drawn or given ones, (p, 1)."""
        fixed = {name: value for name, value in self.own.fixed.items() if name in self.scene.rows}
        column = self.scene.table({**self.scene.fixed, **fixed})
        return column.astype(np.float32, copy=False)

    @cached_property
    def _commands(self) -> NDArray[np.float32]:
        return np.ascontiguousarray(self.play.commands.transpose(1, 2, 0), np.float32)

    @cached_property
    def _anchors(self) -> NDArray[np.float32]:
        anchors = (self.play.anchors - [*self.scene.origin, 0.0]) / [1.0, 1.0, 2 * np.pi]
        return np.ascontiguousarray(anchors.transpose(1, 2, 0), np.float32)

    def _room_for(self, n: int) -> Rehearsed:
        rows = {name: self.play.n_steps + 1 if name in self.keep else 0 for name in KEPT}
        return Rehearsed(
            np.empty((rows["poses"], 3, n), np.float32),
            np.empty((rows["readings"], self._n_sensors, n), np.float32),
            np.empty((rows["stalled"], n), np.bool_),
            np.empty((rows["wheels"], 2, n), np.float32),
            np.empty((max(rows["commands"] - 1, 0), 2, n), np.float32),
            np.empty((n, self.scene.arena.grid.n_cells), np.bool_),
        )

    def _named(self, kept: Rehearsed, m: int, k: int) -> Rehearsal:
        def steps(array: NDArray[np.float32]) -> NDArray[np.float32]:
            return np.moveaxis(array.reshape(*array.shape[:-1], m, k), (-2, -1), (0, 1))

        kept.poses[:, :2] += np.array(self.scene.origin, np.float32)[:, None]
        kept.poses[:, 2] *= np.float32(2 * np.pi)
        stalled = np.moveaxis(kept.stalled.reshape(len(kept.stalled), m, k), (-2, -1), (0, 1))
        return Rehearsal(
            steps(kept.poses),
            steps(kept.readings),
            stalled,
            steps(kept.wheels),
            steps(kept.commands),
            kept.cells.reshape(m, k, -1),
        )


def _in_columns(values: Values, k: int) -> dict[str, NDArray[np.float64]]:
    """Return each number as (m, 1) or (m, k).

    Raises:
        ValueError: They are of several lengths, or of other trials.
    """
    given = {name: np.asarray(value, np.float64) for name, value in values.items()}
    given = {name: value[:, None] if value.ndim == 1 else value for name, value in given.items()}
    m = len(next(iter(given.values()), ()))
    for name, value in given.items():
        if value.ndim != 2 or len(value) != m or value.shape[1] not in (1, k):
            raise ValueError(
                f"{name} has shape {np.shape(values[name])}, expected ({m},) or ({m}, {k}): a number for each set, "
                "or for each trial of each."
            )
    return given


def _as_it_is(rehearsal: Rehearsal) -> Rehearsal:
    return rehearsal


def _n_robots(values: Values) -> int:
    """Return the number of sets of numbers; one robot as it is if there are none."""
    return next((len(np.asarray(value)) for value in values.values()), 1)


def _in_order(parts: Iterable[tuple[NDArray[np.int64], NDArray[F]]], m: int) -> NDArray[F]:
    """Return consecutive rows of some robots in the order of all robots, (m, ...)."""
    rows: NDArray[F] | None = None
    for robots, part in parts:
        if rows is None:
            rows = np.empty((m, *part.shape[1:]), part.dtype)
        rows[robots] = part
    if rows is None:
        raise ValueError("Got no set of numbers, expected at least one.")
    return rows


def _gathered(parts: Sequence[tuple[NDArray[np.int64], Rehearsal]]) -> Rehearsal:
    """Return all robots in order."""
    if len(parts) == 1:
        return parts[0][1]
    m = sum(len(robots) for robots, _ in parts)
    names = ("poses", "readings", "stalled", "wheels", "commands", "cells")
    return Rehearsal(
        *(_in_order(((robots, getattr(part, name)) for robots, part in parts), m) for name in names)
    )
