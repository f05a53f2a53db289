"""An emulated Scribbler as a function of bytes and time: no port, no clock, no threads."""

from __future__ import annotations

import heapq
import math
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from realitygap.emulator import SECOND, EmulatedRobot, nanoseconds
from realitygap.errors import RobotError, whole_number
from realitygap.world import Arena, Pose

from ._camera import Camera
from ._fluke import LINK_BYTE_NS, Fluke
from ._link import SAG_HANG_UP_S, Faults, FaultyLink, Line
from ._memory import Memory
from ._motors import DROP_OUT_VOLTS, S1_SPACING, S2_SPACING, Battery, S1Motors, S2Motors
from ._scene import Scene, paper_scene
from ._scribbler import BYTE_NS, Scribbler
from ._senses import Senses
from ._simulated import BoxOnWheels, RobotOfItsOwn, SimulatedRobot
from ._table import Table

MODELS, FLUKES = ("s1", "s2"), ("none", "1", "2")
MOST_INCOMING = 1 << 20  # bytes that wait for the robot; more are lost, as on a line without flow control


class Emulator(EmulatedRobot):
    """A Scribbler as a client sees it through its port.

    Bytes go in with `receive`, time passes with `advance`, and `transmit` gives the bytes that have come out by then.
    Everything is a function of these calls and the seed, and the physics do not depend on how time is cut into pieces.

    Args:
        model: "s1" or "s2", which an S3 is too.
        fluke: "none", "1" or "2".
        arena: Arena of the robot, or a scene of one. Default: the paper's arena.
        seed: Seed of the noise of its sensors, and of faults.
        faults: Faults of the link. Default: none.
        timing: True if bytes, tones, sensors, and writing to memory take their time.
        state: The file in which it keeps name, password, data, forwardness, echo mode and volume.
        robot: Simulated robot behind it, which replaces a box on two wheels in the arena. If it has its own infrared
            and battery, these are used, too.

    Attributes:
        identity: Identity of the emulated robot, which does not depend on its port and seed.

    Raises:
        RobotError: There is no such model, or the file of its state cannot be read.
    """

    def __init__(
        self,
        model: Literal["s1", "s2"] = "s2",
        fluke: Literal["none", "1", "2"] = "2",
        *,
        arena: Arena | Scene | None = None,
        seed: int = 0,
        faults: Faults | None = None,
        timing: bool = True,
        state: Path | None = None,
        robot: SimulatedRobot | None = None,
    ) -> None:
        if model not in MODELS:
            raise RobotError(f"Unknown model {model!r}; expected {' or '.join(MODELS)}; an S3 is an s2.")
        if fluke not in FLUKES:
            raise RobotError(f"Unknown Fluke {fluke!r}; expected {', '.join(FLUKES)}.")
        seed = whole_number("seed", seed, 0)
        self.model, self.fluke_model, self.timing = model, fluke, timing
        self.scene = arena if isinstance(arena, Scene) else Scene(arena) if arena else paper_scene()
        self.arena = self.scene.arena
        self.faults = faults or Faults()
        self.may_hang_up = bool(self.faults.hangup)
        self.link = FaultyLink(self.faults, seed)
        self.memory = Memory(model, state)
        self._now = 0
        self._order = 0
        self._events: list[tuple[int, int, Callable[[int], None], Callable[[], bool] | None]] = []
        self._incoming: deque[tuple[int, int]] = deque()
        self._free = 0
        self._line = Line()
        self._byte_ns = 0 if not timing else BYTE_NS if fluke == "none" else LINK_BYTE_NS
        self._robot_byte_ns = BYTE_NS if timing else 0
        self._spoils = self.faults.any_on_the_wire
        self._is_plain = not (self._spoils or self.faults.hangup or self.faults.sag)
        self._build(seed, robot)

    def _build(self, seed: int, robot: SimulatedRobot | None) -> None:
        """Put the robot together and on its start."""
        arena = self.scene.arena
        motors: S1Motors | S2Motors
        motors = S1Motors(self.memory.data) if self.model == "s1" else S2Motors()
        spacing = S1_SPACING if self.model == "s1" else S2_SPACING
        body: SimulatedRobot = robot or BoxOnWheels(arena, spacing)
        own = body if isinstance(body, RobotOfItsOwn) else None
        self.battery = Battery(self.faults.sag, own.volts if own else None)
        self.table = Table(body, motors, self.battery, arena)
        self.identity = self._identity(body)
        self.senses = Senses(body, self.scene, seed)
        self.fluke: Fluke | None = None
        to_client = self._from_robot if self.fluke_model == "none" else self._through_fluke
        self.robot = Scribbler(
            self.model,
            self.table,
            self.senses,
            self.memory,
            self.schedule,
            to_client,
            timing=self.timing,
        )
        if self.fluke_model != "none":
            camera = Camera(body, self.scene, self.fluke_model)
            self.fluke = Fluke(
                self.fluke_model, self.robot, camera, self.schedule, self._send, timing=self.timing
            )
        self._board: Scribbler | Fluke = self.fluke or self.robot
        self.place(arena.start, seed)

    def _identity(self, body: SimulatedRobot) -> str:
        """Return a description of what is emulated, equal for equal robots."""
        moves = getattr(body, "identity", type(body).__name__)
        goes_wrong = [f"{name}={value:g}" for name, value in vars(self.faults).items() if value]
        own = [f"{self.model}, Fluke {self.fluke_model}", moves, *goes_wrong]
        return ", ".join(own if self.timing else [*own, "no timing"])

    # time

    @property
    def now(self) -> float:
        """The time since it was switched on [s]."""
        return self._now / SECOND

    @property
    def now_ns(self) -> int:
        """The time since it was switched on [ns]."""
        return self._now

    def schedule(
        self, when: int, act: Callable[[int], None], is_due: Callable[[], bool] | None = None
    ) -> None:
        """Call `act` at a time [ns], or immediately if that is past.

        `next_event` drops the call if `is_due` returns False.
        """
        if when <= self._now:
            act(self._now)
            return
        self._order += 1
        heapq.heappush(self._events, (when, self._order, act, is_due))

    def advance(self, seconds: float) -> None:
        """Let time pass.

        Raises:
            ValueError: Time does not run backwards.
        """
        if not 0 <= seconds < math.inf:
            raise ValueError(f"seconds is {seconds!r}, expected a time from now on.")
        self.advance_to(self._now + nanoseconds(seconds))

    def advance_to(self, until: int) -> None:
        """Let time pass up to a moment [ns]; one that is past changes nothing."""
        incoming, events = self._incoming, self._events
        while True:
            first = incoming[0][0] if incoming else until + 1
            if events and events[0][0] < first and events[0][0] <= until:
                when, _, act, _ = heapq.heappop(events)
                self._now = max(self._now, when)
                act(self._now)
            elif first <= until:
                when, byte = incoming.popleft()
                self._now = max(self._now, when)
                self._board.receive(byte, self._now)
            else:
                break
        self._now = max(self._now, until)
        if self.faults.sag:
            self._check_supply()

    def next_event(self, wanted: int = 1) -> int | None:
        """Return the time of the next event that may bring output, or at which `wanted` bytes are out [ns], or None."""
        while self._events and (is_due := self._events[0][3]) is not None and not is_due():
            heapq.heappop(self._events)
        times = [self._line.due(wanted)]
        if self._incoming:
            times.append(self._incoming[0][0])
        if self._events:
            times.append(self._events[0][0])
        return min((time for time in times if time is not None), default=None)

    @property
    def is_talking(self) -> bool:
        """True while bytes are transmitted to it or from it."""
        return bool(self._incoming) or self._line.due(1) is not None

    # bytes

    def receive(self, data: bytes) -> None:
        """Take bytes that a client sends from now on."""
        if self._is_plain and not self._byte_ns:
            for byte in data:
                self._board.receive(byte, self._now)
            return
        if not self.is_connected:
            return
        data = self.link.spoil(data) if self._spoils else data
        at = max(self._free, self._now) + self.link.lateness()
        for byte in data[: MOST_INCOMING - len(self._incoming)]:
            at += self._byte_ns
            self._incoming.append((at, byte))
        self._free = at
        self.advance_to(self._now)

    def transmit(self) -> bytes:
        """Return the bytes that have been sent since the last call."""
        if not self._is_plain and not self.is_connected:
            self._line.drop()
            return b""
        return self._line.take(self._now)

    def _from_robot(self, data: bytes, ready: int, is_echo: bool) -> None:
        self._send(data, ready, self._robot_byte_ns)

    def _through_fluke(self, data: bytes, ready: int, is_echo: bool) -> None:
        if self.fluke is not None:
            self.fluke.relay(data, ready, is_echo)

    def _send(self, data: bytes, ready: int, byte_ns: int) -> None:
        if self._spoils:
            data, ready = self.link.spoil(data), ready + self.link.lateness()
        self._line.send(data, ready, byte_ns)

    @property
    def is_connected(self) -> bool:
        """True if the link works; a fault may interrupt it for a while."""
        if self._is_plain:
            return True
        self._check_supply()
        return self.link.is_up(self._now)

    def _check_supply(self) -> None:
        self.table.advance_to(self._now)
        if self.battery.volts(self.table.motors.load) < DROP_OUT_VOLTS and self._now >= self.link.away_until:
            self.link.hang_up(self._now, SAG_HANG_UP_S)

    def reset_line(self) -> None:
        """Apply DTR going low on a cable: an S2 restarts. Behind a Fluke this has no effect."""
        if self.model == "s2" and self.fluke is None:
            self.robot.reset(self._now)

    def overload(self) -> None:
        """Block the wheels: too much current stops an S2 until a reset, and it answers nothing."""
        motors = self.table.motors
        self.table.advance_to(self._now)
        if isinstance(motors, S2Motors):
            motors.trip()

    @property
    def is_overloaded(self) -> bool:
        """True if too much current has stopped it."""
        return isinstance(self.table.motors, S2Motors) and self.table.motors.tripped

    # what an observer sees

    @property
    def is_turning(self) -> bool:
        """True if its motors run, up to where the physics were computed."""
        return self.table.motors.turning

    def compute_motion(self) -> None:
        """Compute the physics up to the present."""
        self.table.advance_to(self._now)

    @property
    def fluke_ahead(self) -> bool:
        """True if the end with the Fluke is ahead."""
        return self.fluke is not None and self.memory.fluke_ahead

    @property
    def _turn(self) -> float:
        """Return the angle from the Scribbler's heading to that of the end that is ahead [rad]."""
        return math.pi if self.fluke_ahead else 0.0

    @property
    def pose(self) -> Pose:
        """Pose of the pen; its heading is that of the end that is ahead at present."""
        self.table.advance_to(self._now)
        x, y, heading = self.table.robot.pose
        return Pose(x, y, heading + self._turn)

    def place(self, pose: Pose, seed: int) -> None:
        """Place the robot at a pose with its motors off; the pen's path and the sensors' noise restart.

        Args:
            pose: Pose of the pen; the heading is that of the end that is ahead.
            seed: Seed of the sensors' noise.
        """
        x, y, heading = map(float, pose)
        if not all(map(math.isfinite, (x, y, heading))):
            raise ValueError(f"pose is {tuple(pose)!r}, expected three finite numbers.")
        self.table.advance_to(self._now)
        self.robot.drop_motions()
        if isinstance(self.table.robot, RobotOfItsOwn):
            self.table.robot.restart(seed)
        self.table.place(Pose(x, y, heading - self._turn), self._now)
        self.senses.restart(seed)

    def wheel_speeds(self) -> tuple[float, float]:
        """Return the wheel speeds, left and right as seen by the end that is ahead [m/s]."""
        self.table.advance_to(self._now)
        motors = self.table.motors
        left, right = motors.speeds() if motors.turning else (0.0, 0.0)
        return (0.0 - right, 0.0 - left) if self.fluke_ahead else (left, right)

    def path(self) -> NDArray[np.float64]:
        """Return time [s], x [m], y [m] and heading [rad] of the pen since it was placed, (t, 4)."""
        pose = self.pose
        points = np.frombuffer(self.table.points, dtype=float).reshape(-1, 4).copy()
        points[:, 3] += self._turn
        return np.vstack([points, (self.now, *pose)]) if points[-1, 0] < self.now else points

    def cells(self) -> tuple[int, ...]:
        """Return cells of the arena's grid along the driven line, in order of first visits."""
        self.table.advance_to(self._now)
        return self.table.cells()
