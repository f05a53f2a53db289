"""Connections without the token cut nobody off who has it."""

from __future__ import annotations

import asyncio
import resource
import socket
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import pytest

from realitygap.lab._connections import MOST_BYTES, PATIENCE_S, Strangers, most_strangers

from .conftest import RunningLab
from .sheets import drive_paths

DESCRIPTORS = 160


class Transport:
    """Of a connection."""

    is_aborted = False

    def abort(self) -> None:
        self.is_aborted = True


@pytest.fixture
def timers(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, asyncio.TimerHandle]]:
    """What is called later: when, and the call; no time passes."""
    later: list[tuple[float, asyncio.TimerHandle]] = []
    loop = asyncio.new_event_loop()
    loop.close()

    def call_later(seconds, *call):
        later.append((seconds, asyncio.TimerHandle(0.0, call[0], call[1:], loop)))
        return later[-1][1]

    monkeypatch.setattr(asyncio, "get_running_loop", lambda: SimpleNamespace(call_later=call_later))
    monkeypatch.setattr(loop, "_timer_handle_cancelled", lambda handle: None, raising=False)
    return later


def test_connection_without_the_token_is_closed_after_a_time_unless_it_shows_it(timers):
    strangers, idle, known = Strangers(4), Transport(), Transport()
    for transport in (idle, known):
        strangers.meet(transport)
    strangers.forget(known)
    assert [seconds for seconds, _ in timers] == [PATIENCE_S] * 2
    for _, timer in timers:
        if not timer.cancelled():
            timer._run()
    assert idle.is_aborted
    assert not known.is_aborted


def test_oldest_connections_without_the_token_make_room_for_new_ones(timers):
    strangers, known = Strangers(4), Transport()
    strangers.meet(known)
    strangers.forget(known)
    others = [Transport() for _ in range(10)]
    for transport in others:
        strangers.meet(transport)
    assert [transport.is_aborted for transport in others] == [True] * 6 + [False] * 4
    assert not known.is_aborted
    assert sum(not timer.cancelled() for _, timer in timers) == 4


def test_connections_without_the_token_get_a_share_of_few_descriptors(monkeypatch):
    shares = {}
    for limit in (64, 256, 1024, 2**20, resource.RLIM_INFINITY):
        monkeypatch.setattr(resource, "getrlimit", lambda _, limit=limit: (limit, limit))
        shares[limit] = most_strangers()
    assert shares == {64: 8, 256: 32, 1024: 64, 2**20: 64, resource.RLIM_INFINITY: 64}


def connect(lab: RunningLab) -> socket.socket:
    host, port = lab.address.removeprefix("http://").rstrip("/").split(":")
    return socket.create_connection((host, int(port)), timeout=60)


@pytest.mark.slow
def test_a_large_upload_with_the_token_is_taken_on_a_new_connection(tmp_path: Path):
    """Its first bytes come at once, and are more than a connection without the token may send."""
    lab = RunningLab(tmp_path / "studies")
    lab.root.mkdir()
    drive_paths(lab.root, steps=12)
    lab.start()
    n_bytes = 16 * MOST_BYTES
    head = (
        f"POST /photos/by-robot?sheet=1&name=a.jpg HTTP/1.1\r\nHost: {lab.address.split('/')[2]}\r\n"
        f"Cookie: {lab.cookie['name']}={lab.token}\r\nContent-Length: {n_bytes}\r\n\r\n"
    )
    try:
        for _ in range(20):
            with connect(lab) as upload:
                upload.sendall(head.encode() + bytes(n_bytes))
                assert upload.recv(4096).startswith(b"HTTP/1.1 ")  # whatever it says of such a photo
    finally:
        lab.stop()


@pytest.mark.slow
def test_stop_is_answered_while_more_strangers_are_connected_than_there_are_descriptors(tmp_path: Path):
    lab = RunningLab(tmp_path / "studies", limits={resource.RLIMIT_NOFILE: DESCRIPTORS})
    lab.start()
    with ExitStack() as strangers:
        for number in range(DESCRIPTORS + 40):
            idle = strangers.enter_context(connect(lab))
            if number % 2:
                idle.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
        assert lab.post("stop") == b"no robot"
        flood = strangers.enter_context(connect(lab))
        endless = b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * (300 * MOST_BYTES // 6)
        with pytest.raises((ConnectionResetError, BrokenPipeError)):
            flood.sendall(endless)
        assert lab.post("stop") == b"no robot"
    lab.stop()
    assert "Traceback" not in lab.said
