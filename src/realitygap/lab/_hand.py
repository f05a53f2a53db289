"""A robot that is driven by hand, as the pages see it."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.world import Arena, Grid, Pose

from ._job import MOST_POINTS, Job

SILENT_S = 1.0
"""Age of the readings from which a robot counts as silent [s]."""


class Hand(Job):
    """A robot at its port.

    Attributes:
        port: Its name.
        label: REAL or EMULATED; empty before it answers.
        about: What it says of itself.
        n_sensors: Number of its range sensors.
        more: Other sensors that its senses have: light, line.
        has_camera, has_battery: Whether it has a camera, and reports the voltage of its battery.
        senses: The last ones; None before.
        sensed_s: When the last ones came, on the monotonic clock [s].
        battery_v: [V]; None before it was told.
        preflight: What the last one found; None before.
        picture: PNG in base64; empty before.
        arena: Where an emulated robot drives; None where nobody sees it.
        line: (x, y) [m] where it has been.
        doing: What it is doing since a visitor asked for it: preflight, picture, or place; empty otherwise.
        said: What it refused last; empty where nothing.
        n_stops: How often somebody pressed stop.

    Args:
        order: What the process is told first.
        root: Where it works.
        changed: Called after each change but that of the senses, from another thread.
    """

    QUIET = frozenset({"senses"})
    STOPPED = "The robot was stopped and disconnected."
    LOST = "The robot's process ended (status {status})."

    def __init__(self, order: dict[str, Any], root: Path, changed: Callable[[], None]) -> None:
        self.port = str(order["port"])
        self.label = ""
        self.about: dict[str, str] = {}
        self.n_sensors = 0
        self.more: list[str] = []
        self.has_camera = self.has_battery = False
        self.senses: dict[str, Any] | None = None
        self.sensed_s = 0.0
        self.battery_v: float | None = None
        self.preflight: dict[str, Any] | None = None
        self.picture = ""
        self.arena: Arena | None = None
        self.line: list[list[float]] = []
        self.doing = self.said = ""
        self.n_live = 0
        self.n_stops = 0
        super().__init__({"work": "robot", **order}, root, changed)

    @property
    def has_met(self) -> bool:
        """True if the robot has answered."""
        return self.senses is not None

    @property
    def is_lost(self) -> bool:
        """True if it was connected, and its link has failed."""
        return self.is_failed and self.has_met

    @property
    def age_s(self) -> float:
        """Age of the last readings [s]; 0 before the first ones."""
        return 0.0 if self.senses is None else time.monotonic() - self.sensed_s

    @property
    def is_silent(self) -> bool:
        """True if the robot is connected, but has not answered for a while."""
        return not self.is_over and self.age_s > SILENT_S

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
            self._child.tell({"do": "drive", "move": move, "turn": turn})

    def release(self) -> None:
        """The handle was let go: stop, until it is pulled again."""
        self._child.tell({"do": "release"})

    def stop(self) -> None:
        """Stop the motors; a handle that is held has to be let go before it drives again."""
        self.n_stops += 1
        self._child.tell({"do": "stop"})

    def want(self, what: str) -> None:
        """Ask for preflight, picture, or place."""
        self.doing, self.said = what, ""
        self._child.tell({"do": "want", "what": what})
        self._changed()

    def _on_met(self, message: dict[str, Any]) -> None:
        self.n_sensors, self.more = message["n_sensors"], message["more"]
        self.has_camera, self.has_battery = message["has_camera"], message["has_battery"]
        self.about = {
            "name": str(message["name"]),
            **{key: str(value) for key, value in message["info"].items()},
        }
        if "grid" in message:
            walls = tuple(tuple(wall) for wall in message["walls"])
            self.arena = Arena("emulated", walls, Grid(**message["grid"]), Pose(*message["start"]))
        self.label = message["label"]  # last: a page shows the robot from then on

    def _on_senses(self, message: dict[str, Any]) -> None:
        self.senses, self.sensed_s = message, time.monotonic()
        self.n_live += 1
        pose = message.get("pose")
        if pose is not None and (not self.line or self.line[-1] != pose[:2]):
            self.line = [*self.line[-MOST_POINTS:], pose[:2]]

    def _on_battery(self, message: dict[str, Any]) -> None:
        self.battery_v = message["volts"]

    def _on_preflight(self, message: dict[str, Any]) -> None:
        self.preflight, self.doing = message, ""

    def _on_picture(self, message: dict[str, Any]) -> None:
        self.picture, self.doing = message["png"], ""

    def _on_placed(self, message: dict[str, Any]) -> None:
        self.line, self.doing = [], ""

    def _on_refused(self, message: dict[str, Any]) -> None:
        self.said, self.doing = message["text"], ""
