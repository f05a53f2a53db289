"""The S2's commands by distance: the motions of its wheels, and the robot's estimate of the pose.

Positions are dead reckoning of the commands: they change to the target's value immediately. Lengths are in the S2's
unit of half a millimeter, angles in its unit of 955 a full circle, counter-clockwise positive.

Source: ipre_s2_port.spin of Myro's repository, and what is known of s2.spin. How an arc to a point begins, with a turn
on the spot to its tangent, is inferred.
"""

from __future__ import annotations

import math

from ._motors import CIRCLE, PATH_SPEED, TOP_STEP, Segment

TO, BY, METRIC, OTHER = 2, 4, 1, 8
SPACING = CIRCLE / math.pi  # of the wheels


class Reckoning:
    """The pose that an S2 estimates, and the motions for its commands."""

    def __init__(self) -> None:
        self.x = self.y = 0.0
        self.angle = 0.0
        self._speed = PATH_SPEED
        self._in_path = False
        self._held: list[Segment] = []  # the last motion of a path, until the next one or the end

    def begin_path(self, speed: int) -> None:
        """Motions from here on wait for the next one."""
        self._in_path = True
        self._speed = max(0, min(TOP_STEP, speed))

    def end_path(self) -> list[Segment]:
        """End the path and return the motions that were held back."""
        self._in_path = False
        held, self._held = self._held, []
        return held

    def forget(self) -> None:
        """Nothing is held back any more."""
        self._held = []

    def move(self, kind: int, x: int, y: int) -> list[Segment]:
        """Return the motions of MOVE; none for a kind that does not exist."""
        scale = 2 if kind & METRIC else 1
        x, y = x * scale, y * scale
        kind &= ~METRIC
        if kind == BY + OTHER:
            return self._in_turn([Segment(2 * x, 2 * y, TOP_STEP, rolls_on=True)])
        if kind not in (TO, BY):
            return []
        to_x, to_y = (x, y) if kind == TO else (self.x + x, self.y + y)
        far = math.hypot(to_x - self.x, to_y - self.y)
        if not far:
            return []
        turn = self._face(math.atan2(to_y - self.y, to_x - self.x))
        self.x, self.y = to_x, to_y
        return self._in_turn([*turn, self._segment(far, far)])

    def arc(self, kind: int, x: int, y: int, radius: int) -> list[Segment]:
        """Return the motions of ARC; none for a kind that does not exist, or without a radius."""
        scale = 2 if kind & METRIC else 1
        radius *= scale
        kind &= ~METRIC
        if not radius:
            return []
        if kind == BY + OTHER:
            return self._in_turn([self._arc_through(radius, math.radians(x))])
        if kind not in (TO, BY):
            return []
        x, y = x * scale, y * scale
        to_x, to_y = (x, y) if kind == TO else (self.x + x, self.y + y)
        chord = math.hypot(to_x - self.x, to_y - self.y)
        if not chord:
            return []
        half = math.asin(min(1.0, chord / (2 * abs(radius))))
        round_ = math.copysign(max(abs(radius), chord / 2), radius)
        direction = math.atan2(to_y - self.y, to_x - self.x)
        turn = self._face(direction - math.copysign(half, radius))
        segment = self._arc_through(round_, 2 * half)
        self.x, self.y = to_x, to_y
        return self._in_turn([*turn, segment])

    def turn(self, kind: int, angle: int) -> list[Segment]:
        """Return the motion of TURN by the shorter way; none for a kind that does not exist."""
        units = angle * CIRCLE / 360 if kind & METRIC else float(angle)
        kind &= ~METRIC
        if kind == BY + OTHER:
            self.angle += units
            return [self._turning(units)]
        if kind not in (TO, BY):
            return []
        return self._in_turn(self._turn_by(_shorter(units - (self.angle if kind == TO else 0.0))))

    def _in_turn(self, segments: list[Segment]) -> list[Segment]:
        """Return the motions that can begin now. Within a path, the last one is held back."""
        if not self._in_path or not segments:
            return segments
        ready = [*self._held, *segments[:-1]]
        self._held = segments[-1:]
        return ready

    def _face(self, direction: float) -> list[Segment]:
        return self._turn_by(_shorter(direction / (2 * math.pi) * CIRCLE - self.angle))

    def _turn_by(self, units: float) -> list[Segment]:
        self.angle += units
        return [self._turning(units)] if units else []

    def _turning(self, units: float) -> Segment:
        return self._segment(-units, units)

    def _arc_through(self, radius: float, angle: float) -> Segment:
        """Return an arc with its middle to the left for a positive radius; ahead for a positive angle [rad]."""
        side = math.copysign(1.0, radius)
        heading = self.angle / CIRCLE * 2 * math.pi
        after = heading + side * angle
        self.x += radius * (math.sin(after) - math.sin(heading))
        self.y -= radius * (math.cos(after) - math.cos(heading))
        self.angle += side * angle / (2 * math.pi) * CIRCLE
        return self._segment(
            (abs(radius) - side * SPACING / 2) * angle, (abs(radius) + side * SPACING / 2) * angle
        )

    def _segment(self, left: float, right: float) -> Segment:
        return Segment(2 * left, 2 * right, self._speed)


def _shorter(units: float) -> float:
    """Return the same turn in the shorter direction."""
    return (units + CIRCLE / 2) % CIRCLE - CIRCLE / 2
