"""The robot's shape and its sensors."""

from __future__ import annotations

from dataclasses import dataclass

from realitygap.errors import check_finite


@dataclass(frozen=True)
class Body:
    """An outline that can collide.

    Attributes:
        corners: (b, 2) forward and left of the center [m], in order around the outline.
    """

    corners: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        """Raise a ValueError if a number is infinite or NaN."""
        check_finite(vars(self))


@dataclass(frozen=True)
class RangeSensors:
    """Thin rays that measure the distance to the nearest wall.

    Attributes:
        mounts: (s, 3) forward [m], left [m] of the center and direction [rad, positive to the left].
        max_range: Reading if nothing is nearer [m].
    """

    mounts: tuple[tuple[float, float, float], ...]
    max_range: float

    def __post_init__(self) -> None:
        """Raise a ValueError if a number is infinite or NaN."""
        check_finite(vars(self))


# Jyro's Scribbler: forward +-0.09 m, left +-0.08 m.
JYRO_SCRIBBLER = Body(((0.09, 0.08), (0.09, -0.08), (-0.09, -0.08), (-0.09, 0.08)))
