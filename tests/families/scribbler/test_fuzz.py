"""Random and mutated bytes against codec and link: values or our own errors, no hang, no growing memory.

Ten thousand strings here, a million with `--long`, from a fixed seed.
"""

from __future__ import annotations

import gc
import random
import tracemalloc

import pytest

from realitygap.errors import ProtocolError, RobotError
from realitygap.families.scribbler import Scribbler, _codec, _images
from realitygap.families.scribbler._link import Link
from realitygap.robots import Command

from ...robots.ports import WiredPort
from .peers import INFOS, FakeScribbler
from .pictures import jpeg_parts, slope

N = 10_000
N_LONG = 1_000_000

DECODERS = {
    _codec.sensor_block: 11,
    _codec.flag: 1,
    _codec.two_flags: 2,
    _codec.binary_block: 1,
    _codec.light_words: 6,
    _codec.word: 3,
    _codec.obstacle: 2,
    _codec.volts: 2,
    _codec.distance: 1,
    _codec.signed_long: 4,
    _codec.signed_longs: 8,
    _codec.motor_stats: 5,
    _codec.blob: 4,
    _codec.text: 16,
}
LINES = [*INFOS.values(), b"\n", b"fluke:\n", b"Robot:\n"]
HEADER, SCAN = jpeg_parts(slope(32, 16))


def mutated(draw: random.Random, data: bytes) -> bytes:
    """The same with up to four bytes lost, added, changed, or a piece cut out or repeated."""
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(len(data) + 1)
        to = min(at + draw.randint(1, 12), len(data))
        what = draw.randrange(5)
        if what == 0:
            data = data[:at] + data[to:]
        elif what == 1:
            data = data[:at] + draw.randbytes(draw.randint(1, 12)) + data[at:]
        elif what == 2:
            data = data[:at] + draw.randbytes(1) + data[at + 1 :]
        elif what == 3:
            data = data[:to] + data[at:]
        else:
            data = data[:at]
    return data


def fuzz_codec(n: int) -> int:
    """Decode n strings; how many were refused."""
    draw = random.Random(5)
    n_refused = 0
    decoders = list(DECODERS.items())
    for k in range(n):
        try:
            if k % 3 == 0:
                decode, length = draw.choice(decoders)
                decode(draw.randbytes(length))
            elif k % 3 == 1:
                line = mutated(draw, draw.choice(LINES))
                found = _codec.info_line(line)
                assert found.model in ("s1", "s2", None)
                assert found.fluke in ("none", "1", "2")
                assert found.model or found.fluke != "none"
            elif draw.random() < 0.1:
                header, scan = mutated(draw, HEADER), mutated(draw, SCAN)
                _images.jpeg_pixels(header, scan, _images.Size(32, 16), gray=draw.random() < 0.5)
            else:
                data = draw.randbytes(draw.randrange(40))
                size = _images.Size(draw.randint(1, 50), draw.randint(1, 9))
                assert _images.run_pixels(data, size, draw.choice((2, 3))).shape == size[::-1]
        except ProtocolError:
            n_refused += 1
    return n_refused


class FuzzPort(WiredPort):
    """A robot whose answers are now and then something else."""

    def __init__(self, setup: str, draw: random.Random) -> None:
        super().__init__(FakeScribbler(setup))
        self.draw = draw
        self.rate = 0.0
        self.n_strings = 0

    def send(self, data: bytes) -> None:
        if self.draw.random() < (self.rate if data else self.rate / 200):  # a few unasked
            self.n_strings += 1
            random_length = self.draw.choice((0, 1, 2, 9, 11, 20, 40, 600))
            data = (
                self.draw.randbytes(random_length) if self.draw.random() < 0.5 else mutated(self.draw, data)
            )
        self.incoming += data


CALLS = [
    Scribbler.observe,
    lambda robot: robot.drive(Command(0.5, 0.5)),
    lambda robot: robot.motors(-1, 1),
    lambda robot: robot.beep(0.1, 440),
    Scribbler.sensors,
    lambda robot: robot.name,
    lambda robot: robot.encoders(zero=True),
    lambda robot: robot.position,
    lambda robot: robot.move_by(1, 1),
    Scribbler.battery,
    lambda robot: robot.set_forwardness("fluke"),
    Scribbler.blob,
    Scribbler.picture,
    lambda robot: robot.picture("blob"),
    Scribbler.get_ir_message,
    Scribbler.error_log,
    Scribbler.reset_robot,
]


def fuzz_link(n: int) -> tuple[int, int]:
    """Sessions with n strings in all; how many calls worked and how many ended in our errors."""
    draw = random.Random(6)
    n_strings = n_worked = n_failed = 0
    while n_strings < n:
        port = FuzzPort(draw.choice(list(INFOS)), draw)
        robot = Scribbler(port)
        port.rate = draw.choice((0.02, 0.2, 0.9))
        for _ in range(20):
            try:
                draw.choice(CALLS)(robot)
                n_worked += 1
            except RobotError as error:
                n_failed += 1
                n_letters = len(str(error))
                assert n_letters < 1000
        n_strings += port.n_strings
        port.rate = 0.0
        robot.close()  # whatever happened, the motors stop once the wire is sound
        assert port.robot.motors == (100, 100)
        assert port.clock.now() < 3600
    return n_worked, n_failed


def check_all(n: int) -> None:
    n_refused = fuzz_codec(n // 2)
    assert 0.1 * n < n_refused < 0.5 * n
    tracemalloc.start()
    try:
        fuzz_link(n // 20)
        gc.collect()
        before = tracemalloc.get_traced_memory()[0]
        n_worked, n_failed = fuzz_link(n // 2)
        gc.collect()
        grown = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert n_worked > 0.1 * n_failed > 0
    assert grown < 200_000


@pytest.mark.slow
def test_ten_thousand_random_and_mutated_strings_do_no_harm():
    check_all(N)


@pytest.mark.long
def test_a_million_random_and_mutated_strings_do_no_harm():
    check_all(N_LONG)


def test_a_link_keeps_no_bytes_of_a_flood():
    """An answer without an end is given up after a bounded number of bytes."""

    class Flood(WiredPort):
        n_read = 0
        flooding = False

        def read(self, size: int = 1) -> bytes:
            if not self.flooding:
                return super().read(size)
            self.n_read += size
            return b"\0" * size

        @property
        def in_waiting(self) -> int:
            return 65536 if self.flooding else super().in_waiting

    port = Flood(FakeScribbler("s2+fluke1"))
    robot = Scribbler(port)
    port.flooding = True
    tracemalloc.start()
    with pytest.raises(RobotError, match="never silent"):
        robot.picture()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6
    assert port.n_read < 100e6
    port.flooding = False
    Link.close(robot.link)
