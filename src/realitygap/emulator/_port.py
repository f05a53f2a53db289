"""An emulator in the same process, behind the interface of a serial port of pyserial.

`serial.serial_for_url("emulator://s2?fluke=2&arena=paper&seed=1&speed=off")` opens one. With `speed=off` no real time
passes: the port's clock is that of the emulator, waiting for bytes lets time pass in it, and so does sleeping.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from threading import RLock
from typing import Any, ClassVar
from urllib.parse import parse_qsl, urlsplit

import serial
from serial.serialutil import PortNotOpenError, SerialBase, SerialException, Timeout

from realitygap.errors import DescriptionError, RobotError, did_you_mean
from realitygap.robots import SystemClock
from realitygap.world import Arena, load_arena

from ._emulated import SECOND, EmulatedRobot, nanoseconds
from ._witness import DirectWitness

SCHEME = "emulator"
FASTEST = 1000.0
_REAL_TIME = SystemClock()
_shared: dict[str, tuple[EmulatedRobot, RLock]] = {}


class EmulatorClock:
    """The emulator's time for those who use its port.

    Args:
        port: Port with the clock.
    """

    def __init__(self, port: EmulatedPort) -> None:
        self._port = port

    def now(self) -> float:
        """Return seconds since the emulator was switched on."""
        return self._port.time()

    def sleep(self, seconds: float) -> None:
        """Let time pass. With `speed=off` exactly this much passes, and it takes no real time."""
        self._port.wait(seconds)


class EmulatedPort(SerialBase):  # type: ignore[misc]  # pyserial has no types
    """A serial port with an emulated robot at its other end. A family has a subclass with `make_robot`.

    Attributes:
        options: Options of an address that `make_robot` takes, besides `speed` and `id`.
        emulator: The robot; None before it was first opened.
        clock: Clock of the emulated robot.
        witness: Witness of the emulated robot.
    """

    options: ClassVar[tuple[str, ...]] = ("arena", "seed")

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self.emulator: EmulatedRobot | None = None
        self._lock = RLock()
        self._buffer = bytearray()
        self._speed: float | None = 1.0
        self._begun = 0.0
        self.clock = EmulatorClock(self)
        self.is_open = False
        self._dtr_was_high = False
        super().__init__(*args, **kwargs)

    # opening

    def open(self) -> None:
        """Open the port; the first time the robot is made, afterwards it is the same one."""
        if self.is_open:
            raise SerialException("Port is already open.")
        if self.emulator is None:
            self._make(str(self.portstr))
        self._sync()
        if not self._robot.is_connected:
            raise SerialException(f"could not open port {self.portstr}: the link is away")
        self._robot.transmit()
        self._buffer.clear()
        self.is_open = True
        self._dtr_was_high = bool(self._dtr_state)
        self._reconfigure_port()

    def _make(self, url: str) -> None:
        host, options = self._parse(url)
        speed = options.pop("speed", "1")
        self._speed = None if speed == "off" else number_in("speed", speed, 0.001, FASTEST)
        shared = options.pop("id", None)
        if shared in _shared:
            self.emulator, self._lock = _shared[shared]
        else:
            try:
                self.emulator = self.make_robot(host, options)
            except RobotError as error:
                raise RobotError(f"{url}: {error}") from error
            if shared:
                _shared[shared] = (self.emulator, self._lock)
        self._begun = time.monotonic() - self.emulator.now / (self._speed or 1.0)
        self.witness = DirectWitness(self.emulator, self._lock)

    def _parse(self, url: str) -> tuple[str, dict[str, str]]:
        """Return the host and the options of emulator://HOST?seed=1&speed=off."""
        parts = urlsplit(url)
        options = dict(parse_qsl(parts.query, keep_blank_values=True))
        known = (*self.options, "speed", "id")
        for key in options:
            if key not in known:
                raise RobotError(f"{url}: unknown option {key!r}. {did_you_mean(key, known)}")
        return parts.netloc, options

    def make_robot(self, host: str, options: Mapping[str, str]) -> EmulatedRobot:
        """Return the robot that an address describes.

        Raises:
            RobotError: An option is out of range.
        """
        raise NotImplementedError

    @property
    def _robot(self) -> EmulatedRobot:
        if self.emulator is None:
            raise PortNotOpenError
        return self.emulator

    def close(self) -> None:
        """Close the port; the robot continues to follow its last command."""
        self.is_open = False

    def _reconfigure_port(self) -> None:
        """The rate set by a client has no effect here."""

    # time

    def _sync(self) -> None:
        """Advance the emulator's time to the real one."""
        if self._speed is not None:
            self._robot.advance_to(nanoseconds((time.monotonic() - self._begun) * self._speed))

    def time(self) -> float:
        """Return seconds since the emulator was switched on."""
        with self._lock:
            self._sync()
            return self._robot.now

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        if self._speed is None:
            with self._lock:
                self._robot.advance(max(0.0, seconds))
        else:
            _REAL_TIME.sleep(seconds / self._speed)

    # bytes

    def _fetch(self) -> None:
        self._sync()
        if not self._robot.is_connected:
            self.is_open = False
            raise SerialException(f"{self.portstr}: the link was lost (a hang-up of the emulator)")
        self._buffer += self._robot.transmit()

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting."""
        self._check()
        with self._lock:
            self._fetch()
            return len(self._buffer)

    def _check(self) -> None:
        if not self.is_open:
            raise PortNotOpenError

    def read(self, size: int = 1) -> bytes:
        """Return `size` bytes, or those that arrive before the timeout."""
        self._check()
        give_up = Timeout(None if self._timeout is None else self._timeout / (self._speed or 1.0))
        with self._lock:
            until = None if self._timeout is None else self._robot.now_ns + nanoseconds(self._timeout)
        while True:
            with self._lock:
                self._fetch()
                missing = size - len(self._buffer)
                late = until is not None and (
                    self._robot.now_ns >= until or (self._speed and give_up.expired())
                )
                if missing <= 0 or late or not self.is_open:
                    data = bytes(self._buffer[:size])
                    del self._buffer[:size]
                    return data
                pause = self._pass_time(missing, until)
            if pause:
                time.sleep(pause)

    def _pass_time(self, missing: int, until: int | None) -> float:
        """Let simulated time pass up to the next event; return the real time to sleep."""
        now, due = self._robot.now_ns, self._robot.next_event(missing)
        if due is None and until is None and self._speed is None:
            raise SerialException(
                f"{self.portstr}: nothing will ever come, and there is no timeout to wait for"
            )
        step = min(time for time in (due, until, now + SECOND if self._speed else None) if time is not None)
        if self._speed is None:
            self._robot.advance_to(step)
            return 0.0
        return min(0.01, max(0.0, (step - now) / SECOND / self._speed))

    def write(self, data: Any) -> int:
        """Send bytes to the robot."""
        self._check()
        data = bytes(data)
        with self._lock:
            self._fetch()
            self._robot.receive(data)
        return len(data)

    def flush(self) -> None:
        """Nothing waits to be sent."""

    def reset_input_buffer(self) -> None:
        """Discard received bytes that were not read."""
        self._check()
        with self._lock:
            self._fetch()
            self._buffer.clear()

    def reset_output_buffer(self) -> None:
        """Nothing waits to be sent."""

    # lines

    def _update_dtr_state(self) -> None:
        """DTR going low restarts a cabled S2, as on its socket."""
        falls = self._dtr_was_high and not self._dtr_state
        self._dtr_was_high = bool(self._dtr_state)
        if falls:
            with self._lock:
                self._sync()
                self._robot.reset_line()

    def _update_rts_state(self) -> None:
        """Nobody uses RTS."""

    def _update_break_state(self) -> None:
        """A break has no meaning here."""

    @property
    def cts(self) -> bool:
        """Always clear to send."""
        return True

    @property
    def dsr(self) -> bool:
        """Always ready."""
        return True

    @property
    def ri(self) -> bool:
        """Never rings."""
        return False

    @property
    def cd(self) -> bool:
        """True if the link works."""
        return self.emulator is not None and self._robot.is_connected


def number_in(name: str, text: str, least: float, most: float, *, whole: bool = False) -> float:
    """Return the number that an option of an emulator's address gives.

    Raises:
        RobotError: It is no number, or out of range.
    """
    try:
        value = int(text) if whole else float(text)
    except ValueError:
        value = float("nan")
    if not least <= value <= most:
        kind = "a whole number" if whole else "a number"
        raise RobotError(f"{name}={text}: expected {kind} from {least:g} to {most:g}.")
    return value


def open_arena(name: str) -> Arena:
    """Return the arena of that name, or of a file.

    Args:
        name: Name of an arena, or the path of its TOML or SVG file.

    Raises:
        RobotError: There is no such arena or file, or the file cannot be used; the text says where and why.
    """
    try:
        arena = load_arena(name)
    except DescriptionError as error:
        raise RobotError(str(error)) from None
    if arena.vary:
        raise RobotError(
            f"{name}: {', '.join(arena.vary)} are drawn, expected plain numbers: an emulator draws none."
        )
    return arena


def register() -> None:
    """Let pyserial know emulator://."""
    package = __name__.rpartition(".")[0]
    if package not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(package)
