"""A robot in a `SimWorld`: what it is told, and what it knows."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import Point
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import crowd as crowd
from realitygap.kernels.sim.lanes import make_sim_room
from realitygap.robots import Command, Label, Observation, ProgramRobot, check_command
from realitygap.trials import REAL, Draws, NoiseKey, counters_of
from realitygap.world import Arena, Obstacle, Pose, RobotModel

from ._platform import SimPlatform
from ._scene import sim_scene
from ._trials import sensor_names, sim_rules

if TYPE_CHECKING:
    from ._world import SimWorld

_NO_INPUTS = ("time",)  # no network looks at what a driven robot sees


class SimWorldRobot(ProgramRobot):
    """One robot of a `SimWorld`, made by `SimWorld.add`; also a robot under the contract that a physical one meets.

    Under the contract `drive` is a command and one step of the whole world, and `reset` is one of the whole world.

    | command | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | a wheel's full speed, or as the robot's file mixes them |
    | turn | -1 | 1 | likewise, to the left |

    Attributes:
        name: What `world[name]` finds it by.
        color: Of its trail and outline.
        brain: Called with the robot in each step, when its turn to move has come.
        start: Where it begins.
        keep_trail: Whether poses are kept in `trail`.
        trail: (t, 3) poses since the start, where they are kept.
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
        """The command of this and all further steps, each part -1..1.

        Raises:
            ValueError: A part is not within -1..1. The robot goes on as before.
        """
        self.command = check_command(Command(move, turn))

    # what it knows

    @property
    def pose(self) -> Pose:
        """Where it is; the heading lies in -pi..pi."""
        self.world._prepare()
        return self._pose

    def point(self, ahead: float, left: float) -> Point:
        """Where a point of the robot is in the arena [m]."""
        return self.pose.point(ahead, left)

    @property
    def stalled(self) -> bool:
        """Whether it was held up in its last step, as its own kind of stall sensor has it."""
        self.world._prepare()
        return bool(self._room.lanes.stalled[0] > 0)

    @property
    def readings(self) -> dict[str, float]:
        """What its sensors answer, noise and all, 0..1 with 1 for near: "range.0", "light.0", "line.0", "bump.0"."""
        self.world._prepare()
        return dict(zip(self._names, self._room.lanes.readings[:, 0].tolist(), strict=True))

    @property
    def distances(self) -> NDArray[np.float64]:
        """(rays,) how far the nearest wall or robot is along each ray of the range sensors [m], without noise."""
        self.world._prepare()
        found: NDArray[np.float64] = self._room.lanes.distances[:, 0].astype(np.float64)
        return found

    @property
    def wheels(self) -> tuple[float, float]:
        """How far the left and the right wheel have driven since the start [m], without the encoders' error."""
        self.world._prepare()
        left, right = self._room.lanes.wheels[:, 0].tolist()
        return left, right

    # the contract

    @property
    def step_s(self) -> float:
        """How long one command lasts [s]."""
        return self.world.step_s

    def reset(self, pose: Pose | None = None) -> None:
        """Begin anew with the whole world, this robot at a pose if one is given."""
        self._check_open()
        if pose is not None:
            self.start = Pose(*pose)
        self.world.reset()

    def observe(self) -> Observation:
        """The range readings after the last step; raw is the same, as they have no other unit."""
        self._check_open()
        readings = tuple(value for name, value in self.readings.items() if name.startswith("range."))
        return Observation(readings, self.stalled, readings)

    def drive(self, command: Command) -> None:
        """Give a command, and let the world go on by one step."""
        self._check_open()
        self.move(*command)
        self.world.step()

    def stop(self) -> None:
        """Tell it to stand from the next step on."""
        self.command = Command(0.0, 0.0)

    # what the world asks

    def _parts(self) -> list[Obstacle]:
        """What the others meet of it, where it starts."""
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
        """See the others where they are now."""
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
    """The robot with what is drawn for a trial in place of distributions."""
    draws = Draws(model.numbers())
    if not draws.names:
        return model
    values: dict[str, Any] = dict(
        zip(draws.names, draws.draw(key.key, counters_of(key))[0].tolist(), strict=True)
    )
    return model.with_numbers(values)
