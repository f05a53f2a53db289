"""The proxy passes bytes on as they are, and disturbs those that it is told to."""

from __future__ import annotations

import socket

import pytest

from tests.byte_proxy import KINDS, ByteProxy, WireFaults


@pytest.fixture
def ends():
    """Return the proxy, the client's side, and the robot's side of a connection."""
    with (
        socket.create_server(("127.0.0.1", 0)) as listening,
        ByteProxy(f"socket://127.0.0.1:{listening.getsockname()[1]}", seed=1) as proxy,
    ):
        host, port = proxy.name.removeprefix("socket://").split(":")
        with socket.create_connection((host, int(port)), timeout=10) as client:
            robot, _ = listening.accept()
            robot.settimeout(10)
            with robot:
                yield proxy, client, robot


def received(side: socket.socket, n: int) -> bytes:
    got = b""
    while len(got) < n:
        got += side.recv(n - len(got))
    return got


def test_bytes_pass_unchanged_without_faults(ends):
    proxy, client, robot = ends
    sent = bytes(range(256)) * 40
    client.sendall(sent)
    assert received(robot, len(sent)) == sent
    robot.sendall(sent)
    assert received(client, len(sent)) == sent
    assert not proxy.n_struck


@pytest.mark.parametrize(
    ("kind", "arrives"), [("drop", b"bc"), ("duplicate", b"aabc"), ("delay", b"abc"), ("corrupt", b"?bc")]
)
def test_strike_disturbs_one_byte_in_one_direction(ends, kind, arrives):
    proxy, client, robot = ends
    proxy.strike(kind, "to_robot")
    robot.sendall(b"xyz")
    assert received(client, 3) == b"xyz"
    client.sendall(b"abc")
    got = received(robot, len(arrives))
    assert got[1:] == arrives[1:]
    assert (got[:1] == arrives[:1]) == (kind != "corrupt")
    assert (got[0] ^ ord("a")).bit_count() == (kind == "corrupt") or kind == "drop"
    assert proxy.n_struck == {kind: 1}


def test_shares_disturb_about_so_many_bytes_and_the_same_ones_for_a_seed():
    made = []
    for _ in range(2):
        with ByteProxy("socket://127.0.0.1:1", seed=3, faults=WireFaults(*(0.1,) * 4, delay_s=0.0)) as proxy:
            made.append((proxy._disturbed(bytes(1000), "to_host"), dict(proxy.n_struck)))
    assert made[0] == made[1]
    assert all(60 < made[0][1][kind] < 140 for kind in KINDS)


def test_cut_ends_both_connections_and_the_client_can_come_again(ends):
    proxy, client, robot = ends
    client.sendall(b"a")
    assert received(robot, 1) == b"a"  # from here on the proxy knows both connections
    proxy.cut()
    assert client.recv(1) == b""
    assert robot.recv(1) == b""
