"""The address of a robot: `/robot1?domain=0&interface=eth0`, and how it is opened."""

from __future__ import annotations

import os
from typing import Literal, NamedTuple
from urllib.parse import parse_qsl

from realitygap.errors import RobotError, did_you_mean
from realitygap.robots import Label

LOOPBACK = "lo"
OPTIONS = ("domain", "interface", "robot", "label")
RANGES = ("", "SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
"""Values of `ROS_AUTOMATIC_DISCOVERY_RANGE`."""
_MOST_DOMAIN = 232


class Address(NamedTuple):
    """The address of a robot.

    Attributes:
        namespace: Namespace of its topics, such as `/` or `/robot1`; empty for a port that is no namespace.
        port: A port of pyserial, such as `emulator://burger` or `socket://127.0.0.1:7001`; empty for a namespace.
        domain: Number of the DDS domain.
        interface: Network interface; empty for the configuration in `CYCLONEDDS_URI`.
        robot: Name or file of the robot; empty for that of the platform.
        label: REAL, or EMULATED for what runs on this machine.
    """

    namespace: str
    port: str
    domain: int
    interface: str
    robot: str
    label: Label


def read_address(text: str) -> Address:
    """Return the parts of an address, with or without `ros2:` before it.

    Options that are left out are those of ROS: the domain is `ROS_DOMAIN_ID`, and discovery stays on this machine
    unless `ROS_AUTOMATIC_DISCOVERY_RANGE` is SUBNET, or `CYCLONEDDS_URI` is set. A robot on the interface of this
    machine counts as EMULATED, and others as REAL.

    Raises:
        RobotError: It is no address.
    """
    text = text.removeprefix("ros2:")
    if "://" in text:
        base, _, query = text.partition("?")
        pairs = parse_qsl(query, keep_blank_values=True)
        robot = dict(pairs).get("robot", "")
        rest = "&".join(f"{name}={value}" for name, value in pairs if name != "robot")
        keeps = text.startswith("emulator:")
        return Address("", text if keeps else base + (f"?{rest}" if rest else ""), 0, "", robot, "EMULATED")
    namespace, _, query = text.partition("?")
    options = dict(parse_qsl(query, keep_blank_values=True))
    for name in options:
        if name not in OPTIONS:
            raise RobotError(f"{text}: unknown option {name!r}. {did_you_mean(name, OPTIONS)}")
    if not namespace.startswith("/") or "//" in namespace or any(letter.isspace() for letter in namespace):
        raise RobotError(
            f"ros2:{text} names no robot, expected the namespace of its topics, such as ros2:/ or "
            "ros2:/robot1?interface=eth0."
        )
    interface = options.get("interface", _usual_interface())
    usual = "EMULATED" if interface == LOOPBACK else "REAL"
    label: Literal["EMULATED", "REAL"] = (
        "REAL" if options.get("label", usual).upper() == "REAL" else "EMULATED"
    )
    if options.get("label", usual).upper() not in ("REAL", "EMULATED"):
        raise RobotError(f"{text}: label is {options['label']!r}, expected REAL or EMULATED.")
    return Address(
        namespace.rstrip("/") or "/", "", _domain(options), interface, options.get("robot", ""), label
    )


def _domain(options: dict[str, str]) -> int:
    given = options.get("domain", os.environ.get("ROS_DOMAIN_ID", "0"))
    if not (given.isdecimal() and int(given) <= _MOST_DOMAIN):
        raise RobotError(f"The DDS domain is {given!r}, expected a whole number from 0 to {_MOST_DOMAIN}.")
    return int(given)


def _usual_interface() -> str:
    if os.environ.get("CYCLONEDDS_URI"):
        return ""
    given = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    if given.upper() not in RANGES:
        raise RobotError(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is {given!r}, expected {', '.join(filter(None, RANGES))}."
        )
    return "auto" if given.upper() == "SUBNET" else LOOPBACK
