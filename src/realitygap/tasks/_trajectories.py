"""The steps of many trials as arrays, for the scores of tasks and for films."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.world import Arena


class TraceArrays(NamedTuple):
    """The arrays that kernels save of n trials of t steps, in the precision of the trials; row 0 is the start.

    A compiled task reads these: nothing is converted or copied for it.
    """

    poses: NDArray[
        np.floating
    ]  # (t + 1, 3, n) x, y [m] from the start, heading [turns, counter-clockwise from +x]
    readings: NDArray[
        np.floating
    ]  # (t + 1, s, n) 0..1, 1: as near, bright or dark as can be told; without noise
    inputs: NDArray[np.floating]  # (t, i, n) what the networks saw
    commands: NDArray[np.floating]  # (t, 2, n) move and turn, -1..1
    stalled: NDArray[np.bool_]  # (t + 1, n)
    wheels: NDArray[np.floating]  # (t + 1, 2, n) way of the left and the right wheel since the start [m]


@dataclass(frozen=True)
class Trajectories:
    """n trials of t steps in one arena.

    All arrays are made when they are first asked for, in meters and radians, trials first; row 0 of a trial is its
    start.

    Attributes:
        arena: Arena of the trials.
        step_s: Duration of a step [s].
        arrays: Arrays as the kernels store them.
        sensors: (s,) names of the readings, such as `range.0`, `light.1`.
        network_inputs: (i,) names of what the networks saw.
        coverage_line, coverage_ends: (n,) visited share of the reachable cells, 0..1.
        n_stalls: (n,) blocked steps.
        drawn: (n,) numbers that were drawn for each trial, by dotted name. `arena` has their centers.
    """

    arena: Arena
    step_s: float
    arrays: TraceArrays
    sensors: tuple[str, ...]
    network_inputs: tuple[str, ...]
    coverage_line: NDArray[np.float64]
    coverage_ends: NDArray[np.float64]
    n_stalls: NDArray[np.int32]
    drawn: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    def __len__(self) -> int:
        """Return the number of trials."""
        return int(self.arrays.stalled.shape[1])

    def number(self, name: str, value: float) -> NDArray[np.float64]:
        """Return a number of each trial, (n,): the drawn number, or the value if it is not drawn."""
        return self.drawn[name] if name in self.drawn else np.full(len(self), float(value))

    @property
    def n_steps(self) -> int:
        """Steps of each trial."""
        return int(self.arrays.commands.shape[0])

    @cached_property
    def poses(self) -> NDArray[np.float64]:
        """Poses x [m], y [m], heading [rad, 0 to 2 pi, counter-clockwise from +x], (n, t + 1, 3)."""
        start = self.arena.start
        poses = _trials_first(self.arrays.poses) * [1.0, 1.0, math.tau] + [start.x, start.y, 0.0]
        poses[..., 2] %= math.tau
        return poses

    @cached_property
    def readings(self) -> NDArray[np.float64]:
        """Readings of sensors, 0 (nothing) to 1 (nearest, brightest, or darkest), (n, t + 1, s).

        With their noise on `sim`, without it on `jyro`.
        """
        return _trials_first(self.arrays.readings)

    @cached_property
    def inputs(self) -> NDArray[np.float64]:
        """Inputs of the networks, (n, t, i)."""
        return _trials_first(self.arrays.inputs)

    @cached_property
    def commands(self) -> NDArray[np.float64]:
        """Commands of the networks, move and turn, -1..1, (n, t, 2)."""
        return _trials_first(self.arrays.commands)

    @cached_property
    def stalled(self) -> NDArray[np.bool_]:
        """True if the step was blocked, (n, t + 1)."""
        return np.ascontiguousarray(self.arrays.stalled.T)

    @cached_property
    def wheels(self) -> NDArray[np.float64]:
        """Distances of the left and the right wheel since the start [m], (n, t + 1, 2).

        Raises:
            ValueError: The platform has no wheels, as `jyro`, which moves and turns as a whole.
        """
        if self.arrays.wheels.shape[0] == 0:
            raise ValueError(
                "These trials are of a robot without wheels (platform 'jyro' moves and turns as a whole): look at "
                "`commands` or `poses`, or use platform 'sim'."
            )
        return _trials_first(self.arrays.wheels)

    def readings_of(self, kind: str) -> NDArray[np.float64]:
        """Return the readings of the k sensors of a kind: range, light, line or bump, (n, t + 1, k).

        Raises:
            ValueError: The robot has none of this kind.
        """
        columns = [k for k, name in enumerate(self.sensors) if name.partition(".")[0] == kind]
        if not columns:
            kinds = sorted({name.partition(".")[0] for name in self.sensors})
            raise ValueError(f"The robot has no sensors of kind {kind!r}, it has {', '.join(kinds)}.")
        return self.readings[..., columns]

    @property
    def light(self) -> NDArray[np.float64]:
        """Readings of the light sensors, 0..1, (n, t + 1, k)."""
        return self.readings_of("light")


def _trials_first(array: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return an array of kernels (t, k, n) as (n, t, k)."""
    return np.ascontiguousarray(array.transpose(2, 0, 1), np.float64)
