"""The surroundings of an emulated robot, as its sensors see them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from realitygap.emulator import open_arena
from realitygap.world import Arena, paper_arena

DARK = 0.5  # a floor less bright than this is dark to a line sensor: 0 is black, 1 white
NEAREST = 0.05  # a light counts as no nearer than this [m]


@dataclass(frozen=True)
class Scene:
    """An arena as the sensors see it.

    Its lights shine to all sides and through walls, besides the room's own light, which is the same everywhere; their
    strength is a share of it, at a distance of 1 m.

    Attributes:
        arena: Walls, obstacles, lights, floor, grid of cells and start.
    """

    arena: Arena

    def is_dark(self, x: float, y: float) -> bool:
        """Return whether a point of the floor [m] is dark."""
        return self.arena.floor.brightness(x, y) < DARK

    def light(self, x: float, y: float, direction: float) -> float:
        """Return the light that a sensor sees which looks from (x, y) [m] in a direction [rad]; the room's own is 1."""
        total = 1.0
        for lamp in self.arena.lights:
            to_x, to_y = lamp.x - x, lamp.y - y
            far = max(NEAREST, math.hypot(to_x, to_y))
            facing = (to_x * math.cos(direction) + to_y * math.sin(direction)) / far
            total += lamp.strength * max(0.0, facing) ** 2 / far**2
        return total


def open_scene(name: str) -> Scene:
    """Return the scene with the arena of that name, or of a TOML or SVG file.

    Raises:
        RobotError: There is no such arena or file, or the file cannot be used; the text says where and why.
    """
    return Scene(open_arena(name))


def paper_scene() -> Scene:
    """Return the paper's arena as a scene."""
    return Scene(paper_arena())
