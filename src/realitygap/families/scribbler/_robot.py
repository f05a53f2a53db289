"""The Scribbler as a robot that trials and calibration can use."""

from __future__ import annotations

import weakref
from pathlib import Path
from typing import Any

from realitygap.errors import RobotError, check_finite
from realitygap.robots import EXITS, Clock, Command, Label, Observation, PortDriver, check_command
from realitygap.world import Pose

from . import _codec as codec
from ._board import Board
from ._camera import Camera
from ._channels import Channels
from ._device import RobotInfo
from ._driving import Driving
from ._link import Link
from ._ports import is_serial_port, label_of, open_port, port_name
from ._sound import SoundAndLight
from ._watchdog import Watchdog, WatchedClock

COUNT_M = 0.00025
"""Distance of a wheel for one count of an S2's encoders [m]: half of its half millimeter."""
FAR = 99
"""Distance reading of an S2 if nothing is in range."""


class Scribbler(Driving, Channels, SoundAndLight, Camera, Board, PortDriver):
    """A Scribbler (S1, S2 or S3), alone or with a Fluke (1 or 2), on a port.

    | command | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | 1: full speed, the end ahead first |
    | turn | -1 | 1 | 1: one wheel full ahead, the other full back, to the left |

    | observation | with | from 0 | to 1 | raw |
    |---|---|---|---|---|
    | obstacle left, center, right | a Fluke | free | `reading_max` and more | 0 to 6400 |
    | distance left, right | an S2 alone | nothing seen | touching | 99 to 0 |
    | infrared left, right | an S1 alone | free | an obstacle | 1, 0 |

    The motors are off after opening. `close`, the end of a `with` block, an exception, Ctrl-C, SIGTERM, and the end of
    the program stop them. In trials, silence of the program also stops them (`watchdog_s`).

    Args:
        port: Name of the port for pyserial, with or without `scribbler:` before it; or an open port.
        step_s: Duration of a command of `drive` [s].
        reading_max: Obstacle reading that counts as 1, the nearest.
        record: A new file for the recording of all commands.
        watchdog_s: Silence of the program after which the motors stop [s]. None: never.

    Raises:
        RobotError: The port cannot be opened, or no Scribbler answers.
    """

    least_battery_v = 6.15
    """Voltage below which the firmware of the Fluke 1 blinks for new batteries, and Bluetooth may fail [V]."""
    blinded_advice = ", or lower ir_power"

    def __init__(
        self,
        port: str | Any,
        *,
        step_s: float = 0.5,
        reading_max: float = 1700.0,
        record: Path | str | None = None,
        watchdog_s: float | None = None,
    ) -> None:
        check_finite({"step_s": step_s, "reading_max": reading_max, "watchdog_s": watchdog_s})
        if not (step_s >= 0 and reading_max > 0):
            raise ValueError(
                f"step_s is {step_s} and reading_max {reading_max}, expected 0 or more and more than 0."
            )
        name = (
            port_name(port) if isinstance(port, str) else str(getattr(port, "name", None) or "a given port")
        )
        label = label_of(name) if isinstance(port, str) or is_serial_port(port) else "EMULATED"
        self.link = Link(open_port(name) if isinstance(port, str) else port, name)
        recorder = self._record_into(record, self.link.clock)
        if record is not None:  # the link must not hold the robot, which would never be let go
            self.link.tell = lambda exchange: recorder.wire(*exchange)
        EXITS.hold()
        self._released = weakref.finalize(self, _let_go, self.link)  # also when the program ends
        try:
            found = self.link.greet()
            self._watchdog = None if watchdog_s is None else Watchdog(self.link, watchdog_s)
        except BaseException as error:
            self.link.close()
            self._released()
            self._record_failure(name, error)
            raise
        self.info = RobotInfo(*found, port=name, label=label)
        self.step_s = step_s
        self.reading_max = reading_max
        self.label: Label = label
        self.n_sensors = 3 if self.info.fluke != "none" else 2
        self._n_steps = 0
        self._record_set_up(name, watchdog_s=watchdog_s)

    @property
    def clock(self) -> Clock:
        """The clock of this robot. Waiting by it also runs the watchdog."""
        return self.link.clock if self._watchdog is None else WatchedClock(self.link.clock, self._watchdog)

    @property
    def has_encoders(self) -> bool:
        """True if the robot is an S2 or S3, which have wheel encoders."""
        return self.info.model == "s2"

    @property
    def is_turned(self) -> bool:
        """True if the end with the Fluke is ahead, so that wheel distances are reversed."""
        return self.info.fluke != "none" and self.forwardness == "fluke"

    def wheels(self) -> tuple[float, float]:
        """Return the distance of both wheels since power-on, as seen from the end without the Fluke [m]."""
        left, right = self.encoders()
        return left * COUNT_M, right * COUNT_M

    # the contract

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial: stop the motors, and count steps from 0. The operator has placed the robot at its start."""
        self.need_robot("reset")
        self._recorder.call("reset")
        with self._noted("reset"):
            super().stop()
        self._n_steps = 0
        self._counted = None
        self.link.where = ""

    def observe(self) -> Observation:
        """Read the sensors that look ahead, the selected channels, and the stall."""
        with self._noted("observe"):
            seen = self._observe()
            if self._selected:
                seen = seen._replace(channels=self._read_channels())
        more = {"channels": seen.channels} if seen.channels else {}
        self._recorder.call("observe", readings=seen.readings, stalled=seen.stalled, raw=seen.raw, **more)
        return seen

    def _observe(self) -> Observation:
        if self.info.fluke != "none":
            raw = self.obstacle()
            scale = self.reading_max
            readings = tuple([min(value / scale, 1.0) for value in raw])
            return Observation(readings, self.stall(), tuple(map(float, raw)))
        if self.info.model == "s2":
            far = self.distance()
            readings = tuple([max(1.0 - value / FAR, 0.0) for value in far])
            return Observation(readings, self.stall(), tuple(map(float, far)))
        ir, _, stall = self._flags()
        return Observation((1.0 - ir[0], 1.0 - ir[1]), stall, tuple(map(float, ir)))

    def drive(self, command: Command) -> None:
        """Drive one command for `step_s`: left wheel move - turn, right wheel move + turn, limited to -1..1.

        The robot moves on until the next command.
        """
        move, turn = check_command(command)
        self._n_steps += 1
        self.link.where = f"step {self._n_steps}"
        left, right = _within(move - turn), _within(move + turn)
        self._recorder.call("drive", move=move, turn=turn)
        with self._noted("drive"):
            self.motors(left, right)
        if self._watchdog is not None:
            self._watchdog.excuse(self.step_s)
        self.link.clock.sleep(self.step_s)

    def stop(self) -> None:
        """Stop the motors. This is safe at any moment, and if called twice."""
        try:
            if self.link.is_open:
                self._recorder.call("stop")
        finally:  # also where the recording fails
            super().stop()

    def close(self) -> None:
        """Stop the motors and close the port. This is safe if called twice.

        Raises:
            RobotError: The motors could not be stopped; the port is closed all the same.
        """
        if not self.link.is_open:
            return
        try:
            super().stop()
        finally:
            if self._watchdog is not None:
                self._watchdog.end()
            self.link.close()
            self._released()
            self._recorder.call("close")
            self._recorder.close()


def _within(wheel: float) -> float:
    return min(max(wheel, -1.0), 1.0)


def _let_go(link: Link) -> None:
    """Stop the motors of a robot that was not closed, and close its port."""
    try:
        if link.has_robot and link.is_open:
            link.ask(codec.STOP, codec.sensor_block)
    except RobotError:
        pass
    finally:
        link.close()
        EXITS.release()
