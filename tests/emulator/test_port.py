"""An emulator in the same process, as a port of pyserial."""

import threading
import time

import pytest
import serial
from serial.serialutil import PortNotOpenError, SerialException

import realitygap.emulator  # noqa: F401  # lets pyserial know emulator://
from realitygap.errors import RobotError
from realitygap.world import Pose

from ..families.scribbler.emulator.wire import packet


def open_port(url="emulator://s2?fluke=2&speed=off", **given):
    given.setdefault("timeout", 1.0)
    return serial.serial_for_url(url, **given)


def test_a_command_through_the_port_is_echoed_and_answered():
    with open_port() as port:
        port.write(packet(65))
        assert port.read(9) == packet(65)
        assert len(port.read(11)) == 11
        assert port.in_waiting == 0


def test_sleeping_lets_exactly_that_time_pass_and_no_real_time():
    port = open_port()
    begun, before = time.monotonic(), port.clock.now()
    port.clock.sleep(3600.0)
    assert port.clock.now() - before == pytest.approx(3600.0, abs=1e-9)
    assert time.monotonic() - begun < 60.0


def test_reading_waits_for_its_timeout_in_simulated_time():
    port = open_port(timeout=4.0)
    before = port.clock.now()
    assert port.read(5) == b""
    assert port.clock.now() - before == pytest.approx(4.0, abs=1e-9)
    port.timeout = 0
    assert port.read(5) == b""
    assert port.clock.now() - before == pytest.approx(4.0, abs=1e-9)


def test_reading_returns_as_soon_as_the_bytes_are_there():
    port = open_port(timeout=10.0)
    before = port.clock.now()
    port.write(packet(113, 1, 44, 3, 16))
    assert len(port.read(20)) == 20
    assert port.clock.now() - before == pytest.approx(0.3, abs=0.02)


def test_without_a_timeout_reading_for_ever_is_refused():
    port = open_port(timeout=None)
    with pytest.raises(SerialException, match="nothing will ever come"):
        port.read(1)


def test_a_port_reads_lines_and_single_bytes():
    port = open_port()
    port.write(b"P" + b" " * 8)
    assert port.readline() == b"fluke:3.0.5,Robot-Version:1.1.5,Robot:Scribbler2,Mode:Serial\n"
    port.write(bytes((138, 1)))
    scan = bytearray()
    while not scan.endswith(b"\xff\xd9"):
        scan += port.read(1)
    assert len(port.read(12)) == 12


def test_input_can_be_discarded():
    port = open_port()
    port.write(packet(65))
    port.clock.sleep(0.1)
    assert port.in_waiting == 20
    port.reset_input_buffer()
    assert port.in_waiting == 0


def test_closing_and_opening_again_finds_the_same_robot_still_driving():
    port = open_port()
    port.witness.place(Pose(0.5, 0.3, 0.0), 1)
    port.write(packet(109, 120, 80))
    port.clock.sleep(0.5)
    port.close()
    with pytest.raises(PortNotOpenError):
        port.read(1)
    with pytest.raises(PortNotOpenError):
        port.write(b"x")
    port.open()
    assert port.witness.motors() != (0.0, 0.0)
    port.write(packet(65))
    assert len(port.read(20)) == 20


def test_ports_with_the_same_id_share_a_robot_and_others_do_not():
    first, second, other = (
        open_port(f"emulator://s2?fluke=2&speed=off{extra}") for extra in ("&id=shared", "&id=shared", "")
    )
    assert first.emulator is second.emulator
    assert first.emulator is not other.emulator


def test_the_same_url_gives_the_same_conversation():
    def talk():
        port = open_port("emulator://s2?fluke=2&seed=5&speed=off")
        port.witness.place(Pose(0.4, 0.3, 0.5), 8)
        out = b""
        for k in range(10):
            port.write(packet(109, 190 - 9 * k, 120))
            out += port.read(20)
            port.clock.sleep(0.5)
            port.write(b"\x56")
            out += port.read(2)
        return out, port.witness.cells(), port.clock.now()

    assert talk() == talk()


def test_a_hang_up_is_a_serial_exception_until_the_port_is_opened_again():
    port = open_port("emulator://s2?fluke=2&speed=off&seed=3&faults=hangup=10")

    def talk_on():
        for _ in range(10_000):
            port.write(packet(65))
            port.read(20)
            port.clock.sleep(0.1)

    with pytest.raises(SerialException, match="link was lost"):
        talk_on()
    assert not port.is_open
    tries = 0
    while not port.is_open:
        tries += 1
        try:
            port.open()
        except SerialException:
            port.clock.sleep(0.5)
    assert tries > 1
    port.write(packet(65))
    assert len(port.read(20)) == 20


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("emulator://s3", "Expected emulator://s1, emulator://s2"),
        ("emulator://s2?fluke=7", "none, 1, 2"),
        ("emulator://s2?flute=1", "Did you mean 'fluke'"),
        ("emulator://s2?speed=fast", "speed=fast"),
        ("emulator://s2?seed=-1", "seed=-1"),
        ("emulator://s2?timing=maybe", "on or off"),
        ("emulator://s2?arena=nowhere", "Unknown arena 'nowhere'"),
        ("emulator://s2?faults=drop=7", "drop"),
    ],
)
def test_a_wrong_address_gets_one_clear_message(url, says):
    with pytest.raises(RobotError, match=says):
        open_port(url)


def test_dtr_going_low_resets_a_cabled_s2():
    port = open_port("emulator://s2?fluke=none&speed=off")
    port.write(packet(109, 180, 180))
    assert len(port.read(20)) == 20
    port.clock.sleep(0.5)
    assert port.witness.motors() != (0.0, 0.0)
    port.dtr = False
    assert port.witness.motors() == (0.0, 0.0)
    port.write(packet(65))
    assert port.read(20) == b"", "it is restarting"
    port.clock.sleep(3.0)
    port.write(packet(65))
    assert len(port.read(20)) == 20


def test_dtr_that_was_low_all_along_resets_nothing():
    port = open_port("emulator://s2?fluke=none&speed=off", do_not_open=True)
    port.dtr = False
    port.open()
    port.write(packet(109, 180, 180))
    assert len(port.read(20)) == 20
    port.dtr = False
    assert port.witness.motors() != (0.0, 0.0)


def test_speed_is_seconds_of_the_robot_in_one_of_ours():
    port = open_port("emulator://s2?fluke=2&speed=50")
    before, begun = port.clock.now(), time.monotonic()
    port.clock.sleep(5.0)
    assert time.monotonic() - begun >= 0.1
    assert port.clock.now() - before >= 5.0


def test_two_threads_may_use_a_port():
    port = open_port()
    wrong = []

    def look():
        for _ in range(200):
            try:
                port.witness.pose()
                port.witness.cells()
            except Exception as error:
                wrong.append(error)

    thread = threading.Thread(target=look)
    thread.start()
    for _ in range(200):
        port.write(packet(109, 150, 160))
        assert len(port.read(20)) == 20
    thread.join()
    assert not wrong


def test_other_settings_of_a_port_are_taken():
    port = open_port(baudrate=115200, write_timeout=1.0)
    port.baudrate = 38400
    port.rts = False
    port.reset_output_buffer()
    port.flush()
    assert (port.cts, port.dsr, port.ri, port.cd) == (True, True, False, True)
    with pytest.raises(SerialException, match="already open"):
        port.open()
