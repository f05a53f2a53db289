"""Any robot with two driven wheels on ROS 2, over DDS and without an installation of ROS. It was tried on no robot."""

from typing import TYPE_CHECKING

from realitygap._lazy import lazy_names
from realitygap.robot_families import RobotFamily

if TYPE_CHECKING:
    from ._emulator import EmulatedRos2
    from ._platform import Ros2Platform
    from ._ports import find_ports
    from ._robot import Ros2Info, Ros2Robot

FAMILY = RobotFamily(
    name="ros2",
    noun="robot on ROS 2",
    package=__name__,
    platforms={"ros2": f"{__name__}._platform:Ros2Platform"},
    terminal=f"{__name__}._terminal",
    ports=("/robot1?interface=wlan0",),
    port_files=("robot", "body"),
    addresses=r"/[\w/]*",
    emulated="emulator://ros2",
    emulators={"ros2": f"{__name__}._emulator:Ros2Port"},
    emulate=f"{__name__}._emulate:emulate",
    robot="turtlebot3-burger",
)

__all__ = ["EmulatedRos2", "Ros2Info", "Ros2Platform", "Ros2Robot", "find_ports"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "EmulatedRos2": "._emulator",
        "Ros2Info": "._robot",
        "Ros2Platform": "._platform",
        "Ros2Robot": "._robot",
        "find_ports": "._ports",
    },
)
