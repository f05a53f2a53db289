"""The Parallax Scribbler (S1, S2, S3), alone or with a Fluke (1, 2), over its serial or Bluetooth port.

`_codec` converts values to bytes and back, `_reading` reads an answer, and `_link` owns the port and recovers from
lost bytes. Wheels, sensors, sound and light, identity, camera, functions of an S2 only, and further functions of the
Fluke have a file each. `_robot` combines them and meets the contract.
"""

from ._codec import Blob, MotorStats, SensorBlock
from ._device import RobotInfo
from ._link import Exchange, Faults
from ._ports import PortGuess, find_ports, label_of
from ._robot import Scribbler

__all__ = [
    "Blob",
    "Exchange",
    "Faults",
    "MotorStats",
    "PortGuess",
    "RobotInfo",
    "Scribbler",
    "SensorBlock",
    "find_ports",
    "label_of",
]
