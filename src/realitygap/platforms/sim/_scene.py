"""A robot and an arena in the form that the kernels of `sim` read: structure, and a table of numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.evolution import ControllerInterface
from realitygap.kernels.sim.shape import (
    SimShape,
    encloses,
    half_width,
    in_table,
    make_sim_shape,
    sim_rows,
    sim_table,
    substeps_for,
)
from realitygap.trials import REAL
from realitygap.world import Arena, Distribution, FloorImage, Obstacle, RobotModel

from ._settings import ARENA, SimSettings

Numbers = Mapping[str, float | Distribution]


@dataclass(frozen=True)
class SimScene:
    """A robot in an arena, of which some numbers may be drawn.

    Attributes:
        platform: Settings of the platform.
        robot: Robot with these settings.
        arena: Arena with these settings.
        shape: Values that all trials share.
        numbers: Numbers of robot and arena, by dotted name.
        rows: Row of each number in the table.
    """

    platform: SimSettings
    robot: RobotModel
    arena: Arena
    shape: SimShape
    numbers: Numbers
    rows: dict[str, int]

    @property
    def drawn_names(self) -> tuple[str, ...]:
        """Names of the sampled numbers, in the order of the records."""
        return tuple(name for name, value in self.numbers.items() if isinstance(value, Distribution))

    @property
    def origin(self) -> tuple[float, float]:
        """Origin of the positions in trials: the start [m]."""
        return self.arena.start.x, self.arena.start.y

    def table(self, values: Mapping[str, float | NDArray[np.float64]]) -> NDArray[np.floating]:
        """Return the numbers of n trials, (p, n), or (p, 1), from values in meters and radians."""
        return sim_table(self.shape, values, REAL[self.platform.precision], self.origin)

    def rows_of(self, values: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return some rows of the table, in the order of the names, (d, n)."""
        return np.array([in_table(name, value, self.origin) for name, value in values.items()])

    @property
    def fixed(self) -> dict[str, float]:
        """The numbers that are not drawn, and the centers of those that are."""
        return {
            name: value.center if isinstance(value, Distribution) else value
            for name, value in self.numbers.items()
        }


def sim_scene(platform: SimSettings, arena: Arena, inputs: Sequence[str], noise: float) -> SimScene:
    """Return robot and arena with all settings, and what networks see of them.

    Args:
        platform: The robot as simulated.
        arena: Arena. The numbers in `platform.set` replace its own.
        inputs: Names of what networks see, in order.
        noise: The paper's a, on top of the robot's own noise: each range reading is moved by a * U(-1, 1).

    Raises:
        ValueError: An input that the robot or arena does not have, noise that is not a finite number from 0 on, a
            number that the arena does not have, more than 256 cells, or a robot to be drawn from no calibration.
    """
    if platform.randomize == "posterior" and not platform.draws:
        raise ValueError(
            f"randomize is 'posterior', and robot {platform.robot.name!r} comes from no calibration with draws. "
            "Expected sim:FILE with a file that `realitygap calibrate` wrote."
        )
    if not (math.isfinite(noise) and noise >= 0):
        raise ValueError(f"noise is {noise}, expected a finite number, 0 or more.")
    if arena.grid.n_cells > 256:
        raise ValueError(f"The arena has {arena.grid.n_cells} reachable cells, expected at most 256.")
    robot = platform.model
    if platform.arena_numbers:
        try:
            arena = arena.with_numbers(platform.arena_numbers)
        except ValueError as error:
            lines = [line.removeprefix("ArenaFile").lstrip(".: ") for line in str(error).split("\n")]
            said = [f"{ARENA}{line.rstrip('.')}".replace("mean '", f"mean '{ARENA}") for line in lines]
            raise ValueError("sim.set: " + "; ".join(said)) from None
    numbers: dict[str, float | Distribution] = {**robot.numbers(), **arena.numbers()}
    if noise > 0:
        for k in range(len(robot.range)):
            if highest(numbers[f"range.{k}.noise_uniform"]) > 0:
                raise ValueError(
                    f"noise is {noise:g}, and the robot has range.{k}.noise_uniform in its file, the same kind "
                    "of noise. Leave one of them out."
                )
        numbers |= {f"range.{k}.noise_uniform": noise for k in range(len(robot.range))}
    shape = _shape_of(robot, arena, numbers, _inputs(inputs, robot, arena), platform.command_s)
    rows = sim_rows(shape)
    return SimScene(
        platform,
        robot,
        arena,
        shape,
        {name: value for name, value in numbers.items() if name in rows},
        rows,
    )


def highest(value: float | Distribution) -> float:
    """Return the most that a number can be."""
    return value.highest if isinstance(value, Distribution) else value


# A delay is a queue of commands for each robot.
MOST_DELAY_STEPS = 1000

N_SECTORS = 4
"""Pie slices around a robot of which it knows whether the goal is in them."""

MOST_PARTS = 1_000
"""Maximum number of parts of a step, in each of which contact is checked. More parts mean a body that moves by hundreds
of its own sizes in a step, which is a mistake."""

IN_PARTS = tuple(
    f"drive.{name}"
    for name in (
        "speed",
        "gain_left",
        "gain_right",
        "bias_left",
        "bias_right",
        "travel_noise_per_m",
        "travel_noise_per_s",
        "delay",
        "delay_jitter",
    )
)
"""Numbers on which the parts of a step depend."""

_DRAWN_IN_STEPS = (
    "delay_jitter",
    "travel_noise_per_m",
    "travel_noise_per_s",
    "heading_noise_per_m",
    "heading_noise_per_s",
)


def _shape_of(
    robot: RobotModel, arena: Arena, numbers: Numbers, inputs: list[tuple[str, int]], step_s: float
) -> SimShape:
    """Return the structure of robot and arena."""
    most = {name: largest(numbers[name]) for name in IN_PARTS}
    latest = float(_latest(most))
    if latest > MOST_DELAY_STEPS * step_s:
        raise ValueError(
            f"drive.delay and drive.delay_jitter come to {latest:g} s, expected at most {MOST_DELAY_STEPS} steps of "
            f"{step_s:g} s."
        )
    drive, walls = robot.drive, np.array(arena.walls, np.float64).reshape(-1, 4)
    substeps, late_substeps = parts_of_step(robot, most, step_s)
    moving = any(
        name.startswith("arena.wall.") and isinstance(numbers[name], Distribution) for name in numbers
    )
    x, y = arena.start.x, arena.start.y
    image, grid = _floor_image(arena.floor.image)
    half = arena.floor.tape_width
    return make_sim_shape(
        parts=[len(part.corner) for part in robot.body],
        contact=robot.contact.model,
        mixing=drive.mixing,
        ahead=drive.ahead,
        levels=drive.levels,
        lowest_level=drive.lowest_level,
        delay_steps=math.ceil(latest / step_s),
        late=latest > 0,
        noisy=any(highest(numbers[f"drive.{name}"]) > 0 for name in _DRAWN_IN_STEPS),
        substeps=int(substeps),
        late_substeps=int(late_substeps),
        range_response=[sensor.response + "_edges" * sensor.keeps_edge for sensor in robot.range],
        range_rays=[sensor.rays for sensor in robot.range],
        range_table=[len(sensor.table) for sensor in robot.range],
        range_pulses=[sensor.pulses for sensor in robot.range],
        encoders=robot.encoder is not None,
        sensors={kind: len(sensors) for kind, sensors in robot.sensors.items() if kind != "range"},
        light_shadows=robot.shadows,
        stall=robot.stall.kind,
        line_levels=[sensor.level for sensor in robot.line],
        n_walls=len(walls),
        enclosed=not moving and encloses(walls, arena.start),
        obstacles=[_n_corners(obstacle, k, numbers) for k, obstacle in enumerate(arena.obstacles)],
        obstacle_round=[
            len(obstacle.corners) == 1 or highest(numbers[f"arena.obstacle.{k}.radius"]) > 0
            for k, obstacle in enumerate(arena.obstacles)
        ],
        n_lamps=len(arena.lights),
        goal=arena.goal is not None,
        columns=arena.grid.columns,
        rows=arena.grid.rows,
        floor=image,
        floor_grid=(grid[0] - x, grid[1] - y, grid[2]),
        tapes=[(x1 - x, y1 - y, x2 - x, y2 - y, half, 0.0) for x1, y1, x2, y2 in arena.floor.tape],
        inputs=inputs,
    )


def parts_of_step(
    robot: RobotModel,
    most: Mapping[str, ArrayLike],
    step_s: float,
    halves: Sequence[ArrayLike] = (),
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the parts with contact checks: of a step, and of its start while the previous command continues.

    Args:
        robot: Robot with the bodies.
        most: The largest magnitude of each of the numbers `IN_PARTS`; of any number of robots.
        step_s: Time between commands [s].
        halves: The half width of each body, of as many robots [m]; the robot's own when not given.

    Raises:
        ValueError: A robot drives so far in a step that there are more than `MOST_PARTS`.
    """
    way, latest = _farthest(most, step_s), _latest(most)
    if not halves:
        halves = [own_half(robot, number) for number in range(len(robot.body))]
    parts = [substeps_for(way, half) for half in halves]
    substeps = np.max(np.broadcast_arrays(*parts), axis=0)
    if robot.contact.model == "freeze":
        # Nothing is pushed out, so that a part may be nearly as long as the body is wide; Jyro looks once.
        substeps = -(-substeps // 6)
    if substeps.max() > MOST_PARTS:
        raise ValueError(
            f"the robot drives up to {way.max():,.4g} m in a step, which needs {substeps.max():,} parts to "
            f"look for contact in; expected at most {MOST_PARTS:,}. Is drive.speed in m/s, and step_s in s?"
        )
    while_late = np.maximum(1.0, np.ceil(substeps * np.minimum(latest / step_s, 1.0)))
    return substeps, np.where(latest > 0, while_late, 0.0).astype(np.int64)


def own_half(robot: RobotModel, number: int) -> NDArray[np.float64]:
    """Return the half width of a part of its body as the robot's file has it [m]."""
    body = robot.body[number]
    return half_width([(corner.x, corner.y) for corner in body.corner], body.radius)


def _latest(most: Mapping[str, ArrayLike]) -> NDArray[np.float64]:
    """Return the maximum delay of a command [s]."""
    return np.add(most["drive.delay"], most["drive.delay_jitter"])


def _farthest(most: Mapping[str, ArrayLike], step_s: float) -> NDArray[np.float64]:
    """Return the maximum distance of a wheel in a step [m], with noise of six standard deviations."""
    gain, bias = (
        np.maximum(most[f"drive.{name}_left"], most[f"drive.{name}_right"]) for name in ("gain", "bias")
    )
    way = (np.multiply(most["drive.speed"], gain) + bias) * step_s
    per_m, per_s = (np.square(most[f"drive.travel_noise_per_{each}"]) for each in ("m", "s"))
    variance = per_m * way + per_s * step_s
    return np.asarray(way + 6.0 * np.sqrt(variance))


def largest(value: float | Distribution) -> float:
    """Return the largest magnitude that a number can have."""
    return max(abs(value.lowest), abs(value.highest)) if isinstance(value, Distribution) else abs(value)


def _n_corners(obstacle: Obstacle, k: int, numbers: Numbers) -> int:
    """Return 0 for a disc around its own origin, whose corner needs no numbers."""
    middle = all(numbers[f"arena.obstacle.{k}.corner.0.{axis}"] == 0.0 for axis in "xy")
    return 0 if len(obstacle.corners) == 1 and middle else len(obstacle.corners)


def _floor_image(image: FloorImage | None) -> tuple[NDArray[np.float32] | None, tuple[float, float, float]]:
    """Return brightness 0..1 in square pixels, (h, w), row 0 lowest; its lower left corner [m]; pixels per meter."""
    if image is None:
        return None, (0.0, 0.0, 1.0)
    per_m = max(image.columns / image.width, image.rows / image.height)
    columns = np.minimum(
        (np.arange(max(1, round(image.width * per_m))) + 0.5) / per_m / image.width * image.columns,
        image.columns - 1,
    )
    rows = np.minimum(
        (np.arange(max(1, round(image.height * per_m))) + 0.5) / per_m / image.height * image.rows,
        image.rows - 1,
    )
    upwards = image.gray[::-1].astype(np.float32) / np.float32(255)
    return upwards[rows.astype(int)][:, columns.astype(int)], (image.x, image.y, per_m)


def sim_inputs(robot: RobotModel, arena: Arena) -> tuple[str, ...]:
    """Return names of all that networks can see of a robot in an arena, the constant input included."""
    counts = {kind: len(sensors) for kind, sensors in robot.sensors.items()}
    counts["encoder"] = 0 if robot.encoder is None else 2
    counts["goal_sector"] = 0 if arena.goal is None else N_SECTORS
    names = ["stall", "time", "bias", "last_move", "last_turn"]
    names += ["obstacle"] if robot.range else []
    names += [] if arena.goal is None else ["goal_distance"]
    return (*names, *(f"{kind}.{k}" for kind, n in counts.items() for k in range(n)))


def _inputs(names: Sequence[str], robot: RobotModel, arena: Arena) -> list[tuple[str, int]]:
    """Return the kind and index of each input.

    Raises:
        ControllerError: This robot in this arena does not have one of them.
    """
    where = f"robot {robot.name!r} in arena {arena.name!r}"
    ControllerInterface(tuple(names)).check(sim_inputs(robot, arena), "A network", where)
    parts = [name.partition(".") for name in names]
    return [(kind, int(index or 0)) for kind, _, index in parts]
