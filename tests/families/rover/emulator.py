"""The emulator: a point that drives through walls, and sees nothing."""

import math

from realitygap.emulator import SECOND, EmulatedPort, EmulatedRobot, open_arena
from realitygap.emulator.command import ArenaOption, QuietOption, TcpOption, WitnessOption, serve
from realitygap.world import Arena, Pose

TICK = SECOND // 100


class EmulatedRover(EmulatedRobot):
    identity = "rover"

    def __init__(self, arena: Arena) -> None:
        self.arena, self._now, self._asked, self._answers = arena, 0, b"", b""
        self.place(arena.start, 0)

    @property
    def now_ns(self) -> int:
        return self._now

    def place(self, pose: Pose, seed: int) -> None:
        super().place(pose, seed)
        self._wheels = (0.0, 0.0)

    def advance_to(self, when: int) -> None:
        while self._now + TICK <= when:
            self._now += TICK
            left, right = (speed * TICK / SECOND for speed in self._wheels)
            x, y, heading = self.pose
            way, turn = (left + right) / 2, (right - left) / 0.14
            self.move_to(Pose(x + way * math.cos(heading), y + way * math.sin(heading), heading + turn))

    def next_event(self, wanted: int = 1) -> int | None:
        return self._now if len(self._answers) >= wanted else None

    def receive(self, data: bytes) -> None:
        self._asked += data
        while len(self._asked) >= 3:
            (kind, *speeds), self._asked = self._asked[:3], self._asked[3:]
            if kind == ord("m"):
                self._wheels = (0.002 * (speeds[0] - 100), 0.002 * (speeds[1] - 100))
            self._answers += b"\0\0\0"

    def transmit(self) -> bytes:
        answers, self._answers = self._answers, b""
        return answers

    def wheel_speeds(self) -> tuple[float, float]:
        return self._wheels


class RoverPort(EmulatedPort):
    def make_robot(self, host, options) -> EmulatedRover:
        return EmulatedRover(open_arena(options.get("arena", "paper")))


def emulate(
    arena: ArenaOption = "paper",
    tcp: TcpOption = None,
    witness: WitnessOption = None,
    quiet: QuietOption = False,
) -> None:
    """Emulate a Rover.

    Example: realitygap emulate rover --tcp 0
    """
    serve(EmulatedRover(open_arena(arena)), tcp=tcp, witness=witness)
