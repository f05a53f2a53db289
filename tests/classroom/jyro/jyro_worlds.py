"""Set-ups of `tests/data/world_of_jyro`, which real Jyro has carried out, carried out here."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.classroom import jyro
from realitygap.world import Pose

FOLDER = Path(__file__).parents[2] / "data" / "world_of_jyro"
HALF_PI = np.pi / 2
SETUPS = sorted(path.stem for path in FOLDER.glob("*.json") if path.stem not in ("colors", "groups"))


def read(name: str) -> Any:
    return json.loads((FOLDER / f"{name}.json").read_text("utf-8"))


def build(setup: dict[str, Any]) -> jyro.JyroWorld:
    """The world of a set-up, with everything in it."""
    world = jyro.JyroWorld()
    for box in setup["world"]["boxes"]:
        world.add_box(*box)
    for wall in setup["world"]["walls"]:
        world.add_wall(*wall)
    for light in setup["world"]["lights"]:
        world.add_light(*light)
    world.light_above_walls = setup["world"]["light_above_walls"]
    for given in setup["robots"]:
        robot = world.add(make_robot(given))
        robot.keep_trail = given.get("trail", False)
        for device in given["devices"]:
            robot.add(make_device(device))
    return world


def make_robot(given: dict[str, Any]) -> jyro.SceneRobot:
    x, y, heading = given["start"]
    common: dict[str, Any] = {"name": given["name"], "color": given["color"]}
    if given["kind"] in ("Scribbler", "Pioneer", "Blimp"):
        return getattr(jyro, given["kind"])(x, y, heading + HALF_PI, **common)
    common["body"] = list(zip(*given["box"], strict=True)) if "box" in given else ()
    if "segments" in given:
        ends = list(zip(*given["segments"], strict=True))
        common["segments"] = [(*one, *other) for one, other in zip(ends[::2], ends[1::2], strict=True)]
    kind = jyro.Puck if given["kind"] == "Puck" else jyro.SceneRobot
    return kind(x, y, heading + HALF_PI, **common)


def make_device(given: dict[str, Any]) -> jyro.Device:
    kind = given["kind"]
    if kind == "RangeSensor":
        return jyro.RangeSensor(given["mounts"], given["max_range"])
    if kind == "Camera":
        return jyro.Camera(field=np.radians(given["field"]), fade=given["fade"])
    if kind == "DepthCamera":
        return jyro.DepthCamera(given["max_range"], field=np.radians(given["field"]))
    if kind == "LightSensor":
        ignored = given.get("ignore", ["self"])
        return jyro.LightSensor(
            given["mounts"],
            given["max_range"],
            mode=given["mode"],
            own_shadow="self" not in ignored and "all" not in ignored,
            shadows="other" not in ignored and "all" not in ignored,
        )
    if "mode" in given:
        return getattr(jyro, kind)(given["max_range"], mode=given["mode"])
    return getattr(jyro, kind)()


def do(world: jyro.JyroWorld, name: str, what: str, *values: Any) -> None:
    robot = world[name]
    if what in ("move", "rotate", "translate", "localize"):
        getattr(robot, what)(*values)
    elif what == "pose":
        robot.place(Pose(values[0], values[1], values[2] + HALF_PI))
    elif what == "sideways":
        robot.sideways = -values[0]
    elif what == "scale":
        robot.speed_scale = values[0]
    elif what == "gripper":
        getattr(robot["gripper"], values[0])()
    else:
        robot.devices[0].active = what == "on"


def carry_out(name: str) -> Iterator[tuple[int, jyro.SceneRobot, dict[str, Any]]]:
    """For each step and robot: the number of the step, the robot as it is then, and what Jyro reported."""
    setup = read(name)
    world = build(setup)
    for number, row in enumerate(setup["rows"]):
        if number:
            for one in setup["steps"][number - 1]:
                do(world, *one)
            world.step()
        for robot, expected in zip(world.robots, row, strict=True):
            yield number, robot, expected


def picture(text: str) -> NDArray[np.uint8]:
    """(40, 60, 3) the picture that Jyro's camera gave."""
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8).reshape(40, 60, 3)
