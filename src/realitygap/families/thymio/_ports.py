"""The serial ports behind which a Thymio may be, and the label of a robot on a port."""

from __future__ import annotations

import os
import re
import sys
from typing import Any

from realitygap.robots import Label, PortGuess

VENDOR = 0x0617
PRODUCTS = {0x000A: "a Thymio", 0x000C: "a Thymio's dongle"}
"""Devices of the vendor, by USB product number. Source: epfl-mobots/thymio-python."""
_PSEUDO_TERMINAL = re.compile(
    r"/dev/(pts/\d+|pty\w+)$" if sys.platform != "darwin" else r"/dev/(ttys\d+|pty\w+)$"
)


def port_name(name: str) -> str:
    """Return a port without the platform's name before it."""
    return name.removeprefix("thymio:")


def seems(device: Any) -> str:
    """Return what is behind a port as pyserial describes it; empty if it is no Thymio."""
    return PRODUCTS.get(device.pid, "") if device.vid == VENDOR else ""


def find_ports() -> list[PortGuess]:
    """Return the ports of this machine behind which a Thymio or its dongle is."""
    from serial.tools import list_ports

    found = [PortGuess(each.device, seems(each), each.description or "") for each in list_ports.comports()]
    return sorted(guess for guess in found if guess.seems)


def label_of(name: str, variables: Any) -> Label:
    """Return REAL for a robot on a serial device that describes a battery, otherwise EMULATED."""
    name = port_name(name)
    is_device = "://" not in name and not _PSEUDO_TERMINAL.match(os.path.realpath(name))
    return "REAL" if is_device and "_vbat" in variables else "EMULATED"
