"""The program on board, which stops the motors when commands stop arriving.

Neither the firmware nor Aseba's playground stops the motors when the host is gone. So every command has a life, counted
on board in ticks of 20 ms. In Aseba's notation:

    timer.period[0] = 20
    onevent drive                  # user event 0: left, right, life, check
      if event.args[0] + event.args[1] + event.args[2] + 1234 == event.args[3] then
        if halted == 0 then
          motor.left.target = event.args[0]  motor.right.target = event.args[1]  life = event.args[2]
        end
      end
    onevent timer0
      clock = clock + 1
      if life > 0 then life = life - 1 end
      if life == 0 then motor.left.target = 0  motor.right.target = 0 end
    onevent button.center
      halted = 1  motor.left.target = 0  motor.right.target = 0
    onevent tap
      taps = taps + 1
    onevent motor                  # 100 times a second: sums of 16 bits, which begin again at -32768
      left_sum = left_sum + motor.left.speed  right_sum = right_sum + motor.right.speed

Source of the words: aseba-community/aseba, `aseba/common/consts.h` and `aseba/vm/vm.c`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from realitygap.errors import RobotError

DRIVE = 0
"""User event that sets both motors, for a life in ticks; its last value is the sum of the others and `CHECK`."""
CHECK = 1234
"""First value of the check sum of a command's values. A command that is shifted by a byte has another sum."""
TICK_S = 0.02
"""Duration of a tick of the program's clock [s]."""
OWN = ("life", "halted", "taps", "left_sum", "right_sum", "clock")
"""Variables of the program, one word each, in the order of the robot's memory."""
INIT_EVENT = 0xFFFF
FIRST_LOCAL_EVENT = 0xFFFE
NEEDED_EVENTS = ("timer0", "button.center", "tap", "motor")
NEEDED_VARIABLES = (
    *("event.args", "timer.period", "motor.left.target", "motor.right.target"),
    *("motor.left.speed", "motor.right.speed"),
)
_ADD, _SUBTRACT, _EQUAL, _GREATER = 0x2, 0x3, 0xA, 0xC
_STOP = 0x0000


def with_sum(values: Sequence[int]) -> tuple[int, ...]:
    """Return the values of a user event with the sum of 16 bits that the program on board expects after them."""
    return (*values, (CHECK + sum(values) + 0x8000) % 0x10000 - 0x8000)


def assemble(handlers: Sequence[tuple[int, Sequence[int]]]) -> list[int]:
    """Return the words of a program: a table of events and addresses, then the code of each event."""
    address = 1 + 2 * len(handlers)
    table, code = [address], list[int]()
    for event, body in handlers:
        table += [event, address + len(code)]
        code += [*body, _STOP]
    return table + code


def safety_program(offsets: Mapping[str, int], events: Sequence[str], first_free: int) -> list[int]:
    """Return the words of the program for a robot.

    Args:
        offsets: Offset of each of the robot's variables [words].
        events: Names of its local events in the order of its description.
        first_free: Offset of the first word after the robot's variables.

    Raises:
        RobotError: The robot lacks a variable or an event that the program needs.
    """
    missing = [name for name in NEEDED_VARIABLES if name not in offsets]
    missing += [name for name in NEEDED_EVENTS if name not in events]
    if missing:
        raise RobotError(f"The robot lacks {', '.join(missing)}: is it a Thymio II with its own firmware?")
    life, halted, taps, left_sum, right_sum, clock = (first_free + k for k in range(len(OWN)))
    left, right, args = offsets["motor.left.target"], offsets["motor.right.target"], offsets["event.args"]
    halt = _put(0, left) + _put(0, right)
    take = _copy(args, left) + _copy(args + 1, right) + _copy(args + 2, life)
    count_down = _only_if(life, _GREATER, _change(life, _SUBTRACT)) + _only_if(life, _EQUAL, halt)
    sums = _increase(left_sum, offsets["motor.left.speed"]) + _increase(
        right_sum, offsets["motor.right.speed"]
    )
    zeros = [word for k in range(len(OWN)) for word in _put(0, first_free + k)]

    def local(name: str) -> int:
        return FIRST_LOCAL_EVENT - events.index(name)

    return assemble(
        [
            (INIT_EVENT, zeros + _put(round(TICK_S * 1000), offsets["timer.period"]) + halt),
            (DRIVE, _only_if_sum(args, _only_if(halted, _EQUAL, take))),
            (local("timer0"), _change(clock, _ADD) + count_down),
            (local("button.center"), _put(1, halted) + halt),
            (local("tap"), _change(taps, _ADD)),
            (local("motor"), sums),
        ]
    )


def _push(number: int) -> int:
    return 0x1000 | (number & 0xFFF)


def _load(offset: int) -> int:
    return 0x3000 | offset


def _store(offset: int) -> int:
    return 0x4000 | offset


def _put(number: int, offset: int) -> list[int]:
    return [_push(number), _store(offset)]


def _copy(source: int, target: int) -> list[int]:
    return [_load(source), _store(target)]


def _change(offset: int, operation: int) -> list[int]:
    """Return the words that add 1 to a variable, or subtract 1 from it."""
    return [_load(offset), _push(1), 0x8000 | operation, _store(offset)]


def _increase(offset: int, by: int) -> list[int]:
    """Return the words that add a variable to another."""
    return [_load(offset), _load(by), 0x8000 | _ADD, _store(offset)]


def _only_if(offset: int, comparison: int, body: Sequence[int]) -> list[int]:
    """Return the words that run a body if a variable compares with 0; the distance counts from the branch."""
    return [_load(offset), _push(0), 0xA000 | comparison, len(body) + 2, *body]


def _only_if_sum(args: int, body: Sequence[int]) -> list[int]:
    """Return the words that run a body if three variables and the constant add up to the fourth."""
    total = [_push(CHECK)]
    for k in range(3):
        total += [_load(args + k), 0x8000 | _ADD]
    return [*total, _load(args + 3), 0xA000 | _EQUAL, len(body) + 2, *body]
