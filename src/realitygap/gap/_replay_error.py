"""How far an open-loop replay in simulation comes away from what the target did, over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._side import Values


@dataclass(frozen=True)
class ReplayError:
    """The same commands from the same start on both sides, m trials of t steps.

    Attributes:
        distance: (m, t + 1) between the target's robot and the simulated one after each step [m].
        heading: (m, t + 1) between their headings [rad, 0..pi].
        noise_distance: (m, t + 1) between two replays in simulation, which noise alone drives apart [m].
        noise_heading: (m, t + 1) likewise [rad].
    """

    distance: Values
    heading: Values
    noise_distance: Values
    noise_heading: Values

    @property
    def n(self) -> int:
        """Trials."""
        return len(self.distance)


def replay_error(observed: Values, replayed: Values) -> ReplayError:
    """Set poses of the target beside those of its commands replayed in simulation.

    Args:
        observed: (m, t + 1, 3) x [m], y [m], heading [rad] on the target.
        replayed: (k, m, t + 1, 3) of k replays with noise of their own, k at least 2.

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
        raise ValueError("There is one replay, expected at least 2: noise shows between them.")
    distance, heading = _apart(observed[None], replayed)
    noise_distance, noise_heading = _apart(replayed, np.roll(replayed, 1, axis=0))
    return ReplayError(*(each.mean(axis=0) for each in (distance, heading, noise_distance, noise_heading)))


def _apart(one: Values, other: Values) -> tuple[Values, Values]:
    distance = np.hypot(*np.moveaxis(one[..., :2] - other[..., :2], -1, 0))
    turned = (one[..., 2] - other[..., 2] + np.pi) % (2 * np.pi) - np.pi
    return distance, np.abs(turned)
