"""Why a port could not be opened, in the system's words."""

from __future__ import annotations

import os
import re

_NUMBER = re.compile(r"\[Errno (\d+)\]|\((\d+), '")


def reason_of(error: Exception) -> str:
    """Return the reason without the numbers, names, and calls that pyserial puts around it."""
    if found := _NUMBER.search(str(error)):
        return os.strerror(int(found[1] or found[2]))
    return str(error)
