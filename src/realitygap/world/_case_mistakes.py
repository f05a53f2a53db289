"""Finding and naming everything that is wrong with a case."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic_core import ErrorDetails

from .jyro_stock import DEVICES, INPUTS, LIGHT_MODES, ROBOT_BODIES, complete_device, device_ranges

MAX_VALUES = 100_000_000  # numbers in one result: 800 MB, beyond which a slip is likelier than an intent
MAX_LISTED = 40  # mistakes named one by one

# What each key wants: (the whole value, one entry of it).
EXPECTED: dict[str, tuple[str, str]] = {
    "steps": ("a whole number of steps, 0 or more", ""),
    "dt": ("the length of a step in s, more than 0", ""),
    "world": ('an object such as {"boxes": [[0, 0, 1.0668, 0.6096]]}', ""),
    "boxes": ("a list of boxes [x1, y1, x2, y2] in m", "a box [x1, y1, x2, y2] in m"),
    "walls": ("a list of walls [x1, y1, x2, y2] in m", "a wall [x1, y1, x2, y2] in m"),
    "segments": ("a list of walls [x1, y1, x2, y2] in m", "a wall [x1, y1, x2, y2] in m"),
    "lights": ("a list of lights [x, y, brightness]", "a light [x, y, brightness]"),
    "robots": ("a list of at least one robot", "a robot: an object with start and commands or controller"),
    "name": ("a name in quotes", ""),
    "class": (f"one of {', '.join(ROBOT_BODIES)}", ""),
    "bounding_box": ('an object {"x": [forward, ...], "y": [left, ...]} in m', ""),
    "start": ('an object {"x": m, "y": m, "heading": rad}', ""),
    "x": ("a finite number in m", ""),
    "y": ("a finite number in m", ""),
    "heading": ("a finite number in rad, 0 facing +y, counter-clockwise", ""),
    "devices": ("a list of devices", 'a device such as {"kind": "MyroIR"}'),
    "kind": ("the kind of device in quotes", ""),
    "type": ("a name in quotes", ""),
    "mode": (f"one of {', '.join(LIGHT_MODES)}", ""),
    "geometry": ("a list of mounts [forward, left, angle] in m, m, rad", "a mount [forward, left, angle]"),
    "max_range": ("a range in m, more than 0", ""),
    "commands": ("a list of commands [v, w] in m/s and rad/s, one for each step", "a command [v, w]"),
    "controller": ("an object with inputs and layers", ""),
    "inputs": (f"a list out of {', '.join(INPUTS)}", f"one of {', '.join(INPUTS)}"),
    "layers": ("a list of at least one layer", 'a layer {"weights": [[...], ...], "bias": [...]}'),
    "weights": ("a list of at least one row of numbers", "a row: a list of numbers"),
    "bias": ("a list of numbers, one for each row of weights", ""),
    "output_scale": ("two numbers: factors for v and w", ""),
    "sensor_max_range": ("a range in m, more than 0", ""),
}


def json_text(value: object) -> str:
    """Return a value in JSON, short enough for a message."""
    if isinstance(value, list) and len(value) > 8:
        return f"a list of {len(value)}"
    text = json.dumps(value, default=repr)
    if len(text) <= 60:
        return text
    if isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else f"a list of {len(value)}"
    return text[:57] + "..."


def place_of(loc: tuple[int | str, ...]) -> str:
    """Return a place in the file, such as robots[0].start.heading."""
    path = ""
    for part in loc:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else part
    return path


def explained(error: ErrorDetails) -> str:
    """Describe a value that pydantic refused, in the project's words."""
    loc = error["loc"]
    if error["type"] == "value_error":
        return str(error["ctx"]["error"])
    names = [part for part in loc if isinstance(part, str)]
    whole, entry = EXPECTED[names[-1]]
    if names[-2:] in (["bounding_box", "x"], ["bounding_box", "y"]):
        whole = "a list of numbers in m"
    depth = len(loc) - 1 - max(i for i, part in enumerate(loc) if isinstance(part, str))
    if error["type"] == "missing":
        return f"missing. Give {whole}."
    if error["type"] in ("float_type", "finite_number") and depth:
        return f"expected a finite number, got {json_text(error['input'])}."
    return f"expected {entry if depth else whole}, got {json_text(error['input'])}."


def list_of_mistakes(source: str, mistakes: Mapping[str, str]) -> str:
    """Return one message for all mistakes."""
    in_order = sorted(mistakes, key=lambda path: [part.zfill(9) for part in re.split(r"(\d+)", path)])
    lines = [f"  {path}: {mistakes[path]}" for path in in_order]
    if len(lines) > MAX_LISTED:
        lines = [*lines[:MAX_LISTED], f"  ... and {len(lines) - MAX_LISTED} more."]
    count = "1 mistake" if len(mistakes) == 1 else f"{len(mistakes)} mistakes"
    return "\n".join([f"{source}: {count}.", *lines])


def objects(value: object) -> list[tuple[int, Mapping[str, Any]]]:
    """Return the entries of a list that are objects, with their index; nothing when it is no list."""
    if not isinstance(value, list):
        return []
    return [(i, entry) for i, entry in enumerate(value) if isinstance(entry, Mapping)]


def contradictions(data: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Return mistakes that concern two values together. Values of the wrong kind are ignored."""
    steps = data.get("steps")
    n_steps = steps if type(steps) is int else None
    n_columns = 1
    for i, robot in objects(data.get("robots")):
        here = f"robots[{i}]"
        yield from _body_contradictions(f"{here}.bounding_box", robot.get("bounding_box"))
        yield from _drive_contradictions(here, robot, n_steps)
        n_sensors = 0
        for j, device in objects(robot.get("devices")):
            yield from _device_contradictions(f"{here}.devices[{j}]", complete_device(device))
            geometry = complete_device(device).get("geometry")
            n_sensors += len(geometry) if isinstance(geometry, list) else 0
        n_columns += 8 + n_sensors
        if isinstance(robot.get("controller"), Mapping):
            yield from _controller_contradictions(f"{here}.controller", robot, n_sensors)
    if n_steps is not None and n_steps * n_columns > MAX_VALUES:
        yield (
            "steps",
            f"{json_text(n_steps)} steps of {n_columns} numbers are too many, {MAX_VALUES} in all is the limit. "
            "Take fewer steps, or cut the case in parts.",
        )


def _body_contradictions(here: str, body: object) -> Iterator[tuple[str, str]]:
    if isinstance(body, Mapping) and isinstance(body.get("x"), list) and isinstance(body.get("y"), list):
        n_x, n_y = len(body["x"]), len(body["y"])
        if n_x != n_y:
            yield here, f"x has {n_x} numbers and y has {n_y}; give one of each for every corner."


def _drive_contradictions(
    here: str, robot: Mapping[str, Any], n_steps: int | None
) -> Iterator[tuple[str, str]]:
    commands, controller = robot.get("commands"), robot.get("controller")
    if commands is None and controller is None:
        yield here, "nothing drives this robot. Give commands ([v, w] for each step) or a controller."
    elif commands and controller is not None:
        yield here, "both commands and controller are given. Keep one of them."
    elif (
        isinstance(commands, list) and controller is None and n_steps is not None and len(commands) < n_steps
    ):
        yield (
            f"{here}.commands",
            f"expected {n_steps} commands [v, w], one for each step, got {len(commands)}. "
            f'Add the others, or set "steps" to {len(commands)}.',
        )


def _device_contradictions(here: str, device: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    given = device["type"]
    if not isinstance(device["kind"], str) or not isinstance(given, str):
        return
    stock = DEVICES.get(device["kind"], {}).get("type")
    if stock is not None and given != stock and {given, stock} & {"bumper", "light"}:
        yield (
            f"{here}.type",
            f"a device of kind {device['kind']} is of type {json_text(stock)}, got {json_text(given)}. Leave the type "
            "out, or change the kind.",
        )
    elif stock is None and device["kind"] in ("range", "RangeSensor") and given == "light":
        yield f"{here}.type", 'a device of kind range cannot be of type "light". Set the kind to "light".'


def _controller_contradictions(
    here: str, robot: Mapping[str, Any], n_sensors: int
) -> Iterator[tuple[str, str]]:
    controller = robot["controller"]
    inputs, layers = controller.get("inputs"), controller.get("layers")
    width, what = None, ""
    if isinstance(inputs, list) and all(isinstance(name, str) and name in INPUTS for name in inputs):
        ranges = device_ranges(robot)
        if "max_inverted" in inputs and n_sensors == 0:
            yield f"{here}.inputs", "max_inverted needs a sensor, and this robot has none. Add a device."
        else:
            width = sum(n_sensors if name == "all_inverted" else 1 for name in inputs)
            what = f"inputs {', '.join(inputs)} with {n_sensors} sensors"
        reads = "max_inverted" in inputs or "all_inverted" in inputs
        if reads and controller.get("sensor_max_range") is None and len(ranges) > 1:
            yield (
                f"{here}.sensor_max_range",
                f"missing, and the devices of this robot have different ranges ({json_text(ranges)}). "
                "Give the range that readings are divided by.",
            )
    if isinstance(layers, list):
        yield from _layer_contradictions(here, layers, width, what)


def _layer_contradictions(
    here: str, layers: list[Any], width: int | None, what: str
) -> Iterator[tuple[str, str]]:
    """Return wrong sizes, from the inputs (`width` of them, if known: `what`) to the two outputs."""
    for k, layer in enumerate(layers):
        place = f"{here}.layers[{k}]"
        weights = layer.get("weights") if isinstance(layer, Mapping) else None
        bias = layer.get("bias") if isinstance(layer, Mapping) else None
        if not isinstance(weights, list) or not weights:
            width = None
            continue
        widths = [len(row) for row in weights if isinstance(row, list)]
        if width is None and widths:
            width, what = widths[0], "as in the first row"
        if len(widths) > 1 and len(set(widths)) == 1 and widths[0] != width:
            yield f"{place}.weights", f"expected {width} weights in each row ({what}), got {widths[0]}."
        else:
            for j, row in enumerate(weights):
                if isinstance(row, list) and len(row) != width:
                    yield f"{place}.weights[{j}]", f"expected {width} weights ({what}), got {len(row)}."
        if isinstance(bias, list) and len(bias) != len(weights):
            yield (
                f"{place}.bias",
                f"expected {len(weights)} numbers, one for each row of weights, got {len(bias)}.",
            )
        width, what = len(weights), f"outputs of layer {k}"
    if layers and width not in (None, 2):
        yield (
            f"{here}.layers[{len(layers) - 1}].weights",
            f"expected 2 rows in the last layer, for v and w, got {width}.",
        )
