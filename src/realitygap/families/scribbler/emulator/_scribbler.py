"""The firmware of the driving robot: packets of nine bytes, echoed and answered.

Source: scribbler_server.bs2 (S1, 2.6.2) and ipre_s2_port.spin (S2, 1.1.5) of Myro's repository.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Literal, Protocol

from realitygap.emulator import MILLISECOND, SECOND, nanoseconds
from realitygap.families.scribbler.opcodes import PACKET, Op

from ._memory import Memory
from ._motors import S2Motors, Segment
from ._reckoning import Reckoning
from ._senses import S1_DARKEST, S2_DARKEST, Senses
from ._table import Table

Model = Literal["s1", "s2"]
Send = Callable[[bytes, int, bool], None]  # bytes, from when on, whether they are an echo
Setter = Callable[[bytes, int], int | list[Segment] | None]  # packet, time; how long it takes, or motions

INFO = {
    "s1": b"Robot-Version:2.6.2,Robot:Scribbler,Mode:Serial\n",
    "s2": b"Robot-Version:1.1.5,Robot:Scribbler2,Mode:Serial\n",
}
BYTE_NS = nanoseconds(10 / 38400)  # on the robot's line
HALF_PACKET_NS = SECOND
EEPROM_NS = 5 * MILLISECOND  # to write a byte
BOOT_NS = {"s1": nanoseconds(0.5), "s2": nanoseconds(0.8)}  # until it listens after a reset; chosen
IR_NS = {"s1": nanoseconds(0.001), "s2": nanoseconds(0.0013)}  # a side
LIGHT_NS = {"s1": nanoseconds(0.006), "s2": 0}  # a sensor in a lit room
DISTANCE_NS = nanoseconds(0.024)
INFO_NS = 2 * MILLISECOND
RETRY_NS = 20 * MILLISECOND  # between attempts to hand on a motion
RESET_ECHO = 2  # bytes of the echo that an S2 still sends before it restarts
MOST_PACKETS = 64  # that wait for a busy S2; more are lost

SIDES = {Op.GET_LIGHT_LEFT: 0, Op.GET_LIGHT_CENTER: 1, Op.GET_LIGHT_RIGHT: 2}
EEPROM_READS = {Op.GET_NAME1, Op.GET_NAME2, Op.GET_PASS1, Op.GET_PASS2, Op.GET_DATA}
LEDS = {
    Op.SET_LED_LEFT_ON: (0b100, 0b111),
    Op.SET_LED_LEFT_OFF: (0, 0b011),
    Op.SET_LED_CENTER_ON: (0b010, 0b111),
    Op.SET_LED_CENTER_OFF: (0, 0b101),
    Op.SET_LED_RIGHT_ON: (0b001, 0b111),
    Op.SET_LED_RIGHT_OFF: (0, 0b110),
    Op.SET_LED_ALL_ON: (0b111, 0b111),
    Op.SET_LED_ALL_OFF: (0, 0),
}
"""Bits that each LED command sets, and a mask of the bits that it keeps: left, center, right."""


class Schedule(Protocol):
    """`Emulator.schedule`."""

    def __call__(
        self, when: int, act: Callable[[int], None], is_due: Callable[[], bool] | None = None
    ) -> None: ...


class Scribbler:
    """An S1 or S2 behind its serial line.

    Args:
        model: Model of the robot.
        table: Table with its body and motors.
        senses: Senses with its readings.
        memory: Memory.
        schedule: Calls back at a time [ns].
        send: Takes what it sends.
        timing: True if bytes, tones and sensors take their time.
    """

    def __init__(
        self,
        model: Model,
        table: Table,
        senses: Senses,
        memory: Memory,
        schedule: Schedule,
        send: Send,
        *,
        timing: bool,
    ) -> None:
        self.model = model
        self.table, self.senses, self.memory = table, senses, memory
        self._schedule, self._send = schedule, send
        self._timing = timing
        self._readers = self._all_readers()
        self._setters = self._all_setters()
        self._epoch = 0  # counts resets; what was begun before one is forgotten
        self._is_taking = False
        self._motions = 0  # counts how often motions were dropped
        self._wake(0)

    def _wake(self, now: int) -> None:
        """Begin as after switching on."""
        self._epoch += 1
        self._partial = bytearray()
        self._last_byte = now
        self._packets: deque[tuple[int, bytes]] = deque()
        self._busy = False
        self._busy_until = 0
        self._deaf_until = now
        self._leds = 0
        self._idle_since = now
        self.reckoning = Reckoning()
        self.echo = self.memory.echo
        self.last_command = b""
        self.tone: tuple[int, int, int] | None = None  # Hz, Hz, until
        self.table.motors.stop()
        if isinstance(self.table.motors, S2Motors):
            self.table.motors.tripped = False
            self.table.motors.encoders = [0.0, 0.0]
        self._announces = bool(self.memory.broadcast)
        if self._announces:
            self._later(now, self._announce)

    def reset(self, now: int) -> None:
        """Restart, as its button, its reset line or SOFT_RESET do."""
        self.table.advance_to(now)
        self._wake(now)
        self._deaf_until = now + (BOOT_NS[self.model] if self._timing else 0)

    def _later(self, when: int, act: Callable[[int], None]) -> None:
        """Do something at a time, unless the robot is reset before."""
        epoch = self._epoch

        def unless_reset(now: int) -> None:
            if epoch == self._epoch:
                act(now)

        self._schedule(when, unless_reset)

    def _announce(self, now: int) -> None:
        """Send the name once a second until the first command."""
        if self._announces:
            self._send(b"IPRE" + bytes(self.memory.name[:9]) + b"\0", now, False)
            self._later(now + SECOND, self._announce)

    @property
    def busy(self) -> bool:
        """True if a command is being executed."""
        return self._busy

    # receiving

    def receive(self, byte: int, at: int) -> None:
        """Take a byte that has arrived at a time, not before the byte before."""
        if self.model == "s1":
            self._send(bytes((byte,)), at, True)  # its line echoes by itself
            if self._busy or at < self._busy_until:
                return  # it does not listen while it works
        if at < self._deaf_until:
            return
        if self._partial and at - self._last_byte > HALF_PACKET_NS:
            self._partial.clear()
        self._partial.append(byte)
        self._last_byte = at
        if len(self._partial) == PACKET:
            if len(self._packets) < MOST_PACKETS:
                self._packets.append((at, bytes(self._partial)))
            self._partial.clear()
            self._take_next(at)

    def _take_next(self, now: int) -> None:
        """Execute the waiting packets one after another until one of them takes time."""
        if self._is_taking:
            return  # called from within the loop below, which continues
        self._is_taking = True
        try:
            while self._packets and not self._busy:
                self._busy = True
                at, packet = self._packets.popleft()
                self._later(max(at, now), partial(self._execute, packet))
        finally:
            self._is_taking = False

    def _execute(self, packet: bytes, now: int) -> None:
        """Execute a command and send the answer when it is done."""
        self.table.advance_to(now)
        if getattr(self.table.motors, "tripped", False):
            self._busy = False
            return  # too much current has stopped everything
        self._announces = False
        self._blink(now)
        self.last_command = packet
        code = packet[0]
        if code == Op.SOFT_RESET:
            if self.model == "s2":
                self._send(packet[:RESET_ECHO], now, True)
            self.reset(now)
            return
        if self.model == "s2" and code != Op.GET_INFO:
            self._send(packet, now, True)
        reader = self._readers.get(code)
        if reader is not None:
            duration, read = reader
            self._finish_after(duration, packet, lambda: read(packet), now)
            return
        setter = self._setters.get(code)
        if setter is None:
            self._finish_after(0, packet, bytes, now)
            return
        work = setter(packet, now)
        if isinstance(work, list):
            self._hand_on(work, packet, self._motions, now)
        else:
            self._finish_after((work or 0) + self._block_ns, packet, self._sensor_block, now)

    def drop_motions(self) -> None:
        """Forget motions that have not begun."""
        self.reckoning.forget()
        self._motions += 1

    def _hand_on(self, segments: list[Segment], packet: bytes, number: int, now: int) -> None:
        """Give motions to the motors; the answer waits until they have taken all of them."""
        motors = self.table.motors
        self.table.advance_to(now)
        if number != self._motions:
            segments = []
        while segments and isinstance(motors, S2Motors) and motors.post(segments[0]):
            segments = segments[1:]
        if segments:
            self._later(now + RETRY_NS, lambda when: self._hand_on(segments, packet, number, when))
        else:
            self._finish_after(self._block_ns, packet, self._sensor_block, now)

    def _finish_after(self, duration: int, packet: bytes, answer: Callable[[], bytes], now: int) -> None:
        if self._timing and duration:
            self._later(now + duration, lambda when: self._finish(packet, answer, when))
        else:
            self._finish(packet, answer, now)

    def _finish(self, packet: bytes, answer: Callable[[], bytes], now: int) -> None:
        self.table.advance_to(now)
        data = answer()
        if self.echo:
            from_memory = self.model == "s1" and packet[0] in EEPROM_READS
            data += data[:1] if from_memory else packet[:1]
        if data:
            self._send(data, now, False)
        self._idle_since = now
        self._leds ^= 0b010
        self.tone = None
        self._busy = False
        self._busy_until = now + len(data) * BYTE_NS if self._timing and self.model == "s1" else now
        self._take_next(now)

    # reading

    def _all_readers(self) -> dict[int, tuple[int, Callable[[bytes], bytes]]]:
        """Return, for each reading, the time that it takes and the function that answers it."""
        ir, light = IR_NS[self.model], LIGHT_NS[self.model]
        memory = self.memory
        readers: dict[int, tuple[int, Callable[[bytes], bytes]]] = {
            Op.GET_PASS1: (0, lambda _: bytes(memory.password[:8])),
            Op.GET_PASS2: (0, lambda _: bytes(memory.password[8:])),
            Op.GET_NAME1: (0, lambda _: bytes(memory.name[:8])),
            Op.GET_NAME2: (0, lambda _: bytes(memory.name[8:])),
            Op.GET_DATA: (0, lambda _: bytes(memory.data)),
            Op.GET_INFO: (INFO_NS, lambda _: INFO[self.model]),
            Op.GET_ALL: (self._block_ns, lambda _: self._sensor_block()),
            Op.GET_ALL_BINARY: (2 * ir, lambda _: self._binary()),
            Op.GET_LIGHT_ALL: (3 * light, lambda _: self._light()),
            Op.GET_IR_LEFT: (ir, lambda _: self._ir()[:1]),
            Op.GET_IR_RIGHT: (ir, lambda _: self._ir()[1:]),
            Op.GET_IR_ALL: (2 * ir, lambda _: self._ir()),
            Op.GET_LINE_LEFT: (0, lambda _: self._line()[:1]),
            Op.GET_LINE_RIGHT: (0, lambda _: self._line()[1:]),
            Op.GET_LINE_ALL: (0, lambda _: self._line()),
            Op.GET_STATE: (0, lambda _: self._state()),
            Op.GET_STALL: (0, lambda _: bytes((self.table.stalled,))),
        }
        for op in SIDES:
            readers[op] = (light, self._one_light)
        if self.model == "s2":
            readers |= {
                Op.GET_POSITION: (0, lambda _: _longs(_halved(self.reckoning.x), _halved(self.reckoning.y))),
                Op.GET_ANGLE: (0, lambda _: _longs(round(self.reckoning.angle * 360 / 955))),
                Op.GET_MIC_ENVELOPE: (0, lambda _: _longs(self.senses.loudness())),
                Op.GET_MOTOR_STATS: (0, lambda _: self._s2.statistics(self.table.time)),
                Op.GET_ENCODERS: (0, self._encoders),
                Op.GET_IR_EX: (ir, self._ir_ex),
                Op.GET_LINE_EX: (0, self._line_ex),
                Op.GET_DISTANCE: (DISTANCE_NS, lambda packet: bytes((self.senses.ir_level(packet[1] & 1),))),
            }
        return readers

    @property
    def _s2(self) -> S2Motors:
        motors = self.table.motors
        assert isinstance(motors, S2Motors)  # noqa: S101  # asked of an S2 only
        return motors

    @property
    def _block_ns(self) -> int:
        return 2 * IR_NS[self.model] + 3 * LIGHT_NS[self.model]

    def _sensor_block(self) -> bytes:
        return self._ir() + self._light() + self._line() + bytes((self.table.stalled,))

    def _ir(self, threshold: int = 0) -> bytes:
        left, right = self.senses.ir(threshold)
        return bytes((not left, not right))

    def _light(self) -> bytes:
        return b"".join(value.to_bytes(2, "big") for value in self.senses.light(self._darkest))

    @property
    def _darkest(self) -> int:
        return S1_DARKEST if self.model == "s1" else S2_DARKEST

    def _one_light(self, packet: bytes) -> bytes:
        side = SIDES[Op(packet[0])]
        return self._light()[2 * side : 2 * side + 2]

    def _line(self) -> bytes:
        return bytes(self.senses.line())

    def _binary(self) -> bytes:
        ir, line = self._ir(), self._line()
        return bytes((ir[0] << 4 | ir[1] << 3 | self.table.stalled << 2 | line[0] << 1 | line[1],))

    def _state(self) -> bytes:
        """Return input and output pins; on the S2 the levels of the light sensors spoil the former."""
        line = self._line()
        pins = 1 << 3 | line[1] << 4 | line[0] << 5 | 1 << 6 | self.table.stalled << 7
        if self.model == "s2":
            left, center, right = (255 - (value >> 8) for value in self.senses.light(S2_DARKEST))
            pins |= right | center << 1 | left << 2 | 0b11 << 14
        left_led, center_led, right_led = self.leds(self.table.time)
        pins |= right_led << 8 | center_led << 9 | left_led << 10
        return bytes((pins & 0xFF, pins >> 8 & 0xFF))

    def _encoders(self, packet: bytes) -> bytes:
        counts = self._s2.encoders
        answer = _longs(*(int(count) for count in counts))
        if not packet[1]:
            counts[:] = [0.0, 0.0]
        return answer

    def _ir_ex(self, packet: bytes) -> bytes:
        side = packet[1] & 1
        return self._ir(packet[3])[side : side + 1]

    def _line_ex(self, packet: bytes) -> bytes:
        side = packet[1] & 1
        return self._line()[side : side + 1]

    # setting

    def _all_setters(self) -> dict[int, Setter]:
        """Return the action of each setting command.

        An action returns its duration [ns], or motions for the motors.
        """
        memory = self.memory
        setters: dict[int, Setter] = {
            Op.SET_PASS1: lambda packet, _: self._keep(memory.password, 0, packet[1:]),
            Op.SET_PASS2: lambda packet, _: self._keep(memory.password, 8, packet[1:]),
            Op.SET_NAME1: lambda packet, _: self._keep(memory.name, 0, packet[1:]),
            Op.SET_NAME2: lambda packet, _: self._keep(memory.name, 8, packet[1:]),
            Op.SET_DATA: lambda packet, _: self._keep(memory.data, 0, packet[1:]),
            Op.SET_SINGLE_DATA: self._set_single_data,
            Op.SET_ECHO_MODE: self._set_echo,
            Op.SET_LED_ALL: self._set_leds,
            Op.SET_MOTORS_OFF: self._stop,
            Op.SET_MOTORS: self._drive,
            Op.SET_LOUD: lambda _, __: self._set_quiet(0),
            Op.SET_QUIET: lambda _, __: self._set_quiet(0xFF),
            Op.SET_SPEAKER: self._sound,
            Op.SET_SPEAKER_2: self._sound,
        }
        for op in LEDS:
            setters[op] = self._set_led
        if self.model == "s2":
            setters |= {
                Op.SET_VOLUME: self._set_volume,
                Op.PATH: self._path,
                Op.MOVE: lambda packet, _: self.reckoning.move(packet[1], _word(packet, 2), _word(packet, 4)),
                Op.ARC: lambda packet, _: self.reckoning.arc(
                    packet[1], _word(packet, 2), _word(packet, 4), _word(packet, 6)
                ),
                Op.TURN: self._turn,
                Op.SET_POSITION: self._set_position,
                Op.SET_ANGLE: self._set_angle,
            }
        return setters

    def _keep(self, where: bytearray, first: int, data: bytes) -> int:
        if where[first : first + len(data)] != data:
            where[first : first + len(data)] = data
            self.memory.save()
        return len(data) * EEPROM_NS

    def _set_single_data(self, packet: bytes, now: int) -> int:
        """No bounds are checked: password, echo mode, name broadcast and quiet follow the eight bytes."""
        position, value = packet[1], packet[2]
        memory = self.memory
        if position < 8:
            return self._keep(memory.data, position, bytes((value,)))
        if position < 24:
            return self._keep(memory.password, position - 8, bytes((value,)))
        kept = {25: "echo", 26: "broadcast", 27: "quiet"}.get(position)
        if kept:
            setattr(memory, kept, value)
            memory.save()
        return EEPROM_NS

    def _set_echo(self, packet: bytes, now: int) -> int:
        self.echo = packet[1]
        if self.model == "s1":
            self.memory.broadcast = packet[1]
        self.memory.set_echo(packet[1])
        return EEPROM_NS

    def _set_quiet(self, value: int) -> int:
        self.memory.quiet = value
        self.memory.save()
        return EEPROM_NS

    def _set_volume(self, packet: bytes, now: int) -> None:
        self.memory.volume = min(100, packet[1])
        self.memory.save()

    def _set_led(self, packet: bytes, now: int) -> None:
        on, kept = LEDS[Op(packet[0])]
        self._leds = self._leds & kept | on

    def _set_leds(self, packet: bytes, now: int) -> None:
        self._leds = (packet[1] & 1) << 2 | (packet[2] & 1) << 1 | packet[3] & 1

    def _blink(self, now: int) -> None:
        """The center LED is toggled once a second while idle."""
        self._leds ^= ((now - self._idle_since) // SECOND % 2) << 1
        self._idle_since = now

    def leds(self, now: int) -> tuple[int, int, int]:
        """Return left, center and right, 1 for on; all blink after an over-current."""
        if getattr(self.table.motors, "tripped", False):
            on = 1 - now // (SECOND // 2) % 2
            return on, on, on
        shown = self._leds ^ (((now - self._idle_since) // SECOND % 2) << 1)
        return shown >> 2 & 1, shown >> 1 & 1, shown & 1

    def _stop(self, packet: bytes, now: int) -> None:
        self.table.motors.stop()
        self.reckoning.forget()

    def _drive(self, packet: bytes, now: int) -> None:
        self.table.motors.drive(right=packet[1], left=packet[2])
        self.reckoning.forget()

    def _sound(self, packet: bytes, now: int) -> int:
        """Play a tone. The answer follows it, also when the robot is quiet."""
        milliseconds = packet[1] << 8 | packet[2]
        second = packet[5] << 8 | packet[6] if packet[0] == Op.SET_SPEAKER_2 else 0
        if self.model == "s2":  # its counter of clock cycles has 32 bits
            milliseconds = milliseconds * 80_000 % 2**32 // 80_000
        duration = milliseconds * MILLISECOND
        if not self.memory.quiet:
            self.tone = (packet[3] << 8 | packet[4], second, now + duration)
        return duration

    def _path(self, packet: bytes, now: int) -> int | list[Segment]:
        if packet[1] == 1:
            self.reckoning.begin_path(_word(packet, 2))
            return 0
        return self.reckoning.end_path() if packet[1] == 0 else 0

    def _turn(self, packet: bytes, now: int) -> list[Segment]:
        if packet[1] in (12, 13):
            self.table.motors.stop()
            self.reckoning.forget()
        return self.reckoning.turn(packet[1], _word(packet, 2))

    def _set_position(self, packet: bytes, now: int) -> None:
        self.reckoning.x, self.reckoning.y = 2.0 * _long(packet, 1), 2.0 * _long(packet, 5)

    def _set_angle(self, packet: bytes, now: int) -> None:
        self.reckoning.angle = _long(packet, 1) * 955 / 360


def _word(packet: bytes, first: int) -> int:
    return int.from_bytes(packet[first : first + 2], "big", signed=True)


def _long(packet: bytes, first: int) -> int:
    return int.from_bytes(packet[first : first + 4], "big", signed=True)


def _longs(*values: int) -> bytes:
    return b"".join((value & 0xFFFFFFFF).to_bytes(4, "big") for value in values)


def _halved(half_mm: float) -> int:
    """Return whole millimeters, cut off towards zero as the firmware's division does."""
    return int(round(half_mm) / 2)
