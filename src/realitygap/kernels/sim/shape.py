"""The common structure of the trials of one call of the platform `sim`, and the place of each of their numbers.

A robot and its arena are structure (how many corners, sensors, walls, and of which kind) and numbers. The
structure is a `SimShape`, the same for all trials of a call; the numbers are a table with a row for each and a
column for each trial. Every number has a dotted name, as in robot files (`sim_rows`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

# What a body does that meets a wall.
FREEZE, STOP, SLIDE = 0, 1, 2
CONTACT_MODELS = {"freeze": FREEZE, "stop": STOP, "slide": SLIDE}

# What the two commands are.
WHEELS, INDEPENDENT = 0, 1
MIXINGS = {"wheels": WHEELS, "independent": INDEPENDENT}

# How a range sensor answers.
LINEAR, IR, TABLE, PULSES, LORENTZ, LORENTZ_EDGES = 0, 1, 2, 3, 4, 5
RESPONSES = {
    "linear": LINEAR,
    "ir": IR,
    "table": TABLE,
    "pulses": PULSES,
    "lorentz": LORENTZ,
    "lorentz_edges": LORENTZ_EDGES,
}

# What says that a robot stalls: contact that held it up, or an idler wheel as in an S2.
BLOCKED, IDLER = 0, 1
STALLS = {"blocked": BLOCKED, "idler": IDLER}

# How much of a light arrives in the shadow of a wall or an obstacle: there are none, half of it, or nothing.
NO_SHADOWS, HALF_SHADOWS, DARK_SHADOWS = 0, 1, 2
SHADOWS = {"none": NO_SHADOWS, "half": HALF_SHADOWS, "dark": DARK_SHADOWS}

# What a network sees: kind and index of each input. Of a sensor, the index is the place among all readings.
READING, OBSTACLE, STALL, TIME, BIAS, GOAL_SECTOR, GOAL_DISTANCE, ENCODER, LAST_MOVE, LAST_TURN = range(10)
INPUT_KINDS = {
    "obstacle": OBSTACLE,
    "stall": STALL,
    "time": TIME,
    "bias": BIAS,
    "goal_sector": GOAL_SECTOR,
    "goal_distance": GOAL_DISTANCE,
    "encoder": ENCODER,
    "last_move": LAST_MOVE,
    "last_turn": LAST_TURN,
}

# The numbers of each group, in the order of their rows; a row is the first of its group and the place here.
CONTACT_NUMBERS = ("friction", "long", "lat", "ang", "saturation")
DRIVE_NUMBERS = (
    "speed",
    "track",
    "axle",
    "turn_rate",
    "gain_left",
    "gain_right",
    "bias_left",
    "bias_right",
    "dead_band",
    "lag",
    "delay",
    "delay_jitter",
    "slip",
    "travel_noise_per_m",
    "travel_noise_per_s",
    "heading_noise_per_m",
    "heading_noise_per_s",
    "drift_per_m",
    "battery_sag",
    "rise",
    "soft_dead_band",
)
RANGE_NUMBERS = (
    "x",
    "y",
    "direction",
    "cone",
    "reach",
    "amplitude",
    "decay",
    "noise_uniform",
    "noise_gain",
    "drop_most",
    "drop_at",
    "drop_width",
    "outlier_most",
    "outlier_at",
    "outlier_width",
    "burst",
    "incidence",
    "half_width",
    "peak",
    "compression",
)  # then distance and reading of each entry of its table
# The kinds of sensors with a place on the body, in the order of rows and readings, and the numbers of each sensor.
SENSOR_NUMBERS = {
    "range": RANGE_NUMBERS,
    "light": ("x", "y", "direction", "width", "gain", "noise"),
    "line": ("x", "y", "threshold", "noise"),
    "bump": ("x", "y", "reach"),
}
RANGE, LIGHT, LINE, BUMP = range(len(SENSOR_NUMBERS))
STALL_NUMBERS = ("idler", "share", "window")
ENCODER_NUMBERS = ("gain_left", "gain_right", "noise_per_m", "drift_per_m")

# What a number is when nobody says: it changes nothing.
NEUTRAL = {
    "contact.long": 1.0,
    "contact.lat": 1.0,
    "contact.ang": 1.0,
    "drive.track": 1.0,
    "drive.gain_left": 1.0,
    "drive.gain_right": 1.0,
    "encoder.gain_left": 1.0,
    "encoder.gain_right": 1.0,
}
_ENDLESS = 10**9
"""Parts of a step, at most: of a robot that goes as far as numbers do."""
ANGLES = (
    "heading",
    "direction",
    "cone",
    "turn_rate",
    "drift_per_m",
    "heading_noise_per_m",
    "heading_noise_per_s",
)
"""Last parts of names of numbers that are angles. `width` is the angle of a light sensor and the length of an image."""
AXES = {"x": 0, "y": 1, "x1": 0, "y1": 1, "x2": 0, "y2": 1}


class SimShape(NamedTuple):
    """Counts, kinds, and rows: `row_*` are the first rows of groups, in the table or in what follows from it."""

    contact: int  # FREEZE, STOP or SLIDE
    mixing: int  # WHEELS or INDEPENDENT
    ahead: int  # 1 or -1: which end is
    levels: int  # speeds up to full, evenly spaced from 0; 0: all speeds exist
    lowest_level: int  # the number of the slowest that exists
    delay_steps: int  # whole steps by which a command can be late
    late: bool  # whether commands come late at all
    noisy: bool  # whether the drive draws random numbers
    substeps: int  # parts of a step in which contact is looked for
    late_substeps: int  # likewise, of its beginning, when the old command still goes on
    enclosed: bool  # whether the walls close a convex room, so that each is a half-plane
    stall: int  # BLOCKED or IDLER
    light_shadows: int  # NO_SHADOWS, HALF_SHADOWS or DARK_SHADOWS
    columns: int  # of the grid of cells
    rows: int
    part_corners: NDArray[np.int32]  # (k,) corners of each part of the body
    row_part: NDArray[np.int32]  # (k,) x, y of its corners in turn, then its radius
    row_contact: int
    row_drive: int
    encoders: bool  # whether wheel encoders are read
    row_encoder: int
    row_stall: int
    first_reading: NDArray[np.int32]  # (kinds + 1,) the readings of each kind of `SENSOR_NUMBERS` among all
    row_sensor: NDArray[np.int32]  # (r,) first row of each sensor, in the order of the readings
    row_range: NDArray[np.int32]  # (s,) those of the range sensors
    range_response: NDArray[np.int32]  # (s,) LINEAR, IR, TABLE, PULSES or LORENTZ
    range_rays: NDArray[np.int32]  # (s,) how many rays each has
    range_table: NDArray[np.int32]  # (s,) entries of its table
    range_pulses: NDArray[np.int32]  # (s,)
    first_ray: NDArray[np.int32]  # (s + 1,) the rays of each sensor among all
    line_levels: NDArray[np.bool_]  # whether each line sensor answers how dark it is, and not whether
    row_start: int  # x, y, heading
    n_walls: int
    row_wall: int  # x1, y1, x2, y2 of each
    obstacle_corners: NDArray[np.int32]  # (o,) 0: a disc
    obstacle_round: NDArray[np.bool_]  # (o,) whether its radius may be other than 0
    row_obstacle: NDArray[np.int32]  # (o,) x, y, heading, radius, then x, y of its corners
    n_lights: int
    row_lamp: int  # x, y, strength of each light
    row_goal: int  # x, y, radius; -1: no goal
    n_rows: int  # of the table
    n_readings: int  # of all sensors
    inputs: NDArray[np.int32]  # (i, 2) what networks see: kind and index
    floor: NDArray[np.float32]  # (h, w) brightness of the floor, 0..1; (0, 0): no image
    floor_grid: NDArray[np.float64]  # (3,) x, y of its lower left corner [m], pixels per meter
    tapes: NDArray[np.float64]  # (k, 6) lines on the floor: both ends [m], width [m], brightness
    # Rows that follow from the table, behind it
    row_outline: NDArray[np.int32]  # (k,) for each corner of a part, counter-clockwise: x from the axle, y,
    # normal x, y and length of the edge that begins there
    row_reach: int  # the farthest that the body reaches from its axle [m]
    row_bounds: int  # least x, most x, least y and most y of the body, from its axle [m]
    row_plane: int  # normal x, y and offset of each wall
    row_ray: int  # cosine and sine of each ray
    shape_corners: NDArray[np.int32]  # (q,) corners of all that is met as a polygon: obstacles, open walls
    row_shape: NDArray[np.int32]  # (q,) x, y, normal x, y, length for each corner; then its radius
    n_all_rows: int


class _Counts(NamedTuple):
    """Counts that decide the numbers of the table."""

    parts: Sequence[int]
    sensors: Sequence[int]  # of each kind of `SENSOR_NUMBERS`
    range_table: Sequence[int]
    walls: int
    obstacles: Sequence[int]
    lamps: int
    goal: bool


def _names(counts: _Counts) -> list[str]:
    """The numbers of the table, in the order of rows."""
    names: list[str] = []
    for k, corners in enumerate(counts.parts):
        names += [f"body.{k}.corner.{j}.{axis}" for j in range(corners) for axis in "xy"]
        names.append(f"body.{k}.radius")
    names += [f"contact.{name}" for name in CONTACT_NUMBERS]
    names += [f"drive.{name}" for name in DRIVE_NUMBERS]
    names += [f"encoder.{name}" for name in ENCODER_NUMBERS]
    names += [f"stall.{name}" for name in STALL_NUMBERS]
    for (kind, numbers), n in zip(SENSOR_NUMBERS.items(), counts.sensors, strict=True):
        for k in range(n):
            names += [f"{kind}.{k}.{name}" for name in numbers]
            entries = counts.range_table[k] if kind == "range" else 0
            names += [
                f"{kind}.{k}.table.{j}.{name}" for j in range(entries) for name in ("distance", "reading")
            ]
    names += [f"arena.start.{name}" for name in ("x", "y", "heading")]
    names += [f"arena.wall.{k}.{name}" for k in range(counts.walls) for name in ("x1", "y1", "x2", "y2")]
    for k, corners in enumerate(counts.obstacles):
        names += [f"arena.obstacle.{k}.{name}" for name in ("x", "y", "heading", "radius")]
        names += [f"arena.obstacle.{k}.corner.{j}.{axis}" for j in range(corners) for axis in "xy"]
    names += [f"arena.light.{k}.{name}" for k in range(counts.lamps) for name in ("x", "y", "strength")]
    if counts.goal:
        names += [f"arena.goal.{name}" for name in ("x", "y", "radius")]
    return names


def make_sim_shape(
    *,
    parts: Sequence[int],
    contact: str = "slide",
    mixing: str = "wheels",
    ahead: int = 1,
    levels: int = 0,
    lowest_level: int = 1,
    late: bool = True,
    noisy: bool = True,
    delay_steps: int = 0,
    substeps: int = 4,
    late_substeps: int = 1,
    stall: str = "blocked",
    range_response: Sequence[str] = (),
    range_rays: Sequence[int] | None = None,
    range_table: Sequence[int] | None = None,
    range_pulses: Sequence[int] | None = None,
    encoders: bool = False,
    sensors: Mapping[str, int] | None = None,
    light_shadows: str = "none",
    line_levels: Sequence[bool] | None = None,
    n_walls: int = 0,
    enclosed: bool = False,
    obstacles: Sequence[int] = (),
    obstacle_round: Sequence[bool] | None = None,
    n_lamps: int = 0,
    goal: bool = False,
    columns: int = 1,
    rows: int = 1,
    inputs: Sequence[tuple[str, int]] = (("obstacle", 0), ("stall", 0), ("time", 0)),
    floor: NDArray[np.float32] | None = None,
    floor_grid: Sequence[float] = (0.0, 0.0, 1.0),
    tapes: Sequence[Sequence[float]] = (),
) -> SimShape:
    """The structure of a robot and its arena.

    Args:
        parts: Corners of each part of the body.
        contact: "freeze", "stop" or "slide".
        mixing: "wheels" or "independent".
        ahead: 1, or -1 where the end at -x is ahead.
        levels, lowest_level: Speeds that exist: lowest_level / levels up to 1; 0: all.
        late, noisy: Whether the drive has a delay, and random numbers; without, they need not be worked out.
        delay_steps: Whole steps by which a command can be late at most.
        substeps, late_substeps: Parts of a step in which contact is looked for, of the new command and of the
            old one that goes on before it (`substeps_for`).
        stall: "blocked" or "idler".
        range_response: A key of `RESPONSES` for each range sensor.
        range_rays, range_table, range_pulses: Rays (1 or odd), entries of the table, and pulses of each.
        encoders: Whether wheel encoders are read; they are where networks see them.
        sensors: Number of the other sensors, by kind.
        light_shadows: "none", "half" or "dark".
        line_levels: Whether each line sensor answers how dark the floor is, and not whether it is.
        n_walls, enclosed: Walls, and whether they close a convex room (`encloses`).
        obstacles: Corners of each, in order counter-clockwise; 0: a disc.
        obstacle_round: Whether the radius of each may be other than 0; discs' may.
        n_lamps, goal: Lights, and whether there is a goal.
        columns, rows: Of the grid of cells.
        inputs: What networks see: a key of `SENSOR_NUMBERS` or `INPUT_KINDS`, and an index each.
        floor, floor_grid: Image of the floor (h, w), row 0 lowest in y, and where it lies: x, y of its lower left
            corner [m from the origin of the table], pixels per meter.
        tapes: Both ends [m from the origin], width [m] and brightness of each line on the floor.
    """
    s = len(range_response)
    rays = np.ones(s, np.int32) if range_rays is None else np.array(range_rays, np.int32)
    table = np.zeros(s, np.int32) if range_table is None else np.array(range_table, np.int32)
    pulses = np.zeros(s, np.int32) if range_pulses is None else np.array(range_pulses, np.int32)
    if obstacle_round is None:
        obstacle_round = [corners == 0 for corners in obstacles]
    n_sensors = {**dict.fromkeys(SENSOR_NUMBERS, 0), **(sensors or {}), "range": s}
    first = np.concatenate([[0], np.cumsum(list(n_sensors.values()))]).astype(np.int32)
    names = _names(
        _Counts(parts, list(n_sensors.values()), table.tolist(), n_walls, obstacles, n_lamps, goal)
    )
    row = {name: k for k, name in enumerate(names)}
    row_sensor = np.array([row[f"{kind}.{k}.x"] for kind, n in n_sensors.items() for k in range(n)], np.int32)
    first_of_kind = dict(zip(n_sensors, first.tolist(), strict=False))
    seen = [
        (READING, first_of_kind[kind] + index) if kind in first_of_kind else (INPUT_KINDS[kind], index)
        for kind, index in inputs
    ]
    first_ray = np.concatenate([[0], np.cumsum(rays)]).astype(np.int32)
    polygons = [max(corners, 1) for corners in obstacles] + ([] if enclosed else [2] * n_walls)
    end = len(names)
    row_outline, end = _stack([5 * corners for corners in parts], end)
    row_reach, end = end, end + 1
    row_bounds, end = end, end + 4
    row_plane, end = end, end + (3 * n_walls if enclosed else 0)
    row_ray, end = end, end + 2 * int(first_ray[-1])
    row_shape, end = _stack([5 * corners + 1 for corners in polygons], end)
    return SimShape(
        contact=CONTACT_MODELS[contact],
        mixing=MIXINGS[mixing],
        ahead=ahead,
        levels=levels,
        lowest_level=lowest_level,
        late=late,
        noisy=noisy,
        delay_steps=delay_steps,
        substeps=substeps,
        late_substeps=late_substeps,
        enclosed=enclosed,
        stall=STALLS[stall],
        light_shadows=SHADOWS[light_shadows],
        columns=columns,
        rows=rows,
        part_corners=np.array(parts, np.int32),
        row_part=_firsts(row, "body.{}.corner.0.x", len(parts)),
        row_contact=row["contact.friction"],
        row_drive=row["drive.speed"],
        encoders=encoders or any(kind == "encoder" for kind, _ in inputs),
        row_encoder=row["encoder.gain_left"],
        row_stall=row["stall.idler"],
        first_reading=first,
        row_sensor=row_sensor,
        row_range=row_sensor[:s],
        range_response=np.array([RESPONSES[name] for name in range_response], np.int32),
        range_rays=rays,
        range_table=table,
        range_pulses=pulses,
        first_ray=first_ray,
        line_levels=np.array([False] * n_sensors["line"] if line_levels is None else line_levels, np.bool_),
        row_start=row["arena.start.x"],
        n_walls=n_walls,
        row_wall=row.get("arena.wall.0.x1", -1),
        obstacle_corners=np.array(obstacles, np.int32),
        obstacle_round=np.array(obstacle_round, np.bool_),
        row_obstacle=_firsts(row, "arena.obstacle.{}.x", len(obstacles)),
        n_lights=n_lamps,
        row_lamp=row.get("arena.light.0.x", -1),
        row_goal=row.get("arena.goal.x", -1),
        n_rows=len(names),
        n_readings=len(row_sensor),
        inputs=np.array(seen, np.int32).reshape(-1, 2),
        floor=np.zeros((0, 0), np.float32) if floor is None else np.ascontiguousarray(floor, np.float32),
        floor_grid=np.array(floor_grid, np.float64),
        tapes=np.array(tapes, np.float64).reshape(-1, 6),
        row_outline=row_outline,
        row_reach=row_reach,
        row_bounds=row_bounds,
        row_plane=row_plane,
        row_ray=row_ray,
        shape_corners=np.array(polygons, np.int32),
        row_shape=row_shape,
        n_all_rows=end,
    )


def _firsts(row: Mapping[str, int], name: str, n: int) -> NDArray[np.int32]:
    return np.array([row[name.format(k)] for k in range(n)], np.int32)


def _stack(sizes: Sequence[int], first: int) -> tuple[NDArray[np.int32], int]:
    """Return the first row of each of several consecutive groups of rows, from `first` on, and the end of the last."""
    ends = first + np.cumsum([0, *sizes])
    return ends[:-1].astype(np.int32), int(ends[-1])


def sim_rows(shape: SimShape) -> dict[str, int]:
    """The row of the table in which each number is, by its dotted name."""
    counts = _Counts(
        parts=shape.part_corners.tolist(),
        sensors=np.diff(shape.first_reading).tolist(),
        range_table=shape.range_table.tolist(),
        walls=shape.n_walls,
        obstacles=shape.obstacle_corners.tolist(),
        lamps=shape.n_lights,
        goal=shape.row_goal >= 0,
    )
    return {name: k for k, name in enumerate(_names(counts))}


def is_angle(name: str) -> bool:
    """Whether a number is an angle or a rate of one, which the table holds in whole turns."""
    last = name.rsplit(".", 1)[-1]
    return last in ANGLES or (name.startswith("light.") and last == "width")


def sim_table(
    shape: SimShape,
    numbers: Mapping[str, float | NDArray[np.floating]],
    dtype: type[np.floating],
    origin: Sequence[float] = (0.0, 0.0),
) -> NDArray[np.floating]:
    """The table of the numbers of n trials, from what they are called, in meters and radians.

    Args:
        shape: The structure.
        numbers: A number for all trials, or (n,) one for each, by dotted name. One that is missing changes nothing.
        dtype: Precision of the trials.
        origin: (x, y) of the arena from which trials measure positions, best the start's.

    Returns:
        (p, n), or (p, 1) where each number is the same for all: angles in whole turns, places from the origin.

    Raises:
        KeyError: A number that this structure does not have.
    """
    rows = sim_rows(shape)
    n = max((np.size(value) for value in numbers.values()), default=1)
    table = np.zeros((len(rows), n), np.float64)
    for name, value in NEUTRAL.items():
        table[rows[name]] = value
    for name, value in numbers.items():
        table[rows[name]] = value
    for name, row in rows.items():
        table[row] = in_table(name, table[row], origin)
    return table.astype(dtype)


def in_table(
    name: str, values: NDArray[np.float64], origin: Sequence[float] = (0.0, 0.0)
) -> NDArray[np.float64]:
    """Values of a number as the table holds them: angles in whole turns, places in the arena from the origin."""
    if is_angle(name):
        return values / math.tau
    parts = name.split(".")
    if parts[0] == "arena" and "corner" not in parts and parts[-1] in AXES:
        return values - origin[AXES[parts[-1]]]
    return values


def encloses(walls: NDArray[np.float64], start: Sequence[float]) -> bool:
    """Whether walls (w, 4) close a convex room around a start, so that each may be taken for a half-plane."""
    ends = [tuple(end) for wall in walls.tolist() for end in (wall[:2], wall[2:])]
    along = walls[:, 2:] - walls[:, :2]
    if len(walls) < 3 or any(ends.count(end) != 2 for end in ends) or not np.hypot(*along.T).all():
        return False
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    at_start = normals @ np.asarray(start[:2], np.float64) - (normals * walls[:, :2]).sum(1)
    normals *= np.sign(at_start)[:, None]
    gaps = normals @ walls.reshape(-1, 2).T - (normals * walls[:, :2]).sum(1)[:, None]
    return bool((at_start != 0).all() and gaps.min() >= -1e-9)


def half_width(corners: ArrayLike, radius: ArrayLike) -> NDArray[np.float64]:
    """Half of what a part of a body measures where it is narrowest [m].

    Args:
        corners: (..., n, 2) [m], around.
        radius: (...) by which it is rounded [m].
    """
    points = np.asarray(corners, np.float64)
    along = np.roll(points, -1, axis=-2) - points
    size = np.hypot(along[..., 0], along[..., 1])
    normals = np.stack([along[..., 1], -along[..., 0]], axis=-1) / np.where(size > 0, size, 1.0)[..., None]
    widths = np.ptp(normals @ np.swapaxes(points, -1, -2), axis=-1)
    narrowest = np.where(size > 0, widths, np.inf).min(axis=-1)
    return np.asarray(np.where(np.isfinite(narrowest), narrowest, 0.0) / 2 + radius)


def substeps_for(travel: ArrayLike, half: ArrayLike) -> NDArray[np.int64]:
    """Parts of a step in which contact must be looked for, so that nothing thin is passed through.

    In each part the body moves less than a quarter of its half width: what it meets is always pushed back out to the
    side where it came from. Half of it would be enough for that; the rest, and that there are at least two, is for
    the sake of exactness.

    Args:
        travel: The farthest that a wheel drives in a step [m], of any number of robots.
        half: Of a part of the body, the smallest, its `half_width` [m]; of as many.
    """
    way, half = np.abs(travel), np.asarray(half, np.float64)
    parts = np.ceil(4 * way / np.where(half > 0, half, 1.0))
    return np.where(half > 0, np.clip(parts, 2, _ENDLESS), 64).astype(np.int64)
