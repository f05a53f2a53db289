"""Ports of pyserial, and why one could not be opened, in the system's words."""

from __future__ import annotations

import os
import re
from typing import Any

_EMULATOR = "realitygap.emulator"
"""The package that pyserial imports for names that begin with emulator://."""
_NUMBER = re.compile(r"\[Errno (\d+)\]|\((\d+), '")


def serial_port(name: str, baud: int, timeout_s: float) -> Any:
    """Return a port of pyserial that is not open yet.

    Raises:
        ValueError: The name has an unknown scheme.
    """
    import serial

    if _EMULATOR not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(_EMULATOR)
    return serial.serial_for_url(name, do_not_open=True, baudrate=baud, timeout=timeout_s)


def reason_of(error: Exception) -> str:
    """Return the reason without the numbers, names, and calls that pyserial puts around it."""
    if found := _NUMBER.search(str(error)):
        return os.strerror(int(found[1] or found[2]))
    return str(error)
