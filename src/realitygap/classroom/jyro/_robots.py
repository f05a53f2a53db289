"""Jyro's robots: Scribbler, Pioneer, Blimp, Puck."""

from __future__ import annotations

import math
from dataclasses import replace

from realitygap.drawing import Ink, Shape
from realitygap.world.jyro_stock import ROBOT_BODIES

from ._robot import SceneRobot

_Corners = list[tuple[float, float]]


def _body_of(name: str) -> _Corners:
    box = ROBOT_BODIES[name]
    return list(zip(box["x"], box["y"], strict=True))


class Scribbler(SceneRobot):
    """A box of 0.18 x 0.16 m, drawn with a rounded outline."""

    kind = "scribbler"
    kind_body = _body_of("Scribbler")

    def outlines(self) -> list[Shape]:
        """Return the rounded outline, and two wheels."""
        shapes: list[Shape] = [self.polygon(_SCRIBBLER, self.color)]
        for left in (0.075, -0.075):
            wheel = [(0.04, left + 0.005), (0.04, left - 0.005), (-0.04, left - 0.005), (-0.04, left + 0.005)]
            shapes.append(self.polygon(wheel, "black"))
        return shapes


class Pioneer(SceneRobot):
    """A box of 0.45 x 0.35 m; it is drawn white while it is stalled."""

    kind = "pioneer"
    kind_body = _body_of("Pioneer")

    def outlines(self) -> list[Shape]:
        """Return an octagon."""
        return [self.polygon(_PIONEER, "white" if self.stalled else self.color)]


class Blimp(SceneRobot):
    """A disc of 0.44 m without a body: it collides with nothing, and no robot sees it."""

    kind = "blimp"
    kind_body = _body_of("Blimp")
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
            shapes.append(replace(self.polygon(self.body, self.color, Ink.MUTED), fill=None))
        return shapes


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
