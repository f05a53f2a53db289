"""The firmware of the Fluke: it runs its own commands and passes all others on to the robot.

Source: main.c and server-helper.c of Myro's repository (Fluke 1, 2.9.1); for the Fluke 2 headers of its server (3.0.5)
and what its clients expect.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Literal

from realitygap.emulator import MILLISECOND, SECOND, nanoseconds
from realitygap.families.scribbler.opcodes import FLUKE_2_COMMANDS, FLUKE_COMMANDS, PACKET, FlukeLengths, Op

from ._camera import Camera, Window
from ._memory import SCRIBBLER_AHEAD
from ._scribbler import BYTE_NS, Schedule, Scribbler
from ._senses import IR_POWER

FlukeModel = Literal["1", "2"]
Answer = Callable[[bytes, int, int], None]  # bytes, from when on, time of a byte
Act = Callable[[bytes, int], bytes | None]  # arguments, time; its answer, if it has one

VERSION = {"1": b"fluke:2.9.1", "2": b"fluke:3.0.5"}
LINK_BYTE_NS = nanoseconds(10 / 460800)  # between the board and its Bluetooth chip
VERSION_NS = MILLISECOND  # after GET_INFO the board's own version is sent
SILENT_NS = 250 * MILLISECOND  # after which it ends the line for a robot that does not answer
ROBOT_NS = 300 * MILLISECOND  # for which a Fluke 2 waits for the robot's answer
GAP_NS = SECOND  # after which a Fluke 2 begins a new packet; a Fluke 1 never does
IR_NS = {"1": 5 * MILLISECOND, "2": 40 * MILLISECOND}  # of a reading; the first is chosen
PICTURE_NS = 66 * MILLISECOND  # to take a picture; chosen
VOLTS = 20.9813  # units of the battery's reading in a volt
LOG_BYTES = 10_000  # of the Fluke 2's log of errors
MOST_HELD = 1 << 16  # bytes that wait while it works; more are lost
SIZES = {213: (1280, 800), 71: (427, 266)}
EMITTERS = {
    Op.GET_DONGLE_IR_LEFT: "left",
    Op.GET_DONGLE_IR_CENTER: "center",
    Op.GET_DONGLE_IR_RIGHT: "right",
}
PICTURES = {
    *(Op.GET_IMAGE, Op.GET_WINDOW, Op.GET_WINDOW_LIGHT, Op.GET_RLE, Op.GET_BLOB, Op.GET_BLOB_WINDOW),
    *(Op.GET_JPEG_GRAY_SCAN, Op.GET_JPEG_COLOR_SCAN),
}
OWN_LENGTH = {
    Op.GET_WINDOW: FlukeLengths(1, 0),
    Op.PASS_N_BYTES: FlukeLengths(1, 0),
    Op.GET_PASS_N_BYTES: FlukeLengths(1, 0),
    Op.GET_PASS_BYTES_UNTIL: FlukeLengths(1, 0),
    Op.SEND_IR_MESSAGE: FlukeLengths(1, 0),
    Op.SET_SCRIBBLER_BATCH: FlukeLengths(2, 0),
}
ROBOT_IDS = {"s1": b"SCRIBBLER-1\n", "s2": b"SCRIBBLER-2\n"}
NAMES = {int(op): op for op in Op}


class Fluke:
    """The board between the client and the robot.

    Args:
        model: "1" or "2".
        robot: Robot that it is plugged into.
        camera: Camera.
        schedule: Calls back at a time [ns].
        answer: Takes what goes to the client.
        timing: True if bytes and readings take their time.
    """

    def __init__(
        self,
        model: FlukeModel,
        robot: Scribbler,
        camera: Camera,
        schedule: Schedule,
        answer: Answer,
        *,
        timing: bool,
    ) -> None:
        self.model = model
        self._robot, self._camera = robot, camera
        self._table, self._senses, self._memory = robot.table, robot.senses, robot.memory
        self._schedule, self._answer = schedule, answer
        self._timing = timing
        self._jobs = 0
        self._commands = {**(FLUKE_COMMANDS if model == "1" else FLUKE_2_COMMANDS), **OWN_LENGTH}
        self._robot_byte_ns = BYTE_NS if timing else 0
        self._link_byte_ns = LINK_BYTE_NS if timing else 0
        self._acts = self._all_acts()
        self.heard = b""  # the last message received by IR
        self.sent: deque[bytes] = deque(maxlen=100)  # messages sent by IR
        self._wake()

    def _wake(self) -> None:
        """Begin as after switching on."""
        self._op: Op | None = None
        self._arguments = bytearray()
        self._index = 0  # of the next byte in a robot's packet
        self._packet = bytearray(PACKET)
        self._last_byte = 0
        self._relays = False
        self._passes_all = False
        self._held: deque[tuple[int, int]] = deque()
        self._busy = 0  # counts what it is busy with; 0 for nothing
        self._waiting = 0  # number of the job that waits for the robot's answer, 0 for none
        self._robot_line_free = 0
        self._info = ""  # "asked" after GET_INFO, "said" when the own version was sent
        self._info_job = 0
        self.front_led = False
        self.back_led = 0
        self.ir_power = IR_POWER
        self.emitters = 0b111
        self.servos = [0, 0, 0, 0]
        self.log = b""
        self._camera.restart()

    # receiving

    def receive(self, byte: int, at: int) -> None:
        """Take a byte that has arrived at a time; while the board works, it waits."""
        if not (self._busy or self._waiting):
            self._take(byte, at)
        elif len(self._held) < MOST_HELD:
            self._held.append((byte, at))

    def _go_on(self, now: int) -> None:
        """Take what had to wait, until there is work again."""
        while self._held and not (self._busy or self._waiting):
            byte, at = self._held.popleft()
            self._take(byte, max(at, now))

    def _take(self, byte: int, at: int) -> None:
        if self._passes_all:
            self._pass(byte, at)
        elif self._op is not None:
            self._arguments.append(byte)
            self._dispatch_if_complete(at)
        else:
            if self.model == "2" and self._index and at - self._last_byte > GAP_NS:
                self._index = 0
            self._last_byte = at
            if self._index == 0 and byte in self._commands:
                self._op = NAMES[byte]
                self._arguments.clear()
                self._dispatch_if_complete(at)
            else:
                self._take_packet_byte(byte, at)

    def _take_packet_byte(self, byte: int, at: int) -> None:
        """Take a byte for the robot. When the Fluke is ahead, wheels are swapped and reversed."""
        self._relays = True
        self._packet[self._index] = byte
        self._index = (self._index + 1) % PACKET
        if self._index == 0 and self._packet[0] == Op.GET_INFO:
            self._info = "asked"
        if self._packet[0] != Op.SET_MOTORS or not self._memory.fluke_ahead or not 1 <= self._index <= 3:
            self._pass(byte, at)
        elif self._index == 3:
            op, right, left = self._packet[:3]
            for value in (op, (200 - left) & 0xFF, (200 - right) & 0xFF):
                self._pass(value, at)
        if self._index == 0:
            self._packet_is_through(at)

    def _pass(self, byte: int, at: int) -> None:
        """Put a byte on the robot's line."""
        self._robot_line_free = max(self._robot_line_free, at) + self._robot_byte_ns
        self._robot.receive(byte, self._robot_line_free)

    def _packet_is_through(self, at: int) -> None:
        if self._info:
            job = self._new_job()
            self._info_job = job
            self._schedule(self._robot_line_free + VERSION_NS, lambda now: self._say_version(job, now))
        if self.model == "2" and self._robot.busy:
            job = self._waiting = self._new_job()
            self._schedule(at + ROBOT_NS, lambda now: self._give_up(job, now), lambda: self._waiting == job)

    def _new_job(self) -> int:
        self._jobs += 1
        return self._jobs

    def _give_up(self, job: int, now: int) -> None:
        """Stop waiting for the robot's answer. Its later bytes are passed on when they arrive."""
        if self._waiting == job:
            self._waiting = 0
            self.log = (self.log + b"scribbler: no answer to %d\n" % self._packet[0])[-LOG_BYTES:]
            self._go_on(now)

    # what the robot sends

    def relay(self, data: bytes, ready: int, is_echo: bool) -> None:
        """Pass on what the robot sends; its info line gets the board's version in front."""
        if not self._relays:
            return
        if self._info and not is_echo:
            data = (b"," if self._info == "said" else VERSION[self.model] + b",") + data
            self._info = ""
        self._answer(data, ready, self._robot_byte_ns)
        if self._waiting and not is_echo:
            self._waiting = 0
            self._schedule(ready, self._go_on)

    def _say_version(self, job: int, now: int) -> None:
        """The robot has not answered GET_INFO yet."""
        if self._info == "asked" and job == self._info_job:
            self._info = "said"
            self._answer(VERSION[self.model], now, self._link_byte_ns)
            self._schedule(
                now + SILENT_NS,
                lambda later: self._end_line(job, later),
                lambda: self._info == "said" and job == self._info_job,
            )

    def _end_line(self, job: int, now: int) -> None:
        """The robot does not answer GET_INFO at all."""
        if self._info == "said" and job == self._info_job:
            self._info = ""
            self._answer(b"\n", now, self._link_byte_ns)

    # its own commands

    def _dispatch_if_complete(self, at: int) -> None:
        op = self._op
        if op is None or len(self._arguments) < self._n_arguments(op):
            return
        arguments = bytes(self._arguments)
        self._op = None
        duration = self._duration(op) if self._timing else 0
        if not duration:
            self._carry_out(op, arguments, at)
            return
        self._busy = job = self._new_job()
        self._schedule(at + duration, lambda now: self._carry_out_later(job, op, arguments, now))

    def _n_arguments(self, op: Op) -> int:
        """Return the number of argument bytes of a command, as far as the bytes received so far determine it."""
        n = self._commands[op].arguments
        given = self._arguments
        if op == Op.SET_UART0:
            return 4 if not given or given[0] == 1 else 1
        if op in (Op.PASS_N_BYTES, Op.SEND_IR_MESSAGE):
            return n + given[0] if given else n
        if op == Op.SET_SCRIBBLER_BATCH:
            return n + (given[0] << 8 | given[1]) if len(given) > 1 else n
        return n

    def _duration(self, op: Op) -> int:
        if op in EMITTERS or op == Op.GET_DONGLE_IR:
            return IR_NS[self.model]
        return PICTURE_NS if op in PICTURES else 0

    def _carry_out_later(self, job: int, op: Op, arguments: bytes, now: int) -> None:
        if self._busy != job:
            return
        self._busy = 0
        self._carry_out(op, arguments, now)
        self._go_on(now)

    def _carry_out(self, op: Op, arguments: bytes, now: int) -> None:
        self._table.advance_to(now)
        act = self._acts.get(op)
        if act is not None and (data := act(arguments, now)):
            self._answer(data, now, self._link_byte_ns)

    def _all_acts(self) -> dict[Op, Act]:
        """Return the action of each command; an action returns the answer.

        Commands without an action have no effect and no answer.
        """
        acts: dict[Op, Act] = {
            Op.GET_BATTERY: self._get_battery,
            Op.SET_FRONT_LED_ON: lambda _, __: self._set(front_led=True),
            Op.SET_FRONT_LED_OFF: lambda _, __: self._set(front_led=False),
            Op.SET_BACK_LED: lambda given, _: self._set(back_led=given[0]),
            Op.SET_DONGLE_IR: lambda given, _: self._set(ir_power=given[0]),
            Op.SET_IR_EMITTERS: lambda given, _: self._set(emitters=given[0]),
            Op.GET_DONGLE_IR: self._get_ir_by_mask,
            Op.SET_FORWARDNESS: self._set_forwardness,
            Op.GET_SERIAL_MEMORY: lambda given, _: bytes((self._memory.read_page(*_words(given[:4])),)),
            Op.SET_SERIAL_MEMORY: self._set_serial_memory,
            Op.ERASE_SERIAL_MEMORY: self._erase,
            Op.GET_VERSION: lambda _, __: VERSION[self.model] + b"\n",
            Op.GET_ROBOT_ID: self._identify,
            Op.RESET_SCRIBBLER: self._reset_robot,
            Op.RESET_SCRIBBLER_2: self._reset_robot,
            Op.WATCHDOG_RESET: self._restart,
            Op.GET_IR_MESSAGE: self._get_message,
            Op.SEND_IR_MESSAGE: self._send_message,
            Op.SET_PASSTHROUGH: self._set_passthrough,
            Op.PASS_BYTE: self._pass_bytes,
            Op.PASS_N_BYTES: lambda given, now: self._pass_bytes(given[1:], now),
            Op.RELAY_ON: lambda _, __: self._set(_relays=True),
            Op.RELAY_OFF: lambda _, __: self._set(_relays=False),
            Op.GET_SCRIBBLER_PROGRAM: lambda _, __: b"\0",
        }
        for op in EMITTERS:
            acts[op] = self._get_ir(op)
        if self.model == "2":
            acts[Op.GET_ERRORS] = lambda _, __: len(self.log).to_bytes(2, "big") + self.log
            acts[Op.SET_SERVO] = self._set_servo
        return acts | self._camera_acts()

    def _set(self, **values: object) -> None:
        for name, value in values.items():
            setattr(self, name, value)

    def _get_battery(self, given: bytes, now: int) -> bytes:
        volts = self._table.battery.volts(self._table.motors.load)
        return min(0xFFFF, round(volts * VOLTS)).to_bytes(2, "big")

    def _get_ir(self, op: Op) -> Act:
        return lambda _, __: self._obstacle(EMITTERS[op]).to_bytes(2, "big")

    def _obstacle(self, emitter: str) -> int:
        return self._senses.obstacle(emitter, self.ir_power, in_pulses=self.model == "2")

    def _get_ir_by_mask(self, given: bytes, now: int) -> bytes:
        """Return emitters by a mask of 1 right, 2 left, 4 center; the largest of what each of them would give."""
        chosen = [name for bit, name in ((1, "right"), (2, "left"), (4, "center")) if given[2] & bit]
        return max((self._obstacle(name) for name in chosen), default=0).to_bytes(2, "big")

    def _set_forwardness(self, given: bytes, now: int) -> None:
        self._memory.write_page(0, 0, 1 if given[0] else SCRIBBLER_AHEAD)

    def _set_serial_memory(self, given: bytes, now: int) -> None:
        page, offset = _words(given[:4])
        self._memory.write_page(page, offset, given[4])

    def _erase(self, given: bytes, now: int) -> None:
        self._memory.erase_page(given[0] << 8 | given[1])

    def _identify(self, given: bytes, now: int) -> bytes:
        self._robot.reset(now)
        return ROBOT_IDS[self._robot.model]

    def _reset_robot(self, given: bytes, now: int) -> None:
        self._robot.reset(now)

    def _restart(self, given: bytes, now: int) -> None:
        self._wake()

    def _get_message(self, given: bytes, now: int) -> bytes:
        heard, self.heard = self.heard, b""
        return len(heard).to_bytes(2, "big") + heard

    def _send_message(self, given: bytes, now: int) -> None:
        self.sent.append(given[1:])

    def _set_passthrough(self, given: bytes, now: int) -> None:
        if given[0] == 1:
            self._passes_all = self._relays = True

    def _pass_bytes(self, given: bytes, now: int) -> None:
        for byte in given:
            self._pass(byte, now)

    def _set_servo(self, given: bytes, now: int) -> None:
        self.servos[given[0] & 3] = given[1]

    # pictures

    def _camera_acts(self) -> dict[Op, Act]:
        camera = self._camera
        acts: dict[Op, Act] = {
            Op.GET_IMAGE: lambda _, __: camera.raw().tobytes(),
            Op.SET_WINDOW: self._set_window,
            Op.GET_WINDOW: lambda given, _: camera.window(given[0]).tobytes(),
            Op.GET_WINDOW_LIGHT: lambda given, _: camera.window_sum(given[0]).to_bytes(3, "big"),
            Op.SET_RLE: self._set_colors,
            Op.GET_RLE: self._get_runs,
            Op.GET_BLOB: lambda _, __: self._blob(None),
            Op.GET_BLOB_WINDOW: lambda given, _: self._blob(given[0]),
            Op.WHITE_BALANCE_ON: lambda _, __: self._set_register(bytes((0x12, 0x14))),
            Op.WHITE_BALANCE_OFF: lambda _, __: self._set_register(bytes((0x12, 0x10))),
            Op.GET_CAMERA_PARAMETER: lambda given, _: bytes((camera.register(given[0]),)),
            Op.SET_CAMERA_PARAMETER: lambda given, _: self._set_register(given),
            Op.GET_JPEG_GRAY_HEADER: lambda _, __: _with_length(camera.jpeg_header(in_color=False)),
            Op.GET_JPEG_COLOR_HEADER: lambda _, __: _with_length(camera.jpeg_header(in_color=True)),
            Op.GET_JPEG_GRAY_SCAN: lambda given, now: self._scan(given, now, in_color=False),
            Op.GET_JPEG_COLOR_SCAN: lambda given, now: self._scan(given, now, in_color=True),
        }
        if self.model == "2":
            acts[Op.SET_PICTURE_SIZE] = self._set_size
        return acts

    def _set_register(self, given: bytes) -> None:
        self._camera.set_register(given[0], given[1])

    def _set_colors(self, given: bytes, now: int) -> None:
        self._camera.set_colors(given[1], given[2:])

    def _set_window(self, given: bytes, now: int) -> None:
        if self.model == "1":
            number, x_low, y_low, x_high, y_high, x_step, y_step = given
        else:
            number, x_step, y_step = given[0], given[9], given[10]
            x_low, y_low, x_high, y_high = _words(given[1:9])
        self._camera.set_window(number, Window(x_low, y_low, x_high, y_high, x_step, y_step))

    def _get_runs(self, given: bytes, now: int) -> bytes:
        """Run lengths as words; of a Fluke 2, whose picture is larger, three bytes each."""
        size = 2 if self.model == "1" else 3
        most = 1024 if self.model == "1" else 0xFFFF // size - 1
        data = b"".join(run.to_bytes(size, "big") for run in self._camera.runs(most))
        return len(data).to_bytes(2, "big") + data

    def _blob(self, window: int | None) -> bytes:
        count, x, y = self._camera.blob(window)
        if self.model == "2":
            x, y = x // 8, y // 4
        return min(0xFFFF, count).to_bytes(2, "big") + bytes((x & 0xFF, y & 0xFF))

    def _scan(self, given: bytes, now: int, *, in_color: bool) -> bytes:
        """Return the compressed picture, and three times in microseconds: start, taken, compressed."""
        start = (now - (PICTURE_NS if self._timing else 0)) // 1000
        times = (start, now // 1000, now // 1000)
        scan = self._camera.jpeg_scan(in_color=in_color, careful=bool(given[0]))
        return scan + b"".join((time & 0xFFFFFFFF).to_bytes(4, "little") for time in times)

    def _set_size(self, given: bytes, now: int) -> None:
        if given[0] in SIZES:
            self._camera.set_size(*SIZES[given[0]])


def _words(given: bytes) -> list[int]:
    return [given[k] << 8 | given[k + 1] for k in range(0, len(given), 2)]


def _with_length(header: bytes) -> bytes:
    return len(header).to_bytes(2, "little") + header
