"""An open robot: its link, its identity, and the base class of all parts of the driver."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from realitygap.errors import RobotError
from realitygap.robots import Label

from . import _codec as codec
from ._codec import Request, SensorBlock
from ._link import Faults, Link
from .opcodes import Op

T = TypeVar("T")


@dataclass(frozen=True)
class RobotInfo:
    """Model, firmware, and port of a robot.

    Attributes:
        model: "s1", "s2" (also an S3), or None: a Fluke without a robot.
        fluke: "none", "1" or "2".
        robot_version: Firmware version of the robot as sent. Empty if there is no robot.
        fluke_version: Firmware version of the Fluke as sent. Empty if there is no Fluke.
        port: Name of the port.
        label: Label of its trials in figures.
    """

    model: str | None
    fluke: str
    robot_version: str
    fluke_version: str
    port: str
    label: Label

    def has_fluke(self, *version: int) -> bool:
        """Return whether there is a Fluke with at least this firmware version."""
        return self.fluke != "none" and numbers(self.fluke_version) >= version

    def __str__(self) -> str:
        robot = {"s1": "S1", "s2": "S2", None: "no robot"}[self.model]
        robot += f" (firmware {self.robot_version})" if self.robot_version else ""
        board = "no Fluke" if self.fluke == "none" else f"Fluke {self.fluke} (firmware {self.fluke_version})"
        return f"{robot}, {board} on {self.port}"


class Device:
    """Base class of all parts of the driver: sends requests, and checks what hardware the robot has."""

    link: Link
    info: RobotInfo
    last_sensors: SensorBlock | None = None
    """Sensors from the answer to the last setting. None before the first one."""

    @property
    def port(self) -> Any:
        """The serial object. That of an emulated robot has `clock` and `witness`."""
        return self.link.port

    @property
    def faults(self) -> Faults:
        """Numbers of the faults of the link so far."""
        return self.link.faults

    def _get(self, request: Request, decode: Callable[[bytes], T]) -> T:
        return self.link.ask(request, decode)

    def _set(self, request: Request) -> SensorBlock:
        """Send a setting of the robot and return the sensors from its answer."""
        self.last_sensors = self.link.ask(request, codec.sensor_block)
        return self.last_sensors

    def _set_late(self, request: Request) -> None:
        """Send a setting of the robot whose answer a Fluke 2 may drop."""
        block = self.link.ask(request, codec.late_sensor_block)
        self.last_sensors = block if block is not None else self.last_sensors

    def _tell_fluke(
        self, name: str, op: Op, arguments: bytes = b"", *, repeatable: bool = True, pause_s: float = 0.0
    ) -> None:
        """Send a setting of the Fluke, which has no answer."""
        self.need_fluke(name)
        request = codec.fluke_request(name, op, arguments, answer=0, repeatable=repeatable, pause_s=pause_s)
        self.link.ask(request, codec.nothing)

    def _need(self, what: str, there: bool, who_has_it: str) -> None:
        if not there:
            raise RobotError(f"'{what}' needs {who_has_it}; here is {self.info}.")

    def need_robot(self, what: str) -> None:
        """Raise `RobotError` if there is no robot behind the Fluke."""
        self._need(what, self.info.model is not None, "a robot (S1, S2 or S3)")

    def need_s2(self, what: str) -> None:
        """Raise `RobotError` if the robot is not an S2 or S3."""
        self._need(what, self.info.model == "s2", "an S2 or S3")

    def need_fluke(self, what: str) -> None:
        """Raise `RobotError` if there is no Fluke."""
        self._need(what, self.info.fluke != "none", "a Fluke")

    def need_fluke_2(self, what: str) -> None:
        """Raise `RobotError` if there is no Fluke 2."""
        self._need(what, self.info.fluke == "2", "a Fluke 2")


def numbers(version: str) -> tuple[int, ...]:
    """Return a version as numbers that can be compared."""
    return tuple(int(each) for each in re.findall(r"\d+", version))


def limited(name: str, value: float, low: float, high: float) -> float:
    """Return a value if it is within its range.

    Raises:
        ValueError: The value is out of range.
    """
    if not low <= value <= high:
        raise ValueError(f"{name} is {value!r}, expected {low:g} to {high:g}.")
    return value
