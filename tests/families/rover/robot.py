"""The driver, the platform, and the terminal. A message is 3 bytes: m, left, right for motors; r, 0, 0 for readings."""

from typing import Any, ClassVar

from realitygap.platforms import PortPlatform
from realitygap.robots import (
    Command,
    Observation,
    PortGuess,
    ProgramRobot,
    SystemClock,
    check_command,
    serial_port,
)

RANGE = 255.0


class Rover(ProgramRobot):
    label = "EMULATED"
    step_s = 0.2
    n_sensors = 2
    reading_max = RANGE

    def __init__(self, port: str) -> None:
        self.port = serial_port(port, 9600, 1.0)
        self.port.open()
        self.clock = getattr(self.port, "clock", SystemClock())

    def _ask(self, *message: int) -> bytes:
        self._check_open()
        self.port.write(bytes(message))
        return bytes(self.port.read(3))

    def reset(self, pose: Any = None) -> None:
        self.stop()

    def observe(self) -> Observation:
        left, right, stalled = self._ask(ord("r"), 0, 0)
        return Observation((left / RANGE, right / RANGE), bool(stalled), (float(left), float(right)))

    def drive(self, command: Command) -> None:
        wheels = check_command(command).wheels
        self._ask(ord("m"), *(round(100 + 100 * speed) for speed in wheels))
        self.clock.sleep(self.step_s)

    def stop(self) -> None:
        if self._is_open:
            self._ask(ord("m"), 100, 100)

    def close(self) -> None:
        super().close()
        self.port.close()


class RoverPlatform(PortPlatform):
    name: ClassVar[str] = "rover"
    summary: ClassVar[str] = "a made-up robot"
    base_robot: ClassVar[str] = "rover"

    @property
    def command_s(self) -> float:
        return 0.2

    def connect(self) -> Rover:
        return Rover(self.port)


def find_ports() -> list[PortGuess]:
    return [PortGuess("/dev/ttyUSB7", "a Rover", "")]


def open_robot(port: str, record: Any, watchdog_s: float | None) -> Rover:
    return Rover(port)


def info(robot: Rover) -> dict[str, Any]:
    return {"model": "Rover", "label": robot.label}


def sense(robot: Rover) -> dict[str, Any]:
    return {"distances": robot.observe().raw}


def battery(robot: Rover) -> tuple[str, float]:
    return "battery_v", 6.0
