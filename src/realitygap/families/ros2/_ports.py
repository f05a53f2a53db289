"""The robots on ROS 2 that this machine sees."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
from importlib.util import find_spec

from realitygap._limits import parse_json
from realitygap.robots import PortGuess

from ._address import read_address
from ._graph import COMMANDS, Ends

LOOK_S = 15.0
"""Longest time of a look [s]: it imports DDS, and waits a second for answers."""
FRESH_S = 10.0
"""Time for which a look counts [s]: pages of the lab ask often."""


class _Looks:
    """Looks into the domain in a separate process, at most one every `FRESH_S`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._at = -FRESH_S
        self._found: list[PortGuess] = []

    def robots(self) -> list[PortGuess]:
        """Return the robots of the last look; look if it is old."""
        with self._lock:
            if time.monotonic() - self._at >= FRESH_S:
                self._found = _look()
                self._at = time.monotonic()
            return list(self._found)


_looks = _Looks()


def find_ports() -> list[PortGuess]:
    """Return the robots that take commands in the domain; none if cyclonedds is not installed.

    Domain and interface are those of an address without options: this machine, unless variables of ROS say otherwise.
    """
    return _looks.robots() if find_spec("cyclonedds") else []


def _look() -> list[PortGuess]:
    address = read_address("/")
    settings = {"looks": True, "domain": address.domain, "interface": address.interface}
    command = [sys.executable, "-P", "-m", "realitygap.families.ros2._gateway", json.dumps(settings)]
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=LOOK_S, check=True
        )
        ends = Ends(tuple(parse_json(done.stdout)))
    except (OSError, ValueError, subprocess.SubprocessError):
        return []
    guesses = []
    for namespace, topics in ends.robots().items():
        kinds = {
            end["kind"].rpartition("/")[2]
            for end in ends.all
            if end["role"] == "subscriber" and end["kind"] in COMMANDS and end["topic"] in topics
        }
        listed = ", ".join(topic.removeprefix(namespace.rstrip("/") + "/") for topic in topics[:6])
        guesses.append(PortGuess(namespace, f"a robot on ROS 2 ({', '.join(sorted(kinds))})", listed))
    return guesses
