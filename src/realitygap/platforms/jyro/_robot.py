"""The platform `jyro` as one robot under the contract that a physical one meets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from realitygap.kernels.jyro.fleet import make_fleet, read_robots, start_robots, step_robots
from realitygap.robots import Command, Label, Observation, ProgramRobot, check_command
from realitygap.trials import NoiseKey, counters_of, poses_of
from realitygap.world import Arena, Pose, paper_arena

from ._settings import STEP_S, JyroSettings
from ._trials import jyro_rules, jyro_scene


class JyroRobot(ProgramRobot):
    """The paper's simulated robot, one command at a time.

    A controller that answers each observation drives the same trial as `try_genomes` with its genome, the same noise,
    and the same key (in double precision, in which networks compute outside of trials).

    | command | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | 1: 0.1 m in a step |
    | turn | -1 | 1 | 1: `platform.turn_per_step` in a step, to the left |

    | observation | from 0 | to 1 | raw |
    |---|---|---|---|
    | obstacle left, center, right | nothing within range | touching | distance [m] |

    Noise carries a reading beyond 0..1, unless the platform clips it; `raw` is without noise.

    Args:
        platform: Settings of the simulated robot. Default: the paper's.
        arena: Arena. Default: the paper's.
        noise: Level a: each reading is moved by a * U(-1, 1).
        noise_key: Key of the random numbers, the same in each trial until `noise_key` is changed.
    """

    label: Label = "SIM"
    step_s = STEP_S

    def __init__(
        self,
        platform: JyroSettings | None = None,
        arena: Arena | None = None,
        *,
        noise: float = 0.0,
        noise_key: NoiseKey | None = None,
    ) -> None:
        self.platform = platform or JyroSettings(precision="double")
        self.arena = arena or paper_arena()
        self.noise_key = noise_key or NoiseKey(0)
        self.n_sensors = len(self.platform.sensors.mounts)
        self._rules = jyro_rules(self.platform, noise=noise, bias_input=False, bias_value=1.0)
        self._begin(self.arena)

    def _begin(self, arena: Arena) -> None:
        self._placed = arena
        self._scene = jyro_scene(self.platform, arena)
        self._fleet = make_fleet(self._scene, 1)
        self._cells = np.zeros((1, arena.grid.n_cells), np.uint8)
        self._counts = np.zeros((1, 3), np.int32)
        start_robots(
            self._scene, self._rules, self._fleet, counters_of(self.noise_key), self._cells, self._counts
        )
        self.n_steps = 0

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial at a pose, or at the arena's start."""
        self._check_open()
        self._begin(self.arena if pose is None else replace(self.arena, start=pose))

    def observe(self) -> Observation:
        """Read the sensors; the same until the next command."""
        self._check_open()
        readings = np.empty((1, self.n_sensors))
        read_robots(self._rules, self._fleet, np.uint64(self.noise_key.key), self.n_steps, readings)
        raw = self._fleet.fractions[0, :, 0].astype(np.float64) * self.platform.sensor_range
        return Observation(
            tuple(readings[0].tolist()), bool(self._fleet.stalled[0, 0] > 0), tuple(raw.tolist())
        )

    def drive(self, command: Command) -> None:
        """Run one command for 0.1 s of the simulation."""
        self._check_open()
        given = np.array([check_command(command)], np.float64)
        step_robots(self._scene, self._fleet, given, self._cells, self._counts)
        self.n_steps += 1

    @property
    def pose(self) -> Pose:
        """Pose of the robot."""
        return Pose(*poses_of(self._fleet.poses[0, :, :1].T, self._placed.start)[0].tolist())

    @property
    def visited_cells(self) -> tuple[int, ...]:
        """Cells visited along the line, in order of first visit, columns * row + column."""
        return tuple(self._cells[0, : self._counts[0, 0]].tolist())

    @property
    def coverage(self) -> tuple[float, float]:
        """Visited share of the reachable cells, 0..1: along the line, and at the ends of steps."""
        n = self.arena.grid.n_cells
        return float(self._counts[0, 0] / n), float(self._counts[0, 1] / n)

    @property
    def n_blocked(self) -> int:
        """Blocked steps so far."""
        return int(self._counts[0, 2])
