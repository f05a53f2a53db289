"""Run a case of the platform `jyro`: the scene it describes, step by step."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.jyro import scene as kernel
from realitygap.records import is_special, write_whole
from realitygap.world import Case, CaseBody, CaseDevice

from ..errors import CaseError, RecordError

_LIGHTS = {
    "linear": kernel.SENSOR_LIGHT_LINEAR,
    "ambient": kernel.SENSOR_LIGHT_AMBIENT,
    "direct": kernel.SENSOR_LIGHT_DIRECT,
}
_INPUTS = {
    "max_inverted": kernel.INPUT_MAX_INVERTED,
    "all_inverted": kernel.INPUT_ALL_INVERTED,
    "stall": kernel.INPUT_STALL,
    "time": kernel.INPUT_TIME,
}
_COLUMNS = ["step", "robot", "time", "x", "y", "heading", "stall", "cmd_v", "cmd_w", "energy"]


@dataclass(frozen=True)
class SceneTrack:
    """The tracks of a scene; row 0 is the start. Letters: t steps, r robots, s sensors of one robot.

    Attributes:
        times: (t + 1,) [s].
        poses: (t + 1, r, 3) x, y [m], heading [rad, 0 faces +y, counter-clockwise]; in [0, 2 pi) once the
            robot has moved, and as given until then.
        stalls: (t + 1, r) 1 if the step was blocked.
        commands: (t + 1, r, 2) speed [m/s], turn rate [rad/s] used in the step; 0 in row 0.
        energies: (t + 1, r) Jyro's counter: 10000, less one for each step with a command other than 0.
        readings: (t + 1, s) for each robot, readings of all devices in order: distance [m], bumper 0 or 1, light.
    """

    times: NDArray[np.float64]
    poses: NDArray[np.float64]
    stalls: NDArray[np.int64]
    commands: NDArray[np.float64]
    energies: NDArray[np.float64]
    readings: list[NDArray[np.float64]]

    def write_csv(self, path: Path) -> None:
        """Write a row per step and robot, with full numbers. An existing file is replaced once all is written.

        Columns: step, robot, time, x, y, heading, stall, cmd_v, cmd_w, energy, s0, s1, ... A robot with fewer
        sensors than another leaves its last columns empty.

        Raises:
            CaseError: The file cannot be written, or belongs to a study's results.
        """
        try:
            write_whole(path, (f"{line}\n".encode() for line in self._lines()))
        except RecordError as error:
            raise CaseError(str(error)) from error

    def _lines(self) -> Iterator[str]:
        n_sensors = [readings.shape[1] for readings in self.readings]
        most = max(n_sensors)
        yield ",".join(_COLUMNS + [f"s{i}" for i in range(most)])
        times, poses, stalls = self.times.tolist(), self.poses.tolist(), self.stalls.tolist()
        commands, energies = self.commands.tolist(), self.energies.tolist()
        readings = [robot.tolist() for robot in self.readings]
        for step, time in enumerate(times):
            for robot, n in enumerate(n_sensors):
                values = [time, *poses[step][robot], stalls[step][robot], *commands[step][robot]]
                values += [energies[step][robot], *readings[robot][step]]
                yield ",".join([str(step), str(robot), *map(repr, values)] + [""] * (most - n))


def simulate_case(case: Case) -> SceneTrack:
    """Simulate the robots of a case as Jyro 0.3.2 does.

    Args:
        case: A case, from `Case.read` or `Case.from_dict`.

    Returns:
        The track of all robots over all steps.

    Raises:
        CaseError: A number grows beyond what a float64 holds.

    Source: Jyro 0.3.2. Differs: sensors are read at the start when all robots are in place, and not
    while they are being added.
    """
    scene = _as_arrays(case)
    times, poses, stalls, commands, energies, readings = kernel.run_scene(scene, case.dt, case.steps)
    _refuse_beyond_numbers(case, {"poses": poses, "times": times, "readings": readings, "commands": commands})
    parts = [
        readings[:, first:last]
        for first, last in zip(scene.sensor_rows[:-1], scene.sensor_rows[1:], strict=True)
    ]
    return SceneTrack(times, poses, stalls, commands, energies, parts)


def _refuse_beyond_numbers(case: Case, found: dict[str, NDArray[np.float64]]) -> None:
    for name, values in found.items():
        steps = np.flatnonzero(~np.isfinite(values.reshape(len(values), -1)).all(axis=1))
        if len(steps):
            raise CaseError(
                f"The {name} are no finite numbers from step {steps[0]} on: dt {case.dt:g}, a command or a place is "
                "too large. Make it smaller."
            )


def simulate_file(case: str | Path, out: str | Path) -> tuple[Case, SceneTrack]:
    """Run the case in the JSON file `case` and write its track to `out`, a CSV file.

    Raises:
        CaseError: The case cannot be run as written, or `out` does not end in .csv, cannot be written, or belongs to a
            study's results.
    """
    case, out = Path(case), Path(out)
    if case.exists() and out.exists() and case.samefile(out):
        raise CaseError(f"{out}: would overwrite the case itself. Name another file for the result.")
    _check_ending(out)
    described = Case.read(case)
    track = simulate_case(described)
    track.write_csv(out)
    return described, track


def _check_ending(out: Path) -> None:
    if out.suffix.lower() not in (".csv", "") and not is_special(out):
        raise CaseError(f"{out} ends in {out.suffix}, expected .csv: a track is a CSV file.")


def _as_arrays(case: Case) -> kernel.Scene:
    """Return the case as the kernel takes it."""
    robots = case.robots
    devices = [_all_sensors(robot.devices) for robot in robots]
    sensors = [sensor for robot in devices for sensor in robot]
    networks = [robot.controller for robot in robots]
    layers = [layer for network in networks if network for layer in network.layers]
    names = [robot.name for robot in robots]
    bodies = [_edges(robot.bounding_box) for robot in robots]
    commands = np.zeros((case.steps, len(robots), 2))
    scales = np.ones((len(robots), 3))
    for i, robot in enumerate(robots):
        if robot.controller:
            scales[i] = [*robot.controller.output_scale, robot.controller.sensor_max_range]
        elif case.steps:
            commands[:, i] = robot.commands[: case.steps]
    return kernel.Scene(
        walls=_table(case.world.lines(), 4),
        lights=_table(case.world.lights, 3),
        starts=_table([[robot.start.x, robot.start.y, robot.start.heading] for robot in robots], 3),
        names=np.array([names.index(name) for name in names], np.int64),
        edges=_table([edge for body in bodies for edge in body], 4),
        edge_rows=_row_starts(len(body) for body in bodies),
        mounts=_table([mount for mount, _, _ in sensors], 3),
        sensors=np.array([kind for _, kind, _ in sensors], np.int64),
        reaches=np.array([reach for _, _, reach in sensors], np.float64),
        sensor_rows=_row_starts(len(robot) for robot in devices),
        commands=commands,
        layers=np.array([(len(layer.weights), len(layer.weights[0])) for layer in layers], np.int64).reshape(
            -1, 2
        ),
        layer_rows=_row_starts(len(network.layers) if network else 0 for network in networks),
        weights=np.array(
            [w for layer in layers for row in [*layer.weights, layer.bias] for w in row], np.float64
        ),
        inputs=np.array(
            [_INPUTS[name] for network in networks if network for name in network.inputs], np.int64
        ),
        input_rows=_row_starts(len(network.inputs) if network else 0 for network in networks),
        scales=scales,
    )


def _edges(body: CaseBody) -> list[tuple[float, float, float, float]]:
    """Forward and left of both ends of each edge [m]: each corner is joined to the one before."""
    corners = list(zip(body.x, body.y, strict=True))
    return [(*corner, *corners[i - 1]) for i, corner in enumerate(corners)]


def _all_sensors(devices: list[CaseDevice]) -> list[tuple[list[float], int, float]]:
    """Return the mount, kind for the kernel and maximum range [m] of each sensor of a robot, in order."""
    return [
        (mount, _sensor_kind(device), device.max_range) for device in devices for mount in device.geometry
    ]


def _sensor_kind(device: CaseDevice) -> int:
    if device.reads_light:
        return _LIGHTS[device.mode]
    return kernel.SENSOR_BUMPER if device.type == "bumper" else kernel.SENSOR_RANGE


def _table(rows: Iterable[Iterable[float]], n_columns: int) -> NDArray[np.float64]:
    return np.array([tuple(row) for row in rows], np.float64).reshape(-1, n_columns)


def _row_starts(counts: Iterable[int]) -> NDArray[np.int64]:
    """Return the first row of each robot, (r + 1,), from the numbers of rows."""
    return np.cumsum([0, *counts]).astype(np.int64)
