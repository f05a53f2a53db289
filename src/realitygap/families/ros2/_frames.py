"""Frames of TF: the pose of one in another, from the transforms between them."""

from __future__ import annotations

import math
import time
from typing import Any

from realitygap.world import Pose

_MOST_NAMED = 12


class Frames:
    """Follows the pose of a frame in another one, in the plane.

    Heights and tilts are left out: each transform counts by its place in x and y, and by its turn about z.

    Args:
        parent: Frame in which the pose is told, such as `map`.
        child: Frame of the robot, such as `base_link`.

    Attributes:
        at: Time [s], x [m], y [m], and heading [rad] of the last pose; None before the first one.
    """

    def __init__(self, parent: str = "", child: str = "") -> None:
        self._parent, self._child = parent.lstrip("/"), child.lstrip("/")
        self._steps: dict[str, tuple[str, Pose]] = {}
        self.at: tuple[float, float, float, float] | None = None

    def take(self, message: Any) -> bool:
        """Take the transforms of a message; return whether they tell a new pose."""
        fresh = set()
        for each in message.transforms:
            child, parent = each.child_frame_id.lstrip("/"), each.header.frame_id.lstrip("/")
            step = planar(each.transform.translation, each.transform.rotation)
            self._steps[child] = parent, step
            fresh.add(child)
        chain = self._chain()
        if not chain or fresh.isdisjoint(chain):
            return False
        x, y, heading = 0.0, 0.0, 0.0
        for frame in reversed(chain):
            step = self._steps[frame][1]
            (x, y), heading = Pose(x, y, heading).point(step.x, step.y), heading + step.heading
        self.at = time.monotonic(), x, y, heading
        return True

    def _chain(self) -> list[str]:
        """Return the frames from the robot's up to the one below `parent`; empty if a transform is missing."""
        chain: list[str] = []
        frame = self._child
        while frame != self._parent:
            if frame not in self._steps or frame in chain:
                return []
            chain.append(frame)
            frame = self._steps[frame][0]
        return chain

    def known(self) -> list[str]:
        """Return the transforms that have come, such as `map > odom`, at most 12."""
        return [f"{parent} > {child}" for child, (parent, _) in sorted(self._steps.items())][:_MOST_NAMED]


def planar(at: Any, turn: Any) -> Pose:
    """Return the pose in the plane of a point, or translation, and a quaternion."""
    heading = math.atan2(2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y**2 + turn.z**2))
    return Pose(at.x, at.y, heading)
