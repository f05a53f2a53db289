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
| `robots[].bounding_box` | `{"x": [forward, ...], "y": [left, ...]}`, corners in order, or `[]` | by class |
| `robots[].start` | `{"x": ..., "y": ..., "heading": ...}` | |
| `robots[].devices` | see below; their readings are s0, s1, ... in this order | none |
| `robots[].commands` | `[v, w]` for each step [m/s, rad/s]; what goes beyond `steps` is not used | |
| `robots[].controller` | in place of commands: see below | |

Device: `kind` (`range`, `light` or a stock device of Jyro), `geometry` (`[forward, left, angle]` for each
sensor), `max_range`; `type` (`bumper` makes a range device read 0 or 1), `mode` of a light device (`linear`,
`ambient`, `direct`). Stock devices know their geometry, and most their range.

Controller: `layers` of `{"weights": [[...], ...], "bias": [...]}`, each tanh(W x + b); the last has two
outputs, which times `output_scale` (default `[1, 1]`) give v and w. `inputs` lists what x is: `max_inverted`
(the largest (R - d)/R over all readings d), `all_inverted` (all of them), `stall` (0 or 1), `time` (the part
of the steps that is done). R is `sensor_max_range`; default: the range that all devices of the robot share.

Other keys are notes and are passed over, unless they look like a misspelt one of these.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator, Mapping
from json import JSONDecodeError
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from .._limits import MOST_JSON_BYTES, parse_json, read_file
from ..errors import CaseError, did_you_mean
from ._case_mistakes import contradictions, explained, json_text, list_of_mistakes, objects, place_of
from .jyro_stock import (
    CONTROLLERS,
    DEVICES,
    INPUTS,
    LIGHT_MODES,
    NO_BODY,
    ROBOT_BODIES,
    complete_device,
    device_ranges,
)

DEFAULT_DT = 0.1
SURELY_MISSPELT = 0.8  # likeness (0..1) from which an unknown key is taken for a misspelt one


Row2 = Annotated[list[float], Field(min_length=2, max_length=2)]
Row3 = Annotated[list[float], Field(min_length=3, max_length=3)]
Row4 = Annotated[list[float], Field(min_length=4, max_length=4)]
Positive = Annotated[float, Field(gt=0.0)]


def _one_of(what: str, names: Collection[str]) -> AfterValidator:
    """Return a check that a text is one of the known names."""

    def check(name: str) -> str:
        if name not in names:
            raise ValueError(f"unknown {what} {json_text(name)}. {did_you_mean(name, names)}")
        return name

    return AfterValidator(check)


class _Part(BaseModel):
    """A part of a case: numbers are finite numbers, null is the same as no key, other keys are notes."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False, frozen=True)

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
    """The fixed parts of a case's world: boxes, walls, and lights."""

    boxes: list[Row4] = []
    walls: list[Row4] = []
    lights: list[Row3] = []
    segments: list[Row4] = []

    def lines(self) -> list[list[float]]:
        """Return all walls, x1, y1, x2, y2 [m]: four of each box, and the single ones."""
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
    """The pose at which a robot begins: x, y [m], heading [rad, 0 faces +y, counter-clockwise]."""

    x: float
    y: float
    heading: float


class CaseBody(_Part):
    """The corners of a body in order: forward (`x`) and left (`y`) [m]; none for a robot without a body."""

    x: list[float]
    y: list[float]


class CaseDevice(_Part):
    """Sensors that are read together; `geometry` has a row forward, left [m], angle [rad] for each."""

    kind: Annotated[str, _one_of("kind of device", DEVICES)]
    type: str
    geometry: list[Row3]
    max_range: Positive
    mode: Annotated[str, _one_of("mode", LIGHT_MODES)] = "linear"

    @classmethod
    def _filled(cls, data: dict[str, Any]) -> dict[str, Any]:
        return complete_device(data)

    @property
    def reads_light(self) -> bool:
        """True for a light device; all others measure distance."""
        return self.kind in DEVICES and DEVICES[self.kind].get("type") == "light"


class CaseLayer(_Part):
    """One layer, tanh(W x + b): `weights` (outputs, inputs), `bias` (outputs,)."""

    weights: Annotated[list[list[float]], Field(min_length=1)]
    bias: list[float]


class CaseController(_Part):
    """A feed-forward network from readings to v [m/s] and w [rad/s]."""

    type: Annotated[str, _one_of("type of controller", CONTROLLERS)] = "tanh_layers"
    inputs: list[str]
    layers: Annotated[list[CaseLayer], Field(min_length=1)]
    output_scale: Row2 = [1.0, 1.0]
    sensor_max_range: Positive = 1.0

    @field_validator("inputs")
    @classmethod
    def _inputs_are_known(cls, inputs: list[str]) -> list[str]:
        unknown = [name for name in inputs if name not in INPUTS]
        if unknown:
            hints = (f"{json_text(name)} ({did_you_mean(name, INPUTS)})" for name in unknown)
            raise ValueError(f"unknown input {', '.join(hints)}")
        return inputs


class CaseRobot(_Part):
    """A robot with its start, its devices, and its commands or controller."""

    name: str
    robot_class: Annotated[str, _one_of("class of robot", ROBOT_BODIES)] = Field(alias="class")
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
        ranges = device_ranges(data)
        controller = data.get("controller")
        if (
            len(ranges) == 1
            and isinstance(controller, Mapping)
            and controller.get("sensor_max_range") is None
        ):
            data["controller"] = {**controller, "sensor_max_range": ranges[0]}
        return data

    @field_validator("name")
    @classmethod
    def _name_as_in_jyro(cls, name: str) -> str:
        return name.replace(" ", "_")


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
        """Return the case that `data`, a parsed JSON object, describes.

        Args:
            data: The object; keys as in the introduction of this module.
            source: Name of the case in messages.

        Raises:
            CaseError: Something is missing, of the wrong kind, or contradicts the rest; the message lists
                all of it.
        """
        if not isinstance(data, Mapping):
            raise CaseError(
                f"{source}: expected a JSON object with steps, world and robots, got {json_text(data)}."
            )
        mistakes = dict(_misspelt(data))
        suspected = set(mistakes)
        for path, text in contradictions(data):
            if not suspected & {f"{path}.commands", f"{path}.controller"}:
                mistakes.setdefault(path, text)
        case = None
        try:
            case = cls.model_validate(data)
        except ValidationError as error:
            for item in error.errors():
                path = place_of(item["loc"])
                if path not in suspected:
                    mistakes.setdefault(path, explained(item))
        if mistakes or case is None:
            raise CaseError(list_of_mistakes(source, mistakes))
        return case

    @classmethod
    def read(cls, path: Path) -> Case:
        """Return the case in a JSON file.

        Raises:
            CaseError: The file cannot be read, is not JSON, or is no case.
        """
        return cls.from_dict(_read_json(path), source=str(path))

    def to_dict(self) -> dict[str, Any]:
        """Return the whole case, defaults included, in a form that `from_dict` and JSON take."""
        return self.model_dump(by_alias=True, exclude_none=True)


def _read_json(path: Path) -> object:
    """Return the value in a JSON file; a key given twice is a mistake, like everything that is not JSON."""
    try:
        text = read_file(path, MOST_JSON_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CaseError(
            f"{path}: not a text file (byte {error.start} is not UTF-8). Give a case in JSON."
        ) from None
    except OSError as error:
        raise CaseError(f"{path}: cannot be read ({error.strerror}). Give a case file in JSON.") from None
    try:
        return parse_json(text, pairs=_without_doubles)
    except JSONDecodeError as error:
        raise CaseError(
            f"{path}: not JSON, at line {error.lineno}, column {error.colno}: {error.msg}."
            + (" The file is empty." if not text.strip() else "")
        ) from None
    except _DoubleKeyError as error:
        raise CaseError(f"{path}: the key {error} is given twice in one object. Keep one of them.") from None
    except ValueError as error:
        raise CaseError(f"{path}: cannot be read as JSON ({error}).") from None


class _DoubleKeyError(Exception):
    """A key that an object has twice."""


def _without_doubles(pairs: list[tuple[str, object]]) -> dict[str, object]:
    values: dict[str, object] = {}
    for key, value in pairs:
        if key in values:
            raise _DoubleKeyError(json_text(key))
        values[key] = value
    return values


def _misspelt(data: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield unknown keys that look like one that is not given, by the place of the key that was meant."""
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
                    f"not given, but there is an unknown key {json_text(key)}. {did_you_mean(key, known)}",
                )


def _parts(data: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any], type[_Part]]]:
    """Yield all objects of a case that are objects, with their place and what they should be."""
    yield "", data, Case
    if isinstance(data.get("world"), Mapping):
        yield "world", data["world"], CaseWorld
    for i, robot in objects(data.get("robots")):
        here = f"robots[{i}]"
        yield here, robot, CaseRobot
        if isinstance(robot.get("start"), Mapping):
            yield f"{here}.start", robot["start"], CaseStart
        for j, device in objects(robot.get("devices")):
            yield f"{here}.devices[{j}]", device, CaseDevice
        controller = robot.get("controller")
        if isinstance(controller, Mapping):
            yield f"{here}.controller", controller, CaseController
            for k, layer in objects(controller.get("layers")):
                yield f"{here}.controller.layers[{k}]", layer, CaseLayer
