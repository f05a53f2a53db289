"""Serial ports of this machine: their names, the devices behind them, how one is opened, and which process holds it."""

from __future__ import annotations

import errno
import ipaddress
import os
import socket
import time
from pathlib import Path
from urllib.parse import urlsplit

import serial
from serial.tools import list_ports

from realitygap.errors import RobotError
from realitygap.robots import GIVE_UP_S, Label, Port, PortGuess, is_pseudo_terminal, reason_of, serial_port

from ._reading import GAP_S

BAUD = 38400
WRITE_S = 2.0
"""Maximum time for which a port may refuse a command [s]."""
LOCKED_S = 0.05
"""Time between two attempts to open a port that the guardian of an ended program still holds [s]."""
UNKNOWN_HOLDER_S = 2.0
"""Time to retry if the system does not report which process locked the port [s]."""
LOCKS = Path("/proc/locks")
"""The locks of files, if the system lists them."""


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
    return "EMULATED" if is_pseudo_terminal(name) else "REAL"


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
    devices = {
        device.device: (device.description or "", device.hwid or "") for device in list_ports.comports()
    }
    for path in sorted(Path("/dev").glob("rfcomm*")):
        devices.setdefault(str(path), ("Bluetooth serial port", ""))
    guesses = [
        PortGuess(name, _seems(name, description, hardware), description)
        for name, (description, hardware) in devices.items()
    ]
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


class _Locked(Exception):  # noqa: N818
    """Another process has locked the port."""


def open_port(name: str) -> Port:
    """Open a port with pyserial, with DTR low, as a cabled S2 requires.

    If the guardian of an ended program still holds the port, this waits for it.

    Raises:
        RobotError: The port cannot be opened. The message states the next step.
    """
    give_up_s = time.monotonic() + (GIVE_UP_S + 1.0 if LOCKS.exists() else UNKNOWN_HOLDER_S)
    while True:
        try:
            return _open_once(name)
        except _Locked as error:
            holder = _holder_of(name)
            if holder is not None or time.monotonic() > give_up_s:
                raise RobotError(f"{name} cannot be opened: it is in use. {_holder_words(holder)}") from error
        time.sleep(LOCKED_S)


def _open_once(name: str) -> Port:
    if name.startswith("rfc2217://"):
        raise RobotError(
            f"{name} cannot be opened: RFC 2217 is not supported, as its ports cannot be handed to the process that "
            "stops a robot whose program was killed. Offer the port as raw TCP and name it socket://HOST:PORT."
        )
    try:
        unopened = serial_port(name, BAUD, GAP_S, WRITE_S)
        unopened.dtr = False
        port: Port = unopened
        port.open()
    except (OSError, ValueError, AttributeError) as error:
        if getattr(error, "errno", None) == errno.EAGAIN:
            raise _Locked from error
        raise RobotError(f"{name} cannot be opened: {reason_of(error)}. {_advice(name, error)}") from error
    return port


def is_serial_port(port: object) -> bool:
    """Return whether a port is one of pyserial's, whose name identifies the device."""
    return isinstance(port, serial.SerialBase)


def _advice(name: str, error: Exception) -> str:
    text = str(error).lower()
    if "permission" in text or "denied" in text:
        return "May this account use it? On Linux: sudo usermod -aG dialout $USER, then log in again."
    if "://" in name:
        return "Is the address right, and does something listen there?"
    return "Is the robot on, paired and connected? `realitygap robot list` lists the existing ports."


def _holder_of(port: str) -> int | None:
    """Return the number of the running process that locked a port. None if it has ended or is unknown."""
    try:
        file = Path(port).stat()
        lines = LOCKS.read_text().splitlines()
    except OSError:
        return None
    place = f"{os.major(file.st_dev):02x}:{os.minor(file.st_dev):02x}:{file.st_ino}"
    for line in lines:  # such as "1: FLOCK  ADVISORY  WRITE 1234 00:1a:5 0 EOF"
        words = line.split()
        if words[1:2] == ["FLOCK"] and words[5:6] == [place] and Path(f"/proc/{words[4]}").exists():
            return int(words[4])
    return None


def _holder_words(process: int | None) -> str:
    """Return a sentence that names the process with the open port, and the next step."""
    if process is None:
        return "Another program holds it; close that one."
    if process == os.getpid():
        return "This program has it open already: close that robot first."
    try:
        command = Path(f"/proc/{process}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        command = ""
    named = f" ({command.strip()[:80]})" if command.strip() else ""
    return f"Another program holds it; close that one: process {process}{named}."
