"""Whole conversations as Myro and Scribbler2-Python have them, call by call."""

import io

import pytest
import serial
from PIL import Image

from .clients import Myro, Scribbler2Python
from .wire import word

MYRO_SET_UPS = [("s1", "none"), ("s2", "none"), ("s1", "1"), ("s2", "1"), ("s2", "2")]


def open_port(model, fluke, extra=""):
    return serial.serial_for_url(f"emulator://{model}?fluke={fluke}&speed=off&seed=2{extra}")


FLUKE_SET_UPS = [set_up for set_up in MYRO_SET_UPS if set_up[1] != "none"]
S2_SET_UPS = [set_up for set_up in MYRO_SET_UPS if set_up[0] == "s2"]


def each(set_ups):
    return pytest.mark.parametrize(("model", "fluke"), set_ups)


def myro(model, fluke, extra=""):
    return Myro(open_port(model, fluke, extra))


# Myro


@each(MYRO_SET_UPS)
def test_myro_connects(model, fluke):
    client = myro(model, fluke)
    assert client.name == "Scribby"
    assert client.info["robot"] == {"s1": "Scribbler", "s2": "Scribbler2"}[model]
    assert client.info.get("fluke") == {"none": None, "1": "2.9.1", "2": "3.0.5"}[fluke]
    assert client.info["mode"] == "Serial"
    assert client.trim == [127] * 4
    assert client.port.in_waiting == 0
    assert 2.5 < client.port.clock.now() < 8.0


def test_myro_wakes_a_robot_that_broadcasts_its_name():
    port = open_port("s1", "none")
    port.emulator.memory.broadcast = 1
    port.emulator.robot.reset(port.emulator.now_ns)
    client = Myro(port)
    assert client.name == "Scribby"
    assert client.port.in_waiting == 0


@each(MYRO_SET_UPS)
def test_myro_reads_the_robot(model, fluke):
    client = myro(model, fluke)
    block = client.get(65, 11)
    assert client.get(73, 2) == block[:2]
    assert len(client.get(70, 6)) == 6
    assert client.get(76, 2) == block[8:10]
    assert client.get(81, 8)[:4] == bytes([127] * 4)
    assert client.port.in_waiting == 0


@each(MYRO_SET_UPS)
def test_myro_sets_the_robot(model, fluke):
    client = myro(model, fluke)
    client.set_text(110, 119, "Rosie the Robot")
    assert client.text(78, 64) == "RosietheRobot"  # blanks vanish
    client.set_text(55, 56, "hush")
    assert client.text(50, 51) == "hush"
    client.set(97, *range(8))
    assert list(client.get(81, 8)) == list(range(8))
    client.set(96, 3, 99)
    assert client.get(81, 8)[3] == 99
    for op in range(99, 107):
        client.set(op)
    client.set(111)
    client.set(112)
    assert client.port.in_waiting == 0


@each(MYRO_SET_UPS)
def test_myro_plays_tones(model, fluke):
    client = myro(model, fluke)
    for given in ((0.03, 784), (0.5, 440), (1.5, 440, 880)):
        before = client.port.clock.now()
        client.beep(*given)
        assert len(client.sounded) == 20
        assert given[0] < client.port.clock.now() - before < given[0] + 0.05


@each(MYRO_SET_UPS)
def test_myro_drives(model, fluke):
    client = myro(model, fluke)
    client.port.witness.place((0.5, 0.3, 0.0), 1)
    client.motors(0.5, 0.5)
    client.wait(1.0)
    client.set(108)
    pose = client.port.witness.pose()
    assert pose.x > 0.53, "ahead is ahead, whichever end that is"
    client.motors(-0.5, 0.5)
    client.wait(0.5)
    client.set(108)
    assert client.port.witness.pose().heading > pose.heading + 0.2
    client.motors(0.57, 0.0)  # Myro cuts 156.999 off
    assert client.echo[:3] == (bytes((109, 100, 156)) if fluke == "none" else bytes((109, 44, 100)))


@each(S2_SET_UPS)
def test_myro_uses_what_only_an_s2_has(model, fluke):
    client = myro(model, fluke)
    client.port.witness.place((0.5, 0.3, 0.0), 1)
    assert client.longs(165, 2) == [0, 0]
    client.set(166, 0, 0, 0, 100, 0xFF, 0xFF, 0xFF, 0xCE)
    assert client.longs(165, 2) == [100, -50]
    client.set(168, 0, 0, 0, 90)
    assert client.longs(167, 1) == [90]
    assert client.longs(169, 1)[0] >= 0
    client.set(161, 0, 0, 7)  # Myro's "begin", which is the firmware's "end"
    client.set(162, 4, *word(100), *word(0))
    polls = 0
    while not client.get(170, 5)[4]:
        client.wait(1.0)
        polls += 1
    assert 0 < polls < 20
    assert client.longs(165, 2) == [150, -50]
    for values in (
        (164, 2, *word(100)),
        (164, 5, *word(45)),
        (162, 2, *word(0), *word(0)),
        (163, 4, *word(60), *word(60), *word(80)),
    ):
        client.set(*values)
    client.set(161, 1, 0, 7)
    client.set(108)
    counts = client.longs(171, 2, 1)
    assert any(counts)
    assert client.longs(171, 2, 0) == counts
    assert client.longs(171, 2, 1) == [0, 0]
    client.set(160, 100)
    assert 0 <= client.get(175, 1, 0)[0] <= 99
    assert 0 <= client.get(175, 1, 1)[0] <= 99


@each(FLUKE_SET_UPS)
def test_myro_reads_the_fluke(model, fluke):
    client = myro(model, fluke)
    for op in (85, 86, 87):
        assert 0 <= client.number(2, op) <= 6400
    brights = [client.number(3, 88, window) for window in range(3)]
    assert all(bright > 1_000_000 for bright in brights)
    client.blob()
    assert client.number(2, 89) / 20.9813 == pytest.approx(9.0, abs=0.2)
    assert client.number(2, 150) == 0
    assert client.number(1, 92, 0x12) == 0x14
    client.bytewise(142)
    assert client.port.readline() == f"fluke:{client.info['fluke']}\n".encode()
    assert len(client.get(65, 11)) == 11


@each(FLUKE_SET_UPS)
def test_myro_sets_the_fluke(model, fluke):
    client = myro(model, fluke)
    for values in (
        (128, 0),
        (116,),
        (117,),
        (126, 212),
        (126, 1),
        (120, 130),
        (129,),
        (130,),
        (152, 7),
        (151, 3, 97, 98, 99),
    ):
        client.bytewise(*values)
    assert client.number(1, 90, 0, 0, 0, 0) == 0xDF
    for register, value in ((0x12, 0x10), (0x13, 0xA0), (0, 0), (1, 0), (2, 0), (6, 0), (0x10, 0)):
        client.camera(register, value)
    if fluke == "2":
        client.bytewise(12, 0, 100)
        client.bytewise(13, 0x01, 0x23)
        assert client.number(2, 10) == 0
    assert client.port.in_waiting == 0
    assert len(client.get(65, 11)) == 11


@each(FLUKE_SET_UPS)
def test_myro_takes_pictures(model, fluke):
    client = myro(model, fluke)
    for gray in (False, True):
        for careful in (False, True):
            image = Image.open(io.BytesIO(client.jpeg(gray=gray, careful=careful)))
            image.load()
            assert image.size == ((128, 192) if fluke == "1" else (1280, 800))
    assert len(client.raw()) == client.width * client.height
    assert len(client.gray_raw()) == client.width * client.height // 4
    assert sum(client.runs()) == client.width * client.height // 4
    assert len(client.get(65, 11)) == 11
    assert client.port.in_waiting == 0


@each(FLUKE_SET_UPS)
def test_myro_identifies_and_restarts_the_robot(model, fluke):
    client = myro(model, fluke)
    client.bytewise(156)
    assert client.port.readline() == (b"SCRIBBLER-1\n" if model == "s1" else b"SCRIBBLER-2\n")
    client.wait(3.0)
    client.bytewise(124)
    client.wait(3.0)
    client.flush()
    assert client.text(78, 64) == "Scribby"


# Scribbler2-Python


@pytest.fixture(params=["none", "2"])
def other(request):
    port = open_port("s2", request.param)
    client = Scribbler2Python(port, fluke=request.param != "none")
    if request.param != "none":
        client.fluke(128, 0)  # as its author advises before motor calls: it compares echoes
    client.is_cabled = request.param == "none"
    return client


def test_scribbler2_python_reads_the_robot(other):
    info = other.line(80)
    assert info.endswith(b"Robot-Version:1.1.5,Robot:Scribbler2,Mode:Serial\n")
    assert (info.startswith(b"fluke:3.0.5,")) != other.is_cabled
    for ops, n in (((50, 51), 8), ((78, 64), 8)):
        for op in ops:
            other.robot(op)
            other.bytes(n)
    lengths = {
        77: 2,
        81: 8,
        65: 11,
        71: 1,
        72: 1,
        73: 2,
        67: 2,
        68: 2,
        69: 2,
        70: 6,
        74: 1,
        75: 1,
        76: 2,
        79: 1,
        169: 4,
    }
    for op, n in lengths.items():
        other.robot(op)
        other.bytes(n)
    for op in (172, 173):
        for side in (0, 1):
            other.robot(op, side, 0, 20)
            assert other.number(1) in (0, 1)
    other.robot(175, 1)
    assert 0 <= other.number(1) <= 99
    other.robot(170)
    other.bytes(5)
    other.robot(171, 1)
    other.bytes(8)
    assert other.port.in_waiting == 0


def test_scribbler2_python_sets_the_robot(other):
    other.sensors(110, *b"My robot")
    other.sensors(119, *b" no. 12 ")
    other.robot(78)
    assert other.bytes(8) == b"My robot"
    other.robot(64)
    assert other.bytes(8) == b" no. 12 "
    other.sensors(55, *b"password")
    other.sensors(56, *b"        ")
    other.sensors(96, 7, 200)
    other.sensors(97, *range(8))
    for op in (*range(99, 107), 111, 112):
        other.sensors(op)
    other.sensors(107, 1, 0, 1)
    other.sensors(160, 80)
    before = other.port.clock.now()
    other.sensors(114, *word(800), *word(440), *word(880), pause=0.8)
    assert other.port.clock.now() - before == pytest.approx(0.81, abs=0.02)
    assert other.port.in_waiting == 0


def test_scribbler2_python_drives(other):
    other.port.witness.place((0.5, 0.3, 0.0), 1)
    other.sensors(109, 150, 150)
    other.wait(0.5)
    assert other.port.witness.motors() == pytest.approx((0.075, 0.075))
    other.sensors(108)
    other.set_long(166, 0, 0)
    other.set_long(168, 0)
    before = other.port.witness.pose()
    other.sensors(161, 1, 0, 7)
    assert other.path(162, 5, *word(100), *word(0)) == 0, "the last motion of a path waits"
    assert other.path(164, 5, *word(90)) > 0
    assert other.path(161, 0) > 0
    after = other.port.witness.pose()
    assert after.x - before.x == pytest.approx(0.1, abs=2e-3)
    assert after.heading - before.heading == pytest.approx(1.571, abs=0.01)
    other.robot(165)
    assert (other.number(4), other.number(4)) == (100, 0)
    other.robot(167)
    assert other.number(4) == 90


def test_scribbler2_python_restarts_a_cabled_robot():
    client = Scribbler2Python(open_port("s2", "none"), fluke=False)
    client.port.write(bytes((33,)) + bytes(8))
    client.wait(3.0)
    client.flush()
    client.sensors(65)


@pytest.mark.slow
def test_scribbler2_python_uses_the_fluke_2():
    client = Scribbler2Python(open_port("s2", "2"), fluke=True)
    for size, shape in ((213, (1280, 800)), (71, (427, 266))):
        client.fluke(11, size)
        for header_op, scan_op, careful in ((135, 136, 1), (135, 136, 0), (137, 138, 1), (137, 138, 0)):
            client.fluke(header_op)
            header = client.bytes(int.from_bytes(client.bytes(2), "little"))
            client.fluke(scan_op, careful)
            scan = bytearray()
            while not scan.endswith(b"\xff\xd9"):
                scan += client.bytes(1)
            client.bytes(12)
            image = Image.open(io.BytesIO(header + bytes(scan)))
            image.load()
            assert image.size == shape
    for values in (
        (129,),
        (130,),
        (131, 0x12, 0x14),
        (127, 1, 0, 1, 0, 0, 0, 100, 0, 50, 1, 1),
        (128, 1),
        (120, 255),
        (126, 9),
        (12, 3, 255),
    ):
        client.fluke(*values)
    client.fluke(142)
    assert client.port.readline() == b"fluke:3.0.5\n"
    client.fluke(89)
    assert client.number(2) / 20.9813 == pytest.approx(9.0, abs=0.2)
    client.fluke(10)
    client.bytes(client.number(2))
    client.fluke(86)
    assert client.number(2) % 640 == 0
    client.fluke(156)
    assert client.port.readline() == b"SCRIBBLER-2\n"
    client.wait(4.0)
    client.fluke(124)
    client.wait(3.0)
    client.flush()
    client.sensors(65)
    assert client.port.in_waiting == 0
