"""Devices with a reading for each of several mounts on the robot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._robot import Device


class MountedSensors(Device):
    """Sensors of one kind that are read together.

    Args:
        mounts: (s, 3) forward [m], left [m] and direction [rad, positive to the left] of each on the robot.
        max_range: Maximum range [m].
        groups: Names of groups of sensors.

    Attributes:
        mounts: (s, 3) mounts of the sensors.
        max_range: Largest range [m].
        groups: Indices of the sensors of each group, by name.
    """

    def __init__(
        self,
        mounts: Sequence[Sequence[float]],
        max_range: float,
        groups: Mapping[str, Sequence[int]] | None,
    ) -> None:
        super().__init__()
        self.mounts = _checked(mounts)
        if not (math.isfinite(max_range) and max_range > 0):
            raise ValueError(f"max_range is {max_range!r}, expected a length above 0 [m].")
        self.max_range = float(max_range)
        self.groups = {name: tuple(which) for name, which in (groups or {}).items()}
        self._readings = np.zeros(len(self.mounts))

    def __len__(self) -> int:
        return len(self.mounts)

    @property
    def readings(self) -> NDArray[np.float64]:
        """Readings in the order of the mounts, (s,); a copy."""
        return self._readings.copy()

    def group(self, name: str) -> NDArray[np.float64]:
        """Return the readings of a group of sensors. They are empty if the group is.

        Raises:
            KeyError: There is no such group.
        """
        if name not in self.groups:
            raise KeyError(f"No group {name!r}; there are: {', '.join(sorted(self.groups)) or 'none'}.")
        return self._readings[list(self.groups[name])]

    def to_dict(self) -> dict[str, Any]:
        """Return mounts, range, groups and readings, as plain values."""
        return super().to_dict() | {
            "mounts": self.mounts.tolist(),
            "max_range": self.max_range,
            "groups": {name: list(which) for name, which in self.groups.items()},
            "readings": self._readings.tolist(),
        }


def _checked(mounts: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    try:
        rows = np.array([tuple(mount) for mount in mounts], np.float64)
    except (TypeError, ValueError):
        rows = np.empty(0)
    if rows.ndim != 2 or rows.shape[1] != 3 or not np.isfinite(rows).all():
        raise ValueError(
            f"The mounts are {mounts!r}, expected for each sensor three numbers: forward [m], left [m], direction "
            "[rad]."
        )
    return rows
