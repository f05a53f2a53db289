"""Divergence of the same controller's trials on two platforms, step by step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Posed(Protocol):
    """A trial of which the poses are known, such as a `Trajectory` or a `MovingTrial`."""

    @property
    def poses(self) -> NDArray[np.float64]:
        """Poses x [m], y [m], heading [rad], (t + 1, 3); row 0 is the start."""


@dataclass(frozen=True)
class Divergence:
    """The divergence of n pairs of trials after each of t steps; row 0 is the start.

    Attributes:
        distance: (n, t + 1) between the two robots [m].
        heading: (n, t + 1) difference of their headings, the shorter angle [rad, 0 to pi].
    """

    distance: NDArray[np.float64]
    heading: NDArray[np.float64]

    @property
    def n_pairs(self) -> int:
        """Number of pairs of trials."""
        return len(self.distance)

    @property
    def n_steps(self) -> int:
        """Number of steps that all trials have."""
        return int(self.distance.shape[1]) - 1


def measure_divergence(first: Sequence[Posed], second: Sequence[Posed]) -> Divergence:
    """Measure the divergence of each trial of `first` from its counterpart in `second`, after each step that all have.

    A step is one command on every platform, whatever time it lasts there, so trials are compared by steps.

    Args:
        first: n trials.
        second: n trials, in the order of `first`.

    Raises:
        ValueError: There is none, or their numbers differ.
    """
    if not first or len(first) != len(second):
        raise ValueError(
            f"There are {len(first)} trials beside {len(second)}, expected as many of both, and at least one."
        )
    n_rows = min(len(trial.poses) for trial in (*first, *second))
    poses = [np.array([trial.poses[:n_rows] for trial in trials]) for trials in (first, second)]
    apart = poses[1] - poses[0]
    turned = np.abs(apart[..., 2] - math.tau * np.rint(apart[..., 2] / math.tau))
    return Divergence(np.hypot(apart[..., 0], apart[..., 1]), turned)


def own_divergence(trials: Sequence[Posed]) -> Divergence:
    """Measure the divergence of repeats on one platform: each from the next, the last from the first.

    It is what noise alone does, to which the divergence of two platforms has to be compared.

    Raises:
        ValueError: There are fewer than two.
    """
    if len(trials) < 2:
        raise ValueError(
            f"There is {len(trials)} trial, expected two or more: one alone is not apart from itself."
        )
    return measure_divergence(trials, [*trials[1:], trials[0]])
