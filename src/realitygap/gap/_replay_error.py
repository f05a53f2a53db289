"""The divergence over time between an open-loop replay in simulation and the target."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.stats import Estimate, mean_interval

from ._side import Values


@dataclass(frozen=True)
class ReplayError:
    """Error between the same commands from the same start on both sides, in m trials of t steps.

    Attributes:
        distance: (m, t + 1) between the target's robot and the simulated one after each step [m].
        heading: (m, t + 1) between their headings [rad, 0..pi].
        noise_distance: (m, t + 1) between two replays in simulation, which noise alone drives apart [m].
        noise_heading: (m, t + 1) error of the heading between replays with other noise [rad].
        controllers: (m,) index of each trial's controller.
    """

    distance: Values
    heading: Values
    noise_distance: Values
    noise_heading: Values
    controllers: NDArray[np.int64]

    @property
    def n(self) -> int:
        """Trials."""
        return len(self.distance)

    @property
    def at_end(self) -> Estimate:
        """Mean distance at the end of a trial [m], over controllers."""
        return self._mean(self.distance[:, -1], np.inf)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: after each step, the mean over controllers with its interval."""
        values: dict[str, Any] = {"trials": self.n, "n": len(np.unique(self.controllers))}
        for name in ("distance", "heading", "noise_distance", "noise_heading"):
            most = np.pi if "heading" in name else np.inf
            estimates = [self._mean(step, most) for step in getattr(self, name).T]
            values[name] = {
                name: [getattr(step, end) for step in estimates]
                for name, end in (("estimate", "value"), ("low", "low"), ("high", "high"))
            }
        return values

    def _mean(self, values: Values, most: float) -> Estimate:
        """Return the mean of (m,) values from 0 to `most`; trials of one controller count as one."""
        _, which, n = np.unique(self.controllers, return_inverse=True, return_counts=True)
        return mean_interval(np.bincount(which, values) / n, (0.0, most))


def replay_error(
    observed: Values, replayed: Values, controllers: NDArray[np.int64] | None = None
) -> ReplayError:
    """Compare poses of the target with those of its commands replayed in simulation.

    Args:
        observed: (m, t + 1, 3) x [m], y [m], heading [rad] on the target.
        replayed: (k, m, t + 1, 3) poses of k replays, each with its own noise; k is at least 2.
        controllers: (m,) index of each trial's controller. Default: each trial has another controller.

    Returns:
        The mean over replays. Of the noise: between each replay and the next.

    Raises:
        ValueError: Shapes do not fit, or there is one replay.
    """
    if observed.ndim != 3 or replayed.ndim != 4 or replayed.shape[1:] != observed.shape:
        raise ValueError(
            f"observed has shape {observed.shape} and replayed {replayed.shape}, expected (m, t + 1, 3) and "
            "(k, m, t + 1, 3)."
        )
    if len(replayed) < 2:
        raise ValueError("There is one replay, expected at least 2 to measure their noise.")
    distance, heading = _apart(observed[None], replayed)
    noise_distance, noise_heading = _apart(replayed, np.roll(replayed, 1, axis=0))
    return ReplayError(
        distance.mean(axis=0),
        heading.mean(axis=0),
        noise_distance.mean(axis=0),
        noise_heading.mean(axis=0),
        np.arange(len(observed)) if controllers is None else controllers,
    )


def _apart(one: Values, other: Values) -> tuple[Values, Values]:
    distance = np.hypot(*np.moveaxis(one[..., :2] - other[..., :2], -1, 0))
    turned = (one[..., 2] - other[..., 2] + np.pi) % (2 * np.pi) - np.pi
    return distance, np.abs(turned)
