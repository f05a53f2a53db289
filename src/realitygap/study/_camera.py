"""A camera over the arena: how it is named, and what it observes of trials."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import parse_qsl

import numpy as np
from numpy.typing import NDArray

from realitygap._wording import fixed
from realitygap.errors import RobotError, StudyError, VisionError, did_you_mean
from realitygap.records import EndReason, Observe, Score, TrialRecord
from realitygap.robots import Clock, Robot
from realitygap.trials import PortObserver, SheetObserver, TrialPlan
from realitygap.vision import CORNER_SIZE_M, FAMILIES, Marks, RobotTag, Track, read_lens
from realitygap.world import Arena, Pose

from ._tracked import score_along

OWN_POSES = "own"
"""Name in place of a camera for the poses that a robot tells."""
AT_REST_S = 0.4
"""Largest time by which the poses may begin after or end before a trial, because the robot is at rest at both ends."""


class Looking(Protocol):
    """Follows a robot, such as `LiveTrack`."""

    def now(self) -> float:
        """Return the time of its pictures [s]."""
        ...

    def begin(self) -> None:
        """A trial begins."""
        ...

    def tracked(self, until_s: float | None = None) -> HasTrack:
        """Return the track since then, up to a time [s] at least."""
        ...


class HasTrack(Protocol):
    """A result with a track, such as `Tracked`."""

    @property
    def track(self) -> Track:
        """The robot's path."""
        ...


class CameraObserver:
    """A camera above a robot, which observes its poses and the cells that it crosses.

    Args:
        camera: Follows the robot.
        arena: Arena in the camera's view.
        beside: Another observer, which puts the robot at its start and reads its encoders; None if that is not needed.
        say: Called with the reason if a trial has to be counted by hand.
    """

    who = "camera"
    asks = False
    observes: Observe = "track"

    def __init__(
        self,
        camera: Looking,
        arena: Arena,
        beside: PortObserver | None = None,
        say: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._camera, self._arena, self._say = camera, arena, say
        self.beside: PortObserver = beside or SheetObserver(lambda _: ())
        self._times: list[float] = []
        self._track: Track | None = None

    @property
    def identity(self) -> str:
        """Identity of the robot that was met."""
        return self.beside.identity

    def meet(self, robot: Robot, arena: Arena | None = None) -> None:
        """Take note of a robot that was opened.

        Raises:
            RobotError: The camera was set up for another arena.
        """
        if arena not in (None, self._arena):
            raise RobotError(
                f"The camera was set up for arena {self._arena.name!r}, and the trials are in {arena.name!r}. Set it "
                "up for the arena of the trials."
            )
        self.beside.meet(robot, arena)

    def ready(self) -> None:
        """Wait until the robot is at a place where it can turn on the spot."""
        self.beside.ready()

    def clock(self, robot: Robot) -> Clock:
        """Return the clock by which its commands are timed."""
        return self.beside.clock(robot)

    def place(self, plan: TrialPlan, arena: Arena, observe: Observe) -> None:
        """Have it put at a start, and look from then on."""
        self.beside.place(plan, arena, "readings")
        self._times, self._track = [], None
        self._begin(plan.start or arena.start)

    def _begin(self, start: Pose) -> None:
        self._camera.begin()

    def battery_v(self) -> float:
        """Return the voltage of the robot at the start of a trial [V]; nan if it is not known."""
        return self.beside.battery_v()

    def wheels(self) -> tuple[float, float] | None:
        """Return the way of the wheels by its encoders [m]."""
        return self.beside.wheels()

    def look(self) -> None:
        """Record the time. The robot's pose at this time is in the pictures."""
        self._times.append(self._camera.now())
        self.beside.look()

    def poses(self) -> NDArray[np.float64]:
        """Return the pose at each look, (n, 3).

        Raises:
            RobotError: The camera did not see it.
        """
        return self._seen().at(np.array(self._times)) if self._times else np.empty((0, 3))

    def cells(self) -> tuple[int, ...]:
        """Return the cells along its line.

        Raises:
            RobotError: The camera did not see it.
        """
        if len(self._times) < 2:
            return ()
        return self._seen().between(self._times[0], self._times[-1]).cells(self._arena.grid)

    def score(self, arena: Arena) -> Score | None:
        """Return the cells along the robot's line, and the path; None if the camera did not see it."""
        if arena.grid != self._arena.grid:
            self._say(
                f"The camera looks at the arena {self._arena.name!r}, and the trial was in {arena.name!r}."
            )
            return None
        try:
            score = score_along(self._seen(), np.array(self._times), arena.grid, self.who)
        except RobotError as error:
            self._say(f"{error} Count its cells by hand.")
            return None
        self._say(f"The camera counts {len(score.cells)} cells.")
        return score

    def settle(self, plan: TrialPlan, arena: Arena, trial: TrialRecord) -> TrialRecord | None:
        """Return None: a person scores the trial, because its pictures are gone with the program."""
        self.beside.settle(plan, arena, replace(trial, end=str(EndReason.RUNNING)))
        return None

    def _seen(self) -> Track:
        """Return the track from the first look to the last."""
        if self._track is None:
            self._track = seen_between(self._camera, self._times[0], self._times[-1])
        return self._track


class OwnPosesObserver(CameraObserver):
    """A robot that tells its poses, by odometry or from a motion capture, and so the cells that it crosses.

    Such a robot has `tells_poses`, `begin_path`, and `path`, as one on ROS 2. Another observer puts it at its start.

    Args:
        arena: Arena of the trials.
        beside: Observer that puts the robot at its start, a person or the witness of an emulated robot.
        say: Called with the reason if a trial has to be counted by hand.
    """

    who = "robot's poses"

    def __init__(
        self, arena: Arena, beside: PortObserver | None = None, say: Callable[[str], None] = lambda _: None
    ) -> None:
        self._path = _OwnPath()
        super().__init__(self._path, arena, beside, say)

    def meet(self, robot: Robot, arena: Arena | None = None) -> None:
        """Take note of a robot that was opened.

        Raises:
            RobotError: It tells no poses, or drives in another arena.
        """
        if not getattr(robot, "tells_poses", False):
            raise RobotError(
                "This robot tells no poses. Name a camera above it, or, for a robot on ROS 2, its odometry or motion "
                "capture in [driver] of the robot file."
            )
        super().meet(robot, arena)
        self._path.robot = robot

    def _begin(self, start: Pose) -> None:
        self._path.robot.begin_path(start)


class _OwnPath:
    """The path that a robot tells since its trial began, as `Looking` has it."""

    def __init__(self) -> None:
        self.robot: Any = None
        self._rows = np.empty((0, 4))

    def now(self) -> float:
        return float(self.robot.clock.now())

    def begin(self) -> None:
        raise NotImplementedError("A path begins at a pose.")

    def tracked(self, until_s: float | None = None) -> _OwnPath:
        self._rows = self.robot.path()
        if not len(self._rows):
            raise RobotError("The robot told no pose in this trial. Check its odometry.")
        return self

    @property
    def track(self) -> Track:
        """The robot's path."""
        poses = self._rows[:, 1:].copy()
        poses[:, 2] = np.unwrap(poses[:, 2])
        return Track(self._rows[:, 0], poses, np.ones(len(poses), np.bool_))


def seen_between(camera: Looking, first: float, last: float) -> Track:
    """Return the track of a trial from one time to another [s].

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
            f"The camera saw the robot from {fixed(from_s, 1)} to {fixed(to_s, 1)} s of a trial of "
            f"{fixed(last - first, 1)} s, expected "
            "all of it. Does it see the whole arena?"
        )
    return track.held(min(first, track.times[0]), max(last, track.times[-1]))


_KEYS = ("tag", "tag-size", "tag-height", "tag-at", "corner-size", "corner-inset", "lens")


def read_camera(spec: str, arena: Arena) -> tuple[str, Marks]:
    """Return a camera's number or a video's file, and what to look for in its pictures.

    Args:
        spec: Camera, such as 0, or film.mp4?tag=10&tag-height=0.1. The options of `realitygap track` follow the
            question mark.
        arena: Arena of the robot.

    Raises:
        StudyError: Something in it cannot be.
        VisionError: The lens cannot be read.
    """
    name, _, query = spec.partition("?")
    options = dict(parse_qsl(query, keep_blank_values=True))
    unknown = [key for key in options if key not in _KEYS]
    if unknown:
        raise StudyError(f"--camera: unknown option {unknown[0]!r}. {did_you_mean(unknown[0], _KEYS)}")

    def length(name: str) -> float | None:
        text = options.get(name)
        try:
            return None if text is None else float(text)
        except ValueError:
            raise StudyError(f"--camera: {name} is {text!r}, expected a length in meters.") from None

    size, height = length("tag-size"), length("tag-height")
    tag = tag_of(
        options.get("tag", "10"),
        0.07 if size is None else size,
        0.1 if height is None else height,
        options.get("tag-at", "0,0,0"),
    )
    lens = options.get("lens")
    return name, marks_of(
        arena, tag, None if lens is None else Path(lens), length("corner-size"), length("corner-inset")
    )


def tag_of(text: str, size: float, height: float, at: str) -> RobotTag:
    """Return the robot's tag by options: number or FAMILY:NUMBER, side [m], height [m], and AHEAD,LEFT,DEGREES.

    Raises:
        StudyError: One of them cannot be.
    """
    family, colon, number = text.rpartition(":")
    if not number.isdecimal() or (colon and family not in FAMILIES):
        raise StudyError(
            f"tag is {text!r}, expected a number such as 10, or FAMILY:NUMBER. {did_you_mean(family, FAMILIES)}"
        )
    try:
        ahead, left, degrees = (float(part) for part in at.split(","))
    except ValueError:
        raise StudyError(f"tag-at is {at!r}, expected three numbers such as 0.02,0,90.") from None
    try:
        return RobotTag(int(number), size, height, family, ahead, left, math.radians(degrees))
    except ValueError as error:
        raise StudyError(f"The robot's tag: {error}") from None


def marks_of(
    arena: Arena, tag: RobotTag, lens: Path | None, corner_size: float | None, corner_inset: float | None
) -> Marks:
    """Return the marks that are known before a camera records, by options.

    Raises:
        VisionError: The lens cannot be read.
    """
    known = None if lens is None else read_lens(lens)
    return Marks(arena, tag, known, CORNER_SIZE_M if corner_size is None else corner_size, corner_inset)
