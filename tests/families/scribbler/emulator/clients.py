"""Clients of our own that talk to a robot as Myro and Scribbler2-Python do: the same bytes, reads and timeouts.

Written from the protocol document and from reading the clients; nothing is taken over. They run on the clock of the
port, so that their pauses cost no real time.
"""

from __future__ import annotations

from .wire import long, word

BLOCK = 11


class Myro:
    """As Myro 2.9.9 does: what it writes, how many bytes it reads, with which timeouts; it never looks at echoes."""

    def __init__(self, port):
        self.port, self.wait = port, port.clock.sleep
        port.timeout = 10
        port.baudrate = 38400
        self.dongle = None
        self.info = self.get_info()
        if "fluke" in self.info:
            self._set_up_fluke()
        if "robot" in self.info:
            self._restart()
            self.trim = [self.get(81, 8)[k] for k in range(4)]

    # the opening conversation

    def get_info(self):
        self.flush()
        self.port.timeout = 4
        for _ in range(2):
            self.port.write(b"P" + b" " * 8)
            line = self.port.readline().decode("latin-1")
            self.wait(0.1)
        self.port.timeout = 10
        line = line.lstrip("Pp")
        return {
            key.strip().lower(): value.strip() for key, value in (part.split(":") for part in line.split(","))
        }

    def flush(self):
        before, self.port.timeout = self.port.timeout, 0.5
        while self.port.read(1):
            pass
        self.port.timeout = before

    def _set_up_fluke(self):
        self.dongle = [int(part) for part in self.info["fluke"].split(".")]
        self.is_2 = self.dongle >= [3, 0, 0]
        self.width, self.height = (1280, 800) if self.is_2 else (256, 192)
        if self.is_2:
            self.bytewise(11, 213)
        self.camera(18, 20)
        self.camera(19, 163)
        width, height = self.width, self.height
        self.gray_window(0, 2, 0, width // 2, height - 1)
        self.gray_window(1, width // 4, 0, width // 4 + width // 2 - 2, height - 1)
        self.gray_window(2, width // 2, 0, width - 2, height - 1)
        self.bytewise(120, 135)
        self.bytewise(118, 90, 4, 0, 255, 51, 136, 190, 255)

    def _restart(self):
        self.flush()
        self.set(98, 0)
        self.wait(0.25)
        self.port.reset_input_buffer()
        while True:
            self.port.reset_input_buffer()
            self.wait(1.2)
            if not self.port.in_waiting:
                break
            self.set(98, 0)
        self.set(108)
        self.set(106)
        for frequency in (784, 880, 698, 349, 523):
            self.beep(0.03, frequency)
        self.name = self.text(78, 64)

    # how it writes and reads

    def bytewise(self, *values):
        """A command of the Fluke: one write for each byte."""
        for value in values:
            self.port.write(bytes((value,)))

    def _read(self, n):
        data = self.port.read(n)
        while len(data) < n:
            more = self.port.read(n - len(data))
            assert more, f"Myro waits for ever: {len(data)} of {n} bytes"
            data += more
        return data

    def set(self, *values):
        self.port.write(bytes(values) + bytes(9 - len(values)))
        self.echo = self._read(9)
        self.last_sensors = self._read(BLOCK)
        return self.last_sensors

    def get(self, op, n, argument=None):
        given = (op,) if argument is None else (op, argument)
        self.port.write(bytes(given) + bytes(9 - len(given)))
        self.echo = self._read(9)
        return self._read(n)

    def longs(self, op, n, argument=None):
        data = self.get(op, 4 * n, argument)
        return [int.from_bytes(data[k : k + 4], "big", signed=True) for k in range(0, 4 * n, 4)]

    def text(self, first, second):
        both = self.get(first, 8) + self.get(second, 8)
        return "".join(chr(byte) for byte in both if "0" <= chr(byte) <= "z")

    def set_text(self, first, second, text):
        padded = text.ljust(16)
        self.set(first, *padded[:8].strip().encode())
        self.set(second, *padded[8:16].strip().encode())

    def beep(self, seconds, first, second=None):
        before, self.port.timeout = self.port.timeout, seconds + 2
        op = 113 if second is None else 114
        values = [*word(int(seconds * 1000)), *word(first), *([] if second is None else word(second))]
        self.port.write(bytes((op, *values)) + bytes(8 - len(values)))
        self.sounded = self.port.read(20)
        self.port.timeout = before

    def motors(self, left, right):
        return self.set(109, int((right + 1) * 100), int((left + 1) * 100))

    # the Fluke

    def number(self, n, *values):
        self.bytewise(*values)
        return int.from_bytes(b"".join(self._read(1) for _ in range(n)), "big")

    def camera(self, register, value):
        self.bytewise(131, register, value)
        self.wait(0.15)

    def gray_window(self, window, x_low, y_low, x_high, y_high, x_step=1, y_step=1):
        self.window(window, x_low | 1, y_low, x_high, y_high, x_step + x_step % 2, y_step)

    def window(self, window, x_low, y_low, x_high, y_high, x_step, y_step):
        sides = (x_low, y_low, x_high, y_high)
        self.bytewise(
            127,
            window,
            *(byte for side in sides for byte in (word(side) if self.is_2 else (side,))),
            x_step,
            y_step,
        )

    def blob(self):
        count, x, y = self.number(2, 95), *self._read(2)
        return (count, x << 3, y << 2) if self.is_2 else (count, x, y)

    def jpeg(self, *, gray, careful):
        self.bytewise(135 if gray else 137)
        header = self._read(int.from_bytes(self._read(2), "little"))
        self.bytewise(136 if gray else 138, int(careful))
        scan = bytearray()
        while not scan.endswith(b"\xff\xd9"):
            scan += self._read(1)
        self.times = [int.from_bytes(self._read(4), "little") for _ in range(3)]
        return header + bytes(scan)

    def raw(self):
        self.bytewise(83)
        return self._read(self.width * self.height)

    def gray_raw(self):
        self.window(0, 1, 0, self.width - 1, self.height - 1, 2, 2)
        self.bytewise(84, 0)
        data = self._read(self.width // 2 * (self.height // 2))
        self.gray_window(0, 2, 0, self.width // 2, self.height - 1)
        return data

    def runs(self):
        data = self._read(self.number(2, 82))
        size = 3 if self.is_2 else 2
        return [int.from_bytes(data[k : k + size], "big") for k in range(0, len(data), size)]


class Scribbler2Python:
    """As Scribbler2-Python 4 does on an S2, by cable or behind a Fluke 2: it compares every echo."""

    def __init__(self, port, *, fluke):
        self.port, self.wait = port, port.clock.sleep
        port.baudrate, port.timeout = (115200 if fluke else 38400), 1.0
        if not fluke:
            self.wait(3.0)
        self.flush()

    def flush(self):
        self.port.reset_output_buffer()
        self.port.reset_input_buffer()
        self.port.read(1000)

    def robot(self, *values, pause=0.0):
        sent = bytes(values) + bytes(9 - len(values))
        self.port.write(sent)
        self.wait(pause)
        if values[0] != 80:
            echo = self.port.read(9)
            assert echo == sent, "Packet Mismatch"

    def bytes(self, n):
        data = self.port.read(n)
        assert len(data) == n, f"{len(data)} of {n} bytes"
        return data

    def number(self, n):
        return int.from_bytes(self.bytes(n), "big", signed=True)

    def sensors(self, *values, pause=0.0):
        self.robot(*values, pause=pause)
        return self.bytes(BLOCK)

    def line(self, *values):
        self.robot(*values)
        return self.port.readline()

    def fluke(self, *values):
        self.port.write(bytes(values))
        self.wait(0.1)

    def set_long(self, op, *values):
        return self.sensors(op, *(byte for value in values for byte in long(value)))

    def path(self, *values):
        """A motion command: asks for the motors until they stand still, every half second, then for the sensors."""
        self.sensors(*values)
        polls = 0
        while True:
            self.robot(170)
            moving = self.number(4) & 3
            self.number(1)
            if not moving:
                break
            self.wait(0.5)
            polls += 1
            assert polls < 100
        self.sensors(65)
        return polls
