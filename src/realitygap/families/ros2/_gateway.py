"""The gateway: a separate process that speaks DDS for a driver, and stops the robot if the driver's program dies.

It is run as `python -P -m realitygap.families.ros2._gateway SETTINGS`, with settings as JSON. Standard input brings
requests, and standard output takes answers, a line of JSON each (`_lines` describes them). DDS has threads of its own,
which end with a program that is killed. This process outlives it: a command has a life, and at its end, or at the end
of standard input, the gateway publishes zeros.
"""

from __future__ import annotations

import json
import math
import os
import select
import signal
import sys
import time
from typing import Any

from realitygap._limits import parse_json

from ._dds import Node
from ._frames import Frames, planar
from ._lines import IDLE, LIFE_S, MOST_TRAIL, ONCE_S, REPEAT_S, TICK_S, ZEROS_S
from ._messages import ODOMETRY, POSE, TF, TWIST_STAMPED

PIECE = 1 << 16
LOOK_S = 1.0
"""Time for which a look waits for others to answer [s]."""
MOST_LINE = 1 << 16
"""Largest length of a request [bytes]."""


class Gateway:
    """Serves one driver.

    Args:
        settings: `domain`, `interface`, `command` (its topic), `topics` (types by topic), and `frames` (of transforms).
    """

    def __init__(self, settings: dict[str, Any]) -> None:
        self.node = Node(settings["domain"], settings["interface"])
        self._command: str = settings["command"]
        for topic, kind in settings["topics"].items():
            self.node.subscribe(topic, kind)
        self._trails: dict[str, list[list[float]]] = {}
        self._frames = Frames(*settings.get("frames", ("", "")))
        self._twist = (0.0, 0.0)
        self._until = -math.inf  # the end of the command's life
        self._repeats = True
        self._zeros_until = -math.inf
        self._published = -math.inf
        self._clock_offset = 0.0  # of the robot's time from this machine's

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """Do what a request says, and return the answer."""
        what = request["do"]
        if what == "drive":
            self.drive(
                float(request["ahead"]),
                float(request["turn"]),
                float(request["life"]),
                not request.get("once"),
            )
            return {}
        if what == "stop":
            self.stop()
            return {}
        if what == "read":
            self.tick()
            trails, self._trails = self._trails, {}
            topics = {topic: self._framed(topic, known) for topic, known in self.node.newest().items()}
            return {
                "now": time.monotonic(),
                "topics": {topic: known for topic, known in topics.items() if known},
                "trails": trails,
            }
        if what == "graph":
            return {
                "graph": self.node.graph(),
                "kinds": self.node.command_kinds(self._command),
                "frames": self._frames.known(),
            }
        raise ValueError(f"unknown request {what!r}")

    def _framed(self, topic: str, known: dict[str, Any]) -> dict[str, Any]:
        """Return what is known of a topic; of transforms, only the pose of the robot, empty if there is none."""
        if self.node.kind_of(topic) != TF:
            return known
        at = self._frames.at
        return {} if at is None else known | {"age": time.monotonic() - at[0], "message": {"pose": at[1:]}}

    def drive(self, ahead: float, turn: float, life_s: float, repeats: bool = True) -> None:
        """Publish a command [m/s, rad/s], and repeat it until its life ends [s]."""
        self._twist, self._repeats = (ahead, turn), repeats
        self._until = time.monotonic() + min(life_s, LIFE_S if repeats else ONCE_S)
        self._publish()

    def stop(self) -> None:
        """Publish zeros, and repeat them for a while."""
        self._twist, self._until, self._repeats = (0.0, 0.0), -math.inf, True
        self._zeros_until = time.monotonic() + ZEROS_S
        self._publish()

    def tick(self) -> None:
        """Take what has come, and repeat what lasts."""
        for topic, message in self.node.take():
            kind = self.node.kind_of(topic)
            if kind == ODOMETRY:
                stamp = message.header.stamp
                self._clock_offset = stamp.sec + stamp.nanosec * 1e-9 - time.time()
            if kind in (ODOMETRY, POSE):
                pose = message.pose.pose if kind == ODOMETRY else message.pose
                self._keep(topic, [time.monotonic(), *planar(pose.position, pose.orientation)])
            elif kind == TF and self._frames.take(message) and self._frames.at:
                self._keep(topic, [*self._frames.at])
        now = time.monotonic()
        if self._twist != (0.0, 0.0) and now >= self._until:
            self.stop()
        elif (
            self._repeats and now < max(self._until, self._zeros_until) and now - self._published >= REPEAT_S
        ):
            self._publish()

    def _keep(self, topic: str, row: list[float]) -> None:
        """Add a time [s] and a pose to the trail of a topic."""
        if all(map(math.isfinite, row)):
            trail = self._trails.setdefault(topic, [])
            trail.append(row)
            del trail[:-MOST_TRAIL]

    def _publish(self) -> None:
        ahead, turn = self._twist
        self._published = time.monotonic()
        for kind in self.node.command_kinds(self._command):
            values: dict[str, Any] = {"linear": {"x": ahead}, "angular": {"z": turn}}
            if kind == TWIST_STAMPED:
                now = time.time() + self._clock_offset
                stamp = {"sec": int(now), "nanosec": int(now % 1 * 1e9)}
                values = {"header": {"stamp": stamp}, "twist": values}
            self.node.publish(self._command, kind, values)

    def halt(self) -> None:
        """Publish zeros for a second: the program is gone."""
        self.stop()
        end = time.monotonic() + 2 * ZEROS_S
        while time.monotonic() < end:
            self._publish()
            time.sleep(REPEAT_S)


def serve(gateway: Gateway, program: int) -> None:
    """Answer requests until standard input ends, or the program is gone."""
    held = b""
    while True:
        if select.select([0], [], [], TICK_S)[0]:
            data = os.read(0, PIECE)
            if not data:
                return
            *lines, held = (held + data).split(b"\n")
            if len(held) > MOST_LINE:
                return
            for line in lines:
                request = parse_json(line)
                try:
                    answer = gateway.answer(request)
                except (ValueError, KeyError, TypeError) as error:
                    answer = {"error": f"{type(error).__name__}: {error}"}
                sys.stdout.write(json.dumps(answer | {"id": request.get("id")}) + "\n")
                sys.stdout.flush()
        elif os.getppid() != program:
            return
        gateway.tick()


def stand_by(program: int) -> bool:
    """Wait for the program's word, or its end; return whether the robot has to be stopped."""
    while not select.select([0], [], [], TICK_S)[0]:
        if os.getppid() != program:  # a child of the program may hold the other end of the pipe
            return True
    return os.read(0, PIECE) != IDLE


def look(settings: dict[str, Any]) -> None:
    """Print who publishes and subscribes in a domain."""
    node = Node(settings["domain"], settings["interface"])
    time.sleep(LOOK_S)
    sys.stdout.write(json.dumps(node.graph()))
    node.close()


def main() -> None:
    """Serve the program that started this process, then stop the robot."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)  # what ends the program must not end its gateway first
    settings = parse_json(sys.argv[1])
    if settings.get("looks"):
        look(settings)
        return
    try:
        gateway = Gateway(settings)
    except ValueError as error:  # it answers the first request
        sys.stdout.write(json.dumps({"error": str(error), "id": 1}) + "\n")
        return
    program = int(settings["program"])
    if settings.get("halts"):
        gateway.node.wait_for_subscriber(settings["command"])
        is_needed = stand_by(program)
    else:
        serve(gateway, program)
        is_needed = True
    if is_needed:
        gateway.halt()
    gateway.node.close()


if __name__ == "__main__":
    main()
