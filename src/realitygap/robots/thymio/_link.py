"""The link to a Thymio: messages over a serial port or TCP, with one question at a time."""

from __future__ import annotations

import contextlib
import errno
import socket
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from realitygap.errors import ProtocolError, RobotError, RobotTimeout
from realitygap.robots.scribbler._guardian import Guardian, descriptor_of
from realitygap.robots.scribbler._guardian_process import SILENT_S

from . import _messages as messages
from ._messages import Decoder, Kind, Message
from ._program import OWN, safety_program

BAUD = 115_200
POLL_S = 0.02
"""Longest wait for bytes in one piece [s]."""
ANSWER_S = 0.8
"""Time in which a robot has to answer [s]."""
OTHERS_S = 0.1
"""Time in which other robots on a dongle may name themselves after the first [s]."""
WRITE_S = 0.5
ONCE_MORE = 2
"""Attempts to read variables: reading them again is safe."""
MOST_READ = 47
"""Largest number of words that the firmware sends in one answer."""
MOST_PROGRAM_WORDS = 200
"""Words of a program in one message; a message has room for 256."""
Span = tuple[int, int]
"""Offset and number of words."""
Tell = Callable[[str, bytes, bytes], None]
"""Called with what happened, the bytes sent, and the bytes that came."""


def open_port(name: str) -> Any:
    """Open a port with DTR high, as the robot needs it to listen.

    Raises:
        RobotError: It cannot be opened; the message says what to do.
    """
    import serial

    try:
        port = serial.serial_for_url(name, do_not_open=True, baudrate=BAUD, timeout=POLL_S)
        port.write_timeout = WRITE_S
        with contextlib.suppress(AttributeError, NotImplementedError, ValueError):
            port.exclusive = True
        port.open()
        connection = getattr(port, "_socket", None)
        if isinstance(
            connection, socket.socket
        ):  # otherwise a short message waits for the one before to be confirmed
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except (OSError, ValueError, AttributeError) as error:
        raise RobotError(f"{name} cannot be opened: {error}. {_advice(name, error)}") from error
    return port


def _advice(name: str, error: Exception) -> str:
    number, text = getattr(error, "errno", None), str(error).lower()
    if number in (errno.EAGAIN, errno.EBUSY) or "busy" in text or "exclusively lock" in text:
        return "Another program has the port: quit Thymio Suite, which holds it while it runs, and try again."
    if "access is denied" in text:
        return "Another program may have the port: quit Thymio Suite and try again."
    if "permission" in text or "denied" in text:
        return "May this account use it? On Linux: sudo usermod -aG dialout $USER, then log in again."
    if "://" in name:
        return "Is the address right, and does a playground listen there?"
    return "Is the robot or its dongle plugged in? `realitygap robot list` names the ports."


@dataclass(frozen=True)
class Description:
    """A robot as it describes itself.

    Attributes:
        name: Its name, such as thymio-II.
        node: Its number.
        variables: Offset and number of words of each variable, by name.
        events: Names of its events.
        first_free: Offset of the first word after its variables.
        room: Words that a program may have.
    """

    name: str
    node: int
    variables: dict[str, tuple[int, int]]
    events: tuple[str, ...]
    first_free: int
    room: int

    @property
    def offsets(self) -> dict[str, int]:
        """Offset of each variable."""
        return {name: offset for name, (offset, _) in self.variables.items()}


class Link:
    """Questions and commands to the one robot behind a port.

    Args:
        port: An open port of pyserial.
        name: Its name, for messages.
    """

    def __init__(self, port: Any, name: str) -> None:
        self.port = port
        self.name = name
        self.lock = threading.RLock()
        self.is_open = True
        self.tell: Tell | None = None
        self._guardian: Guardian | None = None
        self._decoder = Decoder()

    def find(self) -> Description:
        """Find the robot behind the port and read its description.

        Raises:
            RobotError: No robot answers, several do, or it is not a Thymio.
        """
        with self.lock:
            present: set[int] = set()

            def add(message: Message) -> bool:
                if message.kind == Kind.NODE_PRESENT:
                    messages.node_present(message)
                    present.add(message.source)
                return bool(present)

            self._send(messages.list_nodes())
            if not self._listen(add, ANSWER_S):
                raise RobotTimeout(
                    f"No Thymio answers on {self.name}. Is the robot on, and paired with the dongle? "
                    "Is this the port of a Thymio, and does no other program use it? `realitygap robot list` names "
                    "the ports."
                )
            self._listen(lambda message: add(message) and False, OTHERS_S)
            if len(present) > 1:
                raise RobotError(
                    f"{len(present)} robots answer on {self.name}: nodes {', '.join(map(str, sorted(present)))}. "
                    "Switch off all but one."
                )
            return self._describe(present.pop())

    def _describe(self, node: int) -> Description:
        found: list[messages.Head] = []
        variables: dict[str, tuple[int, int]] = {}
        events: list[str] = []
        end = 0

        def add(message: Message) -> bool:
            nonlocal end
            if message.source != node:
                return False
            if message.kind == Kind.DESCRIPTION:
                found[:] = [messages.head(message.payload)]
            elif message.kind == Kind.NAMED_VARIABLE:
                size, name = messages.named_variable(message.payload)
                variables[name] = end, size
                end += size
            elif message.kind == Kind.LOCAL_EVENT:
                events.append(messages.local_event(message.payload))
            return bool(found) and len(variables) >= found[0].n_variables and len(events) >= found[0].n_events

        self._send(messages.get_description(node))
        if not self._listen(add, ANSWER_S, for_each=True):
            raise RobotTimeout(f"The robot on {self.name} did not describe itself to the end. Is it near?")
        head = found[0]
        if not head.name.lower().startswith("thymio"):
            raise RobotError(f"The robot on {self.name} is {head.name!r}, expected a Thymio II.")
        if end + len(OWN) > head.variables:
            raise RobotError(f"The robot on {self.name} has no room for the variables of the safety program.")
        return Description(head.name, node, variables, tuple(events), end, head.bytecode)

    def load(self, robot: Description) -> None:
        """Stop the motors, and load and start the safety program.

        Raises:
            RobotError: The robot has no room for it, or does not answer.
        """
        program = safety_program(robot.offsets, robot.events, robot.first_free)
        if len(program) > robot.room:
            raise RobotError(
                f"The safety program has {len(program)} words; the robot has room for {robot.room}."
            )
        with self.lock:
            for start in range(0, len(program), MOST_PROGRAM_WORDS):
                part = program[start : start + MOST_PROGRAM_WORDS]
                self._send(messages.set_bytecode(robot.node, start, part))
            self._send(messages.control(Kind.RESET, robot.node))
            self._send(messages.control(Kind.RUN, robot.node))

    def read(self, robot: Description, *spans: Span) -> list[tuple[int, ...]]:
        """Return words of the robot's variables, of all spans in one round trip.

        Raises:
            RobotError: It does not answer, or the link is lost.
        """
        with self.lock:
            for attempt in range(ONCE_MORE):
                try:
                    return self._read(robot, spans)
                except (ProtocolError, RobotTimeout):
                    if attempt == ONCE_MORE - 1:
                        raise
            raise AssertionError

    def _read(self, robot: Description, spans: Sequence[Span]) -> list[tuple[int, ...]]:
        values: dict[int, int] = {}
        wanted = {offset + k for offset, count in spans for k in range(count)}

        def add(message: Message) -> bool:
            if message.kind == Kind.VARIABLES and message.source == robot.node:
                start, part = messages.variables(message.payload)
                if start in wanted and start + len(part) - 1 in wanted:
                    values.update(enumerate(part, start))
            return wanted <= values.keys()

        questions = [
            messages.get_variables(robot.node, start, min(MOST_READ, offset + count - start))
            for offset, count in spans
            for start in range(offset, offset + count, MOST_READ)
        ]
        self._send(b"".join(questions))
        if not self._listen(add, ANSWER_S):
            raise RobotTimeout(
                f"The Thymio on {self.name} does not answer. Is it on and near? If it was driving, its program stops "
                "it when the last command ends."
            )
        return [tuple(values[offset + k] for k in range(count)) for offset, count in spans]

    def write(self, robot: Description, offset: int, values: Sequence[int]) -> None:
        """Set words of the robot's variables."""
        with self.lock:
            self._send(messages.set_variables(robot.node, offset, values))

    def emit(self, event: int, values: Sequence[int]) -> None:
        """Send a user event."""
        with self.lock:
            self._send(messages.user_event(event, values))

    def reset(self, robot: Description) -> None:
        """End the program on board."""
        with self.lock:
            self._send(messages.control(Kind.RESET, robot.node))

    def send(self, data: bytes) -> None:
        """Send messages that nobody answers."""
        with self.lock:
            self._send(data)

    def guard(self, stop: bytes) -> None:
        """Have another process stop the motors if this one is killed or frozen, if the port can be inherited.

        Args:
            stop: Messages that stop the motors.

        Raises:
            RobotError: It cannot be started.
        """
        descriptor = descriptor_of(self.port)
        if descriptor is not None:
            self._stop, self._guardian = stop, Guardian(descriptor, self._replace_guardian, stop)

    def _replace_guardian(self) -> None:
        """Stop the motors, as nobody would now if this program were killed, and start another guardian."""
        with self.lock:
            if self.is_open and self._guardian is not None:
                self._guardian.end()
                self._guardian = None
                with contextlib.suppress(RobotError):
                    self._send(self._stop)
                    self.guard(self._stop)

    def expect_motion(self) -> None:
        """Tell the guardian that the motors will run.

        Raises:
            RobotError: It does not answer, or it stopped the motors since the last call.
        """
        if self._guardian is not None:
            if self._guardian.has_stopped_motors():
                raise RobotError(f"This program was silent for {SILENT_S:g} s, so the motors were stopped.")
            self._guardian.expect_motion()

    def expect_rest(self) -> None:
        """Tell the guardian that the motors are off."""
        if self._guardian is not None:
            self._guardian.expect_rest()

    def close(self) -> None:
        """Close the port; safe to call twice. This does not stop the motors."""
        with self.lock:
            self.is_open = False
            if self._guardian is not None:
                self._guardian.end()
                self._guardian = None
            with contextlib.suppress(OSError, ValueError, AttributeError, TypeError):
                self.port.close()

    def _send(self, data: bytes) -> None:
        try:
            self.port.write(data)
        except (OSError, ValueError, AttributeError, TypeError) as error:
            raise RobotError(self._lost(error)) from error
        if self.tell is not None:
            self.tell("send", data, b"")

    def _listen(self, take: Callable[[Message], bool], seconds: float, *, for_each: bool = False) -> bool:
        """Give messages to `take` until it returns True; return whether it did in time.

        With `for_each`, the time begins again with each message.
        """
        until = time.monotonic() + seconds
        last = until + 3.0
        while True:
            message = self._decoder.next()
            if message is not None:
                if take(message):
                    return True
                if for_each:
                    until = min(time.monotonic() + seconds, last)
                continue
            if time.monotonic() > until:
                self._decoder.clear()
                return False
            try:
                data = self.port.read(max(getattr(self.port, "in_waiting", 1), self._decoder.missing))
            except (OSError, ValueError, AttributeError, TypeError) as error:
                raise RobotError(self._lost(error)) from error
            self._decoder.feed(data)
            if self.tell is not None and data:
                self.tell("receive", b"", data)

    def _lost(self, error: Exception) -> str:
        return (
            f"The link to the Thymio on {self.name} is lost: {error}. Was the dongle or the cable pulled, or has "
            "another program connected? Its program stops it when the last command ends."
        )
