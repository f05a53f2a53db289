"""What figures draw of the platforms whose robot is a Scribbler as the paper saw it."""

from __future__ import annotations

import math

from realitygap.drawing import Picture
from realitygap.settings import Settings
from realitygap.world import JYRO_SCRIBBLER, Body, RangeSensors, robot_picture


class ScribblerFigures(Settings):
    """A platform whose figures draw the paper's Scribbler, whatever its own outline is."""

    @property
    def body(self) -> Body:
        """What figures draw: the box of 0.18 x 0.16 m that holds the body."""
        return JYRO_SCRIBBLER

    @property
    def sensors(self) -> RangeSensors:
        """What figures draw: three rays from the front, as far as readings were reasonable to the paper (9 in)."""
        return RangeSensors(((0.09, 0.05, 0.0), (0.09, 0.0, 0.0), (0.09, -0.05, 0.0)), 0.2286)

    @property
    def body_radius(self) -> float:
        """Distance of the farthest corner from the center [m]."""
        return max(math.hypot(forward, left) for forward, left in self.body.corners)

    @property
    def title(self) -> str:
        """Of its picture."""
        return "scribbler"

    def picture(self) -> Picture:
        """The robot from above, to scale, with its dimensions."""
        return robot_picture(self.title, self.body, self.sensors)

    def _repr_svg_(self) -> str:
        return self.picture().to_svg(300.0)
