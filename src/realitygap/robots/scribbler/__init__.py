"""The Parallax Scribbler (S1, S2, S3), alone or with a Fluke (1, 2), over its serial or Bluetooth port.

`_codec` knows the bytes, `_reading` reads an answer, `_link` has the port and knows what to do when bytes are lost.
The wheels, the senses, sound and light, who the robot is, its camera, what only an S2 does, and the rest of the Fluke
have a file each; `_robot` puts them together and meets the contract.
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
