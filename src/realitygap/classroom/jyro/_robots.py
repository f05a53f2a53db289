"""Jyro's robots: Scribbler, Pioneer, Blimp, Puck."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from realitygap.drawing import Ink, Shape
from realitygap.world.jyro_stock import ROBOT_BODIES

from ._robot import SceneRobot

_Corners = list[tuple[float, float]]


class _StockRobot(SceneRobot):
    """A robot with a fixed body."""

    body_name: str

    def __init__(
        self,
        x: float,
        y: float,
        heading: float = 0.0,
        *,
        name: str | None = None,
        color: str = "red",
        segments: Sequence[Sequence[float]] = (),
        brain: Callable[[Any], object] | None = None,
    ) -> None:
        box = ROBOT_BODIES[self.body_name]
        body = list(zip(box["x"], box["y"], strict=True))
        super().__init__(x, y, heading, name=name, color=color, body=body, segments=segments, brain=brain)


class Scribbler(_StockRobot):
    """A box of 0.18 x 0.16 m, drawn with a rounded outline."""

    kind = "scribbler"
    body_name = "Scribbler"

    def outlines(self) -> list[Shape]:
        """Return the rounded outline, and two wheels."""
        shapes: list[Shape] = [self.polygon(_SCRIBBLER, self.color)]
        for left in (0.075, -0.075):
            wheel = [(0.04, left + 0.005), (0.04, left - 0.005), (-0.04, left - 0.005), (-0.04, left + 0.005)]
            shapes.append(self.polygon(wheel, "black"))
        return shapes


class Pioneer(_StockRobot):
    """A box of 0.45 x 0.35 m; it is drawn white while it is stalled."""

    kind = "pioneer"
    body_name = "Pioneer"

    def outlines(self) -> list[Shape]:
        """Return an octagon."""
        return [self.polygon(_PIONEER, "white" if self.stalled else self.color)]


class Blimp(_StockRobot):
    """A disc of 0.44 m without a body: it collides with nothing, and no robot sees it."""

    kind = "blimp"
    body_name = "Blimp"
    radius = 0.44

    def outlines(self) -> list[Shape]:
        """Return the disc."""
        return [self.polygon(_circle(self.radius), self.color, "#0000ff")]


class Puck(SceneRobot):
    """A disc of 0.05 m, without a body unless one is given. Nothing pushes it; a gripper can store it.

    Source: Jyro 0.3.2. There too, its friction has no effect.
    """

    kind = "puck"
    radius = 0.05

    def outlines(self) -> list[Shape]:
        """Return the disc, and the body if it has one."""
        shapes: list[Shape] = [self.polygon(_circle(self.radius), self.color)]
        if self.body:
            shapes.append(_without_fill(self))
        return shapes


def _without_fill(robot: SceneRobot) -> Shape:
    from dataclasses import replace

    return replace(robot.polygon(robot.body, robot.color, Ink.MUTED), fill=None)


def _circle(radius: float, n: int = 40) -> _Corners:
    angles = [2 * math.pi * k / n for k in range(n)]
    return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]


_SCRIBBLER: _Corners = [
    (0.05, 0.06), (0.05, 0.08), (0.07, 0.07), (0.07, 0.06), (0.09, 0.06), (0.09, -0.06), (0.07, -0.06),
    (0.07, -0.07), (0.05, -0.08), (0.05, -0.06), (-0.05, -0.06), (-0.05, -0.08), (-0.07, -0.07), (-0.08, -0.06),
    (-0.09, -0.05), (-0.09, 0.05), (-0.08, 0.06), (-0.07, 0.07), (-0.05, 0.08), (-0.05, 0.06),
]  # fmt: skip
_PIONEER: _Corners = [
    (0.225, 0.08), (0.15, 0.175), (-0.15, 0.175), (-0.225, 0.08),
    (-0.225, -0.08), (-0.15, -0.175), (0.15, -0.175), (0.225, -0.08),
]  # fmt: skip
