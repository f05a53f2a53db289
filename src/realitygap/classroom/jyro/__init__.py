"""Jyro's world with all of its robots and devices, one step at a time, for teaching and experiments.

A `JyroWorld` holds walls, boxes, lamps and robots; robots carry devices. Lengths in meters, headings in radians
counter-clockwise from +x. The physics is that of `realitygap simulate` and compiled. Devices are Python; a custom
device is a class of a few lines (`Device`). Studies with many trials use the platform `jyro` instead.
"""

from . import _picture  # noqa: F401  # registers the picture of a world
from ._camera import Camera, Column, DepthCamera, LampSeen
from ._driven import DrivenRobot
from ._gripper import Gripper
from ._robot import Device, Edge, Lamp, Mount, SceneRobot
from ._robots import Blimp, Pioneer, Puck, Scribbler
from ._sensors import Bumper, LightMode, LightSensor, MountedSensors, RangeSensor
from ._stock import (
    MyroBumper,
    MyroIR,
    MyroLightSensors,
    Pioneer4FrontLightSensors,
    Pioneer4Sonars,
    Pioneer16Sonars,
    PioneerBackSonars,
    PioneerFrontLightSensors,
    PioneerFrontSonar,
    PioneerFrontSonars,
)
from ._world import Area, JyroWorld

__all__ = [
    "Area",
    "Blimp",
    "Bumper",
    "Camera",
    "Column",
    "DepthCamera",
    "Device",
    "DrivenRobot",
    "Edge",
    "Gripper",
    "JyroWorld",
    "Lamp",
    "LampSeen",
    "LightMode",
    "LightSensor",
    "Mount",
    "MountedSensors",
    "MyroBumper",
    "MyroIR",
    "MyroLightSensors",
    "Pioneer",
    "Pioneer4FrontLightSensors",
    "Pioneer4Sonars",
    "Pioneer16Sonars",
    "PioneerBackSonars",
    "PioneerFrontLightSensors",
    "PioneerFrontSonar",
    "PioneerFrontSonars",
    "Puck",
    "RangeSensor",
    "SceneRobot",
    "Scribbler",
]
