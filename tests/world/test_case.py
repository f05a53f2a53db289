"""Reading a case, and saying what is wrong with one."""

from __future__ import annotations

import contextlib
import copy
import json
import math
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from realitygap.errors import CaseError
from realitygap.world._case import Case
from realitygap.world.jyro_stock import DEVICES, ROBOT_BODIES

DATA = Path(__file__).parent.parent / "data"
CASES = sorted(DATA.glob("jyro*/*.json"))


def good() -> dict[str, Any]:
    """A case with commands and one with a network, both right."""
    sensors = {
        "kind": "range",
        "type": "ir",
        "geometry": [[0.09, 0.05, 0], [0.09, -0.05, 0]],
        "max_range": 0.2,
    }
    network = {
        "inputs": ["max_inverted", "all_inverted", "time"],
        "layers": [
            {"weights": [[1, 2, 3, 4]] * 3, "bias": [0, 0, 0]},
            {"weights": [[1, 2, 3]] * 2, "bias": [0, 0]},
        ],
    }
    start = {"x": 0.2, "y": 0.3, "heading": 0}
    case = {
        "steps": 2,
        "world": {"boxes": [[0, 0, 1.0668, 0.6096]], "lights": [[0.5, 0.5, 1.0]]},
        "robots": [
            {"start": start, "devices": [sensors], "commands": [[0, 0], [0.5, 0.1]]},
            {"start": start, "devices": [sensors], "controller": network},
        ],
    }
    return json.loads(json.dumps(case))  # no part of it is shared


def complaint(data: object) -> list[str]:
    """The mistakes named in the message, one a line."""
    with pytest.raises(CaseError) as caught:
        Case.from_dict(data)
    first, *mistakes = str(caught.value).splitlines()
    assert first.startswith("the case: ")
    return [mistake.strip() for mistake in mistakes] or [first]


# what is right


def test_defaults_are_jyros() -> None:
    case = Case.from_dict(good())
    assert case.dt == 0.1
    assert [robot.name for robot in case.robots] == ["robot0", "robot1"]
    assert case.robots[0].robot_class == "Scribbler"
    assert case.robots[0].bounding_box.x == [0.09, 0.09, -0.09, -0.09]
    assert case.robots[1].controller is not None
    assert case.robots[1].controller.output_scale == [1.0, 1.0]
    assert case.robots[1].controller.sensor_max_range == 0.2


def test_null_is_the_same_as_no_key() -> None:
    data = good()
    data["dt"] = data["world"]["walls"] = data["robots"][0]["bounding_box"] = data["robots"][0][
        "controller"
    ] = None
    assert Case.from_dict(data) == Case.from_dict(good())


@pytest.mark.parametrize("name", sorted(ROBOT_BODIES))
def test_a_class_knows_its_body_and_a_given_body_wins(name: str) -> None:
    data = good()
    data["robots"][0]["class"] = name
    assert Case.from_dict(data).robots[0].bounding_box.x == ROBOT_BODIES[name]["x"]
    data["robots"][0]["bounding_box"] = {"x": [0.1, -0.1], "y": [0, 0]}
    assert Case.from_dict(data).robots[0].bounding_box.x == [0.1, -0.1]
    data["robots"][0]["bounding_box"] = []
    assert Case.from_dict(data).robots[0].bounding_box.x == []


@pytest.mark.parametrize("path", CASES, ids=[path.stem for path in CASES])
def test_stock_devices_have_the_geometry_that_jyro_recorded(path: Path) -> None:
    """Cases that Jyro wrote state the geometry in full; without it the table must say the same."""
    full = json.loads(path.read_text())
    bare = copy.deepcopy(full)
    for robot in bare["robots"]:
        for device in robot["devices"]:
            if "geometry" in DEVICES[device["kind"]]:
                device.pop("geometry", None)
                device.pop("type", None)
    assert Case.from_dict(bare) == Case.from_dict(full)


def test_a_device_without_a_kind_goes_by_its_type() -> None:
    data = good()
    mounts = [[0, 0, 0]]
    data["robots"][0]["devices"] = [
        {"type": "sonar", "geometry": mounts, "max_range": 1},
        {"type": "light", "geometry": mounts, "max_range": 1},
        {"name": "bumper", "geometry": mounts, "max_range": 1},
    ]
    devices = Case.from_dict(data).robots[0].devices
    assert [(device.kind, device.type) for device in devices] == [
        ("range", "sonar"),
        ("light", "light"),
        ("range", "bumper"),
    ]


def test_names_are_jyros() -> None:
    data = good()
    data["robots"][0]["name"] = "my robot"
    assert Case.from_dict(data).robots[0].name == "my_robot"


def test_boxes_may_be_given_by_any_two_opposite_corners() -> None:
    lines = []
    for box in ([0, 1, 2, 3], [2, 1, 0, 3], [2, 3, 0, 1]):
        data = good()
        data["world"] = {"boxes": [box]}
        lines.append(Case.from_dict(data).world.lines())
    assert lines[0] == lines[1] == lines[2]
    assert len(lines[0]) == 4


def test_other_keys_are_notes() -> None:
    data = good() | {"id": 7, "note": "anything", "noise": 0.0}
    data["robots"][0]["color"] = "red"
    assert Case.from_dict(data) == Case.from_dict(good())


@pytest.mark.parametrize("path", CASES, ids=[path.stem for path in CASES])
def test_a_case_survives_json(path: Path) -> None:
    case = Case.read(path)
    assert Case.from_dict(json.loads(json.dumps(case.to_dict()))) == case


# what is wrong


def put(*where: Any) -> Callable[[dict[str, Any]], None]:
    """A change: the last of `where` is the value, the rest the way to it."""
    *way, key, value = where

    def change(data: Any) -> None:
        for step in way:
            data = data[step]
        data[key] = value

    return change


def take(*where: Any) -> Callable[[dict[str, Any]], None]:
    *way, key = where

    def change(data: Any) -> None:
        for step in way:
            data = data[step]
        del data[key]

    return change


LAYER = ("robots", 1, "controller", "layers")
DEVICE = ("robots", 0, "devices", 0)
WRONG = [
    (take("steps"), "steps: missing. Give a whole number of steps, 0 or more."),
    (put("steps", -1), "steps: expected a whole number of steps, 0 or more, got -1."),
    (put("steps", 2.5), "steps: expected a whole number of steps, 0 or more, got 2.5."),
    (put("steps", True), "steps: expected a whole number of steps, 0 or more, got true."),
    (put("dt", 0), "dt: expected the length of a step in s, more than 0, got 0."),
    (put("dt", math.nan), "dt: expected the length of a step in s, more than 0, got NaN."),
    (take("world"), "world: missing. Give an object"),
    (
        put("world", "boxes", 0, [0, 0, 1]),
        "world.boxes[0]: expected a box [x1, y1, x2, y2] in m, got [0, 0, 1].",
    ),
    (put("world", "boxes", 0, 2, "1"), 'world.boxes[0][2]: expected a finite number, got "1".'),
    (put("world", "lights", 0, 2, math.inf), "world.lights[0][2]: expected a finite number, got Infinity."),
    (put("world", "walls", {}), "world.walls: expected a list of walls [x1, y1, x2, y2] in m, got {}."),
    (put("robots", []), "robots: expected a list of at least one robot, got []."),
    (
        put("robots", 0, 5),
        "robots[0]: expected a robot: an object with start and commands or controller, got 5.",
    ),
    (
        take("robots", 0, "start"),
        'robots[0].start: missing. Give an object {"x": m, "y": m, "heading": rad}.',
    ),
    (take("robots", 0, "start", "heading"), "robots[0].start.heading: missing."),
    (
        put("robots", 0, "start", "x", "left"),
        'robots[0].start.x: expected a finite number in m, got "left".',
    ),
    (put("robots", 0, "class", "Scribler"), "unknown class of robot \"Scribler\". Did you mean 'Scribbler'?"),
    (
        put("robots", 0, "bounding_box", {"x": [1, 2], "y": [1]}),
        "robots[0].bounding_box: x has 2 numbers and y has 1",
    ),
    (put("robots", 0, "bounding_box", 3), "robots[0].bounding_box: expected an object"),
    (put("robots", 0, "commands", 1, [1]), "robots[0].commands[1]: expected a command [v, w], got [1]."),
    (
        put("robots", 0, "commands", [[0, 0]]),
        "robots[0].commands: expected 2 commands [v, w], one for each step, got 1.",
    ),
    (take("robots", 0, "commands"), "robots[0]: nothing drives this robot."),
    (
        put("robots", 1, "commands", [[0, 0]] * 2),
        "robots[1]: both commands and controller are given. Keep one of them.",
    ),
    (
        put(*DEVICE, "kind", "MyroIr"),
        "robots[0].devices[0].kind: unknown kind of device \"MyroIr\". Did you mean 'MyroIR'?",
    ),
    (put(*DEVICE, "kind", "Camera"), "robots[0].devices[0].kind: unknown kind of device"),
    (take(*DEVICE, "geometry"), "robots[0].devices[0].geometry: missing. Give a list of mounts"),
    (take(*DEVICE, "max_range"), "robots[0].devices[0].max_range: missing. Give a range in m, more than 0."),
    (
        put(*DEVICE, "max_range", 0),
        "robots[0].devices[0].max_range: expected a range in m, more than 0, got 0.",
    ),
    (
        put(*DEVICE, "geometry", 0, [1, 2]),
        "robots[0].devices[0].geometry[0]: expected a mount [forward, left, angle]",
    ),
    (
        put(*DEVICE, "mode", "lineal"),
        "robots[0].devices[0].mode: unknown mode \"lineal\". Did you mean 'linear'?",
    ),
    (
        put(*DEVICE, {"kind": "MyroIR", "type": "bumper"}),
        'a device of kind MyroIR is of type "ir", got "bumper".',
    ),
    (
        put(*DEVICE, "type", "light"),
        'robots[0].devices[0].type: a device of kind range cannot be of type "light".',
    ),
    (
        put("robots", 1, "controller", "type", "tanh"),
        "unknown type of controller \"tanh\". Did you mean 'tanh_layers'?",
    ),
    (put("robots", 1, "controller", "inputs", ["tine"]), "unknown input \"tine\" (Did you mean 'time'?)"),
    (put("robots", 1, "devices", []), "robots[1].controller.inputs: max_inverted needs a sensor"),
    (
        put("robots", 1, "controller", "output_scale", [1]),
        "output_scale: expected two numbers: factors for v and w, got [1].",
    ),
    (put("robots", 1, "controller", "layers", []), "layers: expected a list of at least one layer, got []."),
    (
        put(*LAYER, 0, "weights", 2, [1, 2, 3]),
        "layers[0].weights[2]: expected 4 weights (inputs max_inverted, all_inverted",
    ),
    (
        put(*LAYER, 1, "weights", 0, [1, 2]),
        "layers[1].weights[0]: expected 3 weights (outputs of layer 0), got 2.",
    ),
    (put(*LAYER, 0, "bias", [0]), "layers[0].bias: expected 3 numbers, one for each row of weights, got 1."),
    (
        put(*LAYER, 1, {"weights": [[1, 2, 3]], "bias": [0]}),
        "expected 2 rows in the last layer, for v and w, got 1.",
    ),
    (take(*LAYER, 0, "bias"), "robots[1].controller.layers[0].bias: missing."),
    (put(*LAYER, 0, "weights", 0, 0, None), "layers[0].weights[0][0]: expected a finite number, got null."),
]


@pytest.mark.parametrize(("change", "expected"), WRONG, ids=[expected for _, expected in WRONG])
def test_one_mistake_is_one_line(change: Callable[[dict[str, Any]], None], expected: str) -> None:
    data = good()
    change(data)
    mistakes = complaint(data)
    assert len(mistakes) == 1, mistakes
    assert expected in mistakes[0]


def test_all_mistakes_come_at_once_in_the_order_of_places() -> None:
    data = good()
    put("world", "boxes", 0, [1])(data)
    put("robots", 0, "commands", [[0, "x"]])(data)
    put(*DEVICE, "kind", "MyroBumpers")(data)
    put(*LAYER, 0, "bias", [0])(data)
    take("robots", 1, "start", "y")(data)
    assert [mistake.split(": ")[0] for mistake in complaint(data)] == [
        "robots[0].commands",
        "robots[0].commands[0][1]",
        "robots[0].devices[0].kind",
        "robots[1].controller.layers[0].bias",
        "robots[1].start.y",
        "world.boxes[0]",
    ]


def test_a_misspelt_key_is_named_with_the_one_that_was_meant() -> None:
    data = good()
    data["robots"][0]["comands"] = data["robots"][0].pop("commands")
    data["robots"][1]["devcies"] = data["robots"][1].pop("devices")
    data["robots"][1]["controller"]["inputs"] = ["time", "stall", "stall", "stall"]
    assert complaint(data) == [
        "robots[0].commands: not given, but there is an unknown key \"comands\". Did you mean 'commands'?",
        "robots[1].devices: not given, but there is an unknown key \"devcies\". Did you mean 'devices'?",
    ]


def test_the_range_must_be_given_where_devices_differ() -> None:
    data = good()
    data["robots"][1]["devices"].append({"kind": "range", "geometry": [], "max_range": 3})
    assert complaint(data) == [
        "robots[1].controller.sensor_max_range: missing, and the devices of this robot have different ranges "
        "([0.2, 3]). Give the range that readings are divided by."
    ]


def test_many_mistakes_are_counted() -> None:
    data = good()
    data["steps"] = 0
    data["robots"][0]["commands"] = [[None, None]] * 100
    mistakes = complaint(data)
    assert len(mistakes) == 41
    assert mistakes[-1] == "... and 160 more."


def test_a_result_too_big_for_memory_is_refused() -> None:
    data = good()
    del data["robots"][0]
    data["steps"] = 10**9
    assert complaint(data)[0].startswith("steps: 1000000000 steps of 11 numbers are too many")


FILES = {
    "not there": (None, "cannot be read (No such file or directory)"),
    "empty": (b"", "The file is empty"),
    "not JSON": (b'{"steps": 3 "dt": 1}', "not JSON, at line 1, column 13"),
    "not text": (b"\xff\xfe\x00", "not a text file"),
    "a list": (b"[1, 2]", "expected a JSON object with steps, world and robots, got [1, 2]"),
    "a double key": (b'{"steps": 3, "steps": 4}', 'the key "steps" is given twice'),
    "too deep": (b"[" * 100_000, "cannot be read as JSON"),
    "a huge number": (b'{"steps": ' + b"9" * 5000 + b"}", "cannot be read as JSON"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_wrong_file_is_one_message(name: str, tmp_path: Path) -> None:
    content, expected = FILES[name]
    path = tmp_path / "case.json"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(CaseError) as caught:
        Case.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert expected in str(caught.value)


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "case.json"
    path.write_bytes(b"\xef\xbb\xbf" + json.dumps(good()).encode())
    assert Case.read(path) == Case.from_dict(good())


JUNK = [
    None,
    True,
    "x",
    "light",
    -1,
    0,
    2.5,
    1e308,
    10**400,
    math.nan,
    [],
    {},
    [1],
    [[1]],
    [None],
    {"a": 1},
    [{}],
]


@pytest.mark.parametrize("seed", range(20))
def test_whatever_is_wrong_ends_in_a_case_or_in_a_message(seed: int) -> None:
    """Put junk into random places: nothing but `CaseError` may come out."""
    rng = random.Random(seed)
    for _ in range(40):
        data = good()
        for _ in range(rng.randint(1, 3)):
            spot: Any = data
            while True:
                keys = list(spot) if isinstance(spot, dict) else list(range(len(spot)))
                if not keys:
                    break
                key = rng.choice(keys)
                if isinstance(spot[key], dict | list) and rng.random() < 0.7:
                    spot = spot[key]
                elif rng.random() < 0.3:
                    del spot[key]
                    break
                else:
                    spot[key] = copy.deepcopy(rng.choice(JUNK))
                    break
        with contextlib.suppress(CaseError):
            Case.from_dict(data)
