"""Stall as an S2 computes it: a caster that rolls too little for what the drive wheels turn."""

from __future__ import annotations

import math

from realitygap.world import Pose

from ._model import TwinModel

COUNT = 2.5e-4  # of an S2's encoders [m]; less than that is no difference


class Idler:
    """The caster of one twin, watched.

    Args:
        model: The twin.
        pose: Start of the robot.
    """

    def __init__(self, model: TwinModel, pose: Pose) -> None:
        self._stall, self._ahead = model.stall, model.wheels.caster
        self._was = self._point(pose)
        self._driven = self._rolled = 0.0
        self.stalled = False

    def _point(self, pose: Pose) -> tuple[float, float]:
        return (
            pose.x + self._ahead * math.cos(pose.heading),
            pose.y + self._ahead * math.sin(pose.heading),
        )

    def watch(self, pose: Pose, left: float, right: float, seconds: float) -> None:
        """Take note of a short time.

        Args:
            pose: Pose of the robot after it.
            left, right: Distances of the wheels in it [m].
            seconds: Duration [s].
        """
        point = self._point(pose)
        way = math.dist(point, self._was)
        self._was = point
        keep = math.exp(-seconds / self._stall.window)
        self._driven = keep * self._driven + abs(left + right) / 2
        self._rolled = keep * self._rolled + way
        is_driven = abs(left) + abs(right) > 1e-9
        self.stalled = is_driven and self._rolled + COUNT < self._stall.share * self._driven
