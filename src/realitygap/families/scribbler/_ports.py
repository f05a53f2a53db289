"""Names of serial ports, and the devices behind them."""

from __future__ import annotations

import ipaddress
import re
import socket
import sys
from pathlib import Path
from urllib.parse import urlsplit

from realitygap.robots import Label, PortGuess

from ._link import serial_devices

_PSEUDO_TERMINAL = re.compile(
    r"/dev/(pts/\d+|pty\w+)$" if sys.platform != "darwin" else r"/dev/(ttys\d+|pty\w+)$"
)


def port_name(name: str) -> str:
    """Return a port without the platform's name before it."""
    return name.removeprefix("scribbler:")


def label_of(name: str) -> Label:
    """Return the label of a robot on this port: EMULATED if the port cannot belong to a real robot, otherwise REAL."""
    name = port_name(name)
    scheme, _, inner = name.partition("://")
    if scheme in ("emulator", "loop"):
        return "EMULATED"
    if scheme in ("spy", "alt"):  # pyserial's ways to open another port
        return label_of(inner.partition("?")[0])
    if inner:
        return "EMULATED" if _is_loopback(name) else "REAL"
    return "EMULATED" if _PSEUDO_TERMINAL.match(str(Path(name).resolve())) else "REAL"


def _is_loopback(url: str) -> bool:
    try:
        host = urlsplit(url).hostname
        addresses = socket.getaddrinfo(host, None) if host else []
    except (OSError, ValueError):
        return False
    return bool(addresses) and all(
        ipaddress.ip_address(str(entry[4][0]).partition("%")[0]).is_loopback for entry in addresses
    )


def find_ports() -> list[PortGuess]:
    """Return the serial ports of this machine, probable robots first."""
    found = {device.device: (device.description or "", device.hwid or "") for device in serial_devices()}
    for path in sorted(Path("/dev").glob("rfcomm*")):
        found.setdefault(str(path), ("Bluetooth serial port", ""))
    guesses = [PortGuess(name, _seems(name, *said), said[0]) for name, said in found.items()]
    order = ("a Fluke", "Bluetooth", "USB")
    return sorted(
        guesses, key=lambda guess: ([not guess.seems.startswith(word) for word in order], guess.port)
    )


def _seems(name: str, description: str, hardware: str) -> str:
    words = f"{name} {description} {hardware}".lower()
    if "fluke" in words or "ipre" in words or "scribbler" in words:
        return "a Fluke"
    if "rfcomm" in words or "bluetooth" in words or "bthenum" in words:
        return "Bluetooth, perhaps a Fluke"
    if "usb" in words:
        return "USB serial cable, perhaps an S1 or S2 without a Fluke"
    return "a serial port"
