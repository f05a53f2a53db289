"""The robots on ROS 2 that this machine sees."""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
import threading
import time
from importlib.util import find_spec

from realitygap._limits import parse_json
from realitygap.errors import RobotError
from realitygap.robots import PortGuess

from ._address import LOOPBACK, read_address
from ._graph import COMMANDS, Ends

LOOK_S = 15.0
"""Longest time of a look [s]: it imports DDS, and waits a second for answers."""
MOST_LISTED = 24
"""Largest number of topics that are listed."""
FRESH_S = 10.0
"""Time for which a look counts [s]: pages of the lab ask often."""


class _Looks:
    """Looks into the domain in a separate process, at most one every `FRESH_S`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._at = -FRESH_S
        self._found: list[PortGuess] = []
        self._looking: threading.Thread | None = None

    def robots(self, *, waits: bool) -> list[PortGuess]:
        """Return the robots of the last look, and begin another one if it is old.

        Args:
            waits: True to wait for that one.
        """
        with self._lock:
            is_old = time.monotonic() - self._at >= FRESH_S
            if is_old and self._looking is None:
                self._looking = threading.Thread(target=self._look, daemon=True)
                self._looking.start()
            looking = self._looking
        if waits and looking is not None:
            looking.join()
        return list(self._found)

    def _look(self) -> None:
        found = _look()
        with self._lock:
            self._found, self._at, self._looking = found, time.monotonic(), None


_looks = _Looks()


def find_ports() -> list[PortGuess]:
    """Return the robots that take commands in the domain; none if cyclonedds is not installed.

    Domain and interface are those of an address without options: this machine, unless variables of ROS say otherwise.
    There is no look if `ROS_AUTOMATIC_DISCOVERY_RANGE` is OFF. A page of the lab, which must not wait, gets the robots
    of the last look.
    """
    if os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "OFF" or not find_spec("cyclonedds"):
        return []
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return _looks.robots(waits=True)
    return _looks.robots(waits=False)


def _look() -> list[PortGuess]:
    try:
        address = read_address("/")
    except RobotError as error:
        return [PortGuess("/", f"robots on ROS 2 were not looked for: {error}", "")]
    settings = {"looks": True, "domain": address.domain, "interface": address.interface}
    command = [sys.executable, "-P", "-m", "realitygap.families.ros2._gateway", json.dumps(settings)]
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=LOOK_S, check=True
        )
        ends = Ends(tuple(parse_json(done.stdout)))
    except (OSError, ValueError, subprocess.SubprocessError):
        return []
    options = [f"domain={address.domain}"] * (address.domain != 0)
    options += [f"interface={address.interface}"] * (address.interface not in ("", LOOPBACK))
    query = "?" + "&".join(options) if options else ""
    guesses = []
    for namespace, topics in ends.robots().items():
        kinds = {
            end["kind"].rpartition("/")[2]
            for end in ends.all
            if end["role"] == "subscriber" and end["kind"] in COMMANDS and end["topic"] in topics
        }
        what = f"a robot on ROS 2 ({', '.join(sorted(kinds))})"
        if any(ends.n_programs(topic) > 1 for topic in topics):
            what = "several robots on ROS 2 in one namespace, which cannot be driven"
        listed = ", ".join(topic.removeprefix(namespace.rstrip("/") + "/") for topic in topics[:MOST_LISTED])
        more = f" and {len(topics) - MOST_LISTED} more" if len(topics) > MOST_LISTED else ""
        guesses.append(PortGuess(f"{namespace}{query}", what, listed + more))
    return guesses
