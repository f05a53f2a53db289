"""A robot in a `JyroWorld`, its devices, and the interface of the world that both use."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import Ink, Line, Picture, Point, Shape, Text, hex_of
from realitygap.errors import RobotError, check_finite
from realitygap.kernels.jyro.scene import START_ENERGY
from realitygap.world import Pose

Edge = tuple[float, float, float, float]
"""Forward and left of one end, then of the other, on a robot [m]."""
Mount = tuple[float, float, float]
"""Forward [m], left [m], direction [rad, positive to the left], on a robot."""
Part = Literal["trails", "rays", "bodies", "devices", "speech"]
"""A part of a robot's drawing."""
_PORTRAIT = 1.0  # side of the picture of one robot [m]


@dataclass
class Lamp:
    """A lamp: x, y [m], brightness (1 is usual), color. All may be changed; a reset restores them."""

    x: float
    y: float
    brightness: float = 1.0
    color: str = "yellow"


class Surroundings(Protocol):
    """The interface of the world for a robot and its devices. `JyroWorld` describes the members."""

    step_s: float
    lights: list[Lamp]
    light_above_walls: bool
    random: np.random.Generator

    def look(
        self, robot: SceneRobot, mounts: NDArray[np.float64], reach: float
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]: ...

    def what(self, hit: int) -> tuple[str, SceneRobot | None]: ...

    def light_at(
        self, robot: SceneRobot, mounts: NDArray[np.float64], mode: int, reach: float, stops: int
    ) -> NDArray[np.float64]: ...

    def step(self) -> None: ...

    def reset(self) -> None: ...

    def _is_placed(self, robot: SceneRobot) -> None: ...

    def _has_changed(self) -> None: ...


class Device:
    """A device on a robot, which is read, or moves, once in each step.

    A custom device overrides `read`, `move`, `edges`, `shapes`, and `reset` as needed:

        class Compass(Device):
            kind = "compass"

            def read(self):
                self.heading = self.robot.pose.heading

    Attributes:
        kind: Key of the device in `robot[kind]`. The last added device of a kind is returned.
        active: Whether it is read. An inactive device keeps its readings, and still moves and collides.
        robot: The robot that carries it. Set when the device is added.
    """

    kind = "device"
    robot: SceneRobot

    def __init__(self) -> None:
        self.active = True

    def read(self) -> None:
        """Refresh the readings. Called at the end of each step, after all robots have moved."""

    def move(self) -> None:
        """Advance by one step. Called right after the robot moved, but not if it was blocked."""

    def reset(self) -> None:
        """Restore the initial state."""

    def edges(self, *, ahead: bool) -> Sequence[Edge]:
        """Return the edges that the device adds to the robot's body. Their number is constant.

        Args:
            ahead: Whether to return the edges after the next `move`, instead of the present ones.
        """
        return ()

    def rays(self) -> list[Shape]:
        """Return shapes of the sensor's rays, drawn below the robot, in world coordinates [m]."""
        return []

    def shapes(self) -> list[Shape]:
        """Return shapes of the device, drawn above the robot, in world coordinates [m]."""
        return []

    def to_dict(self) -> dict[str, Any]:
        """Return the kind, `active`, and readings, as plain values."""
        return {"kind": self.kind, "active": self.active}


AnyDevice = TypeVar("AnyDevice", bound=Device)


class SceneRobot:
    """A robot with any outline, or none. Without an outline it collides with nothing, and no robot sees it.

    Args:
        x, y: Start position [m].
        heading: Start heading [rad, counter-clockwise from +x].
        name: Key of the robot in `world[name]`. Default: its kind and a number.
        color: An X11 name or `#rrggbb`, for pictures and for cameras.
        body: Corners of a closed outline in order, forward and left of the center [m]. Default: that of its kind.
        segments: Single edges that belong to the body as well, forward and left of both ends [m].
        brain: Function of the robot, called in each step before the robot moves.

    Attributes:
        speed: Commanded speed ahead [m/s].
        sideways: Commanded speed to the left [m/s].
        turn_rate: Commanded rate of turn to the left [rad/s].
        speed_scale: Factor of both speeds, not of turning.
        stalled: Whether its last step was blocked.
        energy: 10000, less 1 for each step with a command other than 0; nothing depends on it.
        keep_trail: Whether poses are stored in `trail`.
        trail: Poses after each step or `place` that changed the pose.
        devices: Its devices in the order of adding.

    Source: Jyro 0.3.2, `Robot`. Differs: odometry is also right for sideways motion; sideways is positive to the left,
    as everywhere in realitygap; the text of `say` can be drawn.
    """

    kind = "robot"
    kind_body: ClassVar[Sequence[Sequence[float]]] = ()
    """Outline of all robots of a kind; empty if they have none."""

    def __init__(
        self,
        x: float,
        y: float,
        heading: float = 0.0,
        *,
        name: str | None = None,
        color: str = "red",
        body: Sequence[Sequence[float]] | None = None,
        segments: Sequence[Sequence[float]] = (),
        brain: Callable[[Any], object] | None = None,
    ) -> None:
        hex_of(color)  # refused here, not in the middle of a step
        self.name = name
        self.color = color
        corners = self.kind_body if body is None else body
        check_finite({"body": tuple(map(tuple, corners))})
        self.body = tuple((float(forward), float(left)) for forward, left in corners)
        self.brain = brain
        self.devices: list[Device] = []
        self.keep_trail = False
        self.speed_scale = 1.0
        self._segments = _segments(segments)
        self._start = Pose(float(x), float(y), float(heading))
        self._row = to_jyro(self._start)
        self._world: Surroundings | None = None
        self.reset()

    # where it is

    @property
    def world(self) -> Surroundings:
        """The world that the robot is in. A RobotError if it is in none."""
        if self._world is None:
            raise RobotError(
                f"The {self.kind} {self.name or ''} is in no world: call world.add(robot) first."
            )
        return self._world

    @property
    def pose(self) -> Pose:
        """The pose of the robot; the heading is within -pi..pi."""
        return from_jyro(self._row)

    def place(self, pose: Sequence[float]) -> None:
        """Place the robot at a pose, even inside other things. Odometry does not change."""
        self._row[:] = to_jyro(pose)
        self._row[2] %= 2 * math.pi
        if self._world is not None:
            self._world._is_placed(self)
        self._leave_trail()

    def point(self, forward: float, left: float) -> Point:
        """Return the position in the world of a point of the robot [m]."""
        return self.pose.point(forward, left)

    @property
    def odometry(self) -> Pose:
        """The pose as reckoned from the robot's motion since `localize` or the start: exact, without drift."""
        return self._odometry

    def localize(self, x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> None:
        """Set the odometry: x ahead [m], y to the left [m], heading [rad], in a frame of the robot."""
        check_finite({"x": x, "y": y, "heading": heading})
        self._odometry = Pose(x, y, heading)

    # driving

    def move(self, speed: float, turn_rate: float) -> None:
        """Drive at a speed [m/s] and turn to the left at a rate [rad/s] from now on. There are no limits."""
        check_finite({"speed": speed, "turn_rate": turn_rate})
        self.speed, self.turn_rate = speed, turn_rate

    def translate(self, speed: float) -> None:
        """Set the speed alone [m/s]."""
        check_finite({"speed": speed})
        self.speed = speed

    def rotate(self, turn_rate: float) -> None:
        """Set the rate of turn alone [rad/s]."""
        check_finite({"turn_rate": turn_rate})
        self.turn_rate = turn_rate

    def stop(self) -> None:
        """Stop."""
        self.move(0.0, 0.0)
        self.sideways = 0.0

    def say(self, text: str) -> None:
        """Show a text next to the robot in pictures. An empty text removes it."""
        self.speech = text

    def reset(self) -> None:
        """Restore the start pose and the devices, stop the robot, fill its energy, and clear its trail."""
        self._row[:] = to_jyro(self._start)
        self._odometry = Pose(0.0, 0.0, 0.0)
        self.speed = self.sideways = self.turn_rate = 0.0
        self.stalled = False
        self.energy = START_ENERGY
        self.trail: list[Pose] = []
        self.speech = ""
        for device in self.devices:
            device.reset()
        if self._world is not None:
            self._world._is_placed(self)

    # devices

    def add(self, device: AnyDevice) -> AnyDevice:
        """Add a device to the robot and return the device.

        Raises:
            RobotError: The device is on a robot already.
        """
        if hasattr(device, "robot"):
            raise RobotError(f"This {device.kind} is on {device.robot.name} already: make another one.")
        device.robot = self
        self.devices.append(device)
        if self._world is not None:
            self._world._has_changed()
        return device

    def __getitem__(self, kind: str) -> Any:
        """Return the last added device of a kind.

        Raises:
            KeyError: The robot has no such device.
        """
        for device in reversed(self.devices):
            if device.kind == kind:
                return device
        kinds = sorted({device.kind for device in self.devices})
        raise KeyError(f"{self.name} has no device {kind!r}; it has: {', '.join(kinds) or 'none'}.")

    # what the world asks

    def edges(self, *, ahead: bool = False) -> NDArray[np.float64]:
        """Return (e, 4) edges of body and devices, forward and left of both ends [m].

        Args:
            ahead: Whether to return the edges of devices after their next move.
        """
        rows: list[Sequence[float]] = [
            (*corner, *self.body[i - 1]) for i, corner in enumerate(self.body)
        ]  # each corner is joined to the one before, as in Jyro
        rows += self._segments
        for device in self.devices:
            rows += device.edges(ahead=ahead)
        return np.array(rows, np.float64).reshape(-1, 4)

    def _has_stepped(self, before: NDArray[np.float64]) -> None:
        """Update odometry, trail, and devices after a step that was not blocked."""
        for device in self.devices:
            device.move()
        self._odometry = _reckoned(self._odometry, from_jyro(before), self.pose)
        self._leave_trail()

    def _leave_trail(self) -> None:
        if self.keep_trail and self.trail[-1:] != [self.pose]:
            self.trail.append(self.pose)

    # showing

    def outlines(self) -> list[Shape]:
        """Return the outline of the body as drawn."""
        return [self.polygon(self.body, self.color)] if self.body else []

    def polygon(self, corners: Sequence[Sequence[float]], fill: str, line: str | None = Ink.TEXT) -> Line:
        """Return a filled polygon that is fixed to the robot: corners forward and left [m], an X11 color."""
        points = tuple(self.point(forward, left) for forward, left in corners)
        return Line(points, line, 0.8, closed=True, fill=hex_of(fill))

    def parts(self) -> dict[Part, list[Shape]]:
        """Return the shapes of the robot by part, from back to front."""
        return {
            "trails": self._trail_shapes(),
            "rays": [shape for device in self.devices if device.active for shape in device.rays()],
            "bodies": self._body_shapes(),
            "devices": [shape for device in self.devices for shape in device.shapes()],
            "speech": self._speech_shapes(),
        }

    def _trail_shapes(self) -> list[Shape]:
        if len(self.trail) < 2:
            return []
        return [Line(tuple((pose.x, pose.y) for pose in self.trail), hex_of(self.color), 0.9)]

    def _body_shapes(self) -> list[Shape]:
        shapes = self.outlines()
        for ax, ay, bx, by in self._segments:
            shapes.append(Line((self.point(ax, ay), self.point(bx, by)), Ink.TEXT, 1.0))
        head = (self.point(0.0, 0.012), self.point(0.03, 0.0), self.point(0.0, -0.012))
        shapes.append(Line(head, None, closed=True, fill=Ink.TEXT))
        return shapes

    def _speech_shapes(self) -> list[Shape]:
        if not self.speech:
            return []
        x, y = self.point(0.0, 0.0)
        return [Text(x, y, self.speech, 8.0, "start", (8.0, 10.0), halo=True)]

    def _repr_svg_(self) -> str:
        """Return the robot alone, with its devices and without its rays, in a square of 1 m."""
        x, y = self.point(0.0, 0.0)
        parts = self.parts()
        shapes = (*parts["bodies"], *parts["devices"], *parts["speech"])
        half = _PORTRAIT / 2
        about = f"The {self.kind} {self.name or ''} with {len(self.devices)} devices."
        return Picture(self.kind, about, x - half, y - half, x + half, y + half, shapes).to_svg(180.0)

    def to_dict(self) -> dict[str, Any]:
        """State of the robot, with its devices and their readings, as plain values."""
        return {
            "name": self.name,
            "kind": self.kind,
            "color": self.color,
            "pose": list(self.pose),
            "odometry": list(self.odometry),
            "speed": self.speed,
            "sideways": self.sideways,
            "turn_rate": self.turn_rate,
            "stalled": self.stalled,
            "energy": self.energy,
            "devices": [device.to_dict() for device in self.devices],
        }


def to_jyro(pose: Sequence[float]) -> NDArray[np.float64]:
    """Return (3,) x, y [m] and Jyro's heading: counter-clockwise from +y [rad].

    Raises:
        ValueError: The pose is not three finite numbers.
    """
    row = np.array(tuple(pose), np.float64)
    if row.shape != (3,) or not np.isfinite(row).all():
        raise ValueError(f"The pose is {tuple(pose)}, expected three numbers: x [m], y [m], heading [rad].")
    row[2] -= math.pi / 2
    return row


def from_jyro(row: NDArray[np.float64]) -> Pose:
    """Return the pose of x, y [m] and Jyro's heading [rad]. Its heading is within -pi..pi."""
    return Pose(float(row[0]), float(row[1]), math.remainder(float(row[2]) + math.pi / 2, 2 * math.pi))


def _segments(segments: Sequence[Sequence[float]]) -> list[Edge]:
    edges: list[Edge] = []
    for edge in segments:
        if len(edge) != 4:
            raise ValueError(
                f"A segment is {edge!r}, expected forward and left of both ends [m]: four numbers."
            )
        check_finite({"segment": tuple(edge)})
        edges.append((float(edge[0]), float(edge[1]), float(edge[2]), float(edge[3])))
    return edges


def _reckoned(odometry: Pose, before: Pose, after: Pose) -> Pose:
    """Return odometry advanced by the motion from one pose to another."""
    turn = odometry.heading - before.heading
    sine, cosine = math.sin(turn), math.cos(turn)
    dx, dy = after.x - before.x, after.y - before.y
    heading = odometry.heading + (after.heading - before.heading)
    return Pose(
        odometry.x + dx * cosine - dy * sine,
        odometry.y + dx * sine + dy * cosine,
        math.remainder(heading, 2 * math.pi),
    )
