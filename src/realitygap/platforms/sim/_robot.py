"""The platform `sim` as one robot under the contract that a physical one meets."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError
from realitygap.evolution import ControllerInterface, NeatSettings
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim.crowd import begin_sim, look_sim, move_sim
from realitygap.kernels.sim.lanes import make_sim_room
from realitygap.kernels.sim.trial import observe
from realitygap.robots import Command, Label, Observation, ProgramRobot, check_command
from realitygap.trials import REAL, Draws, NoiseKey, counters_of, poses_of
from realitygap.world import Arena, Pose, paper_arena

from ._scene import sim_inputs, sim_scene
from ._settings import SimSettings
from ._trials import sensor_names, sim_rules


class SimRobot(ProgramRobot):
    """A robot of a file, simulated, one command at a time.

    The kernels of whole populations simulate it. So a controller that answers each observation drives the same trial as
    `try_genomes` with its genome, the same noise, and the same key. The numbers of a trial are drawn again with each
    `reset`, for the trial that `noise_key` names.

    | command | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | as the robot's drive has it: 1 is its full speed ahead |
    | turn | -1 | 1 | 1: the left wheel back and the right one ahead, both at full speed |

    | observation | from 0 | to 1 | raw |
    |---|---|---|---|
    | each range sensor | nothing within reach | as near as can be told | the same |

    `select` adds any other input that networks can have on `sim`: light, line, bumpers, encoders, the goal.

    Args:
        platform: Settings of the simulated robot. Default: the default ones.
        arena: Arena. Default: the paper's.
        noise: The paper's a, on top of the robot's own noise.
        noise_key: Key of the random numbers, the same in each trial until `noise_key` is changed.
    """

    label: Label = "SIM"

    def __init__(
        self,
        platform: SimSettings | None = None,
        arena: Arena | None = None,
        *,
        noise: float = 0.0,
        noise_key: NoiseKey | None = None,
    ) -> None:
        self.platform = platform or SimSettings()
        self.arena = arena or paper_arena()
        self.noise = noise
        self.noise_key = noise_key or NoiseKey(0)
        self.step_s = self.platform.command_s
        self.n_sensors = len(self.platform.model.range)
        self._dtype = REAL[self.platform.precision]
        self.channels = ControllerInterface(sim_inputs(self.platform.model, self.arena)).channels
        self.select(())
        self._begin(self.platform, self.arena)

    def select(self, names: Sequence[str]) -> None:
        """Choose what `observe` reads besides range sensors, from the next `reset` on."""
        self._selected = tuple(names)
        # Networks are not asked here: one without hidden nodes will do.
        self._neat = NeatSettings.named("default").rules(max(len(names), 1), 2)

    def _begin(self, platform: SimSettings, arena: Arena) -> None:
        self._read = self._selected
        self._scene = sim_scene(platform, arena, self._read or ("stall",), self.noise)
        self._rules = sim_rules(self._scene, 1.0)
        self._room = make_sim_room(self._scene.shape, self._neat, 1, self._dtype)
        self._cells = np.zeros((1, arena.grid.n_cells), np.uint8)
        self._commands = np.zeros((2, LANES), self._dtype)
        counters = counters_of(self.noise_key)
        draws = Draws(self._scene.numbers)
        values = draws.draw(self.noise_key.key, counters)[0]
        self.drawn = dict(zip(draws.names, values.tolist(), strict=True))
        self._key = np.uint64(self.noise_key.key)
        table = self._scene.table({**self._scene.fixed, **self.drawn})
        begin_sim(self._scene.shape, table, self._rules, counters, self._room, self._cells)
        look_sim(self._scene.shape, self._rules, self._key, self._room, 0)
        self.n_steps = 0

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial at a pose, or at the arena's start."""
        self._check_open()
        if pose is None:
            self._begin(self.platform, self.arena)
            return
        self._begin(*self.platform.placed(self.arena, pose))

    def observe(self) -> Observation:
        """Read the range sensors and those selected; the same until the next command."""
        self._check_open()
        readings = tuple(self.readings[: self.n_sensors].tolist())
        channels: dict[str, float] = {}
        if self._read:
            observe(self._scene.shape, self._rules, self._room.lanes, self.n_steps)
            values = self._room.lanes.values[: len(self._read), 0].tolist()
            channels = dict(zip(self._read, values, strict=True))
        return Observation(readings, bool(self._room.lanes.stalled[0] > 0), readings, channels)

    def drive(self, command: Command) -> None:
        """Run one command for `step_s` of the simulation."""
        self._check_open()
        self._commands[:, 0] = check_command(command)
        shape, rules, room = self._scene.shape, self._rules, self._room
        move_sim(shape, rules, self._key, room, self._cells, self.n_steps, self._commands)
        self.n_steps += 1
        look_sim(shape, rules, self._key, room, self.n_steps)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of all its readings, such as `range.0`, `light.1`."""
        return sensor_names(self._scene.shape)

    @property
    def readings(self) -> NDArray[np.float64]:
        """Readings of all its sensors, in the order of `sensors`, 0..1, (a,)."""
        readings: NDArray[np.float64] = self._room.lanes.readings[:, 0].astype(np.float64)
        return readings

    @property
    def wheels(self) -> tuple[float, float]:
        """Way of the left and the right wheel since the start of the trial [m]."""
        left, right = self._room.lanes.wheels[:, 0].tolist()
        return left, right

    @property
    def distances(self) -> NDArray[np.float64]:
        """Distances to the nearest object along the rays of all range sensors in turn, without noise, (rays,) [m]."""
        distances: NDArray[np.float64] = self._room.lanes.distances[:, 0].astype(np.float64)
        return distances

    @property
    def encoders(self) -> tuple[float, float]:
        """Way of the left and the right wheel since the start as the robot's encoders tell it [m].

        Raises:
            RobotError: The robot has none.
        """
        self._check_encoders()
        left, right = self._room.lanes.senses.counted[:, 0].tolist()
        return left, right

    @property
    def odometry(self) -> Pose:
        """Pose that a program would estimate from the encoders and the start.

        Raises:
            RobotError: The robot has no encoders.
        """
        self._check_encoders()
        values = {**self._scene.fixed, **self.drawn}
        x, y, heading = (values[f"arena.start.{name}"] for name in ("x", "y", "heading"))
        ahead, left, turned = self._room.lanes.senses.reckoned[:, 0].tolist()
        place = Pose(x, y, heading).point(ahead, left)
        return Pose(*place, (heading + turned * math.tau) % math.tau)

    def _check_encoders(self) -> None:
        if self._scene.robot.encoder is None:
            raise RobotError(f"Robot {self._scene.robot.name!r} has no encoders: nothing counts its wheels.")

    @property
    def pose(self) -> Pose:
        """Pose of the robot."""
        pose = self._room.lanes.pose
        here = np.array([[pose.x[0], pose.y[0], pose.heading[0]]])
        return Pose(*poses_of(here, self._scene.arena.start)[0].tolist())

    @property
    def visited_cells(self) -> tuple[int, ...]:
        """Cells visited along the line, in order of first visit, columns * row + column."""
        return tuple(self._cells[0, : self._room.lanes.n_line[0]].tolist())

    @property
    def n_blocked(self) -> int:
        """Blocked steps so far."""
        return int(self._room.lanes.n_stalls[0])
