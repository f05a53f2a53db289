"""Outlines with rounded corners, of which bodies and obstacles are made, and plain bodies and range sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

from pydantic import Field, model_validator

from realitygap.errors import check_finite
from realitygap.settings import Settings, shown

from ._described import NotNegative, Number

Points = tuple[tuple[float, float], ...]

MOST_CORNERS = 64  # of one part: what a drawing program makes of a circle
STRAIGHT = (
    1e-12  # a corner that turns right by less than this [m2] counts as straight: rounding of its coordinates
)


class Corner(Settings):
    """A corner of an outline."""

    x: Number = Field(description="Distance ahead of the origin [m].")
    y: Number = Field(description="Distance to the left of the origin [m].")


class Part(Settings):
    """A convex polygon whose corners are grown by a radius; with one corner it is a disc.

    Raises:
        ValueError: It is not convex, its corners do not go counter-clockwise, or it has no size.
    """

    corner: tuple[Corner, ...] = Field(
        (Corner(x=0.0, y=0.0),),
        min_length=1,
        max_length=MOST_CORNERS,
        description="Corners [x, y] in counter-clockwise order, before they are grown: one for a disc, two for a bar "
        "with round ends. A file may give the outer size box = [length, width] instead.",
    )
    radius: NotNegative = Field(
        0.0, description="Radius by which it is grown to all sides, which rounds its corners [m]."
    )

    @model_validator(mode="before")
    @classmethod
    def _from_box(cls, values: Any) -> Any:
        return box_as_corners(values)

    @model_validator(mode="after")
    def _is_convex(self) -> Self:
        problem = why_no_part(self.corners, self.radius)
        if problem:
            raise ValueError(problem)
        return self

    @property
    def corners(self) -> Points:
        """Corners x, y before they are grown, (c, 2) [m]."""
        return tuple((corner.x, corner.y) for corner in self.corner)

    def outline(self, *, step: float = math.pi / 16) -> Points:
        """Return points around it, counter-clockwise, (p, 2) [m]. Rounded corners become short lines.

        Args:
            step: Largest angle between two points of a rounded corner [rad].
        """
        return rounded(self.corners, self.radius, step=step)


def box_as_corners(values: Any) -> Any:
    """Return values in which corners replace `box`, an outer length and width from which the radius is subtracted."""
    if not isinstance(values, dict) or "box" not in values:
        return values
    rest = {key: value for key, value in values.items() if key != "box"}
    if "corner" in values:
        raise ValueError("expected box or corner, got both")
    box, radius = values["box"], values.get("radius", 0.0)
    sizes = [size for size in box if type(size) in (int, float)] if isinstance(box, list | tuple) else []
    if len(sizes) != 2 or len(box) != 2:
        raise ValueError(f"expected box = [length, width], got {shown(box)}")
    if not isinstance(radius, int | float):
        return rest  # what is wrong with it is said by its own field
    across, up = sizes[0] / 2 - radius, sizes[1] / 2 - radius
    if not (across >= 0 and up >= 0 and max(sizes) > 0) or not math.isfinite(across + up):
        raise ValueError(
            f"expected box = [length, width] of finite sizes, each at least twice the radius, {radius:g}, got "
            f"{shown(box)}"
        )
    corners = dict.fromkeys([(across, up), (-across, up), (-across, -up), (across, -up)])  # a side may be 0
    return rest | {"corner": [{"x": x, "y": y} for x, y in corners]}


def why_no_part(corners: Sequence[tuple[float, float]], radius: float) -> str:
    """Describe the mistake in an outline; return an empty text if it is convex, counter-clockwise, and of some size."""
    n = len(corners)
    if n < 3:
        if radius > 0 and (n == 1 or corners[0] != corners[1]):
            return ""
        return (
            f"expected a radius of more than 0 for {n} corner{'s' if n > 1 else ''} that differ, got "
            f"{radius:g}"
        )
    edges = [(b[0] - a[0], b[1] - a[1]) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    for k, edge in enumerate(edges):
        if edge == (0.0, 0.0):
            return f"corners {k} and {(k + 1) % n} are the same; leave one out"
    turns = [a[0] * b[1] - a[1] * b[0] for a, b in zip(edges, [*edges[1:], edges[0]], strict=True)]
    area = (
        sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)) / 2
    )
    if area < 0 and all(turn <= STRAIGHT for turn in turns):
        return "its corners go clockwise; give them counter-clockwise"
    bent = [k for k, turn in enumerate(turns) if turn < -STRAIGHT]
    if bent:
        x, y = corners[(bent[0] + 1) % n]
        inwards = f"corner {(bent[0] + 1) % n}, at ({x:g}, {y:g}), points inwards"
        return f"it is not convex: {inwards}. Make it of several convex parts"
    angles = [math.atan2(turn, a[0] * b[0] + a[1] * b[1])
              for turn, a, b in zip(turns, edges, [*edges[1:], edges[0]], strict=True)]  # fmt: skip
    if not math.isclose(sum(angles), 2 * math.pi, abs_tol=1e-3) or area <= 0:
        return "it is no outline: its corners do not go round once. Give them in order, counter-clockwise"
    return ""


def rounded(corners: Sequence[tuple[float, float]], radius: float, *, step: float = math.pi / 16) -> Points:
    """Return points around a convex outline grown by a radius, counter-clockwise, (p, 2) [m]."""
    if not radius:
        return tuple(corners)
    n = len(corners)
    points: list[tuple[float, float]] = []
    for k, (x, y) in enumerate(corners):
        first, last = 0.0, 2 * math.pi
        if n > 1:
            before, after = corners[k - 1], corners[(k + 1) % n]
            first = math.atan2(y - before[1], x - before[0]) - math.pi / 2
            last = math.atan2(after[1] - y, after[0] - x) - math.pi / 2
            last = first + (last - first) % (2 * math.pi)
        pieces = max(1, math.ceil((last - first) / step))
        points += [
            (x + radius * math.cos(first + (last - first) * j / pieces),
             y + radius * math.sin(first + (last - first) * j / pieces))
            for j in range(pieces + (n > 1))
        ]  # fmt: skip
    return tuple(points)


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


# Jyro's robot: forward +-0.09 m, left +-0.08 m.
JYRO_SCRIBBLER = Body(((0.09, 0.08), (0.09, -0.08), (-0.09, -0.08), (-0.09, 0.08)))
