"""What stands around an emulated robot: an arena, and lamps and dark tape that its other sensors see."""

from __future__ import annotations

import math
from dataclasses import dataclass

from realitygap.world import Arena, paper_arena

TAPE_WIDTH = 0.019  # of a line on the floor [m]: the usual 3/4 in


@dataclass(frozen=True)
class Lamp:
    """A light that shines from a point to all sides, through walls.

    Attributes:
        x, y: Where [m].
        strength: Its share of the light in the room, at a distance of 1 m.
    """

    x: float
    y: float
    strength: float = 1.0


@dataclass(frozen=True)
class Scene:
    """An arena with what else the sensors see.

    Attributes:
        arena: Walls, grid of cells and start.
        lamps: Lights besides the room's own, which is the same everywhere.
        tape: Dark lines on the floor, x1, y1, x2, y2 of each [m].
    """

    arena: Arena
    lamps: tuple[Lamp, ...] = ()
    tape: tuple[tuple[float, float, float, float], ...] = ()

    def is_dark(self, x: float, y: float) -> bool:
        """Whether a point of the floor [m] lies on tape."""
        return any(_distance(x, y, line) <= TAPE_WIDTH / 2 for line in self.tape)

    def light(self, x: float, y: float, direction: float) -> float:
        """The light that a sensor sees which looks from (x, y) [m] in a direction [rad]; the room's own is 1."""
        total = 1.0
        for lamp in self.lamps:
            to_x, to_y = lamp.x - x, lamp.y - y
            far = max(0.05, math.hypot(to_x, to_y))
            facing = (to_x * math.cos(direction) + to_y * math.sin(direction)) / far
            total += lamp.strength * max(0.0, facing) ** 2 / far**2
        return total


def paper_scene() -> Scene:
    """The paper's arena and nothing else."""
    return Scene(paper_arena())


def _distance(x: float, y: float, line: tuple[float, float, float, float]) -> float:
    """From a point to a straight line with two ends."""
    x1, y1, x2, y2 = line
    along_x, along_y = x2 - x1, y2 - y1
    squared = along_x**2 + along_y**2
    share = 0.0 if not squared else ((x - x1) * along_x + (y - y1) * along_y) / squared
    share = min(1.0, max(0.0, share))
    return math.hypot(x - x1 - share * along_x, y - y1 - share * along_y)
