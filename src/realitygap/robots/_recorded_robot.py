"""A recording, opened as the robot that was recorded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from realitygap.errors import RecordError, RobotError
from realitygap.world import Pose

from ._bases import ProgramRobot
from ._clock import VirtualClock
from ._contract import Command, Label, Observation, check_command
from ._recording import Line, Recording, read_recording

NAME = "recording:"


class RecordedRobot(ProgramRobot):
    """A robot that repeats recorded answers as long as it gets the recorded calls.

    `reset` goes to the next recorded `reset`. `stop` is allowed at any moment, as on every robot.

    Args:
        recording: A file, with or without `recording:` before it, or a result of `read_recording`.

    Raises:
        RecordError: The file cannot be read, or has no use of a robot.
    """

    def __init__(self, recording: Recording | Path | str) -> None:
        if not isinstance(recording, Recording):
            recording = read_recording(str(recording).removeprefix(NAME))
        header = recording.header
        missing = [name for name in ("label", "step_s", "n_sensors") if header.get(name) is None]
        if missing:
            raise RecordError(
                f"{recording.path} has no {', '.join(missing)}, because no robot answered while it was recorded. Name "
                "another recording."
            )
        self.recording = recording
        self.label: Label = header["label"]
        self.step_s = float(header["step_s"])
        self.n_sensors = int(header["n_sensors"])
        self.clock = VirtualClock()
        self._closed = f"{recording.path} is closed. Reopen the recording."
        self._lines = [line for line in recording.lines if line["kind"] != "wire" and line["name"] != "stop"]
        values = [line.get("values", {}) for line in self._lines if line["name"] == "observe"]
        self.channels = tuple(values[0].get("channels", {})) if values else ()
        self._next = 0
        self._n_steps = 0

    def select(self, names: Sequence[str]) -> None:
        """Do nothing: the recording determines the sensors."""

    def _take(self, name: str) -> Mapping[str, Any]:
        """Return the recorded line of this call, which must have the same name."""
        self._check_open()
        is_over = self._next == len(self._lines)
        line: Line = {"t": 0.0, "kind": "end", "name": "end"} if is_over else self._lines[self._next]
        if line["name"] != name:
            said = "ends" if line["name"] in ("end", "close") else f"has '{line['name']}'"
            raise RobotError(
                f"After step {self._n_steps}, {self.recording.path} {said}, got '{name}'. A recorded robot can only "
                "repeat its recorded calls."
            )
        self._next += 1
        if line["kind"] == "call" and self._next < len(self._lines):
            after = self._lines[self._next]
            if after["kind"] == "fault" and after["name"] == name:
                line = after
                self._next += 1
        if line["kind"] == "fault":
            raise RobotError(f"Recorded error: {line['outcome']}")
        values: Mapping[str, Any] = line.get("values", {})
        self.clock.sleep(max(float(line["t"]) - self.clock.now(), 0.0))
        return values

    def reset(self, pose: Pose | None = None) -> None:
        """Go to the start of the next recorded trial."""
        while self._next < len(self._lines) and self._lines[self._next]["name"] != "reset":
            self._next += 1
        self._take("reset")
        self._n_steps = 0

    def observe(self) -> Observation:
        """Return the recorded observation of this point."""
        seen = self._take("observe")
        channels = seen.get("channels", {})
        return Observation(tuple(seen["readings"]), seen["stalled"], tuple(seen["raw"]), channels)

    def drive(self, command: Command) -> None:
        """Do nothing if the command equals the recorded one.

        Raises:
            RobotError: The command differs from the recorded one.
        """
        command = check_command(command)
        at = self._next
        told = self._take("drive")
        if (told["move"], told["turn"]) != command:
            self._next = at
            raise RobotError(
                f"In step {self._n_steps + 1}, {self.recording.path} has the command {told['move']}, {told['turn']}, "
                f"got {command.move}, {command.turn}. A recorded robot can only repeat its recorded calls."
            )
        self._n_steps += 1
        self.clock.sleep(self.step_s)
