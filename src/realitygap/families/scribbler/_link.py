"""The link to a robot over its port.

A frame has no mark and no checksum, so a lost or added byte shifts all following bytes. Several rules keep the two
sides synchronized. There is one command at a time. Echoes are compared. Values that no robot sends are refused. After
every doubt the link waits for silence, then sends a command whose echo proves that both sides count from the same
byte again.

Source: the protocol of Myro's firmware and clients. Differs: a Fluke 1 that has counted part of a packet keeps that
count forever. Myro cannot recover from this; see `Link._release_counter`.
"""

from __future__ import annotations

import contextlib
import re
import threading
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from realitygap.errors import ProtocolError, RobotError, RobotWarning
from realitygap.robots import SILENT_S, Clock, Guardian, Port, SystemClock, descriptor_of

from . import _codec as codec
from ._codec import Request
from ._reading import GAP_S, Fault, HangUp, read_answer
from .opcodes import COUNTED, JPEG_HEADER, PACKET, Op

T = TypeVar("T")

STOP_BYTES = bytes([Op.SET_MOTORS_OFF] * PACKET)
"""The packet "motors off" wherever a packet begins, as the robot ignores the bytes that follow its opcode. If a program
wrote only a part of its last packet, the first bytes complete that one, and the next nine are a separate packet."""
STOP_ANSWER = re.escape(STOP_BYTES) + rb"[\0\1]{2}.{6}[\0\1]{3}"
"""The echo of the packet and a sensor block, of which five bytes are 0 or 1."""

QUIET_S = 0.5
"""Silence after which no more bytes are expected [s]. Source: Myro's manual_flush."""
FORGET_S = 1.2
"""Silence after which a robot has discarded half a packet [s]: its firmware does so after 1 s."""
CHATTER_S = 4.0
"""A port without silence for this time belongs to a robot that repeats its name, or to another device [s]."""
CHATTER_BYTES = 1 << 20
"""The same limit as a number of bytes."""
PROBE_S = 0.3
"""Maximum time for a Fluke's battery reading when probing [s]."""
MAX_PROBES = 12
"""More than the bytes that any of the Fluke's counters can still expect."""
DOUBT_S = 2.0
"""Time without an answer after which a warning states that the motors may be running [s]."""
ATTEMPTS = 5
"""Attempts for a command that is safe to repeat: enough if half a percent of all bytes are lost."""
RECOVERIES = 8
"""Attempts to resynchronize after one fault, while the robot sends anything."""
SILENT_RECOVERIES = 3
"""Attempts to resynchronize if the robot sends nothing."""
REOPENINGS = 8
"""Attempts to open a port again that hung up, one per second."""
GREETINGS = 4
"""Attempts to identify the robot."""
SILENT_GREETINGS = 3
"""Attempts to identify the robot if nothing arrives. A robot that was reset as its port was opened answers by then."""
STRANGER_PROBES = 8
"""Number of probes: enough to release a Fluke, and less than a packet for a robot without a Fluke."""
PSEUDO_TERMINALS = ("/dev/pts/", "/dev/ttys")
"""First letters of the names of pseudo-terminals, on Linux and macOS."""


try:
    import termios

    _HANG_UPS: tuple[type[Exception], ...] = (OSError, termios.error)
except ImportError:  # Windows
    _HANG_UPS = (OSError,)
# What a port that is gone raises; pyserial's own exceptions are OSErrors.

_MOVING = frozenset((Op.SET_MOTORS, Op.PATH, Op.MOVE, Op.ARC, Op.TURN))
_STEERING = _MOVING | {Op.SET_MOTORS_OFF}
_BY_DISTANCE = _MOVING - {Op.SET_MOTORS}


@dataclass
class Faults:
    """Numbers of faults of the link since it was opened.

    Attributes:
        retries: Commands sent again.
        strays: Bytes that arrived unexpectedly.
        recoveries: Number of resynchronizations. The motors stood still during each.
        hang_ups: Number of times the port disappeared.
        watchdog_stops: Number of times the motors were stopped because the controlling loop was silent.
        guardian_stops: Number of times they were stopped because this program was frozen, or because its guardian
            ended.
    """

    retries: int = 0
    strays: int = 0
    recoveries: int = 0
    hang_ups: int = 0
    watchdog_stops: int = 0
    guardian_stops: int = 0


class Exchange(NamedTuple):
    """One command and its result.

    Attributes:
        time_s: Time of sending, by the port's clock [s].
        took_s: Time until the answer was complete, or given up [s].
        name: Name of the command.
        sent: Bytes of the command.
        answered: The bytes that arrived.
        outcome: "ok", or the error.
    """

    time_s: float
    took_s: float
    name: str
    sent: bytes
    answered: bytes
    outcome: str


class _LostStep(Exception):  # noqa: N818
    """The two sides could not be synchronized, for this reason."""

    def __init__(self, fault: Fault | None) -> None:
        super().__init__(str(fault))
        self.fault = fault


class Link:
    """A port with a robot at its other end. Every method may be called from any thread.

    Args:
        port: A port that is open, or any object with the same methods. Its attribute `clock` is the clock.
        name: Name of the port, for messages.

    Attributes:
        has_robot, fluke: The hardware at the other end, set by `greet`.
        where: Present activity of the caller, for messages.
        motors_off: Whether the motors are known to be off. None if nothing is known.
        is_in_motion: Whether a motion of an S2 by distance may not have ended.
        tell: Function that is called with each finished exchange.
        watch: Function that is called before each command.
        spoken_s: Time of the last command, by the clock [s].
        lock: Held during a command.
    """

    def __init__(self, port: Port, name: str) -> None:
        self.port = port
        self.name = name
        self.clock: Clock = getattr(port, "clock", None) or SystemClock()
        self.has_robot = True
        self.fluke = "none"
        self.faults = Faults()
        self.where = ""
        self.motors_off: bool | None = None
        self.is_in_motion = False
        self.tell: Callable[[Exchange], None] | None = None
        self.watch: Callable[[], None] | None = None
        self.spoken_s = self.clock.now()
        self.lock = threading.RLock()
        self._motors: Request | None = None
        self._in_step = False
        self._fault: Fault | None = None
        self._recoveries = RECOVERIES
        self._asked_s = self.spoken_s
        self._has_warned = False
        self._is_open = True
        self._guardian: Guardian | None = None
        self._stopped = (
            ""  # why the motors were stopped behind the caller's back, until a command has said it
        )
        port.timeout = GAP_S
        try:
            self._start_guardian()
        except RobotError:
            self.close()
            raise

    @property
    def guardian_id(self) -> int | None:
        """Number of the process that stops the motors if this one is killed. None for a robot in this program."""
        return None if self._guardian is None else self._guardian.process_id

    @property
    def is_open(self) -> bool:
        """True if the link can be used."""
        return self._is_open

    # one command

    def ask(self, request: Request, decode: Callable[[bytes], T]) -> T:
        """Send a command and decode its answer.

        Args:
            request: The command.
            decode: Converts the bytes after the echo to a value. It raises `ProtocolError` for bytes that no robot
                sends.

        Raises:
            RobotTimeout: No answer arrived in time, also after repeats if these are safe.
            ProtocolError: The answer was invalid, also after repeats if these are safe.
            RobotError: The port is closed, or hung up and could not be opened again.
        """
        with self.lock:
            if not self._is_open:
                raise RobotError(f"{self.name} is closed. Reopen the robot before '{request.name}'.")
            if self.watch is not None:
                self.watch()
            fault, lost, n_sent = None, False, 0
            self._asked_s = self.clock.now()
            for attempt in range(ATTEMPTS):
                self._refuse_if_stopped(request)
                try:
                    if not self._in_step:
                        self._find_step_for(request)
                    if attempt:
                        self.faults.retries += 1
                        self._move_on(request)
                    n_sent += 1
                    return self._exchange(request, decode)
                except _LostStep as happened:
                    fault, lost = happened.fault, True
                    break
                except Fault as happened:
                    fault = happened
                    if not request.repeatable:
                        break
            self._refuse_if_stopped(request)
            raise self._failure(request, fault, n_sent, lost=lost) from fault

    def _exchange(self, request: Request, decode: Callable[[bytes], T]) -> T:
        """Send a command once. Raise `Fault` if the expected answer does not arrive."""
        port = self.port
        since = self.clock.now()
        # A signal may take us out of here at any point, and leave the link in doubt.
        self._in_step, self._fault = False, None
        if request.data[0] in _MOVING:
            self._expect_motion()
            self.motors_off = False
            self.is_in_motion = request.data[0] in _BY_DISTANCE
        got = b""
        try:
            try:
                if port.in_waiting:
                    self._discard()
                port.write(request.data)
                if request.answer or request.echoed:
                    got = read_answer(port, request, self.fluke)
                    if port.in_waiting:
                        raise Fault(
                            ("More bytes arrived than the answer has"), ProtocolError, got, understood=True
                        )
            except _HANG_UPS as error:
                raise HangUp(f"The port hung up ({error})", RobotError, got) from error
            try:
                value = decode(self._body(request, got))
            except ProtocolError as error:
                raise Fault(str(error), ProtocolError, got, understood=True) from error
        except Fault as fault:
            self._fault = fault
            self._record(request, since, fault.got, str(fault))
            raise
        self._in_step = True
        self._recoveries, self._has_warned = RECOVERIES, False
        self.spoken_s = self.clock.now()
        if request.data[0] in _STEERING:
            self._note_motors(request)
        if request.pause_s:
            self.clock.sleep(request.pause_s)
        if self.tell is not None:
            self._record(request, since, got, "ok")
        return value

    def _note_motors(self, request: Request) -> None:
        """Store the last motor command."""
        standing = request.data[0] == Op.SET_MOTORS and request.data[1:3] == b"dd"  # 100, 100
        if request.data[0] == Op.SET_MOTORS_OFF or standing:
            self.motors_off, self._motors, self.is_in_motion = True, None, False
            if self._guardian is not None:
                self._guardian.expect_rest()
        else:
            self._motors = request if request.data[0] == Op.SET_MOTORS else None

    def _record(self, request: Request, since: float, got: bytes, outcome: str) -> None:
        if self.tell is not None:
            took = self.clock.now() - since
            self.tell(Exchange(since, took, request.name, request.data, got, outcome))

    def _body(self, request: Request, got: bytes) -> bytes:
        """Return the answer without its echo, or without its length."""
        if request.answer in (COUNTED, JPEG_HEADER):
            return got[2:]
        if not request.echoed:
            return got
        if not codec.is_echo(request.data, got[:PACKET]):
            text = f"The echo was {got[:PACKET].hex(' ')} in place of {request.data.hex(' ')}"
            raise Fault(text, ProtocolError, got)
        return got[PACKET:]

    def _discard(self) -> int:
        """Discard the bytes that have arrived."""
        n_bytes = 0
        while (n := self.port.in_waiting) and n_bytes < CHATTER_BYTES:
            n_bytes += len(self.port.read(n))
        self.faults.strays += n_bytes
        return n_bytes

    # the guardian

    def _start_guardian(self) -> None:
        """Start another process that stops the motors if this one is killed or frozen.

        Raises:
            RobotError: it cannot be started.
        """
        descriptor = descriptor_of(self.port)
        if descriptor is not None:
            self._guardian = Guardian(descriptor, self._replace_guardian, STOP_BYTES, STOP_ANSWER)

    def _end_guardian(self) -> None:
        if self._guardian is not None:
            self._guardian.end()
            self._guardian = None

    def _expect_motion(self) -> None:
        """Report to the guardian that the motors will run.

        Raises:
            RobotError: it cannot be started.
        """
        if self._guardian is None:
            self._start_guardian()
        if self._guardian is not None:
            self._guardian.expect_motion()

    def _replace_guardian(self) -> None:
        """Stop the motors and start another guardian.

        Without a guardian, nothing would stop them if this program were killed.
        """
        with self.lock:
            if not self._is_open:
                return
            self._end_guardian()
            if not self.motors_off:
                with contextlib.suppress(RobotError):
                    self.stop_motors()
                self._stopped = "The process that guards the robot ended, so the motors were stopped"
            with contextlib.suppress(RobotError):  # before the next motion it is tried again
                self._start_guardian()

    def stop_motors(self) -> None:
        """Stop the motors for the caller. The next command still reports what had stopped them before.

        Raises:
            RobotError: The motors could not be stopped.
        """
        with self.lock:
            stopped = self._what_stopped()
            try:
                self.ask(codec.STOP, codec.sensor_block)
            finally:
                self._stopped = stopped

    def _what_stopped(self) -> str:
        """Return once why the motors were stopped without a command of the caller. Empty if they were not."""
        if self._guardian is not None and self._guardian.has_stopped_motors():
            self._stopped = f"This program was silent for {SILENT_S:g} s, so the motors were stopped"
            self._in_step, self._fault, self.motors_off = False, Fault(self._stopped, RobotError), None
        stopped, self._stopped = self._stopped, ""
        return stopped

    def _refuse_if_stopped(self, request: Request) -> None:
        """Refuse a command once after the motors were stopped without a command of the caller.

        Raises:
            RobotError: The motors were stopped.
        """
        if stopped := self._what_stopped():
            self.faults.guardian_stops += 1
            raise self._failure(request, Fault(stopped, RobotError), 0, lost=False)

    # finding the same step again

    def _find_step_for(self, request: Request) -> None:
        """Synchronize both sides before a command.

        Raises:
            _LostStep: It failed, or it cut a motion by distance short, which the caller could not notice.
        """
        was_in_motion = self.is_in_motion
        self._find_step()
        if was_in_motion and request.data[0] not in _STEERING:
            text = "The link was disturbed, and a motion that may not have ended was stopped"
            raise _LostStep(Fault(text, RobotError))

    def _find_step(self) -> None:
        """Synchronize both sides, so that they count from the same byte. The motors are off afterwards.

        Raises:
            _LostStep: in vain.
        """
        self.faults.recoveries += 1
        motors, fault = self._motors, self._fault
        n_silent = 0
        for _ in range(self._recoveries):
            self._warn_if_silent()
            try:
                if isinstance(fault, HangUp):
                    self._reopen(fault)
                self._settle(fault)
                self._motors = motors if fault is not None else None
                return
            except Fault as happened:
                fault = happened
            except _HANG_UPS as error:
                fault = HangUp(f"The port hung up ({error})", RobotError)
            n_silent += not fault.got
            if n_silent == SILENT_RECOVERIES:
                break
        self._fault = fault
        raise _LostStep(fault)

    def _warn_if_silent(self) -> None:
        """Warn once if the motors may be running and the robot has not answered for some time."""
        silent_s = self.clock.now() - self._asked_s
        if self.motors_off is not False or self._has_warned or silent_s < DOUBT_S:
            return
        self._has_warned = True
        text = (
            f"The robot on {self.name} has not answered for {silent_s:.0f} s, and its motors may be running. If it "
            "moves, switch it off. This program is trying to reach it again."
        )
        # a registry would show the same text only once
        warnings.warn_explicit(text, RobotWarning, __file__, 0, registry=None)

    def _settle(self, fault: Fault | None) -> None:
        """Wait for silence, then send commands whose answers prove that both sides are synchronized."""
        if fault is None:  # a signal came in between: what was sent was whole, and stopping is urgent
            self.port.write(codec.STOP.data)
        understood = fault is None or fault.understood
        silence_s = QUIET_S if understood else FORGET_S
        if not self._await_silence(silence_s):
            self.port.write(codec.ECHO_OFF.data)  # a robot calls out its name until its first command
            if not self._await_silence(silence_s):
                raise Fault("The port is never silent, as no Scribbler would be", ProtocolError)
        if self.fluke != "none" and not understood:
            self._release_counter(MAX_PROBES)
        if not self.has_robot:
            self._exchange(codec.VERSION, codec.nothing)
            return
        try:
            self._exchange(codec.STOP, codec.sensor_block)
        except Fault as disturbed:
            if disturbed.kind is not ProtocolError:
                raise
        self._exchange(codec.ECHO_OFF, codec.sensor_block)
        if not self.motors_off:
            self._exchange(codec.STOP, codec.sensor_block)

    def _await_silence(self, seconds: float) -> bool:
        """Read and discard bytes until none arrived for a time [s]. Return False if that does not happen."""
        since, n_bytes = self.clock.now(), 0
        self.port.timeout = seconds
        try:
            while self.port.read(1):
                self.faults.strays += 1
                n_bytes += 1 + self._discard()
                if n_bytes > CHATTER_BYTES or self.clock.now() - since > CHATTER_S:
                    return False
            return True
        finally:
            self.port.timeout = GAP_S

    def _release_counter(self, n_probes: int) -> None:
        """Complete the packet that a Fluke believes to be incomplete.

        A Fluke 1 counts the bytes of a packet and never restarts the count. Until it has nine bytes, it takes all bytes
        as part of the packet. So this sends requests for the battery, one at a time, until one is answered. By then the
        robot has discarded its part of the packet (`FORGET_S`), and it has received less than a packet, so it executes
        nothing. (Sending bytes 0 until an echo arrives, as is sometimes advised, would complete the old packet, and 0
        is full speed back.)
        """
        self.port.timeout = PROBE_S
        try:
            n_swallowed = 0
            while n_swallowed < n_probes and not self._is_heard():
                n_swallowed += 1
        finally:
            self.port.timeout = GAP_S
        if n_swallowed:
            self._await_silence(FORGET_S)

    def _is_heard(self) -> bool:
        """Return whether a Fluke answers a request for the battery."""
        self.port.write(codec.BATTERY.data)
        got = self.port.read(2)
        return len(got) == 2 and got[0] <= 1

    def _reopen(self, fault: Fault) -> None:
        """Open the port again after a hang-up.

        Raises:
            _LostStep: in vain.
        """
        self.faults.hang_ups += 1
        if self.name.startswith(PSEUDO_TERMINALS):
            # It does not come back. One with the same name is the terminal of another program.
            raise _LostStep(fault)
        for _ in range(REOPENINGS if self._recoveries > 1 else 1):
            self._end_guardian()  # the port cannot be reopened while the guardian has it open
            with contextlib.suppress(*_HANG_UPS):
                self.port.close()
            self.clock.sleep(1.0)
            with contextlib.suppress(*_HANG_UPS):
                self.port.open()
                self._start_guardian()
                return
            self._warn_if_silent()
        raise _LostStep(fault)

    def _move_on(self, request: Request) -> None:
        """Restore the last motor command after the motors were stopped for safety."""
        if self._motors is not None and self.motors_off and request.data[0] not in _STEERING:
            self._exchange(self._motors, codec.sensor_block)

    # beginning and end

    def greet(self) -> codec.InfoLine:
        """Identify the robot, switch the echo mode off, and stop the motors.

        Raises:
            RobotTimeout: No device answers.
            ProtocolError: The device that answers is no Scribbler.
        """
        with self.lock:
            info = self._ask_who()
            if info.model is None:  # a robot that was just reset needs a moment
                self._await_silence(FORGET_S)
                info = self._ask_who()
            self.has_robot, self.fluke = info.model is not None, info.fluke
            if self.has_robot:
                self.ask(codec.ECHO_OFF, codec.sensor_block)
                self.ask(codec.STOP, codec.sensor_block)
            return info

    def _ask_who(self) -> codec.InfoLine:
        """Return the info line of the robot. A line of unknown form has to arrive twice."""
        since, seen = self.clock.now(), None
        for greeting in range(GREETINGS):
            try:
                try:
                    if greeting:
                        self._await_silence(FORGET_S)
                    if greeting == 1 and seen is None:
                        self._release_counter(STRANGER_PROBES)
                    answer, info = self._exchange(codec.INFO, lambda line: (line, codec.info_line(line)))
                    if info == seen or codec.is_plain_info(answer):
                        return info
                    seen, fault = info, Fault(f"{answer[:60]!r} is not a plain answer", ProtocolError)
                except _HANG_UPS as error:
                    raise HangUp(f"The port hung up ({error})", RobotError) from error
            except HangUp as happened:
                fault = happened
                with contextlib.suppress(_LostStep):
                    self._reopen(happened)
            except Fault as happened:
                fault = happened
                if greeting == SILENT_GREETINGS - 1 and not fault.got:
                    break
        took = self.clock.now() - since
        raise fault.kind(
            f"No Scribbler answers on {self.name}, asked {greeting + 1} times within {took:.0f} s. {fault}. "
            "Is the robot on, paired, and not in use by another program?"
        ) from fault

    def forget(self, request: Request, seconds: float) -> None:
        """Send a command that resets the robot, and then wait for some seconds.

        Its answers are discarded. Call `greet` next.

        Raises:
            RobotError: The port hung up.
        """
        with self.lock:
            self._in_step, self._motors = False, None
            try:
                self.port.write(request.data)
                self.clock.sleep(seconds)
                self._discard()
            except _HANG_UPS as error:
                raise RobotError(
                    f"The port {self.name} hung up as '{request.name}' was sent: {error}."
                ) from error

    def close(self) -> None:
        """Close the port. This is safe if called twice. It does not stop the motors."""
        with self.lock:
            self._is_open = False
            self._end_guardian()
            with contextlib.suppress(*_HANG_UPS):
                self.port.close()

    def _failure(self, request: Request, fault: Fault | None, n_sent: int, *, lost: bool) -> RobotError:
        """Return the error for a command that failed, after the motors were stopped as far as the link allows."""
        if not lost:
            with contextlib.suppress(_LostStep):
                self._find_step()
        if not self._in_step:
            self._recoveries = 1  # it has been tried: do not make everybody wait as long again
        self._motors = None
        state = "motors stopped" if self.motors_off else "the motors may be running: switch the robot off"
        details = [part for part in (self.where, f"sent {n_sent} times" if n_sent > 1 else "", state) if part]
        again = (
            ""
            if request.repeatable or not n_sent
            else f" It is not safe to repeat '{request.name}': it may have been executed."
        )
        kind = fault.kind if fault is not None else RobotError
        return kind(
            f"{fault}: '{request.name}' on {self.name} ({'; '.join(details)}).{again}"
            + (" The link is in step again." if self._in_step else " Is the robot on, paired and near?")
        )
