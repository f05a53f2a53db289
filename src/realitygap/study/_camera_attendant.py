"""Somebody beside a robot, and a camera above it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError, VisionError
from realitygap.records import Observe
from realitygap.robots import Clock, Robot
from realitygap.trials import Attendant, TrialPlan
from realitygap.vision import Track, Tracked
from realitygap.world import Arena, Pose

AT_REST_S = 0.4
"""By so much the robot may be seen later than it began, or less long than it drove: it stands at both ends."""


class Looking(Protocol):
    """What follows a robot, such as `LiveTrack`."""

    def now(self) -> float:
        """The time of its pictures [s]."""
        ...

    def begin(self) -> None:
        """A trial begins."""
        ...

    def tracked(self, until_s: float | None = None) -> Tracked:
        """What was seen since then, up to a time [s] at least."""
        ...


class CameraAttendant:
    """Sees where the robot was before each command, and the cells that it crossed; the rest is another's.

    Args:
        beside: Who puts the robot at its start.
        camera: Who looks.
    """

    observes: Observe = "track"

    def __init__(self, beside: Attendant, camera: Looking) -> None:
        self._beside, self._camera = beside, camera
        self.identity = beside.identity
        self._times: list[float] = []
        self._track: Track | None = None

    def meet(self, robot: Robot, arena: Arena) -> Clock:
        """A robot was opened."""
        self._arena = arena
        clock = self._beside.meet(robot, arena)
        self.identity = self._beside.identity
        return clock

    def place(self, plan: TrialPlan, start: Pose) -> None:
        """Put it at a start, and look from then on."""
        self._beside.place(plan, start)
        self._times, self._track = [], None
        self._camera.begin()

    def battery_v(self) -> float:
        """As whoever is beside it knows [V]."""
        return self._beside.battery_v()

    def wheels(self) -> tuple[float, float] | None:
        """By its encoders [m]."""
        return self._beside.wheels()

    def look(self) -> None:
        """Note the time: where it was then is in the pictures."""
        self._times.append(self._camera.now())

    def poses(self) -> NDArray[np.float64]:
        """(n, 3) at each look.

        Raises:
            RobotError: The camera did not see it.
        """
        return self._seen().at(np.array(self._times)) if self._times else np.empty((0, 3))

    def cells(self) -> tuple[int, ...]:
        """Those along its line.

        Raises:
            RobotError: The camera did not see it.
        """
        if len(self._times) < 2:
            return ()
        return self._seen().between(self._times[0], self._times[-1]).cells(self._arena.grid)

    def _seen(self) -> Track:
        """From the first look to the last."""
        if self._track is None:
            self._track = seen_between(self._camera, self._times[0], self._times[-1])
        return self._track


def seen_between(camera: Looking, first: float, last: float) -> Track:
    """The track of a trial from one time to another [s].

    Raises:
        RobotError: The camera did not see all of it.
    """
    try:
        track = camera.tracked(last).track
    except (VisionError, ValueError) as error:
        raise RobotError(f"The camera did not see the trial: {error}") from error
    if track.times[0] > first + AT_REST_S or track.times[-1] < last - AT_REST_S:
        from_s, to_s = track.times[0] - first, track.times[-1] - first
        raise RobotError(
            f"The camera saw the robot from {from_s:.1f} to {to_s:.1f} s of a trial of {last - first:.1f} s, expected "
            "all of it. Does it see the whole arena?"
        )
    return track.held(min(first, track.times[0]), max(last, track.times[-1]))
