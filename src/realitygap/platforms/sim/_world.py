"""Several robots of the platform `sim` in one arena, one step at a time: they collide and see each other."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap._wording import fixed
from realitygap.drawing import Line, Picture, Point, Shape, hex_of
from realitygap.errors import RobotError, real_number
from realitygap.evolution import NeatSettings
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import crowd
from realitygap.kernels.sim.lanes import make_sim_room
from realitygap.robots import Command, Label, Observation, ProgramRobot, check_command
from realitygap.trials import REAL, Draws, NoiseKey, counters_of
from realitygap.world import Arena, Obstacle, Pose, RobotModel, arena_picture, paper_arena

from ._platform import SimPlatform
from ._scene import sim_scene
from ._settings import DEFAULT_ROBOT
from ._trials import sensor_names, sim_rules

PENS = ("royalblue3", "darkorange3", "seagreen4", "orchid3", "goldenrod3", "firebrick3")
"""Default colors of robots."""

_NO_INPUTS = ("time",)  # no network looks at what a driven robot sees


class SimWorld:
    """Robots with outlines, contact, motors and sensors in one arena.

        world = SimWorld(paper_arena())
        ada = world.add("khepera", Pose(0.3, 0.3, 0.0))
        eve = world.add("e-puck", Pose(0.7, 0.3, math.pi))
        ada.move(0.8, 0.1)
        world.step(10)

    In a step, each robot, in the order of adding, gets a command (from its `brain`, if it has one) and moves. The
    outlines of the others at that moment are obstacles. Then all sensors are read. Nothing is pushed: a robot slides
    along another as along a fixed obstacle. A single robot moves like `SimRobot`.

    Args:
        arena: Arena. Default: the paper's.
        step_s: Duration of a command [s]. Default: that of the robot added first.
        seed: Key of all random numbers.

    Attributes:
        robots: Robots in the order of adding.
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
        """Duration of a command [s]; half a second in a world without robots."""
        if self._step_s is not None:
            return self._step_s
        return self.robots[0].platform.command_s if self.robots else 0.5

    @property
    def time(self) -> float:
        """Simulated time since the start [s]."""
        return self.n_steps * self.step_s

    def add(
        self,
        robot: str | Path | RobotModel | SimPlatform = DEFAULT_ROBOT,
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
            robot: Robot by name, from a file, or with settings.
            start: Start of the robot. Default: the arena's start.
            name: Name for `world[name]`. Default: its kind and a number.
            color: An X11 name or `#rrggbb`.
            brain: Function that is called with the robot in each step, before it moves.
            noise: The paper's a, on top of the robot's own noise.
            noise_key: Key of the random numbers. Default: one from the world's seed and the robot's number.

        Raises:
            RobotError: The world has begun, the name is taken, or the start is in a wall or another robot.
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
        """Return the robot of a name.

        Raises:
            KeyError: There is none.
        """
        for robot in self.robots:
            if robot.name == name:
                return robot
        raise KeyError(f"No robot {name!r}; there are: {', '.join(r.name for r in self.robots) or 'none'}.")

    def step(self, n_steps: int = 1, *, brains: bool = True) -> None:
        """Simulate some steps.

        Args:
            n_steps: Number of steps.
            brains: True to ask robots for commands. Otherwise they keep their last commands.
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
        """Simulate for a time [s], rounded to whole steps."""
        self.step(round(real_number("seconds", seconds) / self.step_s), brains=brains)

    def reset(self) -> None:
        """Put all robots at their starts, standing, with the same random numbers as before."""
        self.n_steps = 0
        self._is_ready = False
        self._prepare()

    def _others(self, robot: SimWorldRobot) -> list[SimWorldRobot]:
        return [other for other in self.robots if other is not robot]

    def _prepare(self) -> None:
        if self._is_ready:
            return
        walls = [Obstacle(0.0, 0.0, 0.0, ((x1, y1), (x2, y2))) for x1, y1, x2, y2 in self.arena.walls]
        standing = [*self.arena.obstacles, *walls]
        for robot in self.robots:
            parts = robot._parts()
            if any(part.overlaps(other) for part in parts for other in standing):
                raise RobotError(
                    f"{robot.name} starts in a wall, an obstacle or another robot at ({fixed(robot.start.x, 3)}, "
                    f"{fixed(robot.start.y, 3)}). Start it elsewhere."
                )
            standing += parts
        for robot in self.robots:
            robot._begin(self.arena, self._others(robot))
        self._is_ready = True

    def picture(self) -> Picture:
        """Return the arena from above with all robots, their trails and what their range sensors see."""
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


class SimWorldRobot(ProgramRobot):
    """One robot of a `SimWorld`, made by `SimWorld.add`. It has the contract of a physical robot.

    With the contract of robots, `drive` gives a command and runs one step of the whole world, and `reset` resets the
    whole world.

    | command | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | a wheel's full speed, or as the robot's file mixes them |
    | turn | -1 | 1 | likewise, to the left |

    Attributes:
        name: Name for `world[name]`.
        color: Color of its trail and outline.
        brain: Function that is called with the robot in each step, before it moves.
        start: Start of the robot.
        keep_trail: True to store poses in `trail`.
        trail: (t, 3) poses since the start, if they are stored.
    """

    label: Label = "SIM"

    def __init__(
        self,
        world: SimWorld,
        platform: SimPlatform,
        start: Pose,
        *,
        name: str,
        color: str,
        brain: Callable[[SimWorldRobot], object] | None,
        noise_key: NoiseKey,
        noise: float,
    ) -> None:
        self.world, self.platform, self.start = world, platform, start
        self.name, self.color, self.brain = name, color, brain
        self.noise_key, self.noise = noise_key, noise
        self.keep_trail = True
        self.model = _drawn(platform.model, noise_key)
        self.n_sensors = len(self.model.range)
        self.command = Command(0.0, 0.0)

    # what it is told

    def move(self, move: float, turn: float) -> None:
        """Set the command of this and all further steps, each part -1..1.

        Raises:
            ValueError: A part is not within -1..1. The robot keeps its last command.
        """
        self.command = check_command(Command(move, turn))

    # what it knows

    @property
    def pose(self) -> Pose:
        """Pose of the robot, with the heading in -pi..pi."""
        self.world._prepare()
        return self._pose

    def point(self, ahead: float, left: float) -> Point:
        """Return the position in the arena of a point of the robot [m]."""
        return self.pose.point(ahead, left)

    @property
    def stalled(self) -> bool:
        """True if it was blocked in its last step, according to its kind of stall sensor."""
        self.world._prepare()
        return bool(self._room.lanes.stalled[0] > 0)

    @property
    def readings(self) -> dict[str, float]:
        """Readings of its sensors with noise, 0..1 with 1 for near: "range.0", "light.0", "line.0", "bump.0"."""
        self.world._prepare()
        return dict(zip(self._names, self._room.lanes.readings[:, 0].tolist(), strict=True))

    @property
    def distances(self) -> NDArray[np.float64]:
        """Distance to the nearest wall or robot along each ray of the range sensors, without noise, (rays,) [m]."""
        self.world._prepare()
        found: NDArray[np.float64] = self._room.lanes.distances[:, 0].astype(np.float64)
        return found

    @property
    def wheels(self) -> tuple[float, float]:
        """Distances that the left and the right wheel drove since the start [m], without the encoders' error."""
        self.world._prepare()
        left, right = self._room.lanes.wheels[:, 0].tolist()
        return left, right

    # the contract

    @property
    def step_s(self) -> float:
        """Duration of a command [s]."""
        return self.world.step_s

    def reset(self, pose: Pose | None = None) -> None:
        """Reset the whole world, with this robot at a pose if one is given."""
        self._check_open()
        if pose is not None:
            self.start = Pose(*pose)
        self.world.reset()

    def observe(self) -> Observation:
        """Return the range readings after the last step; raw is the same, as they have no other unit."""
        self._check_open()
        readings = tuple(value for name, value in self.readings.items() if name.startswith("range."))
        return Observation(readings, self.stalled, readings)

    def drive(self, command: Command) -> None:
        """Give a command, and simulate one step of the world."""
        self._check_open()
        self.move(*command)
        self.world.step()

    def stop(self) -> None:
        """Stop it from the next step on."""
        self.command = Command(0.0, 0.0)

    # what the world asks

    def _parts(self) -> list[Obstacle]:
        """Return the parts of its body at its start, which the others meet."""
        return [Obstacle(*self.start, part.corners, part.radius) for part in self.model.body]

    def _begin(self, arena: Arena, others: list[SimWorldRobot]) -> None:
        """Stand at the start, with the others' parts as the arena's last obstacles."""
        parts = tuple(part for other in others for part in other._parts())
        surroundings = Arena(
            arena.name,
            arena.walls,
            arena.grid,
            self.start,
            (*arena.obstacles, *parts),
            arena.lights,
            arena.floor,
            arena.goal,
        )
        platform = SimPlatform(
            robot=self.model,
            steps=self.platform.steps,
            step_s=self.world.step_s,
            noisy_reading=self.platform.noisy_reading,
            precision=self.platform.precision,
        )
        scene = sim_scene(platform, surroundings, _NO_INPUTS, self.noise)
        real = REAL[platform.precision]
        self._shape, self._rules = scene.shape, sim_rules(scene, 1.0)
        self._names = sensor_names(scene.shape)
        self._room = make_sim_room(scene.shape, self.world._rules, 0, real)
        self._cells = np.zeros((1, arena.grid.n_cells), np.uint8)
        self._key = np.uint64(self.noise_key.key)
        self._first_other = len(arena.obstacles)
        self._commands = np.zeros((2, LANES), real)
        counters = counters_of(self.noise_key)
        table = scene.table(scene.fixed)
        crowd.begin_sim(scene.shape, table, self._rules, counters, self._room, self._cells)
        self._look(0)
        self._take_pose()
        self.trail = [self._pose]
        self.command = Command(0.0, 0.0)

    def _meet(self, others: list[SimWorldRobot]) -> None:
        """Observe the others at their present poses."""
        rows = [
            (other._pose.x - self.start.x, other._pose.y - self.start.y, other._turns)
            for other in others
            for _ in other.model.body
        ]
        if rows:
            poses = np.array(rows, self._commands.dtype)
            crowd.put_others(self._shape, self._room, self._first_other, poses)

    def _move(self, step: int) -> None:
        self._commands[0], self._commands[1] = self.command
        crowd.move_sim(self._shape, self._rules, self._key, self._room, self._cells, step, self._commands)
        self._take_pose()
        if self.keep_trail:
            self.trail.append(self._pose)

    def _look(self, step: int) -> None:
        crowd.look_sim(self._shape, self._rules, self._key, self._room, step)

    def _take_pose(self) -> None:
        at = self._room.lanes.pose
        turns = self._turns = float(at.heading[0])
        self._pose = Pose(
            self.start.x + float(at.x[0]),
            self.start.y + float(at.y[0]),
            math.remainder(turns * math.tau, math.tau),
        )


def _drawn(model: RobotModel, key: NoiseKey) -> RobotModel:
    """Return the robot with drawn numbers instead of distributions."""
    draws = Draws(model.numbers())
    if not draws.names:
        return model
    values: dict[str, Any] = dict(
        zip(draws.names, draws.draw(key.key, counters_of(key))[0].tolist(), strict=True)
    )
    return model.with_numbers(values)


def _drawn_arena(arena: Arena, key: NoiseKey) -> Arena:
    """Return the arena with drawn numbers instead of distributions."""
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
    """Return the rays of the range sensors, as far as they see."""
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
    """Return the outline, and an arrow ahead."""
    color, size = hex_of(robot.color), robot.model.radius
    shapes: list[Shape] = [
        Line(tuple(robot.point(*point) for point in part.outline()), color, 1.4, closed=True, fill="#ffffff")
        for part in robot.model.body
    ]
    nose = (robot.point(0.0, 0.15 * size), robot.point(0.5 * size, 0.0), robot.point(0.0, -0.15 * size))
    return [*shapes, Line(nose, None, closed=True, fill=color)]
