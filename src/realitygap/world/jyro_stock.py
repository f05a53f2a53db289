"""The bodies, mounts, and ranges of Jyro's robots and devices.

Lengths are in meters, angles in radians; body-fixed numbers are forward, then left. Source: Jyro 0.3.2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

Mounts = list[list[float]]

SONAR_RANGE = 8.0


def _mounts(*mounts: tuple[float, float, float]) -> Mounts:
    """Return mounts from forward [m], left [m] and angle [degrees]."""
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
        "geometry": _mounts(
            (0.225, 0.05, 15), (0.225, -0.05, -15), (-0.225, -0.05, 195), (-0.225, 0.05, 165)
        ),
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
    "MyroLightSensors": {"type": "light", "geometry": _mounts((0.18, 0.13, 0), (0.18, -0.13, 0))},
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


def complete_device(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a device of a case with the defaults of its kind; nothing is checked."""
    given = {key: value for key, value in data.items() if value is not None}
    given.setdefault("kind", "light" if given.get("type") == "light" else "range")
    kind = given["kind"]
    if not isinstance(kind, str) or kind not in DEVICES:  # said once; what else it needs is not known
        return {"type": "", "geometry": [], "max_range": 1.0} | given
    if "type" not in given and isinstance(given.get("name"), str):
        given["type"] = DEVICES[kind].get("type", given["name"])
    return {"type": "ir"} | DEVICES[kind] | given


def device_ranges(robot: Mapping[str, Any]) -> list[float]:
    """Return the different maximum ranges of the devices of a robot in a case [m], as far as they can be read."""
    devices = robot.get("devices")
    if not isinstance(devices, list):
        return []
    known = [complete_device(device) for device in devices if isinstance(device, Mapping)]
    reaches = [device.get("max_range") for device in known]
    return sorted({reach for reach in reaches if isinstance(reach, int | float)})
