"""A world that behaves as Jyro 0.3.2 does: walls, lamps and any number of robots, one step at a time."""

from __future__ import annotations

import io
import math
import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import Ink, Line, Picture, Shape, hex_of, picture_of, to_image, to_png
from realitygap.errors import RobotError, check_finite, real_number
from realitygap.kernels.jyro import scene as kernel
from realitygap.records import write_whole
from realitygap.world import Arena

from ._robot import Lamp, SceneRobot

AnyRobot = TypeVar("AnyRobot", bound=SceneRobot)
STEP_S = 0.1
_HUNDREDTH = 10
"""A hundredth of a second, the unit of time in a GIF [ms]."""


@dataclass(frozen=True)
class Area:
    """A filled area in pictures."""

    corners: tuple[tuple[float, float], ...]
    fill: str


class JyroWorld:
    """Walls, boxes, lamps and robots that collide and see each other, as in Jyro 0.3.2.

        world = JyroWorld(paper_arena())
        robot = world.add(Pioneer(0.5, 0.3))
        camera = robot.add(Camera())
        robot.move(0.2, 0.5)
        world.step(10)

    In a step each robot, in the order of adding, is asked for a command (its `brain`, if it has one) and moved, so that
    later ones meet earlier ones at their new poses; then all devices are read. A robot that would touch a wall or
    another robot at the end of its step stays entirely as it was, and stalls.

    Args:
        arena: Walls, obstacles and lights to begin with; rounded corners are short straight walls. None for an empty
            world.
        step_s: Length of a step [s].
        seed: Seed of the sensors' noise.

    Attributes:
        time: Simulated time [s].
        n_steps: Steps since the start or the last reset.
        robots: Robots in the order of adding.
        lights: Lamps in the order of adding. They may be changed at any time.
        areas: Insides of boxes and obstacles, which pictures show filled.
        drawn: Further shapes in pictures.
        light_above_walls: Whether light passes over walls.
        random: Generator of the sensors' noise.

    Source: Jyro 0.3.2, `Physics` and `Simulator`. Differs: two robots of one name are an error, whereas Jyro lets them
    pass through each other; a reset also restores time and devices; all sensors are read again after something is
    added.
    """

    def __init__(self, arena: Arena | None = None, *, step_s: float = STEP_S, seed: int = 0) -> None:
        if not (math.isfinite(step_s) and step_s > 0):
            raise ValueError(f"step_s is {step_s!r}, expected a time above 0 [s].")
        self.arena = arena
        self.step_s = step_s
        self.seed = seed
        self.robots: list[SceneRobot] = []
        self.lights: list[Lamp] = []
        self.areas: list[Area] = []
        self.drawn: list[Shape] = []
        self.light_above_walls = False
        self._walls: list[tuple[float, float, float, float]] = []
        self._wall_colors: list[str] = []
        self._first_lights: list[Lamp] = []
        self._is_ready = False
        self._begin()
        if arena is not None:
            self._furnish(arena)

    def _begin(self) -> None:
        self.time, self.n_steps = 0.0, 0
        self.random = np.random.default_rng(self.seed)

    # what stands

    def add_wall(self, x1: float, y1: float, x2: float, y2: float, color: str = "black") -> None:
        """Add a wall from one point to another [m]."""
        hex_of(color)
        ends = (float(x1), float(y1), float(x2), float(y2))
        if not np.isfinite(ends).all():
            raise ValueError(f"The wall is {ends}, expected four finite numbers [m].")
        self._walls.append(ends)
        self._wall_colors.append(color)
        self._has_changed()

    def add_box(
        self,
        x1: float,
        y1: float,
        x2: float,
        y2: float,
        fill: str = "purple",
        wall_color: str | None = None,
    ) -> None:
        """Add four walls around a box, given by two opposite corners [m]. Robots may be inside or outside."""
        color = fill if wall_color is None else wall_color
        hex_of(fill)
        check_finite({"x1": x1, "y1": y1, "x2": x2, "y2": y2})
        left, right, bottom, top = min(x1, x2), max(x1, x2), min(y1, y2), max(y1, y2)
        self.add_wall(left, top, left, bottom, color)
        self.add_wall(left, top, right, top, color)
        self.add_wall(left, bottom, right, bottom, color)
        self.add_wall(right, top, right, bottom, color)
        self.areas.append(Area(((left, bottom), (right, bottom), (right, top), (left, top)), fill))

    def add_polygon(
        self, corners: Sequence[Sequence[float]], fill: str = "purple", wall_color: str | None = None
    ) -> None:
        """Add walls around any outline: (c, 2) corners in order [m]."""
        hex_of(fill)
        points = tuple((float(x), float(y)) for x, y in corners)
        if len(points) < 3:
            raise ValueError(f"The polygon has {len(points)} corners, expected 3 or more.")
        for start, end in zip(points, (*points[1:], points[0]), strict=True):
            self.add_wall(*start, *end, fill if wall_color is None else wall_color)
        self.areas.append(Area(points, fill))

    def _furnish(self, arena: Arena) -> None:
        for x1, y1, x2, y2 in arena.floor.tape:
            self.add_shape(Line(((x1, y1), (x2, y2)), Ink.BODY, 3.0))
        for wall in arena.walls:
            self.add_wall(*wall)
        for obstacle in arena.obstacles:
            self.add_polygon(obstacle.outline(), "gray70", "gray40")
        for light in arena.lights:
            self.add_light(light.x, light.y, light.strength)

    def add_light(self, x: float, y: float, brightness: float = 1.0, color: str = "yellow") -> Lamp:
        """Add a lamp [m] and return it."""
        hex_of(color)
        check_finite({"x": x, "y": y, "brightness": brightness})
        lamp = Lamp(x, y, brightness, color)
        self.lights.append(lamp)
        self._first_lights.append(Lamp(x, y, brightness, color))
        self._has_changed()
        return lamp

    def add_shape(self, shape: Shape) -> None:
        """Add a shape to pictures [m]. Robots neither see it nor collide with it."""
        self.drawn.append(shape)

    @property
    def walls(self) -> tuple[tuple[float, float, float, float], ...]:
        """Walls x1, y1, x2, y2, including those of boxes, (w, 4) [m]."""
        return tuple(self._walls)

    @property
    def wall_colors(self) -> tuple[str, ...]:
        """Color of each wall, (w,)."""
        return tuple(self._wall_colors)

    def add(self, robot: AnyRobot) -> AnyRobot:
        """Add a robot to the world and return it.

        Raises:
            RobotError: It is in a world already, or its name is taken.
        """
        if robot._world is not None:
            raise RobotError(f"{robot.name} is in a world already: make another robot.")
        robot.name = robot.name or self._free_name(robot.kind)
        if any(other.name == robot.name for other in self.robots):
            raise RobotError(f"There is a robot named {robot.name!r} already: give this one another name.")
        robot._world = self
        self.robots.append(robot)
        self._has_changed()
        return robot

    def _free_name(self, kind: str) -> str:
        taken = {robot.name for robot in self.robots}
        return next(name for k in range(1, len(taken) + 2) if (name := f"{kind}-{k}") not in taken)

    def __getitem__(self, name: str) -> SceneRobot:
        """Return the robot with a name.

        Raises:
            KeyError: There is none.
        """
        for robot in self.robots:
            if robot.name == name:
                return robot
        names = ", ".join(str(robot.name) for robot in self.robots)
        raise KeyError(f"No robot {name!r}; there are: {names or 'none'}.")

    # going on

    def step(self, n_steps: int = 1, *, brains: bool = True) -> None:
        """Advance the world by some steps.

        Args:
            n_steps: Number of steps.
            brains: Whether to call the robots' brains. Otherwise robots keep their commands.
        """
        self._prepare()
        for _ in range(n_steps):
            self.time += self.step_s
            for number, robot in enumerate(self.robots):
                if brains and robot.brain is not None:
                    robot.brain(robot)
                    self._prepare()
                self._move(number, robot)
            self.n_steps += 1
            self._read()

    def run(self, seconds: float, *, brains: bool = True, real_time: bool = False) -> None:
        """Advance the world by a simulated time [s], rounded to whole steps.

        Args:
            seconds: Simulated time [s].
            brains: Whether to call the robots' brains.
            real_time: Whether to run at real-time speed.
        """
        for _ in range(round(real_number("seconds", seconds) / self.step_s)):
            began = time.perf_counter()
            self.step(brains=brains)
            if real_time:
                time.sleep(max(0.0, self.step_s - (time.perf_counter() - began)))

    def reset(self) -> None:
        """Restore the initial state of robots, devices, lamps, and time."""
        for lamp, first in zip(self.lights, self._first_lights, strict=True):
            lamp.x, lamp.y, lamp.brightness, lamp.color = first.x, first.y, first.brightness, first.color
        self._begin()
        for robot in self.robots:
            robot.reset()
        self._has_changed()

    def _move(self, number: int, robot: SceneRobot) -> None:
        before = robot._row.copy()
        stall, cost = kernel.move_robot(
            self._standing,
            number,
            robot.edges(ahead=True),
            robot._row,
            robot.speed * robot.speed_scale,
            -robot.sideways * robot.speed_scale,
            robot.turn_rate,
            self.step_s,
        )
        robot.stalled = bool(stall)
        robot.energy -= cost
        if not stall:
            robot._has_stepped(before)

    # what devices ask

    def look(
        self, robot: SceneRobot, mounts: NDArray[np.float64], reach: float
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return what rays from a robot meet first, except the robot itself.

        Args:
            robot: The robot.
            mounts: (s, 3) forward, left [m] and direction [rad] of each ray.
            reach: Maximum length of a ray [m].

        Returns:
            distances (s,) [m], `reach` if a ray meets nothing; hits (s,), -1 for nothing, otherwise an argument of
            `what`.
        """
        distances, hits = np.empty(len(mounts)), np.empty(len(mounts), np.int64)
        number = self.robots.index(robot)
        kernel.read_ranges(self._standing, number, robot._row, mounts, float(reach), distances, hits)
        return np.minimum(distances, reach), hits

    def what(self, hit: int) -> tuple[str, SceneRobot | None]:
        """Return the color of the thing that a ray met, and the robot, or None for a wall."""
        n_walls = len(self._walls)
        if hit < n_walls:
            return self._wall_colors[hit], None
        robot = self.robots[int(np.searchsorted(self._standing.rows, hit - n_walls, "right")) - 1]
        return robot.color, robot

    def light_at(
        self, robot: SceneRobot, mounts: NDArray[np.float64], mode: int, reach: float, stops: int
    ) -> NDArray[np.float64]:
        """Return (s,) the light at `mounts` (s, 3) of a robot. `mode` and `stops` are those of the kernel."""
        lights = np.array([(lamp.x, lamp.y, lamp.brightness) for lamp in self.lights], np.float64).reshape(
            -1, 3
        )
        readings = np.empty(len(mounts))
        number = self.robots.index(robot)
        kernel.read_lights(self._standing, lights, number, robot._row, mounts, mode, reach, stops, readings)
        return readings

    # keeping the arrays

    def _has_changed(self) -> None:
        """Rebuild the arrays and read all devices after something was added."""
        self._is_ready = False
        self._prepare()
        self._read()

    def _is_placed(self, robot: SceneRobot) -> None:
        """Update the arrays after a robot was placed."""
        if robot in self.robots:
            self._place(robot)
            self._read_devices(robot)

    def _prepare(self) -> None:
        if self._is_ready:
            return
        counts = [len(robot.edges()) for robot in self.robots]
        walls = np.empty((len(self._walls), 6))
        for line, wall in zip(walls, self._walls, strict=True):
            kernel.set_line(line, *wall)
        self._standing = kernel.Standing(
            walls,
            np.empty((sum(counts), 6)),
            np.cumsum([0, *counts]).astype(np.int64),
            np.arange(len(counts), dtype=np.int64),
        )
        self._is_ready = True
        for robot in self.robots:
            self._place(robot)

    def _place(self, robot: SceneRobot) -> None:
        number = self.robots.index(robot)
        x, y, heading = robot._row.tolist()
        rows = self._standing.rows
        kernel.place_edges(
            robot.edges(), x, y, heading, self._standing.bodies[rows[number] : rows[number + 1]]
        )

    def _read(self) -> None:
        for robot in self.robots:
            self._read_devices(robot)

    def _read_devices(self, robot: SceneRobot) -> None:
        for device in robot.devices:
            if device.active:
                device.read()

    # showing

    def picture(self, hide: Collection[str] = ()) -> Picture:
        """Return the world from above, without the parts to hide: "rays", "trails", "devices" and so on."""
        return picture_of(self, hide=hide)

    def _repr_svg_(self) -> str:
        return self.picture().to_svg()

    def save(self, path: str | Path, width: int = 720) -> Path:
        """Write the picture to a file that ends in .svg or .png.

        Args:
            path: The file; an existing one is replaced.
            width: Width of a .png [pixels].

        Raises:
            ValueError: The path ends in something else.
            RecordError: It cannot be written, or belongs to a study's results.
        """
        path = Path(path)
        ending = path.suffix.lower()
        if ending not in (".svg", ".png"):
            raise ValueError(f"{path} ends in {ending or 'nothing'}, expected .svg or .png.")
        picture = self.picture()
        write_whole(path, [picture.to_svg().encode() if ending == ".svg" else to_png(picture, width)])
        return path

    def save_movie(self, path: str | Path, n_steps: int, *, every: int = 1, width: int = 480) -> Path:
        """Advance the world by some steps, and write them as a GIF that runs at the simulated speed.

        Args:
            path: Ends in .gif.
            n_steps: Number of steps.
            every: Steps from one picture to the next.
            width: Width of the movie [pixels].

        Raises:
            ValueError: The path ends in something else, or a number is below 1.
            RecordError: It cannot be written, or belongs to a study's results.
        """
        if n_steps < 1 or every < 1:
            raise ValueError(f"n_steps is {n_steps} and every {every}, expected 1 or more.")
        from PIL.Image import Dither  # takes a while

        path = Path(path)
        if path.suffix.lower() != ".gif":
            raise ValueError(f"{path} ends in {path.suffix or 'nothing'}, expected .gif.")
        first, *others = [
            to_image(picture, width).quantize(dither=Dither.NONE)
            for picture in self._pictures(n_steps, every)
        ]
        file = io.BytesIO()
        duration = max(20, round(100 * self.step_s * every) * _HUNDREDTH)
        first.save(file, "GIF", save_all=True, append_images=others, duration=duration, loop=0)
        write_whole(path, [file.getvalue()])
        return path

    def _pictures(self, n_steps: int, every: int) -> Iterator[Picture]:
        yield self.picture()
        for step in range(1, n_steps + 1):
            self.step()
            if step % every == 0:
                yield self.picture()

    def to_dict(self) -> dict[str, Any]:
        """Return time, walls, lamps, and the state of all robots, as plain values."""
        return {
            "time": self.time,
            "n_steps": self.n_steps,
            "step_s": self.step_s,
            "walls": [list(wall) for wall in self._walls],
            "wall_colors": list(self._wall_colors),
            "lights": [[lamp.x, lamp.y, lamp.brightness, lamp.color] for lamp in self.lights],
            "robots": [robot.to_dict() for robot in self.robots],
        }
