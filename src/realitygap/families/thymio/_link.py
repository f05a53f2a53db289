"""The link to a Thymio: messages over a serial port or TCP, with one question at a time."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from realitygap.errors import ProtocolError, RobotError, RobotTimeout
from realitygap.robots import SILENT_S as FROZEN_S
from realitygap.robots import Guardian, Port, descriptor_of

from . import _messages as messages
from ._messages import Decoder, Kind, Message
from ._ports import POLL_S
from ._program import OWN, safety_program, with_sum

T = TypeVar("T")

ANSWER_S = 0.8
"""Time in which a robot has to answer [s]."""
OTHERS_S = 0.1
"""Time in which other robots on a dongle may name themselves after the first [s]."""
ONCE_MORE = 2
"""Attempts to read variables: reading them again is safe."""
WRITE_TRIES = 3
MOST_READ = 40
"""Largest number of words in a question; the firmware sends at most 47 in one answer."""
MOST_MORE = 7
"""Words by which a question may be longer, to tell its answer from late ones."""
LATE_S = 5.0
"""Time after which an answer is not expected any more [s]."""
SILENT_S = 0.06
"""Silence after which a message begins [s]."""
MOST_DROPPED = 4096
"""Pieces of what has arrived that are dropped at most before a question."""
MOST_NOISE_S = 0.5
"""Longest wait for silence [s]."""
MOST_ADDRESS = 0xFFF
"""Largest offset that a word of bytecode has room for."""
MOST_PROGRAM_WORDS = 200
"""Words of a program in one message; a message has room for 256."""
Span = tuple[int, int]
"""Offset and number of words."""
Tell = Callable[[str, bytes, bytes], None]
"""A function that gets an event, the bytes sent, and the bytes received."""


@dataclass(frozen=True)
class Description:
    """A robot as it describes itself.

    Attributes:
        name: Name, such as thymio-II.
        node: Number of the node.
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
        name: Name for messages.
    """

    def __init__(self, port: Port, name: str) -> None:
        self.port = port
        self.name = name
        self.lock = threading.RLock()
        self.is_open = True
        self.tell: Tell | None = None
        self._guardian: Guardian | None = None
        self._decoder = Decoder()
        self._late: dict[Span, float] = {}

    def find(self) -> Description:
        """Find the robot behind the port and read its description.

        Raises:
            RobotError: No robot answers, several do, or it is not a Thymio.
        """
        with self.lock:
            return self._try_again(lambda: self._describe(self._node()))

    def _try_again(self, ask: Callable[[], T]) -> T:
        """Ask; once more if the answer is missing or damaged, when no bytes arrive any more."""
        for _ in range(ONCE_MORE - 1):
            with contextlib.suppress(ProtocolError, RobotTimeout):
                return ask()
            self._wait_for_silence()
        return ask()

    def _node(self) -> int:
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
                "Is this the port of a Thymio, and does no other program use it? `realitygap robot list` names the "
                "ports."
            )
        self._listen(lambda message: add(message) and False, OTHERS_S)
        if len(present) > 1:
            raise RobotError(
                f"{len(present)} robots answer on {self.name}: nodes {', '.join(map(str, sorted(present)))}. "
                "Switch off all but one."
            )
        return present.pop()

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
                # what came before belongs to a late description
                found[:] = [messages.head(message.payload)]
                variables.clear()
                events.clear()
                end = 0
            elif not found:
                return False
            elif message.kind == Kind.NAMED_VARIABLE:
                size, name = messages.named_variable(message.payload)
                if name in variables:
                    raise ProtocolError(f"The robot on {self.name} described {name!r} twice.")
                variables[name] = end, size
                end += size
            elif message.kind == Kind.LOCAL_EVENT:
                events.append(messages.local_event(message.payload))
            counts = (len(variables), len(events))
            if counts[0] > found[0].n_variables or counts[1] > found[0].n_events:
                raise ProtocolError(f"The robot on {self.name} described more than it announced.")
            return counts == (found[0].n_variables, found[0].n_events)

        self._send(messages.get_description(node))
        if not self._listen(add, ANSWER_S, for_each=True):
            raise RobotTimeout(f"The robot on {self.name} did not describe itself to the end. Is it near?")
        head = found[0]
        if not head.name.lower().startswith("thymio"):
            raise RobotError(f"The robot on {self.name} is {head.name!r}, expected a Thymio II.")
        if end + len(OWN) > min(head.variables, MOST_ADDRESS + 1):
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
            return self._try_again(lambda: self._read(robot, spans))

    def _read(self, robot: Description, spans: Sequence[Span]) -> list[tuple[int, ...]]:
        values: dict[int, int] = {}
        asked: set[Span] = set()

        def add(message: Message) -> bool:
            if message.kind == Kind.VARIABLES and message.source == robot.node:
                start, part = messages.variables(message.payload)
                span = (start, len(part))
                if span in asked:
                    asked.remove(span)
                    values.update(enumerate(part, start))
                self._late.pop(span, None)
            return not asked

        self._drop()
        for offset, count in spans:
            for start in range(offset, offset + count, MOST_READ):
                asked.add(self._span(start, min(MOST_READ, offset + count - start)))
        try:
            self._send(b"".join(messages.get_variables(robot.node, *span) for span in sorted(asked)))
            if not self._listen(add, ANSWER_S):
                raise RobotTimeout(
                    f"The Thymio on {self.name} does not answer. Is it on and near? If it was driving, its program "
                    "stops it when the last command ends."
                )
        finally:
            self._late |= dict.fromkeys(asked, time.monotonic())
        self._check_end()
        return [tuple(values[offset + k] for k in range(count)) for offset, count in spans]

    def _span(self, start: int, count: int) -> Span:
        """Return offset and count of a question whose answer differs from all answers that may still arrive late."""
        now = time.monotonic()
        self._late = {span: asked_s for span, asked_s in self._late.items() if now - asked_s < LATE_S}
        for more in range(MOST_MORE + 1):
            span = (start - min(more, start), count + more)
            if span not in self._late:
                return span
        raise RobotTimeout(f"The Thymio on {self.name} has not answered many times. Is it on and near?")

    def write(self, robot: Description, offset: int, values: Sequence[int]) -> None:
        """Set words of the robot's variables and read them back.

        Raises:
            RobotError: They are not set, the robot does not answer, or the link is lost.
        """
        with self.lock:
            for _ in range(WRITE_TRIES):
                self._send(messages.set_variables(robot.node, offset, values))
                if self.read(robot, (offset, len(values))) == [tuple(values)]:
                    return
            raise RobotError(
                f"The Thymio on {self.name} does not accept values. Quit other programs that use it, and try "
                "again."
            )

    def emit(self, event: int, values: Sequence[int]) -> None:
        """Send a user event with a sum, by which the program on board knows damaged ones."""
        with self.lock:
            self._send(messages.user_event(event, with_sum(values)))

    def reset(self, robot: Description) -> None:
        """End the program on board."""
        with self.lock:
            self._send(messages.control(Kind.RESET, robot.node))

    def send(self, data: bytes) -> None:
        """Send messages that have no answer."""
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
        """Stop the motors, which would otherwise turn on if this program were killed, and start another guardian."""
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
                raise RobotError(f"This program was silent for {FROZEN_S:g} s, so the motors were stopped.")
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
                return False
            self._decoder.feed(self._receive())

    def _drop(self) -> None:
        """Drop the messages that have arrived; none of them answers what is asked next."""
        for _ in range(MOST_DROPPED):
            if not self._waiting():
                break
            self._decoder.feed(self._receive())
        while self._decoder.next() is not None:
            pass
        if not self._decoder.is_empty:
            self._wait_for_silence()

    def _check_end(self) -> None:
        """Raise an error if bytes follow that are no message: then a byte was added to the answer before them."""
        if self._waiting() or not self._decoder.is_empty:
            self._listen(lambda message: self._decoder.is_empty, POLL_S)
            if not self._decoder.is_empty:
                raise ProtocolError(
                    f"The Thymio on {self.name} sent bytes after its answer that are no message."
                )

    def _wait_for_silence(self) -> None:
        """Drop all bytes until none arrives, so that the next one begins a message."""
        until = time.monotonic() + MOST_NOISE_S
        heard_s = time.monotonic()
        while time.monotonic() < min(until, heard_s + SILENT_S):
            if self._receive():
                heard_s = time.monotonic()
        self._decoder.clear()

    def _waiting(self) -> int:
        """Return the number of bytes that have arrived."""
        try:
            return int(getattr(self.port, "in_waiting", 0))
        except (OSError, ValueError, TypeError) as error:
            raise RobotError(self._lost(error)) from error

    def _receive(self) -> bytes:
        """Return bytes that have arrived, or arrive within `POLL_S`."""
        n = max(self._waiting(), self._decoder.missing)
        try:
            data = bytes(self.port.read(n))
        except (OSError, ValueError, AttributeError, TypeError) as error:
            raise RobotError(self._lost(error)) from error
        if self.tell is not None and data:
            self.tell("receive", b"", data)
        return data

    def _lost(self, error: Exception) -> str:
        return (
            f"The link to the Thymio on {self.name} is lost: {error}. Was the dongle or the cable pulled, or has "
            "another program connected? Its program stops it when the last command ends."
        )
