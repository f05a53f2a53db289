"""A case for the platform `jyro`: one scene, what drives its robots, and how long it lasts.

A case is a JSON object. Lengths are in meters, angles in radians, times in seconds; **headings are Jyro's**
(0 faces +y, counter-clockwise), because the format is Jyro's. Body-fixed numbers are forward, then left.

| key | value | default |
|---|---|---|
| `steps` | number of steps | |
| `dt` | length of a step | 0.1 |
| `world.boxes` | `[x1, y1, x2, y2]`, two opposite corners; four walls each | none |
| `world.walls` | `[x1, y1, x2, y2]` | none |
| `world.lights` | `[x, y, brightness]` | none |
| `world.segments` | walls `[x1, y1, x2, y2]`, read only where there are neither boxes nor walls | |
| `robots[].name` | robots of one name neither touch nor see each other | `robot0`, `robot1`, ... |
| `robots[].class` | `Scribbler`, `Pioneer`, `Blimp`, `Puck`, `Robot` | `Scribbler` |
| `robots[].bounding_box` | `{"x": [forward, ...], "y": [left, ...]}`, the corners in order; `[]` for no body | by class |
| `robots[].start` | `{"x": ..., "y": ..., "heading": ...}` | |
| `robots[].devices` | see below; their readings are s0, s1, ... in this order | none |
| `robots[].commands` | `[v, w]` for each step [m/s, rad/s]; what goes beyond `steps` is not used | |
| `robots[].controller` | in place of commands: see below | |

Device: `kind` (`range`, `light` or a stock device of Jyro), `geometry` (`[forward, left, angle]` for each
sensor), `max_range`; `type` (`bumper` makes a range device read 0 or 1), `mode` of a light device (`linear`,
`ambient`, `direct`). Stock devices know their geometry, and most their range.

Controller: `layers` of `{"weights": [[...], ...], "bias": [...]}`, each tanh(W x + b), the last with two
outputs, times `output_scale` (default `[1, 1]`) giving v and w. `inputs` lists what x is: `max_inverted` (one
number: the largest (R - d)/R of all readings d), `all_inverted` (all of them), `stall` (0 or 1), `time` (steps
done / steps). R is `sensor_max_range`; default: the range that all devices of the robot share.

Other keys are notes and are passed over, unless they look like a misspelt one of these.
"""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from ..errors import CaseError, did_you_mean

Mounts = list[list[float]]

DEFAULT_DT = 0.1
SONAR_RANGE = 8.0
MAX_VALUES = 100_000_000  # numbers in one result: 800 MB, beyond which a slip is likelier than an intent
MAX_LISTED = 40  # mistakes named one by one
SURELY_MISSPELT = 0.8  # likeness (0..1) from which an unknown key is taken for a misspelt one


def _mounts(*mounts: tuple[float, float, float]) -> Mounts:
    """Mounts from forward [m], left [m] and angle [degrees]."""
    return [[forward, left, degrees * (math.pi / 180.0)] for forward, left, degrees in mounts]


FRONT_SONARS = _mounts(
    (0.10, 0.175, 90),
    (0.17, 0.15, 65),
    (0.20, 0.11, 40),
    (0.225, 0.05, 15),
    (0.225, -0.05, -15),
    (0.20, -0.11, -40),
    (0.17, -0.15, -65),
    (0.10, -0.175, -90),
)
BACK_SONARS = _mounts(
    (-0.10, -0.175, -90),
    (-0.17, -0.15, 245),
    (-0.20, -0.11, 220),
    (-0.225, -0.05, 195),
    (-0.225, 0.05, 165),
    (-0.20, 0.11, 140),
    (-0.17, 0.15, 115),
    (-0.10, 0.175, 90),
)

# What each kind of device knows of itself. Source: Jyro 0.3.2.
DEVICES: dict[str, dict[str, Any]] = {
    "range": {},
    "light": {"type": "light"},
    "MyroIR": {
        "type": "ir",
        "geometry": _mounts((0.175, 0.13, 45), (0.175, -0.13, -45)),
        "max_range": 0.5,
    },
    "MyroBumper": {
        "type": "bumper",
        "geometry": _mounts((0.20, 0.0, 80), (0.20, 0.0, -80)),
        "max_range": 0.2,
    },
    "PioneerFrontSonar": {"type": "sonar", "geometry": _mounts((0, 0, 0)), "max_range": SONAR_RANGE},
    "PioneerFrontSonars": {"type": "sonar", "geometry": FRONT_SONARS, "max_range": SONAR_RANGE},
    "PioneerBackSonars": {"type": "sonar", "geometry": BACK_SONARS, "max_range": SONAR_RANGE},
    "Pioneer16Sonars": {"type": "sonar", "geometry": FRONT_SONARS + BACK_SONARS, "max_range": SONAR_RANGE},
    "Pioneer4Sonars": {
        "type": "sonar",
        "geometry": _mounts((0.225, 0.05, 15), (0.225, -0.05, -15), (-0.225, -0.05, 195), (-0.225, 0.05, 165)),
        "max_range": SONAR_RANGE,
    },
    "PioneerFrontLightSensors": {
        "type": "light",
        "geometry": _mounts((0.225, 0.175, 0), (0.225, -0.175, 0)),
    },
    "Pioneer4FrontLightSensors": {
        "type": "light",
        "geometry": _mounts((0.225, 0.175, 0), (0.225, 0.0875, 0), (0.225, -0.0875, 0), (0.225, -0.175, 0)),
    },
}
DEVICES["RangeSensor"] = DEVICES["range"]
DEVICES["LightSensor"] = DEVICES["light"]

NO_BODY: dict[str, list[float]] = {"x": [], "y": []}
ROBOT_BODIES: dict[str, dict[str, list[float]]] = {
    "Scribbler": {"x": [0.09, 0.09, -0.09, -0.09], "y": [0.08, -0.08, -0.08, 0.08]},
    "Pioneer": {"x": [0.225, 0.225, -0.225, -0.225], "y": [0.175, -0.175, -0.175, 0.175]},
    "Blimp": NO_BODY,
    "Puck": NO_BODY,
    "Robot": NO_BODY,
}
LIGHT_MODES = ("linear", "ambient", "direct")
INPUTS = ("max_inverted", "all_inverted", "stall", "time")
CONTROLLERS = ("tanh_layers",)

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

Row2 = Annotated[list[float], Field(min_length=2, max_length=2)]
Row3 = Annotated[list[float], Field(min_length=3, max_length=3)]
Row4 = Annotated[list[float], Field(min_length=4, max_length=4)]
Positive = Annotated[float, Field(gt=0.0)]


class _Part(BaseModel):
    """A part of a case: numbers are finite numbers, null is the same as no key, other keys are notes."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False, frozen=True, populate_by_name=True)

    @model_validator(mode="before")
    @classmethod
    def _prepare(cls, data: object) -> object:
        """Put in what the part knows by itself, before anything is checked."""
        if not isinstance(data, Mapping):
            return data
        return cls._filled({key: value for key, value in data.items() if value is not None})

    @classmethod
    def _filled(cls, data: dict[str, Any]) -> dict[str, Any]:
        return data


class CaseWorld(_Part):
    """What stands still: boxes, walls, lights."""

    boxes: list[Row4] = []
    walls: list[Row4] = []
    lights: list[Row3] = []
    segments: list[Row4] = []

    def lines(self) -> list[list[float]]:
        """All walls, x1, y1, x2, y2 [m]: four of each box, and the single ones."""
        if not self.boxes and not self.walls:
            return self.segments
        lines = []
        for x1, y1, x2, y2 in self.boxes:
            left, right, bottom, top = min(x1, x2), max(x1, x2), min(y1, y2), max(y1, y2)
            lines += [
                [left, top, left, bottom],
                [left, top, right, top],
                [left, bottom, right, bottom],
                [right, top, right, bottom],
            ]
        return lines + self.walls


class CaseStart(_Part):
    """Where a robot begins: x, y [m], heading [rad, 0 faces +y, counter-clockwise]."""

    x: float
    y: float
    heading: float


class CaseBody(_Part):
    """The corners of a body in order: forward (`x`) and left (`y`) [m]; none for a robot without a body."""

    x: list[float]
    y: list[float]


class CaseDevice(_Part):
    """Sensors that are read together; `geometry` has a row forward, left [m], angle [rad] for each."""

    kind: str
    type: str
    geometry: list[Row3]
    max_range: Positive
    mode: str = "linear"

    @classmethod
    def _filled(cls, data: dict[str, Any]) -> dict[str, Any]:
        return _complete_device(data)

    @field_validator("kind")
    @classmethod
    def _kind_is_known(cls, kind: str) -> str:
        if kind not in DEVICES:
            raise ValueError(f"unknown kind of device {_shown(kind)}. {did_you_mean(kind, DEVICES)}")
        return kind

    @field_validator("mode")
    @classmethod
    def _mode_is_known(cls, mode: str) -> str:
        if mode not in LIGHT_MODES:
            raise ValueError(f"unknown mode {_shown(mode)}. {did_you_mean(mode, LIGHT_MODES)}")
        return mode

    @property
    def reads_light(self) -> bool:
        """Whether this is a light device; all others measure distance."""
        return self.kind in DEVICES and DEVICES[self.kind].get("type") == "light"


class CaseLayer(_Part):
    """One layer, tanh(W x + b): `weights` (outputs, inputs), `bias` (outputs,)."""

    weights: Annotated[list[list[float]], Field(min_length=1)]
    bias: list[float]


class CaseController(_Part):
    """A feed-forward network from readings to v [m/s] and w [rad/s]."""

    type: str = "tanh_layers"
    inputs: list[str]
    layers: Annotated[list[CaseLayer], Field(min_length=1)]
    output_scale: Row2 = [1.0, 1.0]
    sensor_max_range: Positive = 1.0

    @field_validator("type")
    @classmethod
    def _type_is_known(cls, name: str) -> str:
        if name not in CONTROLLERS:
            raise ValueError(f"unknown type of controller {_shown(name)}. {did_you_mean(name, CONTROLLERS)}")
        return name

    @field_validator("inputs")
    @classmethod
    def _inputs_are_known(cls, inputs: list[str]) -> list[str]:
        unknown = [name for name in inputs if name not in INPUTS]
        if unknown:
            hints = (f"{_shown(name)} ({did_you_mean(name, INPUTS)})" for name in unknown)
            raise ValueError(f"unknown input {', '.join(hints)}")
        return inputs


class CaseRobot(_Part):
    """A robot, where it starts, what it senses, and what drives it: commands or a controller."""

    name: str
    robot_class: str = Field(alias="class")
    bounding_box: CaseBody
    start: CaseStart
    devices: list[CaseDevice] = []
    commands: list[Row2] = []
    controller: CaseController | None = None

    @classmethod
    def _filled(cls, data: dict[str, Any]) -> dict[str, Any]:
        data.setdefault("class", "Scribbler")
        kind = data["class"]
        if data.get("bounding_box") == []:
            data["bounding_box"] = NO_BODY
        data.setdefault("bounding_box", ROBOT_BODIES.get(kind, NO_BODY) if isinstance(kind, str) else NO_BODY)
        ranges = _device_ranges(data)
        controller = data.get("controller")
        if len(ranges) == 1 and isinstance(controller, Mapping) and controller.get("sensor_max_range") is None:
            data["controller"] = {**controller, "sensor_max_range": ranges[0]}
        return data

    @field_validator("name")
    @classmethod
    def _name_as_in_jyro(cls, name: str) -> str:
        return name.replace(" ", "_")

    @field_validator("robot_class")
    @classmethod
    def _class_is_known(cls, name: str) -> str:
        if name not in ROBOT_BODIES:
            raise ValueError(f"unknown class of robot {_shown(name)}. {did_you_mean(name, ROBOT_BODIES)}")
        return name


class Case(_Part):
    """A scene with everything that drives it. Made by `Case.from_dict` or `Case.read`, which check it."""

    steps: Annotated[int, Field(ge=0)]
    dt: Positive = DEFAULT_DT
    world: CaseWorld
    robots: Annotated[list[CaseRobot], Field(min_length=1)]

    @classmethod
    def _filled(cls, data: dict[str, Any]) -> dict[str, Any]:
        robots = data.get("robots")
        if isinstance(robots, list):
            data["robots"] = [
                {**robot, "name": f"robot{i}"}
                if isinstance(robot, Mapping) and robot.get("name") is None
                else robot
                for i, robot in enumerate(robots)
            ]
        return data

    @classmethod
    def from_dict(cls, data: object, *, source: str = "the case") -> Case:
        """The case that `data`, a parsed JSON object, describes.

        Args:
            data: The object; keys as in the introduction of this module.
            source: What to call it in a message.

        Raises:
            CaseError: Something is missing, of the wrong kind, or contradicts the rest; the message lists
                all of it.
        """
        if not isinstance(data, Mapping):
            raise CaseError(
                f"{source}: expected a JSON object with steps, world and robots, came {_shown(data)}."
            )
        mistakes = dict(_misspelt(data))
        suspected = set(mistakes)
        mistakes |= dict(_contradictions(data))
        case = None
        try:
            case = cls.model_validate(data)
        except ValidationError as error:
            for item in error.errors():
                path = _path(item["loc"])
                if path not in suspected:
                    mistakes.setdefault(path, _explained(item))
        if mistakes or case is None:
            raise CaseError(_listed(source, mistakes))
        return case

    @classmethod
    def read(cls, path: Path) -> Case:
        """The case in a JSON file.

        Raises:
            CaseError: The file cannot be read, is not JSON, or is no case.
        """
        return cls.from_dict(_read_json(path), source=str(path))

    def to_dict(self) -> dict[str, Any]:
        """The whole case, defaults included, in a form that `from_dict` and JSON take."""
        return self.model_dump(by_alias=True, exclude_none=True)


def _complete_device(data: Mapping[str, Any]) -> dict[str, Any]:
    """A device as given, with what its kind knows in the places left out."""
    given = {key: value for key, value in data.items() if value is not None}
    given.setdefault("kind", "light" if given.get("type") == "light" else "range")
    kind = given["kind"]
    if not isinstance(kind, str) or kind not in DEVICES:  # said once; what else it needs is not known
        return {"type": "", "geometry": [], "max_range": 1.0} | given
    if "type" not in given and isinstance(given.get("name"), str):
        given["type"] = DEVICES[kind].get("type", given["name"])
    return {"type": "ir"} | DEVICES[kind] | given


def _device_ranges(robot: Mapping[str, Any]) -> list[float]:
    """The different maximum ranges of a robot's devices [m], as far as they can be read."""
    reaches = [_complete_device(device).get("max_range") for _, device in _objects(robot.get("devices"))]
    return sorted({reach for reach in reaches if isinstance(reach, int | float)})


def _read_json(path: Path) -> object:
    """The value in a JSON file; a key given twice is a mistake, like everything that is not JSON."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise CaseError(
            f"{path}: not a text file (byte {error.start} is not UTF-8). Give a case in JSON."
        ) from None
    except OSError as error:
        raise CaseError(f"{path}: cannot be read ({error.strerror}). Give a case file in JSON.") from None
    try:
        return json.loads(text, object_pairs_hook=_without_doubles)
    except json.JSONDecodeError as error:
        raise CaseError(
            f"{path}: not JSON, at line {error.lineno}, column {error.colno}: {error.msg}."
            + (" The file is empty." if not text.strip() else "")
        ) from None
    except _DoubleKeyError as error:
        raise CaseError(f"{path}: the key {error} is given twice in one object. Keep one of them.") from None
    except (ValueError, RecursionError) as error:
        raise CaseError(f"{path}: cannot be read as JSON ({error}).") from None


class _DoubleKeyError(Exception):
    """A key that an object has twice."""


def _without_doubles(pairs: list[tuple[str, object]]) -> dict[str, object]:
    found: dict[str, object] = {}
    for key, value in pairs:
        if key in found:
            raise _DoubleKeyError(_shown(key))
        found[key] = value
    return found


# --- saying what is wrong -------------------------------------------------------------------------------------


def _shown(value: object) -> str:
    """A value as it came, in JSON, short enough for a message."""
    if isinstance(value, list) and len(value) > 8:
        return f"a list of {len(value)}"
    text = json.dumps(value, default=repr)
    if len(text) <= 60:
        return text
    return {dict: "an object", list: "a list"}.get(type(value), text[:57] + "...")


def _path(loc: tuple[int | str, ...]) -> str:
    """A place in the file: robots[0].start.heading."""
    path = ""
    for part in loc:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else part
    return path


def _explained(error: Any) -> str:
    """What pydantic found wrong with one value, in our words."""
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
        return f"expected a finite number, came {_shown(error['input'])}."
    return f"expected {entry if depth else whole}, came {_shown(error['input'])}."


def _listed(source: str, mistakes: Mapping[str, str]) -> str:
    """One message for all mistakes."""
    lines = [f"  {path}: {text}" for path, text in mistakes.items()]
    if len(lines) > MAX_LISTED:
        lines = [*lines[:MAX_LISTED], f"  ... and {len(lines) - MAX_LISTED} more."]
    count = "1 mistake" if len(mistakes) == 1 else f"{len(mistakes)} mistakes"
    return "\n".join([f"{source}: {count}.", *lines])


def _misspelt(data: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Unknown keys that look like one that is not given, by the place of the key that was meant."""
    for path, part, model in _parts(data):
        known = {field.alias or name for name, field in model.model_fields.items()}
        open_keys = known - set(part)
        for key in part:
            if key in known or not isinstance(key, str):
                continue
            near = difflib.get_close_matches(key, open_keys, n=1, cutoff=SURELY_MISSPELT)
            if near:
                yield (
                    f"{path}.{near[0]}" if path else near[0],
                    f"not given, but there is an unknown key {_shown(key)}. {did_you_mean(key, known)}",
                )


def _parts(data: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any], type[_Part]]]:
    """All objects of a case that are objects, with their place and what they should be."""
    yield "", data, Case
    if isinstance(data.get("world"), Mapping):
        yield "world", data["world"], CaseWorld
    for i, robot in _objects(data.get("robots")):
        here = f"robots[{i}]"
        yield here, robot, CaseRobot
        if isinstance(robot.get("start"), Mapping):
            yield f"{here}.start", robot["start"], CaseStart
        for j, device in _objects(robot.get("devices")):
            yield f"{here}.devices[{j}]", device, CaseDevice
        controller = robot.get("controller")
        if isinstance(controller, Mapping):
            yield f"{here}.controller", controller, CaseController
            for k, layer in _objects(controller.get("layers")):
                yield f"{here}.controller.layers[{k}]", layer, CaseLayer


def _objects(value: object) -> list[tuple[int, Mapping[str, Any]]]:
    """The entries of a list that are objects, with their index; nothing when it is no list."""
    if not isinstance(value, list):
        return []
    return [(i, entry) for i, entry in enumerate(value) if isinstance(entry, Mapping)]


def _contradictions(data: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Mistakes that show only when two values are seen together; values of the wrong kind are passed over."""
    steps = data.get("steps")
    n_steps = steps if type(steps) is int else None
    n_columns = 1
    for i, robot in _objects(data.get("robots")):
        here = f"robots[{i}]"
        yield from _body_contradictions(f"{here}.bounding_box", robot.get("bounding_box"))
        yield from _drive_contradictions(here, robot, n_steps)
        n_sensors = 0
        for j, device in _objects(robot.get("devices")):
            yield from _device_contradictions(f"{here}.devices[{j}]", _complete_device(device))
            geometry = _complete_device(device).get("geometry")
            n_sensors += len(geometry) if isinstance(geometry, list) else 0
        n_columns += 8 + n_sensors
        if isinstance(robot.get("controller"), Mapping):
            yield from _controller_contradictions(f"{here}.controller", robot, n_sensors)
    if n_steps is not None and n_steps * n_columns > MAX_VALUES:
        yield (
            "steps",
            f"{n_steps} steps of {n_columns} numbers are more than {MAX_VALUES} numbers. Cut the case in parts.",
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
    elif isinstance(commands, list) and controller is None and n_steps is not None and len(commands) < n_steps:
        yield (
            f"{here}.commands",
            f"expected {n_steps} commands [v, w], one for each step, came {len(commands)}. "
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
            f"a device of kind {device['kind']} is of type {_shown(stock)}, came {_shown(given)}. "
            "Leave the type out, or change the kind.",
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
        width = sum(n_sensors if name == "all_inverted" else 1 for name in inputs)
        what = f"inputs {', '.join(inputs)} with {n_sensors} sensors"
        if "max_inverted" in inputs and n_sensors == 0:
            yield f"{here}.inputs", "max_inverted needs a sensor, and this robot has none. Add a device."
        ranges = _device_ranges(robot)
        if (
            {"max_inverted", "all_inverted"} & set(inputs)
            and controller.get("sensor_max_range") is None
            and len(ranges) > 1
        ):
            yield (
                f"{here}.sensor_max_range",
                f"missing, and the devices of this robot have different ranges ({_shown(ranges)}). "
                "Give the range that readings are divided by.",
            )
    if not isinstance(layers, list):
        return
    for k, layer in enumerate(layers):
        weights = layer.get("weights") if isinstance(layer, Mapping) else None
        bias = layer.get("bias") if isinstance(layer, Mapping) else None
        if not isinstance(weights, list) or not weights:
            width, what = None, ""
            continue
        place = f"{here}.layers[{k}]"
        for j, row in enumerate(weights):
            if width is None and isinstance(row, list):
                width, what = len(row), "the first row of these weights"
            if isinstance(row, list) and len(row) != width:
                yield (
                    f"{place}.weights[{j}]",
                    f"expected {width} weights ({what}), came {len(row)}.",
                )
        if isinstance(bias, list) and len(bias) != len(weights):
            yield f"{place}.bias", f"expected {len(weights)} numbers, one for each row of weights, came {len(bias)}."
        width, what = len(weights), f"outputs of layer {k}"
    if width is not None and width != 2 and layers:
        yield (
            f"{here}.layers[{len(layers) - 1}].weights",
            f"expected 2 rows in the last layer, for v and w, came {width}.",
        )
