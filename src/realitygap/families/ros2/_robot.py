"""A robot on ROS 2 as a robot that trials and calibration can use."""

from __future__ import annotations

import contextlib
import math
import time
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError, check_finite
from realitygap.robots import (
    EXITS,
    Command,
    Label,
    Observation,
    PortDriver,
    StallRule,
    SystemClock,
    check_command,
)
from realitygap.world import Pose

from ._address import Address, read_address
from ._graph import SENSORS, Ends, refuse_graph, refuse_two
from ._lines import LIFE_S, ONCE_S
from ._link import START_S, GatewayPort, Link, open_link, open_port
from ._messages import full_topic
from ._wiring import intensities_of, is_bumped, load_wired, range_of, respond, sectors_of

DEFAULT_ROBOT = "turtlebot3-burger"
DISCOVERY_S = 5.0
"""Longest wait for a robot's topics, and for the first message of each [s]."""
SETTLE_S = 0.5
"""Time for which discovery goes on when a robot was found [s]: another one may have the same topics."""
LOOK_S = 0.05
LIFE_MARGIN_S = 0.2
"""Time for which a command outlives its step, so that the next one finds the motors running [s]."""
MOST_PATH = 500_000
"""Largest number of poses of a trial."""
PROBE_TURN = 0.5
"""Turn rate at which a robot's own timeout is measured [rad/s]."""
PROBE_NEAR = 0.02
"""Heading that counts as that at the end [rad]."""
PROBE_MOST_S = 4.5
"""Longest timeout that can be told from none [s]: zeros come after 5 s."""
PROBE_REST_S = 0.7
"""Rest before that [s], until the zeros of a stop are over."""
LEAST_SPEED = 0.02
"""Commanded speed of a wheel below which a robot does not count as stalled [m/s]; chosen."""


@dataclass(frozen=True)
class Ros2Info:
    """Facts about a robot.

    Attributes:
        name: Namespace of its topics, or its port.
        robot: Name or file of its description.
        command: Types of the commands that it takes.
        timeout_s: Time after which it stops without commands, as its file says [s]; 0: never, None: it does not say.
        port: Address.
        label: REAL or EMULATED.
    """

    name: str
    robot: str
    command: str
    timeout_s: float | None
    port: str
    label: Label


class Ros2Robot(PortDriver):
    """A robot with two driven wheels on ROS 2, over DDS, without an installation of ROS.

    | command | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | 1: both wheels at `drive.speed` of the robot file |
    | turn | -1 | 1 | 1: one wheel ahead, the other back, at that speed, to the left |

    Both are published as speed ahead and turn rate, limited to `most_speed` and `most_turn` with the curve kept. Its
    readings are those that the robot file describes, of distances in a laser scan or of range sensors. `bump.0` is its
    bumper. `encoder.0` and `encoder.1` are the mean speed of each wheel since the last observation as a part of full
    speed, by odometry. It is stalled while it is bumped, or by `StallRule` if it has odometry.

    A separate process, the gateway, speaks DDS. It repeats a command until its life ends, and publishes zeros then,
    and when this program ends or is killed. If the gateway is killed or frozen, another one publishes zeros.

    Args:
        port: Address, such as `/robot1?domain=0&interface=eth0`, with or without `ros2:` before it, or an open port.
        robot: Name or file of the robot, whose table `[driver]` has its topics; `robot=` of the address goes before it.
        step_s: Duration of a command of `drive` [s].
        record: New file for all messages, one by one.

    Raises:
        RobotError: Nothing takes its commands, a topic is missing or silent, or there are two such robots.
    """

    lasts_s = 0.0
    """Minimum duration of a command, if another program waits for its end [s]."""
    reading_max = 1.0
    platform: Any = None
    """The platform that opened it, for figures."""

    def __init__(
        self,
        port: str | Any,
        *,
        robot: str = DEFAULT_ROBOT,
        step_s: float = 0.1,
        record: Path | str | None = None,
    ) -> None:
        check_finite({"step_s": step_s})
        if step_s < 0:
            raise ValueError(f"step_s is {step_s}, expected 0 or more.")
        self._address = read_address(port) if isinstance(port, str) else _address_of(port)
        self._name = port if isinstance(port, str) else str(getattr(port, "name", None) or "a port")
        self.model, self.wiring = load_wired(self._address.robot or robot)
        namespace = self._address.namespace or "/"
        self._topics = self.wiring.topics(namespace)
        self._needed = self.wiring.needed(namespace)
        self._odometry = self._full(self.wiring.odometry)
        self._command = self._full(self.wiring.command)
        settings = {
            "command": self._command,
            "topics": self._topics,
            "frames": self.wiring.pose_frames or ("", ""),
        }
        self.link: Link = (
            open_link(self._address, settings) if isinstance(port, str) else open_port(port, self._name)
        )
        self.step_s = step_s
        self.n_sensors = len(self.model.range)
        self.has_encoders = bool(self.wiring.odometry)
        self.channels = (
            *(("bump.0",) if self.wiring.bump else ()),
            *(("encoder.0", "encoder.1") if self.has_encoders else ()),
        )
        self._selected: tuple[str, ...] = ()
        self._stall = StallRule(LEAST_SPEED)
        self._way = [0.0, 0.0]  # of each wheel since the robot was opened [m]
        self._last: dict[str, tuple[float, float, float]] = {}  # the last pose of each trail
        self._poses_on = self._full(self.wiring.pose or self.wiring.odometry)
        self._path: list[tuple[float, float, float, float]] = []  # time [s] and pose since the trial began
        self._start: Pose | None = None
        self._observed = (math.nan, 0.0, 0.0)  # time and ways at the last observation
        self._wheels = (0.0, 0.0)  # the last command [m/s]
        self.label: Label = self._address.label
        self.clock = getattr(self.link.port, "clock", None) or SystemClock()
        recorder, clock = self._record_into(record, self.clock), self.clock
        if record is not None:  # the link must not hold the robot, which would never be let go
            self.link.tell = lambda name, sent, came: recorder.wire(clock.now(), 0.0, name, sent, came, "ok")
        EXITS.hold()
        try:
            if isinstance(self.link.port, GatewayPort):
                self.link.port.stand_by()  # before it drives: a program that starts takes time from others
            kinds = self._find()
        except BaseException as error:
            self.link.close()
            EXITS.release()
            self._record_failure(self._name, error)
            raise
        self._released = weakref.finalize(self, _let_go, self.link)
        self.info: Ros2Info = Ros2Info(
            self._address.namespace or self._name, self.model.name, ", ".join(kinds), self.wiring.timeout_s,
            self._shown, self.label,
        )  # fmt: skip
        self._record_set_up(self._name)

    def _full(self, topic: str) -> str:
        return full_topic(self._address.namespace or "/", topic) if topic else ""

    @property
    def port(self) -> Any:
        """The open port; that of an emulated robot in this program has a `witness`."""
        return self.link.port

    @property
    def _shown(self) -> str:
        """The address as a command takes it."""
        return f"ros2:{self._name.removeprefix('ros2:')}"

    @property
    def name(self) -> str:
        """The robot's address, by which it is recognized."""
        return f"{self.info.robot} {self.info.name}"

    def _find(self) -> list[str]:
        """Return the types of the commands that the robot takes, when each of its topics has had a message."""
        self.link.ask("graph", START_S)
        until, settled = time.monotonic() + DISCOVERY_S, 0.0
        while True:
            seen = self.link.ask("graph")
            ends = Ends(tuple(seen["graph"]))
            came = self._ask_read()["topics"]
            missing = [topic for topic in self._needed if topic not in came]
            is_complete, now = bool(seen["kinds"]) and not missing, time.monotonic()
            settled = settled or (now + SETTLE_S * bool(self._address.namespace) if is_complete else 0.0)
            if now >= (settled if is_complete else until):
                refuse_graph(
                    ends,
                    self._address,
                    self._command,
                    self._topics,
                    missing,
                    seen.get("frames", ()),
                    is_complete=is_complete,
                )
                return [str(kind) for kind in seen["kinds"]]
            time.sleep(LOOK_S)

    def _read(self) -> dict[str, Any]:
        """Return the newest message of each topic, and follow odometry."""
        seen = self._ask_read()
        for topic in self._needed:
            known = seen["topics"].get(topic, {"age": math.inf})
            if self._topics[topic] in SENSORS:  # another robot may appear at any time
                refuse_two(topic, known.get("publishers", 1))
            if "too_long" in known:
                raise RobotError(
                    f"A message on {topic} has {known['too_long']:,} values, which is too many for a sensor of a robot."
                )
            if known["age"] > self.wiring.silent_s:
                raise RobotError(
                    f"{topic} is silent: no message for {known['age']:.1f} s. Check the robot's driver of this sensor, "
                    "or set silent_s in [driver] of the robot file."
                )
        topics: dict[str, Any] = {
            topic: known["message"] for topic, known in seen["topics"].items() if "message" in known
        }
        return topics

    def _ask_read(self) -> dict[str, Any]:
        """Return the answer to a reading, whose poses are kept."""
        seen = self.link.ask("read")
        for topic, rows in seen["trails"].items():
            for row in rows:
                self._follow(topic, (row[1], row[2], row[3]))
                if topic == self._poses_on and len(self._path) < MOST_PATH:
                    self._path.append((row[0], row[1], row[2], row[3]))
        return seen

    def _follow(self, topic: str, pose: tuple[float, float, float]) -> None:
        """Add a step of odometry to the way of the wheels."""
        x, y, heading = self._last.get(topic, pose)
        self._last[topic] = pose
        if topic != self._odometry:
            return
        turn = (pose[2] - heading + math.pi) % math.tau - math.pi
        middle = heading + turn / 2
        ahead = (pose[0] - x) * math.cos(middle) + (pose[1] - y) * math.sin(middle)
        way = ahead * (turn / 2 / math.sin(turn / 2) if abs(turn) > 1e-9 else 1.0)  # the arc over its chord
        half = self.model.drive.track / 2
        self._way[0] += way - turn * half
        self._way[1] += way + turn * half

    # the contract

    def select(self, names: Sequence[str]) -> None:
        """Choose the sensors that `observe` reads besides range sensors."""
        self._selected = tuple(names)

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial: motors stopped."""
        self._recorder.call("reset")
        with self._noted("reset"):
            self._stop_motors()
            self._read()
        self._stall = StallRule(LEAST_SPEED)
        self._observed = (math.nan, self._way[0], self._way[1])

    def observe(self) -> Observation:
        """Read the range sensors, and the selected other ones."""
        with self._noted("observe"):
            seen = self._read()
            readings, raw = self._readings(seen)
        bump = seen.get(self._full(self.wiring.bump))
        is_bump = bump is not None and is_bumped(self.wiring.bump_kind, bump)
        channels = {"bump.0": float(is_bump)} | dict(
            zip(("encoder.0", "encoder.1"), self._encoders(), strict=False)
        )
        chosen = {name: channels[name] for name in self._selected}
        return self._seen(Observation(readings, is_bump or self._is_stalled(seen), raw, chosen))

    def _readings(self, seen: Mapping[str, Any]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the reading of each range sensor, and its distance [m], or its intensity."""
        if self.wiring.intensity:
            shares = intensities_of(seen[self._full(self.wiring.intensity)], self.wiring)
            return shares, tuple(share * self.wiring.intensity_most for share in shares)
        pairs = tuple(zip(self.model.range, self._distances(seen), strict=True))
        readings = tuple(respond(sensor, far) for sensor, far in pairs)
        return readings, tuple(sensor.reach if far is None else far for sensor, far in pairs)

    def _distances(self, seen: Mapping[str, Any]) -> list[float | None]:
        """Return the distance that each range sensor sees [m]; None: nothing is in range."""
        if self.wiring.ranges:
            return [range_of(seen[self._full(topic)]) for topic in self.wiring.ranges]
        if self.wiring.scan is None or not self.model.range:
            return []
        return sectors_of(seen[self._full(self.wiring.scan.topic)], self.wiring.scan, self.model.range)

    def _encoders(self) -> tuple[float, ...]:
        """Return the mean speed of each wheel since the last observation, as a part of full speed."""
        if not self.has_encoders:
            return ()
        (before_s, *before), now_s = self._observed, self.clock.now()
        self._observed = (now_s, self._way[0], self._way[1])
        passed = now_s - before_s
        if not passed > 0:
            return (0.0, 0.0)
        full = self.model.drive.speed * passed
        parts = ((now - then) / full for now, then in zip(self._way, before, strict=True))
        return tuple(min(max(part, -1.0), 1.0) for part in parts)

    def _is_stalled(self, seen: Mapping[str, Any]) -> bool:
        if not self._odometry:
            return False
        twist = seen[self._odometry]["twist"]["twist"]
        ahead, turn = twist["linear"]["x"] or 0.0, twist["angular"]["z"] or 0.0
        half = self.model.drive.track / 2
        return self._stall.is_stalled(
            self.clock.now(), self._wheels, (ahead - turn * half, ahead + turn * half)
        )

    @property
    def tells_poses(self) -> bool:
        """True if it has odometry, or a motion capture tells its poses."""
        return bool(self._poses_on)

    def begin_path(self, start: Pose) -> None:
        """Begin a path at a pose, at which the robot stands."""
        self._read()
        newest = self._path[-1:]
        self._path.clear()
        self._read()
        self._path[:] = (newest + self._path)[-1:]
        self._start = start

    def path(self) -> NDArray[np.float64]:
        """Return time [s], x [m], y [m], and heading [rad] in the arena since `begin_path`, (t, 4).

        Poses of odometry are moved so that the first one is the start. So are those of `pose`, unless `pose_frame` is
        `arena`.

        Raises:
            RobotError: There are more than 500,000.
        """
        self._read()
        if len(self._path) >= MOST_PATH:
            raise RobotError(
                f"The robot has told {MOST_PATH:,} poses since the trial began, which is too many. Drive shorter "
                "trials, or have it publish its poses less often."
            )
        rows = np.array(self._path, np.float64).reshape(-1, 4)
        if (
            len(rows)
            and self._start is not None
            and (self.wiring.pose_frame == "start" or not self.wiring.pose)
        ):
            x, y, heading = rows[0, 1:]
            ahead = (rows[:, 1] - x) * math.cos(heading) + (rows[:, 2] - y) * math.sin(heading)
            aside = (rows[:, 2] - y) * math.cos(heading) - (rows[:, 1] - x) * math.sin(heading)
            cos, sin = math.cos(self._start.heading), math.sin(self._start.heading)
            rows[:, 1] = self._start.x + ahead * cos - aside * sin
            rows[:, 2] = self._start.y + ahead * sin + aside * cos
            rows[:, 3] += self._start.heading - heading
        return rows

    def wheels(self) -> tuple[float, float]:
        """Return the way of each wheel since the robot was opened [m], by odometry."""
        self._read()
        return self._way[0], self._way[1]

    def sensors(self) -> dict[str, Any]:
        """Return the newest message of each topic, without long lists."""
        return {topic: _short(message) for topic, message in self._read().items()}

    def volts(self) -> float:
        """Return the voltage of the battery [V].

        Raises:
            RobotError: No message tells it.
        """
        message = self._read().get(self._full(self.wiring.battery))
        if message is None or message["voltage"] is None:
            raise RobotError(
                "The robot does not tell the voltage of its battery. Name the topic of its BatteryState in [driver] of "
                "the robot file: battery = 'battery_state'."
            )
        return float(message["voltage"])

    def timeout(self) -> float:
        """Return the time for which the robot follows a command that is not repeated [s]; inf: 4.5 s and longer.

        It turns on the spot, at 0.5 rad/s or less, and the heading of its poses shows when this ends. So the time has
        the delay and the lag of the robot in it.

        Raises:
            RobotError: It tells no poses, does not turn, or the link is lost.
        """
        if not self.tells_poses:
            raise RobotError(
                "The robot tells no poses, which would show when it stops. Name its odometry in [driver] of its file."
            )
        self.reset()
        self.clock.sleep(PROBE_REST_S)
        self._read()
        self._path.clear()
        turn = min(PROBE_TURN, self.wiring.most_turn)
        began = self.clock.now()
        self.link.ask("drive", ahead=0.0, turn=turn, life=ONCE_S, once=1)
        turned = np.empty((0, 2))
        try:
            while (now := self.clock.now()) < began + ONCE_S:
                self.clock.sleep(LOOK_S)
                self._read()
                rows = np.array(self._path, np.float64).reshape(-1, 4)
                turned = np.column_stack([rows[:, 0], np.unwrap(rows[:, 3])])
                if _has_turned(turned) and now - _last_turn(turned) > 1.0:
                    break
        finally:
            self._stop_motors()
        if not _has_turned(turned):
            raise RobotError("The robot did not turn. Check that it is on, and that nothing holds it.")
        lasts_s = _last_turn(turned) + PROBE_NEAR / turn - began
        return math.inf if lasts_s > PROBE_MOST_S else lasts_s

    def drive(self, command: Command) -> None:
        """Drive one command for `step_s`: left wheel move - turn, right wheel move + turn, limited to -1..1.

        The robot drives on until the next command, or for 0.2 s.

        Raises:
            RobotError: The link is lost, a sensor is silent, or this program was stopped for so long that the robot
                stopped.
        """
        command = check_command(command)
        self._recorder.call("drive", move=command.move, turn=command.turn)
        with self._noted("drive"):
            until = self.clock.now() + self.step_s
            while True:
                left = max(until - self.clock.now(), 0.0)
                life_s = min(max(left, self.lasts_s) + LIFE_MARGIN_S, LIFE_S)
                self._send(command, life_s)
                sent, piece = self.clock.now(), min(left, LIFE_S / 2)
                if piece:
                    self.clock.sleep(piece)
                if left > LIFE_S / 2 and (passed := self.clock.now() - sent) > life_s:
                    raise RobotError(
                        f"This program stood still for {passed - piece:.1f} s. So the robot stopped before the end of "
                        "the command."
                    )
                if left <= LIFE_S / 2:
                    return
                self._read()  # a robot that is gone is silent

    def motors(self, left: float, right: float) -> None:
        """Turn the wheels, each -1 (full back) to 1 (full ahead), until the next command, or for 0.4 s at most.

        Raises:
            RobotError: The link is lost.
        """
        self._send(check_command(Command((left + right) / 2, (right - left) / 2)), 2 * LIFE_MARGIN_S)

    def _send(self, command: Command, life_s: float) -> None:
        """Send a command that the robot follows for so much time [s]."""
        drive = self.model.drive
        if drive.mixing == "independent":
            ahead, turn = drive.ahead * command.move * drive.speed, command.turn * drive.turn_rate
        else:
            left, right = (drive.speed * wheel for wheel in command.wheels)
            ahead, turn = drive.ahead * (left + right) / 2, (right - left) / drive.track
        over = max(abs(ahead) / self.wiring.most_speed, abs(turn) / self.wiring.most_turn, 1.0)
        ahead, turn = ahead / over, turn / over
        half = drive.track / 2
        self._wheels = ahead - turn * half, ahead + turn * half
        self.link.ask("drive", ahead=ahead, turn=turn, life=life_s)

    def _stop_motors(self) -> None:
        self._wheels = (0.0, 0.0)
        self.link.ask("stop")


def _address_of(port: Any) -> Address:
    """Return the address of an open port."""
    return Address("", str(getattr(port, "name", "")), 0, "", "", "EMULATED")


def _has_turned(turned: NDArray[np.float64]) -> bool:
    """Return whether a heading has changed, of times [s] and headings [rad], (t, 2)."""
    return len(turned) > 0 and bool(abs(turned[-1, 1] - turned[0, 1]) > PROBE_NEAR)


def _last_turn(turned: NDArray[np.float64]) -> float:
    """Return the last time at which a heading was not near its end, of times [s] and headings [rad], (t, 2)."""
    return float(turned[np.abs(turned[:, 1] - turned[-1, 1]) > PROBE_NEAR, 0][-1])


def _short(message: Any) -> Any:
    """Return a message with long lists as their lengths."""
    if isinstance(message, Mapping):
        return {name: _short(value) for name, value in message.items()}
    return f"{len(message)} values" if isinstance(message, list) and len(message) > 8 else message


def _let_go(link: Link) -> None:
    """Stop the motors of a robot that was not closed, and close its port."""
    try:
        if link.is_open:
            with contextlib.suppress(RobotError):
                link.ask("stop")
    finally:
        link.close()
        EXITS.release()
