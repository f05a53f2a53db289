"""A twin as one robot under the contract that a physical one meets."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import whole_number
from realitygap.robots._bases import ProgramRobot
from realitygap.robots._clock import VirtualClock
from realitygap.robots._contract import Command, Label, Observation, check_command
from realitygap.world import Arena, Pose, cells_along

from ._ir import IrSensors
from ._model import DELAYS, TwinModel, numbers_for
from ._motors import NOMINAL, TICK_S, PlainSpeeds, Servo, SpeedSteps
from ._physics import Physics
from ._senses import Ambient, Encoders, Idler, names_of
from ._shape import STEP_S

FULL_SCALE = 6400.0  # of a Fluke's obstacle reading
TICK_STEPS = round(TICK_S / STEP_S)
CRUISE_STEPS = 2 * TICK_STEPS  # while nothing changes but slowly


class TwinRobot(ProgramRobot):
    """A twin, one command at a time: pseudo-reality of the wheels, motors and sensors that its file describes.

    Everything is a function of the twin, the arena, the trial's number and the commands.

    | command | least | most | unit |
    |---|---|---|---|
    | move | -1 | 1 | 1: full speed, the end ahead first |
    | turn | -1 | 1 | 1: one wheel full ahead, the other full back, to the left |

    | observation | from 0 | to 1 | raw |
    |---|---|---|---|
    | each infrared sensor, from left to right | no pulse came back | all did | 0 to 6400 |
    | encoder.0, encoder.1: left, right wheel, if selected | -1: full speed back | full speed | |
    | light.K, if the file has them and they are selected | dark | bright | |
    | line.K, likewise | light floor | dark floor | |

    Args:
        model: The twin.
        arena: Arena of the robot.
        number: Number of the trial, which selects the noise.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        ValueError: The twin's engine is sim, which `realitygap.platforms.open_twin` opens.
    """

    label: Label = "TWIN"
    _closed = "This twin is closed: make a new one."
    _selected: tuple[str, ...] = ()

    def __init__(self, model: TwinModel, arena: Arena, *, number: int = 0) -> None:
        if model.engine != "mujoco":
            raise ValueError(
                f"twin {model.name!r} has engine {model.engine!r}, expected 'mujoco'. Open it by "
                "realitygap.platforms.open_twin."
            )
        self.model, self.arena = model, arena
        self.number = number
        self.step_s = model.step_s
        self.n_sensors = len(model.ir.mount)
        self.channels = (*names_of(model), "encoder.0", "encoder.1")
        self.clock = VirtualClock(self.wait)
        self._physics = Physics(model, arena)
        self.reset()

    @property
    def number(self) -> int:
        """Number of the trial that the next `reset` begins."""
        return self._number

    @number.setter
    def number(self, number: int) -> None:
        self._number = whole_number("number", number, 0, 2**63 - 1)

    def select(self, names: Sequence[str]) -> None:
        """Choose the sensors that `observe` reads besides infrared."""
        self._selected = tuple(names)

    def reset(self, pose: Pose | None = None) -> None:
        """Begin trial `number` at a pose, or at the arena's start; the heading is that of the body's x."""
        self._check_open()
        model, number = self.model, self.number
        self._start = self.arena.start if pose is None else Pose(*map(float, pose))
        self._physics.place(self._start)
        self._servo = Servo(model, number)
        self._regulator = SpeedSteps() if model.motors.stepped else PlainSpeeds()
        self._speeds = self._regulator.tick()
        self._ir = IrSensors(model, number)
        self._idler = Idler(model, self._start)
        self._encoders = Encoders(model, number)
        self._ambient = Ambient(model, self.arena, number)
        self._delays = numbers_for(model.seed, number, DELAYS)
        self._heard: deque[tuple[int, float, float]] = deque()  # steps of time, left, right
        self._steps = self._phase = 0
        self._turned = (0.0, 0.0)
        self._points = [tuple(self._start)]
        self._times = [0.0]
        self._seen: Observation | None = None
        self._told = self._before = (0.0, 0.0)
        self.n_steps = 0

    def observe(self) -> Observation:
        """Read the sensors; the same until the next command."""
        self._check_open()
        if self._seen is None:
            readings = self._ir.readings(self._physics, self._servo.volts, self.n_steps)
            raw = tuple((readings * FULL_SCALE).tolist())
            channels = self._read_channels() if self._selected else {}
            self._seen = Observation(tuple(readings.tolist()), self._idler.stalled, raw, channels)
        return self._seen

    def _read_channels(self) -> dict[str, float]:
        """Return the values of the selected sensors by name."""
        values = self._ambient.values(self.pose, self.n_steps)
        values |= {f"encoder.{k}": speed for k, speed in enumerate(self._wheel_speeds())}
        return {name: values[name] for name in self._selected}

    def _wheel_speeds(self) -> list[float]:
        """Return what the encoders counted in the last command, as parts of that at an S2's full speed, -1..1."""
        full = NOMINAL * self.step_s
        counted = zip(self._told, self._before, strict=True)
        return [min(max((now - before) / full, -1.0), 1.0) for now, before in counted]

    def drive(self, command: Command) -> None:
        """Drive one command for `step_s`: left wheel move - turn, right wheel move + turn, limited to -1..1."""
        self._check_open()
        self.order(*check_command(command).wheels)
        self._advance(round(self.step_s / STEP_S))
        self.n_steps += 1
        self._told, self._before = self.encoders, self._told
        self._seen = None

    def order(self, left: float, right: float) -> None:
        """Set the speeds of the wheels, each -1 to 1.

        They take effect after the delay and last until the next ones take effect.
        """
        motors = self.model.motors
        late = motors.delay + motors.delay_jitter * float(self._delays.uniform(-1.0, 1.0))
        due = self._steps + max(0, round(late / STEP_S))
        self._heard.append((max(due, self._heard[-1][0]) if self._heard else due, left, right))

    def wait(self, seconds: float) -> None:
        """Let time pass while the robot continues with its last command."""
        self._check_open()
        self._advance(round(seconds / STEP_S))

    def _advance(self, steps: int) -> None:
        """Advance the physics in steps that end when the regulator ticks or a command takes effect."""
        end = self._steps + steps
        while self._steps < end:
            while self._heard and self._heard[0][0] <= self._steps:
                self._regulator.drive(*self._heard.popleft()[1:])
                self._phase = 0
            if not self._phase:
                self._speeds = self._regulator.tick()
            whole = CRUISE_STEPS if self._regulator.is_steady and self._servo.is_steady else TICK_STEPS
            n = min(whole - self._phase, end - self._steps)
            if self._heard:
                n = min(n, self._heard[0][0] - self._steps)
            self._pass(n)
            self._phase = (self._phase + n) % TICK_STEPS

    def _pass(self, steps: int) -> None:
        seconds = steps * STEP_S
        physics = self._physics
        here = self._points[-1]
        left, right = self._servo.follow(*self._speeds, Pose(*here), seconds)
        physics.move(left, right, steps)
        self._steps += steps
        self.clock.seconds += seconds
        pose, turned, before = physics.pose, physics.wheels, self._turned
        self._idler.watch(pose, turned[0] - before[0], turned[1] - before[1], seconds)
        self._encoders.turn(turned[0] - before[0], turned[1] - before[1])
        self._turned = turned
        self._points.append(tuple(pose))
        self._times.append(self._steps * STEP_S)

    def stop(self) -> None:
        """Stop the motors; safe to call at any moment, and twice."""
        if self._is_open:
            self._heard.clear()
            self._regulator.drive(0.0, 0.0)
            self._phase = 0

    @property
    def pose(self) -> Pose:
        """Pose of the pen, with the heading of the body's x [rad, 0 to 2 pi]."""
        x, y, heading = self._points[-1]
        return Pose(x, y, heading % math.tau)

    @property
    def encoders(self) -> tuple[float, float]:
        """Way of the left and the right wheel since the start of the trial, as its encoders tell it [m]."""
        return self._encoders.distances

    @property
    def wheels(self) -> tuple[float, float]:
        """Distances of the wheels, the same as `encoders`, because a twin shows only what a robot shows."""
        return self.encoders

    @property
    def battery_v(self) -> float:
        """Battery voltage now [V]."""
        return self._servo.volts

    def path(self) -> NDArray[np.float64]:
        """Return the line of the pen since the start, at least every 40 ms: x [m], y [m] and heading [rad], (n, 3)."""
        return np.array(self._points)

    def times(self) -> NDArray[np.float64]:
        """Return the time of each point of `path` since the start, (n,) [s]."""
        return np.array(self._times)

    @property
    def visited_cells(self) -> tuple[int, ...]:
        """Cells visited along the line, in order of first visit, columns * row + column."""
        return cells_along(self.path(), self.arena.grid)
