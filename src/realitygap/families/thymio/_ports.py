"""The ports behind which a Thymio may be: their names, the devices behind them, and how one is opened."""

from __future__ import annotations

import errno
import socket
from collections.abc import Container

from serial.tools import list_ports

from realitygap.errors import RobotError
from realitygap.robots import Label, Port, PortGuess, is_pseudo_terminal, reason_of, serial_port

VENDOR = 0x0617
PRODUCTS = {0x000A: "a Thymio", 0x000C: "a Thymio's dongle"}
"""Devices of the vendor, by USB product number. Source: epfl-mobots/thymio-python."""
BAUD = 115_200
POLL_S = 0.02
"""Longest wait for bytes in one piece [s]."""
WRITE_S = 0.5


def port_name(name: str) -> str:
    """Return a port without the platform's name before it."""
    return name.removeprefix("thymio:")


def find_ports() -> list[PortGuess]:
    """Return the ports of this machine behind which a Thymio or its dongle is."""
    devices = [device for device in list_ports.comports() if device.vid == VENDOR and device.pid in PRODUCTS]
    return sorted(
        PortGuess(device.device, PRODUCTS[device.pid], device.description or "") for device in devices
    )


def label_of(name: str, variables: Container[str]) -> Label:
    """Return REAL for a robot on a serial device that describes a battery, otherwise EMULATED."""
    name = port_name(name)
    is_device = "://" not in name and not is_pseudo_terminal(name)
    return "REAL" if is_device and "_vbat" in variables else "EMULATED"


def open_port(name: str) -> Port:
    """Open a port with DTR high, as the robot needs it to listen.

    Raises:
        RobotError: It cannot be opened; the message says what to do.
    """
    try:
        port: Port = serial_port(name, BAUD, POLL_S, WRITE_S)
        port.open()
        connection = getattr(port, "_socket", None)
        if isinstance(
            connection, socket.socket
        ):  # otherwise a short message waits for the one before to be confirmed
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except (OSError, ValueError, AttributeError) as error:
        raise RobotError(f"{name} cannot be opened: {reason_of(error)}. {_advice(name, error)}") from error
    return port


def _advice(name: str, error: Exception) -> str:
    number, text = getattr(error, "errno", None), str(error).lower()
    if number in (errno.EAGAIN, errno.EBUSY) or "busy" in text or "exclusively lock" in text:
        return "Another program has the port: quit Thymio Suite, which holds it while it runs, and try again."
    if "access is denied" in text:
        return "Another program may have the port: quit Thymio Suite and try again."
    if "permission" in text or "denied" in text:
        return "May this account use it? On Linux: sudo usermod -aG dialout $USER, then log in again."
    if "://" in name:
        return "Is the address right, and does a playground listen there?"
    return "Is the robot or its dongle plugged in? `realitygap robot list` names the ports."
