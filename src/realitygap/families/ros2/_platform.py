"""The platform `ros2`: any robot with two driven wheels on ROS 2."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from realitygap.platforms import PortPlatform, RobotFilePlatform

from ._address import read_address
from ._robot import DEFAULT_ROBOT

if TYPE_CHECKING:
    from ._robot import Ros2Robot


class Ros2Platform(RobotFilePlatform, PortPlatform):
    """A robot on ROS 2, without an installation of ROS. Its address comes from the command line.

    An address is the namespace of its topics, such as `ros2:/` or `ros2:/robot1?domain=0&interface=wlan0`. Discovery
    stays on this machine unless the address names an interface. The robot file, `robot`, has the topics in its table
    `[driver]`. Nobody has tried it on a robot.

    An emulated robot in this program is `ros2:emulator://ros2?robot=turtlebot3-burger`.
    """

    name: ClassVar[str] = "ros2"
    summary: ClassVar[str] = "any robot with two driven wheels on ROS 2"
    base_robot: ClassVar[str] = DEFAULT_ROBOT

    robot: str = Field(
        DEFAULT_ROBOT,
        description="Robot by name, or a file, whose [driver] has its topics; an address may name another.",
    )
    step_s: float = Field(0.2, gt=0, le=60, description="Duration of a command [s].")

    @classmethod
    def base_robot_at(cls, rest: str) -> str:
        """Return the robot that an address names, or the usual one."""
        return (read_address(rest).robot if rest else "") or cls.base_robot

    @property
    def robot_name(self) -> str:
        """Name or file of the robot at the port."""
        return (read_address(self.port).robot if self.port else "") or self.robot

    @property
    def channels(self) -> tuple[str, ...]:  # type: ignore[override]
        """Names of its sensors besides range sensors, by its topics."""
        driver = self.model.driver
        return (
            *(("bump.0",) if driver.get("bump") else ()),
            *(("encoder.0", "encoder.1") if driver.get("odometry") else ()),
        )

    @property
    def command_s(self) -> float:
        """Duration of a command [s]."""
        return self.step_s

    def connect(self) -> Ros2Robot:
        """Connect to the robot at the port.

        Raises:
            RobotError: It cannot be reached.
        """
        from ._robot import Ros2Robot

        robot = Ros2Robot(self.port, robot=self.robot_name, step_s=self.step_s)
        robot.platform = self
        return robot
