"""Several robots of the platform `sim` in one arena, one step at a time: they collide and see each other."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from realitygap.drawing import Line, Picture, Shape, hex_of
from realitygap.errors import RobotError
from realitygap.evolution import NeatSettings
from realitygap.trials import Draws, NoiseKey, counters_of
from realitygap.world import Arena, Pose, RobotModel, arena_picture, paper_arena

from ._overlap import as_obstacles, overlaps
from ._platform import SimPlatform
from ._world_robot import SimWorldRobot

PENS = ("royalblue3", "darkorange3", "seagreen4", "orchid3", "goldenrod3", "firebrick3")
"""What robots are drawn in when nobody says."""


class SimWorld:
    """Robots with outlines, contact, motors and sensors in one arena.

        world = SimWorld(paper_arena())
        ada = world.add("scribbler-s2-fluke2", Pose(0.3, 0.3, 0.0))
        eve = world.add("e-puck", Pose(0.7, 0.3, math.pi))
        ada.move(0.8, 0.1)
        world.step(10)

    In a step each robot, in the order of adding, is asked for a command (its `brain`, if it has one) and moved; the
    outlines of the others stand in its way where they are at that moment. Then all sensors answer. Nothing is pushed:
    a robot slides along another as along an obstacle that stands firm. One robot alone does what `SimRobot` does.

    Args:
        arena: What does not move; the paper's when not given.
        step_s: How long a command lasts [s]; as the robot added first has it when not given.
        seed: Key of all random numbers.

    Attributes:
        robots: In the order of adding.
        n_steps: Steps since the start or the last reset.
    """

    def __init__(self, arena: Arena | None = None, *, step_s: float | None = None, seed: int = 0) -> None:
        if step_s is not None and not (math.isfinite(step_s) and step_s > 0):
            raise ValueError(f"step_s is {step_s!r}, expected a time above 0 [s].")
        self.arena = _drawn_arena(arena or paper_arena(), NoiseKey(seed))
        self.seed = seed
        self.robots: list[SimWorldRobot] = []
        self.n_steps = 0
        self._step_s = step_s
        self._is_ready = False
        self._rules = NeatSettings().rules(1, 2)

    @property
    def step_s(self) -> float:
        """How long a command lasts [s].

        A world without robots takes half a second.
        """
        if self._step_s is not None:
            return self._step_s
        return self.robots[0].platform.command_s if self.robots else 0.5

    @property
    def time(self) -> float:
        """Simulated time since the start [s]."""
        return self.n_steps * self.step_s

    def add(
        self,
        robot: str | Path | RobotModel | SimPlatform = "scribbler-s2-fluke2",
        start: Pose | None = None,
        *,
        name: str | None = None,
        color: str | None = None,
        brain: Callable[[SimWorldRobot], object] | None = None,
        noise: float = 0.0,
        noise_key: NoiseKey | None = None,
    ) -> SimWorldRobot:
        """Put a robot into the world, and get it.

        Args:
            robot: By name, from a file, or with settings.
            start: Where it begins; the arena's start when not given.
            name: What `world[name]` finds it by; its kind and a number when not given.
            color: An X11 name or `#rrggbb`.
            brain: Called with the robot in each step, when its turn to move has come.
            noise: The paper's a, on top of the robot's own noise.
            noise_key: Which random numbers; by the world's seed and the robot's number when not given.

        Raises:
            RobotError: The world has begun, the name is taken, or it stands in a wall or another robot.
            ValueError: There is no such robot or color.
        """
        if self.n_steps:
            raise RobotError(
                "The world has begun: add all robots before the first step, or call reset first."
            )
        platform = robot if isinstance(robot, SimPlatform) else SimPlatform(robot=robot)
        k = len(self.robots)
        color = color or PENS[k % len(PENS)]
        hex_of(color)
        name = name or self._free_name(platform.model.name)
        if any(other.name == name for other in self.robots):
            raise RobotError(f"There is a robot named {name!r} already: give this one another name.")
        key = noise_key or NoiseKey(self.seed, individual=k)
        place = self.arena.start if start is None else Pose(*start)
        added = SimWorldRobot(
            self, platform, place, name=name, color=color, brain=brain, noise_key=key, noise=noise
        )
        self.robots.append(added)
        self._is_ready = False
        try:
            self._prepare()
        except (RobotError, ValueError):
            self.robots.remove(added)
            self._is_ready = False
            raise
        return added

    def _free_name(self, kind: str) -> str:
        taken = {robot.name for robot in self.robots}
        return next(name for k in range(1, len(taken) + 2) if (name := f"{kind}-{k}") not in taken)

    def __getitem__(self, name: str) -> SimWorldRobot:
        """The robot of a name.

        Raises:
            KeyError: There is none.
        """
        for robot in self.robots:
            if robot.name == name:
                return robot
        raise KeyError(f"No robot {name!r}; there are: {', '.join(r.name for r in self.robots) or 'none'}.")

    def step(self, n_steps: int = 1, *, brains: bool = True) -> None:
        """Go on by some steps.

        Args:
            n_steps: How many.
            brains: Whether robots are asked for commands; else they go on with those that they have.
        """
        self._prepare()
        for _ in range(n_steps):
            for robot in self.robots:
                if brains and robot.brain is not None:
                    robot.brain(robot)
                robot._meet(self._others(robot))
                robot._move(self.n_steps)
            for robot in self.robots:
                robot._meet(self._others(robot))
                robot._look(self.n_steps + 1)
            self.n_steps += 1

    def run(self, seconds: float, *, brains: bool = True) -> None:
        """Go on for a time of the simulation [s], rounded to whole steps."""
        self.step(round(seconds / self.step_s), brains=brains)

    def reset(self) -> None:
        """All robots at their starts, standing, with the same random numbers as before."""
        self.n_steps = 0
        self._is_ready = False
        self._prepare()

    def _others(self, robot: SimWorldRobot) -> list[SimWorldRobot]:
        return [other for other in self.robots if other is not robot]

    def _prepare(self) -> None:
        if self._is_ready:
            return
        standing = as_obstacles(self.arena)
        for robot in self.robots:
            parts = robot._parts()
            if any(overlaps(part, other) for part in parts for other in standing):
                raise RobotError(
                    f"{robot.name} stands in a wall, an obstacle or another robot at ({robot.start.x:.3f}, "
                    f"{robot.start.y:.3f}). Start it elsewhere."
                )
            standing += parts
        for robot in self.robots:
            robot._begin(self.arena, self._others(robot))
        self._is_ready = True

    def picture(self) -> Picture:
        """The arena from above with all robots, their trails and what their range sensors see."""
        self._prepare()
        ground = arena_picture(self.arena)
        layers = (_trail, _rays, _body)
        shapes = [shape for layer in layers for robot in self.robots for shape in layer(robot)]
        return Picture(
            "World",
            f"Arena {self.arena.name} with {len(self.robots)} robots after {self.n_steps} steps, {self.time:.4g} s.",
            ground.left,
            ground.bottom,
            ground.right,
            ground.top,
            (*ground.shapes, *shapes),
        )

    def _repr_svg_(self) -> str:
        return self.picture().to_svg()


def _drawn_arena(arena: Arena, key: NoiseKey) -> Arena:
    """The arena with what is drawn for a trial in place of distributions."""
    draws = Draws(arena.numbers())
    if not draws.names:
        return arena
    drawn = draws.draw(key.key, counters_of(key))[0].tolist()
    return arena.with_numbers(dict(zip(draws.names, drawn, strict=True)))


def _trail(robot: SimWorldRobot) -> list[Shape]:
    if len(robot.trail) < 2:
        return []
    return [Line(tuple((pose.x, pose.y) for pose in robot.trail), hex_of(robot.color), 1.2)]


def _rays(robot: SimWorldRobot) -> list[Shape]:
    """The rays of the range sensors, as far as they see."""
    shapes: list[Shape] = []
    lengths = iter(robot.distances.tolist())
    for sensor in robot.model.range:
        start = robot.point(sensor.x, sensor.y)
        for k in range(sensor.rays):
            share = 2 * k / (sensor.rays - 1) - 1 if sensor.rays > 1 else 0.0
            angle, far = sensor.direction + share * sensor.cone, min(next(lengths), sensor.reach)
            end = robot.point(sensor.x + far * math.cos(angle), sensor.y + far * math.sin(angle))
            shapes.append(Line((start, end), hex_of(robot.color), 0.6, (2.0, 1.5)))
    return shapes


def _body(robot: SimWorldRobot) -> list[Shape]:
    """The outline, and an arrow ahead."""
    color, size = hex_of(robot.color), robot.model.radius
    shapes: list[Shape] = [
        Line(tuple(robot.point(*point) for point in part.outline()), color, 1.4, closed=True, fill="#ffffff")
        for part in robot.model.body
    ]
    nose = (robot.point(0.0, 0.15 * size), robot.point(0.5 * size, 0.0), robot.point(0.0, -0.15 * size))
    return [*shapes, Line(nose, None, closed=True, fill=color)]
