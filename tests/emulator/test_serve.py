"""Emulators served to other programs, on pseudo-terminals and TCP ports."""

import json
import os
import socket
import time
from pathlib import Path

import numpy as np
import pytest
import serial

from realitygap.emulator import Server, connect_witness, serve_pty, serve_tcp
from realitygap.emulator._serve import PtyChannel
from realitygap.errors import RobotError
from realitygap.families.scribbler.emulator import Emulator, Faults
from realitygap.world import Pose

from ..families.scribbler.emulator.wire import packet


def robot(**given):
    return Emulator("s2", "2", timing=given.pop("timing", False), **given)


@pytest.fixture(params=[serve_pty, serve_tcp])
def serve(request):
    return request.param


def open_port(server, timeout=5.0):
    return serial.serial_for_url(server.name, timeout=timeout)


def test_a_client_talks_to_it(serve):
    with serve(robot()) as server, open_port(server) as port:
        for _ in range(50):
            port.write(packet(65))
            assert len(port.read(20)) == 20


def test_clients_come_and_go(serve):
    with serve(robot()) as server:
        for _ in range(5):
            with open_port(server) as port:
                port.write(packet(78))
                assert port.read(17)[9:] == b"Scribby "


def test_a_large_answer_arrives_whole(serve):
    with serve(robot()) as server, open_port(server, 20.0) as port:
        port.write(b"\x53")
        assert len(port.read(1280 * 800)) == 1280 * 800
        port.write(packet(65))
        assert len(port.read(20)) == 20


def test_a_client_that_does_not_read_does_not_stop_it(serve):
    with serve(robot(), witness=0) as server:
        with open_port(server) as port:
            port.write(b"\x53" * 5)
            time.sleep(0.3)
            with connect_witness(server.witness_address) as witness:
                assert witness.pose()
        assert not server._stopped


def test_a_second_client_of_a_tcp_port_is_turned_away():
    with serve_tcp(robot()) as server, open_port(server) as first:
        first.write(packet(65))
        assert len(first.read(20)) == 20
        host, port = server.name.removeprefix("socket://").split(":")
        with socket.create_connection((host, int(port)), timeout=5.0) as second:
            assert second.recv(1) == b""
        first.write(packet(65))
        assert len(first.read(20)) == 20


def test_a_pseudo_terminal_is_raw_and_linked(tmp_path):
    link = tmp_path / "robot"
    with serve_pty(robot(), link) as server:
        assert str(link.readlink()) == server.name
        assert server.name.startswith("/dev/")
        with serial.Serial(str(link), timeout=5.0) as port:
            sent = packet(65, 10, 13, 4, 26, 3, 17, 19, 127)  # what a terminal would take for itself
            port.write(sent)
            assert port.read(20)[:9] == sent
    assert not link.is_symlink()


def test_a_link_does_not_take_the_place_of_a_file(tmp_path):
    file = tmp_path / "notes"
    file.write_text("mine")
    with pytest.raises(RobotError, match="is not a link"):
        serve_pty(robot(), file)
    assert file.read_text() == "mine"
    with pytest.raises(RobotError, match="no link can be made"):
        serve_pty(robot(), tmp_path / "missing" / "link")


def test_an_old_link_is_replaced_and_a_newer_one_is_left(tmp_path):
    link = tmp_path / "robot"
    link.symlink_to("/dev/pts/nobody")
    first = serve_pty(robot(), link)
    second = serve_pty(robot(), link)
    first.close()
    assert str(link.readlink()) == second.name
    second.close()


def test_a_second_close_leaves_what_was_opened_in_between():
    server = serve_pty(robot())
    server.close()
    opened = [os.open(os.devnull, os.O_RDONLY) for _ in range(8)]  # they have the numbers of the closed ones
    server.close()
    for each in opened:
        os.close(each)


def test_a_port_that_is_taken_is_said_so():
    with serve_tcp(robot()) as server:
        port = int(server.name.rpartition(":")[2])
        with pytest.raises(RobotError, match="Choose another"):
            serve_tcp(robot(), port)


def test_the_witness_of_another_process_sees_and_moves_the_robot():
    with (
        serve_tcp(robot(), speed=20.0, witness=0) as server,
        connect_witness(server.witness_address) as witness,
    ):
        witness.place(Pose(0.4, 0.3, 1.0), 5)
        assert witness.pose() == pytest.approx((0.4, 0.3, 1.0))
        with open_port(server) as port:
            port.write(packet(109, 180, 180))
            port.read(20)
            assert witness.motors()[0] > 0
            time.sleep(0.2)
            port.write(packet(108))
            port.read(20)
        path = witness.path()
        assert path.shape[1] == 4
        assert witness.cells() == server.witness.cells()
        assert len(witness.cells()) > 1
        assert witness.cells_at([path[0, 0]]) == witness.cells()[:1]
        assert witness.now() >= path[-1, 0]
        assert np.all(np.diff(path[:, 0]) > 0)


@pytest.mark.parametrize(
    "request_",
    [
        b"nonsense",
        b"[]",
        b'{"do": "fly"}',
        b'{"do": "place"}',
        b'{"do": "place", "pose": [1], "seed": 1}',
        b"\xff",
        b'{"do": "place", "pose": [0, 0, 0], "seed": Infinity}',
        b'{"do": "place", "pose": [0, 0, 1' + b"0" * 400 + b'], "seed": 1}',
        b"[" * 50_000,
    ],
)
def test_the_witness_answers_nonsense_with_an_error_and_lives(request_):
    with serve_tcp(robot(), witness=0) as server:
        host, port = server.witness_address.split(":")
        with socket.create_connection((host, int(port)), timeout=5.0) as line:
            file = line.makefile("rb")
            line.sendall(request_ + b"\n")
            assert "error" in json.loads(file.readline())
            line.sendall(b'{"do": "pose"}\n')
            assert "result" in json.loads(file.readline())
            line.sendall(b"x" * 100_000)
        with connect_witness(server.witness_address) as witness:
            assert witness.pose()


def test_connecting_to_a_missing_witness_is_one_error():
    with pytest.raises(RobotError, match="No witness at"):
        connect_witness("127.0.0.1:1")
    for address in ("somewhere", "127.0.0.1:", "127.0.0.1:99999", "127.0.0.1:-1"):
        with pytest.raises(RobotError, match=r"No witness at .* expected HOST:PORT"):
            connect_witness(address)


def test_a_hang_up_closes_the_connection_of_a_tcp_client():
    server = serve_tcp(robot(seed=1, faults=Faults(hangup=0.3)))

    def talk_on(port):
        for _ in range(200):
            port.write(packet(65))
            port.read(20)

    with server, open_port(server, 0.2) as port, pytest.raises(serial.SerialException):
        talk_on(port)


def test_an_idle_emulator_waits_until_something_comes(serve):
    with serve(robot()) as server:
        with open_port(server) as port:
            port.write(packet(65))
            port.read(20)
        assert server._pause() is None


def test_tones_take_their_time_over_the_wire():
    with serve_tcp(robot(timing=True)) as server, open_port(server) as port:
        begun = time.monotonic()
        port.write(packet(113, 0, 200, 3, 16))
        assert len(port.read(20)) == 20
        assert time.monotonic() - begun >= 0.2


def test_the_watch_function_is_called_repeatedly():
    seen = []
    watched = robot()
    server = Server(watched, PtyChannel(), watch=lambda: seen.append(watched.now), watch_s=0.01).start()
    until = time.monotonic() + 60
    while len(seen) <= 3 and time.monotonic() < until:
        time.sleep(0.01)
    server.close()
    assert len(seen) > 3
    assert seen == sorted(seen)


def n_open_files():
    """Of this process, where the system tells."""
    folder = Path("/proc/self/fd")
    return len(list(folder.iterdir())) if folder.is_dir() else 0


def test_a_closed_server_leaves_no_open_files(serve):
    with serve(robot(), witness=0):
        pass
    before = n_open_files()
    for _ in range(5):
        with serve(robot(), witness=0):
            pass
    assert n_open_files() <= before
