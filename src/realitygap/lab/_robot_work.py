"""A robot driven by hand from a page, in its own process; it stops when messages stop."""

from __future__ import annotations

import base64
import io
import math
import queue
import threading
import time
from dataclasses import asdict
from importlib import import_module
from typing import TYPE_CHECKING, Any

from realitygap.errors import RobotError
from realitygap.robots import is_in_this_program, open_on
from realitygap.trials import own_witness, preflight
from realitygap.world import Pose

from ._channel import Channel, Message

if TYPE_CHECKING:
    from realitygap.emulator import Witness

DEAD_MAN_S = 0.4
"""Time without a message from the driving page after which the motors are stopped [s]."""
PERIOD_S = 0.05
"""Period of the loop [s]. Over Bluetooth, the requests in the loop take longer."""
WATCHDOG_S = 1.0
"""Time without a request of the loop after which the driver stops the motors [s]."""
BATTERY_S = 5.0
"""Time between two readings of the battery [s]."""
_MORE = ("light", "line")
"""Sensors that are reported in addition to range sensors, if the robot has them."""


def work(channel: Channel, order: Message) -> None:
    """Connect, then sense and drive until told to quit.

    Args:
        channel: To the server.
        order: `port`, and `witness` of an emulator in another program, if any.
    """
    port = str(order["port"])
    if is_in_this_program(port):
        import_module("realitygap.emulator")  # which tells pyserial of such ports
    with open_on(port, watchdog_s=WATCHDOG_S)[1] as robot:
        _Hand(channel, robot, _witness(robot, order.get("witness") or None)).carry_on()


def _witness(robot: Any, address: str | None) -> Witness | None:
    own = own_witness(robot)
    if own is not None or address is None:
        return own
    from realitygap.emulator import connect_witness

    return connect_witness(address)


class _Hand:
    """Drives while messages arrive, and stops when they do not."""

    def __init__(self, channel: Channel, robot: Any, witness: Witness | None) -> None:
        self._channel, self._robot, self._witness = channel, robot, witness
        self._wheels = (0.0, 0.0)
        self._told_s = 0.0
        self._moves = False
        self._lock = threading.Lock()
        self._wanted: queue.Queue[Message] = queue.Queue()
        self._battery_s = -BATTERY_S
        self._more = [name for name in _MORE if hasattr(robot, name)]
        channel.at_once("drive", self._drive)
        channel.at_once("release", self._stop)
        channel.at_once("stop", self._stop)
        channel.at_once("want", self._wanted.put)

    def carry_on(self) -> None:
        """Sense and drive until the process is interrupted or the robot fails."""
        robot = self._robot
        self._channel.say(
            "met",
            label=robot.label,
            info=asdict(robot.info),
            name=robot.name,
            n_sensors=robot.n_sensors,
            more=self._more,
            has_camera=hasattr(robot, "picture"),
            has_battery=hasattr(robot, "volts"),
            **self._place(),
        )
        while True:
            began = time.monotonic()
            self._keep_moving()
            self._say_senses()
            while not self._wanted.empty():
                self._do(self._wanted.get())
            time.sleep(max(0.0, PERIOD_S - (time.monotonic() - began)))

    # driving

    def _drive(self, message: Message) -> None:
        """Set the speeds of the wheels; the listening thread calls this."""
        move, turn = (_share(message.get(name)) for name in ("move", "turn"))
        with self._lock:
            self._wheels = (_share(move - turn), _share(move + turn))
            self._told_s = time.monotonic()

    def _stop(self, message: Message) -> None:
        """Stop the motors; the listening thread calls this."""
        with self._lock:
            self._told_s = 0.0
            self._moves = False
            self._robot.stop()

    def _keep_moving(self) -> None:
        with self._lock:
            if time.monotonic() - self._told_s < DEAD_MAN_S:
                self._robot.motors(*self._wheels)
                self._moves = self._wheels != (0.0, 0.0)
            elif self._moves:
                self._robot.stop()
                self._moves = False
                self._channel.say("stood")

    # telling

    def _place(self) -> dict[str, Any]:
        """Return the arena of an emulated robot; empty for other robots."""
        if self._witness is None:
            return {}
        arena = self._witness.arena()
        return {
            "walls": [list(wall) for wall in arena.walls],
            "grid": asdict(arena.grid),
            "start": list(arena.start),
        }

    def _say_senses(self) -> None:
        robot = self._robot
        seen = robot.observe()
        values: dict[str, Any] = {
            "raw": list(seen.raw),
            "readings": list(seen.readings),
            "stalled": seen.stalled,
            **{name: list(getattr(robot, name)()) for name in self._more},
            "moves": self._moves,
        }
        if self._witness is not None:
            values["pose"] = list(self._witness.pose())
        if hasattr(robot, "volts") and time.monotonic() - self._battery_s > BATTERY_S:
            self._battery_s = time.monotonic()
            volts = float(robot.volts())
            if not math.isnan(volts):
                self._channel.say("battery", volts=round(volts, 2))
        self._channel.say("senses", **values)

    def _do(self, message: Message) -> None:
        what = message.get("what")
        try:
            self._stop(message)  # a picture takes the link for seconds, in which no stop could pass
            if what == "preflight":
                found = preflight(self._robot)
                self._channel.say("preflight", facts=found.facts, problems=list(found.problems))
            elif what == "picture":
                self._channel.say("picture", png=_png(self._robot))
            elif what == "place" and self._witness is not None:
                self._witness.place(Pose(*self._witness.arena().start), 0)
                self._channel.say("placed")
        except RobotError as error:
            if not self._robot.link.is_open:
                raise
            self._channel.say("refused", text=str(error))


def _png(robot: Any) -> str:
    if not hasattr(robot, "picture"):
        raise RobotError("This robot has no camera.")
    from PIL import Image

    data = io.BytesIO()
    Image.fromarray(robot.picture()).save(data, "PNG")
    return base64.b64encode(data.getvalue()).decode()


def _share(value: Any) -> float:
    """A number within -1..1; 0 where it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        return 0.0
    return min(1.0, max(-1.0, float(value)))
