"""The Scribbler as a robot that trials and calibration can use."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from pathlib import Path

from realitygap.errors import RobotError, check_finite
from realitygap.robots import EXITS, Clock, Command, Label, Observation, Port, PortDriver, check_command
from realitygap.world import Pose

from . import _codec as codec
from ._device import RobotInfo
from ._driving import Driving
from ._fluke import Board, Camera
from ._identity import Identity
from ._link import Link
from ._ports import is_serial_port, label_of, open_port, port_name
from ._senses import Senses
from ._sound import SoundAndLight
from ._watchdog import Watchdog, WatchedClock

COUNT_M = 0.00025
"""Distance of a wheel for one count of an S2's encoders [m]: half of its half millimeter."""
FAR = 99
"""Distance reading of an S2 if nothing is in range."""
DARKEST = {"s1": 5000, "s2": 65_535}
"""The light reading of a dark room; an S1 reads more if there is no light at all."""
FULL_SPEED = 0.15
"""Speed of an S2's wheel at full command: 600 counts in a second [m/s]."""


class Scribbler(Driving, Senses, Identity, SoundAndLight, Camera, Board, PortDriver):
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

    Other sensors are read only if `select` chose them, because each costs a command on the wire.

    | channel | with | from | to |
    |---|---|---|---|
    | light.0, .1, .2: left, center, right | a robot | 0: dark | 1: bright |
    | line.0, .1: left, right | a robot | 0: light floor | 1: dark floor |
    | encoder.0, .1: left, right wheel, as the end ahead sees it | an S2 or S3 | -1: full speed back | 1: full speed |

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

    _selected: tuple[str, ...] = ()
    _is_turned = False
    _counted: tuple[float, int, int] | None = None

    def __init__(
        self,
        port: str | Port,
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

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the sensors besides range sensors."""
        if self.info.model is None:
            return ()
        encoders = ("encoder.0", "encoder.1") if self.info.model == "s2" else ()
        return ("light.0", "light.1", "light.2", "line.0", "line.1", *encoders)

    def select(self, names: Sequence[str]) -> None:
        """Choose the sensors that `observe` reads besides range sensors.

        Raises:
            RobotError: The robot does not answer which end is ahead, which encoders need.
        """
        self._selected = tuple(names)
        self._is_turned = self._has("encoder") and self.forwardness == "fluke"

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial: stop the motors, and count steps from 0. The operator has placed the robot at its start."""
        self.need_robot("reset")
        self._recorder.call("reset")
        with self._noted("reset"):
            self._stop_motors()
        self._n_steps = 0
        self._counted = None
        self.link.where = ""

    def observe(self) -> Observation:
        """Read the sensors that look ahead, the selected channels, and the stall."""
        with self._noted("observe"):
            seen = self._observe()
            if self._selected:
                seen = seen._replace(channels=self._read_channels())
        return self._seen(seen)

    def _has(self, kind: str) -> bool:
        return any(name.startswith(f"{kind}.") for name in self._selected)

    def _read_channels(self) -> dict[str, float]:
        """Read the selected sensors, all of a kind in one command."""
        values: list[tuple[str, float]] = []
        if self._has("light"):
            darkest = DARKEST[self.info.model or "s2"]
            bright = (max(1.0 - raw / darkest, 0.0) for raw in self.light())
            values += [(f"light.{k}", value) for k, value in enumerate(bright)]
        if self._has("line"):
            values += [(f"line.{k}", float(dark)) for k, dark in enumerate(self.line())]
        if self._has("encoder"):
            values += [(f"encoder.{k}", value) for k, value in enumerate(self._wheel_speeds())]
        return {name: value for name, value in values if name in self._selected}

    def _wheel_speeds(self) -> tuple[float, float]:
        """Return the mean speeds since the last call as parts of full speed, -1..1; 0 at the first call of a trial."""
        left, right = self.encoders()
        if self._is_turned:
            left, right = -right, -left
        now = self.link.clock.now()
        time, *before = self._counted or (now, left, right)
        self._counted = now, left, right
        full = FULL_SPEED / COUNT_M * (now - time)
        if full <= 0:
            return 0.0, 0.0
        first, second = (
            min(max((count - old) / full, -1.0), 1.0)
            for count, old in zip((left, right), before, strict=True)
        )
        return first, second

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
        command = check_command(command)
        self._n_steps += 1
        self.link.where = f"step {self._n_steps}"
        self._recorder.call("drive", move=command.move, turn=command.turn)
        with self._noted("drive"):
            self.motors(*command.wheels)
        if self._watchdog is not None:
            self._watchdog.excuse(self.step_s)
        self.link.clock.sleep(self.step_s)

    def _end(self) -> None:
        try:
            self._stop_motors()
        finally:
            if self._watchdog is not None:
                self._watchdog.end()


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
