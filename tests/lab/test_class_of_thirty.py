"""Thirty students at once: their messages go over websockets to a server, in a time that the test moves."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import math
import socket
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from fastapi import FastAPI
from websockets.asyncio.client import ClientConnection, connect

from realitygap.lab._access import CLASS_SOCKET, VISITOR, Access
from realitygap.lab._class import PERIOD_S, Classroom
from realitygap.lab._lab import Lab
from realitygap.lab.pages._class import _Class

N = 30
ROUND_S = 6.0
MOST_STEPS = 1
"""The most steps of the class from the arrival of a command until the page has heard that its robot follows it."""


class Phone:
    """A student's phone, with what the lab said to it last."""

    def __init__(self, socket: ClientConnection, number: int) -> None:
        self._socket, self.number = socket, number
        self.turn = -1 + 2 * number / (N - 1)
        self.now: dict[str, Any] = {}
        self.state: dict[str, Any] = {}
        self.n_sent = 0
        self.sent_at: dict[int, int] = {}
        self.most_steps = 0
        self._heard = asyncio.Event()

    async def listen(self, steps: list[int]) -> None:
        async for text in self._socket:
            message = json.loads(text)
            if message["kind"] == "class":
                self.state = message
            else:
                self.now = message
                for n in [n for n in self.sent_at if n <= message["heard"]]:
                    self.most_steps = max(self.most_steps, steps[0] - self.sent_at.pop(n))
            self._heard.set()

    async def hear(self, what: Any) -> None:
        """Wait until what the lab said fulfills this."""
        while not what(self):
            self._heard.clear()
            await self._heard.wait()

    async def say(self, kind: str, **more: Any) -> None:
        await self._socket.send(json.dumps({"kind": kind, **more}))

    async def drive(self, step: int) -> None:
        self.n_sent += 1
        self.sent_at[self.n_sent] = step
        await self.say("drive", move=0.0, turn=self.turn, n=self.n_sent)


class _Arrivals:
    """Counts the messages that arrive at a class."""

    def __init__(self, room: Classroom) -> None:
        self.n = 0
        self._hear, self._event = room.hear, asyncio.Event()
        room.hear = self.hear  # type: ignore[method-assign]

    def hear(self, *message: Any) -> bool:
        self.n += 1
        self._event.set()
        return self._hear(*message)

    async def until(self, n: int) -> None:
        while self.n < n:
            self._event.clear()
            await self._event.wait()


@contextlib.asynccontextmanager
async def served(room: Classroom, root: Path) -> AsyncIterator[str]:
    """Serve the websockets of a class; yield their address."""
    app = FastAPI()
    app.add_api_websocket_route(CLASS_SOCKET, _Class(Lab(root), room).serve)
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen(128)
        port = listener.getsockname()[1]
        access = Access(app, "secret", port=port, is_local=True, has_class=True)
        server = uvicorn.Server(uvicorn.Config(access, log_level="warning", timeout_graceful_shutdown=2))
        serving = asyncio.create_task(server.serve(sockets=[listener]))
        yield f"ws://127.0.0.1:{port}{CLASS_SOCKET}"
        server.should_exit = True
        await serving


async def drive_a_round(root: Path) -> tuple[Classroom, list[Phone]]:
    now, steps = [0.0], [0]
    room = Classroom(root, clock=lambda: now[0], round_s=ROUND_S)
    arrived = _Arrivals(room)
    async with served(room, root) as address, contextlib.AsyncExitStack() as open_phones:
        phones = []
        for number in range(N):
            cookie = {"Cookie": f"{VISITOR}=phone-{number}"}
            phone = Phone(
                await open_phones.enter_async_context(connect(address, additional_headers=cookie)), number
            )
            phones.append(phone)
        listening = [asyncio.create_task(phone.listen(steps)) for phone in phones]
        for phone in phones:
            await phone.say("join", name=f"Student {phone.number}")

        async def step() -> None:
            steps[0] += 1
            now[0] += PERIOD_S
            await room.step()
            await asyncio.sleep(0.005)  # the phones and the server share this loop

        while not all(phone.state.get("name") for phone in phones):
            await step()
        room.start_round()
        while room.phase == "round":
            before = arrived.n
            for phone in phones:
                await phone.drive(steps[0])
            await arrived.until(before + N)
            await step()
            await asyncio.gather(*(phone.hear(lambda it: not it.sent_at) for phone in phones))
        await step()
        await asyncio.gather(*(phone.hear(lambda it: it.state["phase"] == "over") for phone in phones))
        for task in listening:
            task.cancel()
    room.close()
    return room, phones


@pytest.mark.slow
def test_thirty_students_drive_their_own_robots_and_nobody_waits(tmp_path):
    with ThreadPoolExecutor(1) as pool:  # in this thread, a browser of other tests may have a loop
        room, phones = pool.submit(asyncio.run, drive_a_round(tmp_path)).result()
    board = room.drives()
    assert {drive.name for drive in board} == {f"Student {k}" for k in range(N)}
    assert all(drive.is_over and drive.seconds == ROUND_S for drive in board)
    assert max(phone.most_steps for phone in phones) <= MOST_STEPS
    start = room.arena.start.heading
    for phone in phones:
        (path,) = (drive.path for drive in board if drive.name == f"Student {phone.number}")
        turns = [math.remainder(after[2] - before[2], math.tau) for before, after in itertools.pairwise(path)]
        turned = sum(turns)
        assert math.copysign(1.0, turned) == math.copysign(1.0, phone.turn), phone.number
        assert math.remainder(phone.now["pose"][2] - start - turned, math.tau) == pytest.approx(0.0, abs=0.01)
    fastest, slowest = phones[-1], phones[N // 2]
    assert abs(fastest.now["pose"][2] - slowest.now["pose"][2]) > 0.1
    again = Classroom(tmp_path)
    assert len(again.drives()) == N
