"""The Parallax Scribbler (S1, S2, S3), alone or with a Fluke (1, 2), over its serial or Bluetooth port.

`_codec` converts values to bytes and back, `_reading` reads an answer, and `_link` owns the port and recovers from
lost bytes. Wheels, sensors, sound and light, identity, camera, functions of an S2 only, and further functions of the
Fluke have a file each. `_robot` combines them and meets the contract. `emulator` is the robot for real client programs.
"""

from typing import TYPE_CHECKING

from realitygap._lazy import lazy_names
from realitygap.robot_families import Reading, RobotFamily

if TYPE_CHECKING:
    from ._codec import Blob, MotorStats, SensorBlock
    from ._device import RobotInfo
    from ._link import Faults
    from ._platform import ScribblerPlatform
    from ._ports import find_ports, label_of
    from ._robot import Scribbler

FAMILY = RobotFamily(
    name="scribbler",
    noun="Scribbler",
    package=__name__,
    platforms={"scribbler": f"{__name__}._platform:ScribblerPlatform"},
    terminal=f"{__name__}._terminal",
    ports=("/dev/rfcomm0", "COM3", "socket://HOST:PORT"),
    port_files=("state", "twin"),
    emulated="emulator://s2?fluke=2",
    emulators=dict.fromkeys(("s1", "s2"), f"{__name__}.emulator._port:ScribblerPort"),
    emulate=f"{__name__}._emulate:emulate",
    robot="scribbler-s2-fluke2",
    additions=(("fluke1", "fluke2"), ("cardboard",)),
    range_readings={
        3: tuple(Reading(f"{side} obstacle", "0 to 6,400", 6400.0) for side in ("Left", "Center", "Right")),
        2: tuple(Reading(f"{side} infrared", "0 or 1", 1.0) for side in ("Left", "Right")),
    },
    channel_readings={
        "light": tuple(
            Reading(f"{side} light", "0 bright to 65,535 dark", 65_535.0)
            for side in ("Left", "Center", "Right")
        ),
        "line": tuple(Reading(f"{side} line", "1 on dark floor", 1.0) for side in ("Left", "Right")),
    },
    is_default=True,
)

__all__ = [
    "Blob",
    "Faults",
    "MotorStats",
    "RobotInfo",
    "Scribbler",
    "ScribblerPlatform",
    "SensorBlock",
    "find_ports",
    "label_of",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Blob": "._codec",
        "Faults": "._link",
        "MotorStats": "._codec",
        "RobotInfo": "._device",
        "Scribbler": "._robot",
        "ScribblerPlatform": "._platform",
        "SensorBlock": "._codec",
        "find_ports": "._ports",
        "label_of": "._ports",
    },
)
