"""A plain Thymio behind a port, on a clock of its own, for the wire and the faults that befall it."""

from __future__ import annotations

from dataclasses import dataclass, field

from realitygap.errors import RobotError
from realitygap.families.thymio import _messages as messages
from realitygap.families.thymio._messages import Decoder, Kind, Message
from realitygap.families.thymio._program import CHECK, DRIVE, OWN, TICK_S

from ...robots.ports import Wire, WiredPort

VARIABLES = {
    "_id": 1,
    "event.source": 1,
    "event.args": 32,
    "_fwversion": 2,
    "button.center": 1,
    "prox.horizontal": 7,
    "prox.ground.delta": 2,
    "motor.left.target": 1,
    "motor.right.target": 1,
    "motor.left.speed": 1,
    "motor.right.speed": 1,
    "timer.period": 2,
}
OFFSETS = {name: sum(list(VARIABLES.values())[:k]) for k, name in enumerate(VARIABLES)}
EVENTS = ("button.center", "prox", "tap", "motor", "timer0")
FIRST_FREE = sum(VARIABLES.values())
PROX = (0, 1000, 2000, 3000, 4505, 10, -1)
LEFT, RIGHT = OFFSETS["motor.left.target"], OFFSETS["motor.right.target"]


def text(word: str) -> bytes:
    return bytes([len(word)]) + word.encode()


@dataclass
class FakeThymio:
    """A robot that answers by the protocol; it does not run bytecode, but what the safety program says."""

    node: int = 1
    memory: list[int] = field(default_factory=lambda: [0] * (FIRST_FREE + 512))
    program: dict[int, int] = field(default_factory=dict)
    runs: bool = False
    started_s: float = 0.0
    until_s: float = 0.0
    commands: list[tuple[int, int]] = field(default_factory=list)
    decoder: Decoder = field(default_factory=Decoder)

    def receive(self, byte: int, now: float) -> bytes:
        self.decoder.feed(bytes([byte]))
        try:
            message = self.decoder.next()
        except RobotError:
            return b""
        return b"" if message is None else self.answer(message, now)

    def motors(self, now: float) -> tuple[int, int]:
        self.tick(now)
        return self.memory[LEFT], self.memory[RIGHT]

    def tick(self, now: float) -> None:
        if self.runs and now >= self.until_s:
            self.memory[FIRST_FREE] = self.memory[LEFT] = self.memory[RIGHT] = 0
        if self.runs:
            self.memory[FIRST_FREE + OWN.index("clock")] = round((now - self.started_s) / TICK_S) & 0x7FFF
        first = OFFSETS["prox.horizontal"]
        self.memory[first : first + 7] = PROX
        self.memory[OFFSETS["_fwversion"]] = 11

    def answer(self, message: Message, now: float) -> bytes:
        self.tick(now)
        if message.kind == DRIVE:
            args = messages.signed_words(message.payload.ljust(8, b"\0")[:8])
            if (CHECK + sum(args[:3]) - args[3]) % 0x10000 == 0:
                self.drive(args[:3], now)
            return b""
        if message.kind == Kind.LIST_NODES:
            return Message(self.node, Kind.NODE_PRESENT, messages.words([5])).encoded()
        if message.payload[:2] != messages.words([self.node]) or len(message.payload) % 2:
            return b""
        rest = messages.signed_words(message.payload)[1:]
        if message.kind == Kind.GET_NODE_DESCRIPTION:
            return b"".join(each.encoded() for each in self.description())
        if message.kind == Kind.GET_VARIABLES and len(rest) == 2:
            values = self.memory[rest[0] : rest[0] + rest[1]]
            return Message(self.node, Kind.VARIABLES, messages.words([rest[0], *values])).encoded()
        if message.kind == Kind.SET_VARIABLES and rest:
            for k, value in enumerate(rest[1:], rest[0]):
                if 0 <= k < len(self.memory):
                    self.memory[k] = value
        elif message.kind == Kind.SET_BYTECODE and rest:
            self.program |= {k: value & 0xFFFF for k, value in enumerate(rest[1:], rest[0])}
        elif message.kind == Kind.RESET:
            self.runs = False
            self.memory[:] = [0] * len(self.memory)
        elif message.kind == Kind.RUN:
            self.runs, self.started_s = True, now
        return b""

    def drive(self, values: tuple[int, ...], now: float) -> None:
        if self.runs and not self.memory[FIRST_FREE + OWN.index("halted")]:
            self.memory[LEFT], self.memory[RIGHT], self.memory[FIRST_FREE] = values
            self.until_s = now + values[2] * TICK_S
            self.commands.append(values[:2])

    def description(self) -> list[Message]:
        sizes = [5, 1534, 32, len(self.memory), len(VARIABLES), len(EVENTS), 0]
        return [
            Message(self.node, Kind.DESCRIPTION, text("thymio-II") + messages.words(sizes)),
            *(
                Message(self.node, Kind.NAMED_VARIABLE, messages.words([size]) + text(name))
                for name, size in VARIABLES.items()
            ),
            *(Message(self.node, Kind.LOCAL_EVENT, text(name) + text("")) for name in EVENTS),
        ]


class FakePort(WiredPort):
    """A `FakeThymio` at the other end of a wire."""

    write_s = 0.001

    def __init__(self, robot: FakeThymio | None = None, wire: Wire | None = None) -> None:
        super().__init__(robot or FakeThymio(), wire)
        self.timeout = 0.02
