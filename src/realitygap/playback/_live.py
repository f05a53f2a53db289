"""A robot that is shown while it is used."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RealityGapError
from realitygap.platforms import platform_class
from realitygap.robot_families import default_family
from realitygap.robots import Command, Label, Observation, Robot, channels_of, select_channels
from realitygap.world import Arena, Grid, Pose, VisitedCells

from ._moving import MovingTrial, RobotShape
from ._player import PackedScene, PackedTrial, check_speed, pack_rays, pack_scene, pack_trials, player_class

PERIOD_S = 0.05
"""Minimum time between two messages to a page [s]: at most 20 a second."""

_FAN = 1.0
"""Angle between the outermost sensors if their mounts are unknown [rad]."""


class Page(Protocol):
    """A page that shows a robot.

    Attributes:
        scene: Fixed part of the picture.
        trials: The trial, as far as it can be played.
        live: True if it continues.
    """

    scene: PackedScene
    trials: list[PackedTrial]
    live: bool

    def send(self, content: dict[str, Any]) -> None:
        """Send it the robot's pose."""
        ...

    def on_msg(self, handler: Callable[[Any, dict[str, Any], Any], None]) -> None:
        """Have it ask for everything."""
        ...


class WatchedRobot:
    """A robot with a view below the notebook's cell: its pose, its readings, and its visited cells.

    It meets the contract of robots and passes everything on. The robot's pose comes from the robot itself (a simulated
    one), from the witness of an emulator, or from `pose`. A robot without a known pose is shown alone with its rays. A
    robot whose commands take no time is slowed down for the viewer, but a real one never is. When it is stopped, the
    trial can be replayed.

    Args:
        robot: Any robot with the contract of robots.
        arena: Arena of the robot. Default: that of the robot or of its witness.
        shape: Shape to draw. Default: that of the robot's platform.
        pose: Function that returns the robot's pose. It may be called from another thread.
        speed: 2 is twice as fast as it is; None does not hold a simulated robot back.
        page: Page with the view. Default: a widget below a notebook's cell.

    Raises:
        RealityGapError: anywidget is not there, and no page is given.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        arena: Arena | None = None,
        shape: RobotShape | None = None,
        pose: Callable[[], Pose] | None = None,
        speed: float | None = 1.0,
        page: Page | None = None,
    ) -> None:
        self.robot = robot
        self.label: Label = robot.label
        self.step_s = robot.step_s
        self.n_sensors = robot.n_sensors
        witness = getattr(getattr(robot, "port", None), "witness", None) or getattr(robot, "witness", None)
        witness = witness if hasattr(witness, "pose") else None
        self._where = pose or _whereabouts(robot, witness)
        self._is_polled = pose is not None or witness is not None
        self._arena: Arena | None = arena or getattr(robot, "arena", None) or (witness and witness.arena())
        if self._where is None:
            self._arena = None
        self._shape = shape or _shape_of(robot)
        self._speed = None if speed is None else check_speed(speed)
        self._lock = threading.RLock()
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self._begin(self._now())
        scene = pack_scene(self._arena, f"{type(robot).__name__}, live")
        if page is None:
            self.widget: Any = player_class()(
                scene=scene, trials=self._packed(), live=True, was_live=True, speed=self._speed or 1.0
            )
        else:
            self.widget = page
            page.scene, page.trials, page.live = scene, self._packed(), True
        self.widget.on_msg(self._asked)

    # the contract

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the sensors that the robot has besides range sensors."""
        return channels_of(self.robot)

    def select(self, names: Sequence[str]) -> None:
        """Choose those that it reads; see `Robot`."""
        select_channels(self.robot, names)

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial; see `Robot`."""
        self._end_polling()
        self.robot.reset(pose)
        with self._lock:
            self._begin(self._now())
            self.widget.trials = self._packed()
            self.widget.live = True
            self.widget.send({"kind": "begin"})
            self._show(0.0, at_once=True)
        self._poll()

    def observe(self) -> Observation:
        """Read the sensors; see `Robot`."""
        seen = self.robot.observe()
        with self._lock:
            lengths = (1.0 - np.clip(seen.readings, 0.0, 1.0)) * self._shape.reach
            self._rays[-1] = lengths
            self._stalled[-1] = seen.stalled
        return seen

    def drive(self, command: Command) -> None:
        """Drive one command; see `Robot`."""
        began = time.monotonic()
        lasts = self.step_s / (self._speed or 1.0)
        self.robot.drive(command)
        took = time.monotonic() - began
        is_held = self._speed is not None and self.label != "REAL" and took < lasts
        with self._lock:
            self._poses.append(self._now())
            self._rays.append(np.full(len(self._shape.reach), np.nan))
            self._stalled.append(False)
            self._n_steps += 1
            self._time += self.step_s
            self._show(lasts if is_held else 0.0)
        if is_held:
            _sleep(lasts - took)

    def stop(self) -> None:
        """Stop the motors; what was driven can be played again then."""
        self._end_polling()
        try:
            self.robot.stop()
        finally:
            self._finish()

    def close(self) -> None:
        """Stop the motors and let go of the robot."""
        self._end_polling()
        try:
            self.robot.close()
        finally:
            self._finish()

    def __enter__(self) -> Self:
        self.robot.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end_polling()
        self.robot.__exit__(kind, error, trace)
        self._finish()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "robot":
            raise AttributeError(name)
        return getattr(self.robot, name)

    # what is shown

    def _repr_mimebundle_(self, **options: Any) -> Any:
        return self.widget._repr_mimebundle_(**options)

    @property
    def trial(self) -> MovingTrial:
        """Return the trial of the robot since its last reset."""
        with self._lock:
            poses = np.array(self._poses, np.float64).reshape(-1, 3)
            return MovingTrial(
                f"{type(self.robot).__name__}",
                self.label,
                self._arena or _NOWHERE,
                self._shape,
                self.step_s,
                poses,
                np.array(self._rays, np.float64).reshape(len(poses), -1),
                np.array(self._stalled, np.bool_),
                self._cells,
                tuple(self._visited_at),
            )

    def _begin(self, pose: Pose) -> None:
        self._poses: list[Pose] = [pose]
        self._rays: list[NDArray[np.float64]] = [np.full(len(self._shape.reach), np.nan)]
        self._stalled: list[bool] = [False]
        self._n_steps, self._time = 0, 0.0
        self._visited = VisitedCells(self._arena.grid) if self._arena else None
        self._cells: tuple[int, ...] = ()
        self._visited_at: list[int] = []
        self._visit(pose)
        self._trail: list[tuple[float, float]] = []
        self._sent = _Sent()

    def _visit(self, pose: Pose) -> None:
        """Record the cells on the path to a place."""
        if self._visited is not None:
            self._visited.follow([(pose.x, pose.y)])
            self._cells = self._visited.cells
            self._visited_at += [self._n_steps] * (len(self._cells) - len(self._visited_at))

    def _now(self) -> Pose:
        return Pose(0.0, 0.0, 0.0) if self._where is None else Pose(*self._where())

    def _packed(self) -> list[PackedTrial]:
        """Return a trial in which nothing has happened yet, so that the page knows the robot."""
        (packed,) = pack_trials([self.trial], placed=self._where is not None)
        return [packed]

    def _show(self, lasts: float, *, at_once: bool = False) -> None:
        """Send the robot's pose to the page, unless one was just sent. No part of its motion is left out."""
        pose = self._now()
        self._visit(pose)
        self._trail.append((round(pose.x, 4), round(pose.y, 4)))
        if at_once or time.monotonic() - self._sent.time >= PERIOD_S:
            self._tell(pose, lasts)

    def _tell(self, pose: Pose, lasts: float) -> None:
        known = [rays for rays in self._rays if np.isfinite(rays).all()]
        stalled = self._stalled[-1] or (len(self._stalled) > 1 and self._stalled[-2])
        sent = self._sent
        self.widget.send(
            {
                "kind": "now",
                "pose": [round(part, 4) for part in pose],
                "rays": pack_rays(known[-1].tolist() if known else [float("nan")] * len(self._shape.reach)),
                "stalled": bool(stalled),
                "step": self._n_steps,
                "time": round(self._time, 3),
                "trail": self._trail[sent.n_points : -1],
                "cells": list(self._cells[sent.n_cells :]),
                "lasts": lasts,
            }
        )
        self._sent = _Sent(time.monotonic(), len(self._trail), len(self._cells))

    def _asked(self, _widget: Any, content: dict[str, Any], _buffers: Any) -> None:
        """Send the whole state to a page that is opened later."""
        if content.get("kind") != "all":
            return
        with self._lock:
            self._sent = _Sent()
            self.widget.send({"kind": "begin"})
            self._tell(self._now(), 0.0)

    def _finish(self) -> None:
        with self._lock:
            if self._n_steps and self.widget.live:
                self.widget.trials = pack_trials([self.trial], placed=self._where is not None)
                self.widget.live = False

    # a robot that moves while its program waits

    def _poll(self) -> None:
        if not self._is_polled:
            return
        self._ended.clear()
        self._thread = threading.Thread(target=self._look, name="watched-robot", daemon=True)
        self._thread.start()

    def _look(self) -> None:
        last: Pose | None = None
        while not self._ended.wait(PERIOD_S):
            with contextlib.suppress(RealityGapError, OSError):
                pose = self._now()
                if pose != last:
                    with self._lock:
                        self._show(PERIOD_S)
                last = pose

    def _end_polling(self) -> None:
        self._ended.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        self._thread = None


class _Sent:
    """The state last sent to a page, and its time."""

    def __init__(self, time: float = float("-inf"), n_points: int = 0, n_cells: int = 0) -> None:
        self.time, self.n_points, self.n_cells = time, n_points, n_cells


def _whereabouts(robot: Robot, witness: Any) -> Callable[[], Pose] | None:
    """Return a function that returns the robot's pose; None if there is none."""
    if witness is not None:
        pose: Callable[[], Pose] = witness.pose
        return pose
    return (lambda: robot.pose) if hasattr(robot, "pose") else None


def _shape_of(robot: Robot) -> RobotShape:
    """Return the shape of the robot's platform, or that of the default family with one ray per sensor."""
    platform: Any = getattr(robot, "platform", None)
    is_known = hasattr(platform, "body") and hasattr(platform, "sensors")
    shape = RobotShape.of(platform if is_known else platform_class(default_family().name)())
    n = robot.n_sensors
    if n == len(shape.mounts):
        return shape
    turns = [_FAN * (0.5 - k / (n - 1)) for k in range(n)] if n > 1 else [0.0] * n
    mounts = tuple((shape.front, 0.05 * turn / _FAN, turn) for turn in turns)
    return replace(shape, mounts=mounts, reach=(shape.reach[0],) * n)


def _sleep(seconds: float) -> None:
    time.sleep(seconds)


_NOWHERE = Arena("nowhere", (), Grid(0.0, 0.0, 1.0, 1, 1), Pose(0.0, 0.0, 0.0))
"""Placeholder for the arena of a robot whose pose is unknown."""
