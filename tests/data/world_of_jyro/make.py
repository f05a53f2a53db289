"""What real Jyro 0.3.2 does with several robots and all of its devices; writes the files beside this one.

    uv venv /tmp/jyro && uv pip install --python /tmp/jyro jyro==0.3.2 numpy
    /tmp/jyro/bin/python tests/data/world_of_jyro/make.py

Each file is a set-up and, step by step, what Jyro reported. Jyro needs the system library cairo. A step of a set-up is
a list of things to do before it: `[robot, "move", speed, turn rate]`, `[robot, "gripper", "close"]` and so on, as `do`
below understands them. Headings are Jyro's. Pictures of cameras are compressed bytes (zlib, base64), row by row.
"""

from __future__ import annotations

import base64
import json
import math
import random
import zlib
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent
DIGITS = 10
PUCK_BOX = [[0.05, 0.05, -0.05, -0.05], [0.05, -0.05, -0.05, 0.05]]
COLORS = ["red", "blue", "green", "orange", "purple4", "gray40", "hotpink", "cadetblue3", "white", "black"]
RANGES = ["MyroIR", "MyroBumper", "PioneerFrontSonar", "PioneerFrontSonars", "PioneerBackSonars"]
RANGES += ["Pioneer16Sonars", "Pioneer4Sonars", "RangeSensor"]
LIGHTS = ["PioneerFrontLightSensors", "Pioneer4FrontLightSensors", "LightSensor"]


# set-ups


def random_world(rng, width=3.0, height=2.0, n_boxes=2, n_walls=2, n_lights=2):
    def box():
        x, y = rng.uniform(0.3, width - 0.6), rng.uniform(0.3, height - 0.6)
        return [
            x,
            y,
            x + rng.uniform(0.1, 0.3),
            y + rng.uniform(0.1, 0.3),
            rng.choice(COLORS),
            rng.choice(COLORS),
        ]

    def wall():
        x, y = rng.uniform(0.2, width), rng.uniform(0.2, height)
        return [x, y, x + rng.uniform(-0.6, 0.6), y + rng.uniform(-0.6, 0.6), rng.choice(COLORS)]

    return {
        "boxes": [[0, 0, width, height, "beige", "saddlebrown"], *(box() for _ in range(n_boxes))],
        "walls": [wall() for _ in range(n_walls)],
        "lights": [
            [rng.uniform(0, width), rng.uniform(0, height), rng.uniform(0.5, 2)] for _ in range(n_lights)
        ],
        "light_above_walls": False,
    }


def random_device(rng, kind):
    device = {"kind": kind}
    if kind in ("RangeSensor", "LightSensor"):
        device["mounts"] = [
            [rng.uniform(-0.25, 0.25), rng.uniform(-0.2, 0.2), rng.uniform(-3, 3)]
            for _ in range(rng.randint(1, 3))
        ]
        device["max_range"] = rng.choice([0.3, 1.0, 4.0])
    elif kind in LIGHTS:
        device["max_range"] = rng.choice([1.0, 3.0])
    if kind in LIGHTS:
        device["mode"] = rng.choice(["linear", "ambient", "direct"])
    return device


def random_robot(rng, k, kinds=("Scribbler", "Pioneer", "Robot", "Puck", "Blimp")):
    kind = rng.choice(kinds)
    robot = {"name": f"r{k}", "kind": kind, "color": rng.choice(COLORS), "devices": []}
    robot["start"] = [0.4 + 0.55 * k + rng.uniform(-0.1, 0.1), rng.uniform(0.4, 1.6), rng.uniform(-3, 3)]
    if kind == "Puck":
        robot["box"] = PUCK_BOX
    if kind == "Robot":
        robot["box"] = [[0.12, -0.1, -0.1], [0.0, 0.11, -0.11]]
        robot["segments"] = [[0.12, 0.2, 0.0, 0.05], [0.0, 0.0, 0.11, 0.18]]
    return robot


def random_steps(rng, robots, n_steps, speed=0.8):
    steps = []
    for step in range(n_steps):
        todo = []
        for robot in robots:
            if step % 5 == 0:
                todo.append([robot["name"], "move", rng.uniform(-0.3, 1) * speed, rng.uniform(-1, 1)])
        steps.append(todo)
    return steps


def crowd(seed):
    """Many robots, range and light devices drawn at random: they collide, and see and shade each other."""
    rng = random.Random(seed)
    robots = [random_robot(rng, k) for k in range(5)]
    for k, robot in enumerate(robots):
        robot["devices"] = [
            random_device(rng, RANGES[(seed * 3 + k) % len(RANGES)]),
            random_device(rng, LIGHTS[(seed + k) % len(LIGHTS)]),
        ]
    return {"world": random_world(rng), "robots": robots, "steps": random_steps(rng, robots, 30)}


def cameras(seed):
    """Robots that watch each other, walls and lamps through cameras and depth cameras."""
    rng = random.Random(100 + seed)
    robots = [random_robot(rng, k, ("Scribbler", "Pioneer", "Robot")) for k in range(4)]
    field = [120, 60, 90, 150][seed]
    robots[0]["devices"] = [{"kind": "Camera", "field": field, "fade": True}]
    robots[1]["devices"] = [{"kind": "Camera", "field": field, "fade": False}]
    robots[2]["devices"] = [{"kind": "DepthCamera", "field": field, "max_range": [1.0, 3.0, 8.0, 2.0][seed]}]
    width = [3.0, 3.0, 14.0, 3.0][seed]
    return {"world": random_world(rng, width=width), "robots": robots, "steps": random_steps(rng, robots, 12)}


def motion():
    """Sideways speed, scaled speed, poses that are set, odometry, trail, devices that are switched off."""
    rng = random.Random(7)
    ir = {"kind": "RangeSensor", "mounts": [[0.09, 0.0, 0.0]], "max_range": 3.0}
    robots = [
        {
            "name": "r0",
            "kind": "Scribbler",
            "color": "red",
            "start": [1.0, 1.0, 0.4],
            "devices": [ir],
            "trail": True,
        },
        {
            "name": "r1",
            "kind": "Pioneer",
            "color": "blue",
            "start": [2.0, 1.0, -2.0],
            "devices": [ir],
            "trail": True,
        },
    ]
    steps = [[] for _ in range(40)]
    steps[0] = [["r0", "move", 0.5, 0.7], ["r1", "move", 0.3, 0.0]]
    steps[6] = [["r0", "localize", 0.0, 0.0, 0.0], ["r1", "sideways", 0.4]]
    steps[12] = [["r0", "rotate", -0.9], ["r1", "scale", 0.25], ["r1", "off"]]
    steps[18] = [["r0", "pose", 0.4, 0.5, 5.0], ["r1", "translate", -1.0]]
    steps[24] = [["r0", "localize", 1.0, 2.0, 0.5], ["r1", "on"], ["r1", "sideways", 0.0]]
    steps[30] = [["r0", "move", 0.0, 0.0], ["r1", "move", 2.0, -3.0]]
    return {"world": random_world(rng, n_boxes=0, n_walls=0), "robots": robots, "steps": steps}


def gripper(seed):
    """A gripper that closes on a puck, stores it, bars the way, and is seen."""
    rng = random.Random(30 + seed)
    watch = {
        "kind": "RangeSensor",
        "max_range": 2.0,
        "mounts": [[0.09, 0.03 * k, 0.15 * k] for k in range(-3, 4)],
    }
    robots = [
        {
            "name": "r0",
            "kind": "Pioneer",
            "color": "red",
            "start": [0.6, 1.0, -math.pi / 2 + 0.05],
            "devices": [{"kind": "Gripper"}],
        },
        {
            "name": "puck",
            "kind": "Puck",
            "color": "yellow",
            "box": PUCK_BOX,
            "start": [1.3, 1.0 + 0.04 * seed, 0.3],
            "devices": [],
        },
        {"name": "r2", "kind": "Scribbler", "color": "green", "start": [1.1, 0.3, 0.1], "devices": [watch]},
    ]
    steps = [[] for _ in range(60)]
    steps[0] = [["r0", "move", 0.35, 0.0], ["r2", "move", 0.05, rng.uniform(-0.1, 0.1)]]
    steps[12] = [["r0", "gripper", ["close", "stop", "close"][seed]]]
    steps[16] = [["r0", "move", 0.0, 0.0]]
    steps[24] = [["r0", "gripper", ["store", "open", "open"][seed]]]
    steps[30] = [["r0", "move", 0.2, 0.3]]
    steps[38] = [["r0", "gripper", ["open", "close", "store"][seed]]]
    steps[44] = [["r0", "gripper", ["deploy", "stop", "close"][seed]], ["r0", "move", -0.3, 0.2]]
    steps[50] = [["r0", "gripper", "stop"]]
    if seed == 0:  # of a stored robot that is deployed Jyro loses sight; what comes then is ours
        steps[44] = [["r0", "move", -0.3, 0.2]]
    return {"world": random_world(rng, n_boxes=0, n_walls=0), "robots": robots, "steps": steps}


def lights(seed):
    """The three modes with shadows of walls, of others, of the own body and of none, and light above walls."""
    rng = random.Random(50 + seed)
    robots = [random_robot(rng, k, ("Scribbler", "Pioneer")) for k in range(4)]
    ignored = [["self"], ["other", "self"], ["all"], ["other"], []]
    for k, robot in enumerate(robots):
        robot["devices"] = []
        for mode in ("linear", "ambient", "direct"):
            device = random_device(rng, "LightSensor")
            robot["devices"].append(device | {"mode": mode, "ignore": ignored[(k + seed) % len(ignored)]})
    world = random_world(rng, n_boxes=3, n_lights=3)
    world["light_above_walls"] = seed == 1
    return {"world": world, "robots": robots, "steps": random_steps(rng, robots, 12)}


SETUPS = {f"crowd-{k}": crowd(k) for k in range(6)}
SETUPS |= {f"cameras-{k}": cameras(k) for k in range(4)}
SETUPS |= {f"gripper-{k}": gripper(k) for k in range(3)}
SETUPS |= {f"lights-{k}": lights(k) for k in range(3)}
SETUPS["motion"] = motion()


# carrying them out


def build(setup):
    from jyro.simulator import Physics

    physics = Physics()
    world = setup["world"]
    for box in world["boxes"]:
        physics.addBox(*box)
    for wall in world["walls"]:
        physics.addWall(*wall)
    for light in world["lights"]:
        physics.addLight(*light)
    physics.lightAboveWalls = int(world["light_above_walls"])
    for given in setup["robots"]:
        robot = make_robot(given)
        robot.display["devices"] = robot.display["gripper"] = 0  # rays are not drawn
        robot.useTrail = given.get("trail", False)
        physics.addRobot(robot)
        for device in given["devices"]:
            robot.addDevice(make_device(device))
    for robot in physics.robots:  # with all of them in place
        robot.updateDevices()
    return physics


def make_robot(given):
    from jyro.simulator import robot as robots

    kind = getattr(robots, given["kind"])
    if given["kind"] in ("Scribbler", "Pioneer"):
        robot = kind(given["name"], *given["start"], color=given["color"])
    else:
        robot = kind(given["name"], *given["start"], boundingBox=given.get("box"), color=given["color"])
    if "segments" in given:
        forward, left = given["segments"]
        robot.addBoundingSeg([list(forward), list(left)])
    return robot


def make_device(given):
    from jyro.simulator import device as devices

    kind = given["kind"]
    if kind == "RangeSensor":
        return devices.RangeSensor("ir", given["mounts"], 0.0, given["max_range"])
    if kind == "Camera":
        camera = devices.Camera(field=given["field"])
        camera.colors_fade_with_distance = given["fade"]
        return camera
    if kind == "DepthCamera":
        return devices.DepthCamera(given["max_range"], field=given["field"])
    if kind in LIGHTS:
        arguments = (given["mounts"],) if kind == "LightSensor" else ()
        sensor = getattr(devices, kind)(*arguments, given["max_range"])
        sensor.lightMode = given["mode"]
        sensor.ignore = given.get("ignore", ["self"])
        return sensor
    return getattr(devices, kind)()


def do(physics, name, what, *values):
    robot = physics[name]
    if what in ("move", "rotate", "translate", "localize"):
        getattr(robot, what)(*values)
    elif what == "pose":
        robot.setPose(*values)
    elif what == "sideways":
        robot.vy = values[0]
    elif what == "scale":
        robot.stepScalar = values[0]
    elif what == "gripper":
        getattr(robot["gripper"], values[0])()
    else:
        robot.devices[1].active = what == "on"


def report(physics, n):
    rows = []
    for robot in physics.robots:
        row = {"pose": robot.getPose(), "stall": robot.stall}
        if n % 3 == 0:  # all of it in each row would be too much
            row["energy"] = robot.energy
            row["readings"] = [readings(device) for device in robot.devices[1:]]
        if robot.useTrail:
            row["odometry"] = (robot.x, robot.y, robot.a)
            row["trail"] = len(robot.trail)
        rows.append(row)
    return rows


def readings(device):
    if device.type != "camera":
        return [float(value) for value in device.scan]
    data = np.array(device.getImage(), np.uint8)
    return base64.b64encode(zlib.compress(data.tobytes(), 9)).decode()


def shortened(value):
    if isinstance(value, float):
        short = round(value, DIGITS)
        return int(short) if short.is_integer() else short
    if isinstance(value, dict):
        return {key: shortened(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [shortened(part) for part in value]
    return value


def carry_out(setup):
    physics = build(setup)
    rows = [report(physics, 0)]
    for todo in setup["steps"]:
        for one in todo:
            do(physics, *one)
        physics.step()
        rows.append(report(physics, len(rows)))
    return rows


def main():
    from jyro.simulator.color import colorMap

    for name, setup in SETUPS.items():
        setup = shortened(setup)
        text = json.dumps({**setup, "rows": shortened(carry_out(setup))}, separators=(",", ":"))
        (FOLDER / f"{name}.json").write_text(text.replace('},{"pose"', '},\n{"pose"') + "\n", "utf-8")
    colors = {name: bytes(tuple(color)[:3]).hex() for name, color in colorMap.items()}
    groups = {}
    for kind in (*RANGES[:-1], *LIGHTS[:-1]):
        stock = make_device({"kind": kind, "max_range": 1.0, "mode": "linear"})
        groups[kind] = {part: list(which) for part, which in stock.groups.items()}
    for name, value in (("colors", colors), ("groups", groups)):
        (FOLDER / f"{name}.json").write_text(json.dumps(value, separators=(",", ":")) + "\n", "utf-8")


if __name__ == "__main__":
    main()
