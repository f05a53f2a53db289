"""A robot on a port: asked for its name, or driven by hand from a page.

`Hand` and `IdentifyJob` are what pages see; `drive` and `identify` run in processes of their own.
"""

from __future__ import annotations

import base64
import io
import math
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any

from PIL import Image

from realitygap.emulator import Witness, connect_witness
from realitygap.errors import RobotError
from realitygap.robot_families import default_family, find_family
from realitygap.robots import is_in_this_program, open_on, split_port
from realitygap.trials import own_witness, preflight
from realitygap.world import Arena, Grid, Pose

from . import _messages as messages
from ._channel import Channel
from ._job import MOST_POINTS, Job

DEAD_MAN_S = 0.4
"""Time without a message from the driving page after which the motors are stopped [s]."""
PERIOD_S = 0.05
"""Period of the loop [s]. Over Bluetooth, the requests in the loop take longer."""
WATCHDOG_S = 1.0
"""Time without a request of the loop after which the driver stops the motors [s]."""
BATTERY_S = 5.0
"""Time between two readings of the battery [s]."""
_SHOWN = ("port", "label")
"""Facts that are shown next to the others anyway."""


class IdentifyJob(Job):
    """A robot that is asked for its name, once, because a visitor wants it."""

    LOST = "The process that looked for a robot ended (status {status}). Try again."

    def __init__(self, port: str, root: Path, changed: Callable[[], None]) -> None:
        self._answer = ""
        super().__init__(messages.IdentifyWork(port), root, changed)

    @property
    def reply(self) -> str:
        """Reply on the port, in words."""
        if self.outcome is None:
            return "Looking for a robot…"
        return f"No robot found. {self.outcome}" if self.is_failed else self.outcome

    def _take(self, message: messages.Message) -> None:
        match message:
            case messages.Identified():
                facts = dict(message.facts)
                name = facts.pop("name", "A robot without a name")
                words = [
                    f"{key.replace('_', ' ')} {text}" for key, text in facts.items() if key not in _SHOWN
                ]
                self._answer = f"{name} answered ({message.label}): {', '.join(words)}."
            case messages.Ended() if self._answer and self.outcome is None:
                self._conclude(self._answer)  # not before the port is free again
            case _:
                super()._take(message)


class Hand(Job):
    """A robot that is driven by hand.

    Attributes:
        label: REAL or EMULATED; empty before it answers.
        about: Its name and other facts.
        n_sensors: Number of its range sensors.
        kinds: Kinds of its other sensors, such as `light`.
        has_camera, has_battery: Whether it has a camera, and reports the voltage of its battery.
        senses: The last ones; None before.
        battery_v: [V]; None before it was told.
        preflight: What the last one found; None before.
        picture: PNG in base64; empty before.
        arena: Where an emulated robot drives; None where nobody sees it.
        line: (x, y) [m] where it has been.
        driven_s: Time for which its motors ran since it was placed [s].
        doing: What it is doing since a visitor asked for it; empty otherwise.
        refusal: Why it did not do what it was asked for last; empty if it did.
        n_stops: How often somebody pressed stop.

    Args:
        work: What the process is told first.
        root: Where it works.
        changed: Called after each change but that of the senses, from another thread.
    """

    QUIET = (messages.Senses,)
    STOPPED = "The robot was stopped and disconnected."
    LOST = "The robot's process ended (status {status})."
    SILENT_S = WATCHDOG_S  # by then its driver has stopped the motors, and the pad must not seem to drive

    def __init__(self, work: messages.HandWork, root: Path, changed: Callable[[], None]) -> None:
        self.port = work.port
        self.label = ""
        self.about: dict[str, str] = {}
        self.n_sensors = 0
        self.kinds: list[str] = []
        self.has_camera = self.has_battery = False
        self.senses: messages.Senses | None = None
        self.battery_v: float | None = None
        self.preflight: messages.PreflightResult | None = None
        self.picture = ""
        self.arena: Arena | None = None
        self.line: list[list[float]] = []
        self.driven_s = 0.0
        self.doing: messages.Activity | None = None
        self.refusal = ""
        self.n_live = 0
        self.n_stops = 0
        super().__init__(work, root, changed)

    @property
    def has_met(self) -> bool:
        """True if the robot has answered."""
        return self.senses is not None

    @property
    def is_lost(self) -> bool:
        """True if it was connected, and its link has failed."""
        return self.is_failed and self.has_met

    @property
    def robot_action(self) -> str:
        """Sentence that states that it drives; empty if it stands still."""
        return "The robot is driven by hand." if self.senses is not None and self.senses.moves else ""

    @property
    def reply(self) -> str:
        """Reply on its port, in words; empty as long as it is unknown."""
        if self.label:
            return f"{self.about['name']} answered ({self.label})."
        return "No robot answered." if self.is_failed else ""

    def drive(self, move: float, turn: float, stops: int) -> None:
        """Drive so for the next moment; said again and again, or it stops.

        Args:
            move, turn: -1..1.
            stops: How many stops the page knew of when the handle was taken: a stop since then ends the press, however
                late its words come.
        """
        if stops == self.n_stops:
            self._child.tell(messages.Drive(move, turn))

    def release(self) -> None:
        """The handle was let go: stop, until it is pulled again."""
        self._child.tell(messages.Release())

    def stop_robot(self) -> None:
        """Stop the motors; a handle that is held has to be let go before it drives again."""
        self.n_stops += 1
        self._child.tell(messages.Stop())

    def want(self, what: messages.Activity) -> None:
        """Ask for preflight, picture, or place."""
        self.doing, self.refusal = what, ""
        self._child.tell(messages.Ask(what))
        self._changed()

    def _take(self, message: messages.Message) -> None:
        match message:
            case messages.HandMet():
                self._meet(message)
            case messages.Senses():
                now = time.monotonic()
                if self._answered_s is not None and message.moves:
                    self.driven_s += now - self._answered_s
                self.senses, self._answered_s = message, now
                self.n_live += 1
                pose = message.pose
                if pose is not None and (not self.line or self.line[-1] != pose[:2]):
                    self.line = [*self.line[-MOST_POINTS:], pose[:2]]
            case messages.Battery():
                self.battery_v = message.volts
            case messages.PreflightResult():
                self.preflight, self.doing = message, None
            case messages.Picture():
                self.picture, self.doing = message.png, None
            case messages.Placed():
                self.line, self.driven_s, self.doing = [], 0.0, None
            case messages.Refused():
                self.refusal, self.doing = message.text, None
            case _:
                super()._take(message)

    def _meet(self, robot: messages.HandMet) -> None:
        self.n_sensors, self.kinds, self.about = robot.n_sensors, robot.kinds, robot.facts
        self.has_camera, self.has_battery = robot.has_camera, robot.has_battery
        if (place := robot.place) is not None:
            walls = tuple((x1, y1, x2, y2) for x1, y1, x2, y2 in place["walls"])
            self.arena = Arena("emulated", walls, Grid(**place["grid"]), Pose(*place["start"]))
        self.label = robot.label  # last: a page shows the robot from then on


# in a process


def identify(channel: Channel, work: messages.IdentifyWork) -> None:
    """Open the port, identify the robot, and close the port."""
    _allow_emulators(work.port)
    terminal, robot = open_on(work.port)
    with robot:
        facts = {key: str(value) for key, value in terminal.info(robot).items() if value not in (None, "")}
        channel.say(messages.Identified(robot.label, facts))


def drive(channel: Channel, work: messages.HandWork) -> None:
    """Connect, then sense and drive until told to quit."""
    _allow_emulators(work.port)
    with open_on(work.port, watchdog_s=WATCHDOG_S)[1] as robot:
        witness = own_witness(robot)
        if witness is None and work.witness:
            witness = connect_witness(work.witness)
        _Driver(channel, robot, kinds_of(robot, work.port), witness).carry_on()


def kinds_of(robot: Any, port: str) -> list[str]:
    """Return the kinds of sensors that the family of a port describes, other than range sensors, and the robot has."""
    family = find_family(split_port(port)[0]) or default_family()
    return [kind for kind in family.channel_readings if hasattr(robot, kind)]


def _allow_emulators(port: str) -> None:
    if is_in_this_program(port):
        import_module("realitygap.emulator")  # which tells pyserial of such ports


class _Driver:
    """Drives while messages arrive, and stops when they do not."""

    def __init__(self, channel: Channel, robot: Any, kinds: list[str], witness: Witness | None) -> None:
        self._channel, self._robot, self._kinds, self._witness = channel, robot, kinds, witness
        self._wheels = (0.0, 0.0)
        self._told_s = 0.0
        self._moves = False
        self._lock = threading.Lock()
        self._wishes: queue.Queue[messages.Ask] = queue.Queue()
        self._battery_s = -BATTERY_S
        channel.at_once(messages.Drive, self._drive)
        channel.at_once(messages.Release, self._stop)
        channel.at_once(messages.Stop, self._stop)
        channel.at_once(messages.Ask, self._wishes.put)

    def carry_on(self) -> None:
        """Sense and drive until the process is interrupted or the robot fails."""
        robot = self._robot
        self._channel.say(
            messages.HandMet(
                label=robot.label,
                facts={
                    "name": str(robot.name),
                    **{key: str(fact) for key, fact in asdict(robot.info).items()},
                },
                n_sensors=robot.n_sensors,
                kinds=self._kinds,
                has_camera=hasattr(robot, "picture"),
                has_battery=hasattr(robot, "volts"),
                place=self._place(),
            )
        )
        while True:
            began = time.monotonic()
            self._keep_moving()
            self._say_senses()
            while not self._wishes.empty():
                self._fulfill(self._wishes.get().what)
            time.sleep(max(0.0, PERIOD_S - (time.monotonic() - began)))

    def _drive(self, wish: messages.Drive) -> None:
        """Set the speeds of the wheels; the listening thread calls this."""
        with self._lock:
            self._wheels = wheels_of(wish.move, wish.turn)
            self._told_s = time.monotonic()

    def _stop(self, _wish: messages.Release | messages.Stop | None = None) -> None:
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

    def _place(self) -> messages.Place | None:
        if self._witness is None:
            return None
        arena = self._witness.arena()
        grid = arena.grid
        return {
            "walls": [list(wall) for wall in arena.walls],
            "grid": {
                "x": grid.x,
                "y": grid.y,
                "cell": grid.cell,
                "columns": grid.columns,
                "rows": grid.rows,
            },
            "start": list(arena.start),
        }

    def _say_senses(self) -> None:
        robot = self._robot
        seen = robot.observe()
        others = {kind: list(getattr(robot, kind)()) for kind in self._kinds}
        witness = self._witness
        pose = None if witness is None else list(witness.pose())
        cells = [] if witness is None else list(witness.cells())
        if hasattr(robot, "volts") and time.monotonic() - self._battery_s > BATTERY_S:
            self._battery_s = time.monotonic()
            volts = float(robot.volts())
            if not math.isnan(volts):
                self._channel.say(messages.Battery(round(volts, 2)))
        self._channel.say(
            messages.Senses({"range": list(seen.raw), **others}, seen.stalled, self._moves, cells, pose)
        )

    def _fulfill(self, what: messages.Activity) -> None:
        try:
            self._stop()  # a picture takes the link for seconds, in which no stop could pass
            if what == "preflight":
                result = preflight(self._robot)
                self._channel.say(messages.PreflightResult(result.facts, list(result.problems)))
            elif what == "picture":
                self._channel.say(messages.Picture(_png(self._robot)))
            elif self._witness is not None:
                self._witness.place(Pose(*self._witness.arena().start), 0)
                self._channel.say(messages.Placed())
        except RobotError as error:
            if not self._robot.link.is_open:
                raise
            self._channel.say(messages.Refused(str(error)))


def _png(robot: Any) -> str:
    if not hasattr(robot, "picture"):
        raise RobotError("This robot has no camera.")
    data = io.BytesIO()
    Image.fromarray(robot.picture()).save(data, "PNG")
    return base64.b64encode(data.getvalue()).decode()


def wheels_of(move: float, turn: float) -> tuple[float, float]:
    """Return the speeds of the left and the right wheel, -1..1, for a position of the drive pad."""
    move, turn = _share(move), _share(turn)
    return _share(move - turn), _share(move + turn)


def _share(part: float) -> float:
    """Return a part of full speed within -1..1; 0 for NaN."""
    return 0.0 if part != part else min(1.0, max(-1.0, part))
