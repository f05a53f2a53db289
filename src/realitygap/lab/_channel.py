"""Messages between a process of the lab and its server: one line of JSON each."""

from __future__ import annotations

import contextlib
import json
import queue
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, TextIO

from realitygap._interrupts import interrupt
from realitygap.errors import RealityGapError

Message = dict[str, Any]
MOST_EARLY = 100
"""Largest number of messages that are kept until a function handles them."""
LOOK_S = 0.2
"""Longest single wait [s]. An interrupt is handled between two waits, because a library lets a wait outlast a
signal."""


class Channel:
    """The end of the process that works.

    What must not wait, such as a stop, is taken by the thread that reads; answers wait for who asked. When the server
    says `quit`, or is gone, whatever is going on is interrupted as by Ctrl-C: motors stop, and what was scored is safe.

    Args:
        source: Of lines.
        sink: Of lines.
    """

    def __init__(self, source: TextIO, sink: TextIO) -> None:
        self._source, self._sink = source, sink
        self._lock = threading.Lock()
        self._answers: queue.Queue[Message] = queue.Queue()
        self._at_once: dict[str, Callable[[Message], None]] = {}
        self._hearing = threading.Lock()
        self._early: list[Message] = []
        self._n_asked = 0

    def begin(self) -> Message:
        """The order, with which a server begins."""
        line = self._source.readline()
        if not line:
            raise SystemExit(0)
        threading.Thread(target=self._listen, daemon=True).start()
        order: Message = json.loads(line)
        return order

    def at_once(self, what: str, do: Callable[[Message], None]) -> None:
        """Have the reading thread handle these messages as they arrive; handle the earlier ones now."""
        with self._hearing:
            self._at_once[what] = do
            early = [message for message in self._early if message.get("do") == what]
            self._early = [message for message in self._early if message.get("do") != what]
        for message in early:
            do(message)

    def say(self, kind: str, **values: Any) -> None:
        """Send a message to the server; do nothing if the server is gone."""
        line = json.dumps({"kind": kind, **values}, separators=(",", ":"))
        with self._lock, contextlib.suppress(OSError, ValueError):
            self._sink.write(line + "\n")
            self._sink.flush()

    def ask(self, question: str, *, until: Callable[[], bool] | None = None, **values: Any) -> Message:
        """Ask the visitors, and wait for an answer.

        Args:
            question: What is asked.
            until: Looked at now and then; True ends the waiting without an answer.
            values: What belongs to it.
        """
        self._n_asked += 1
        number = self._n_asked
        self.say("ask", question=question, number=number, **values)
        try:
            while until is None or not until():
                with contextlib.suppress(queue.Empty):
                    answer = self._answers.get(timeout=LOOK_S)
                    if answer.get("number") in (number, None):
                        return answer
            return {}
        finally:
            self.say("answered", number=number)

    def _listen(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            for line in self._source:
                message = _read(line)
                what = message.get("do")
                if what == "quit":
                    break
                if what == "answer":
                    self._answers.put(message)
                else:
                    self._do(str(what), message)
        interrupt()

    def _do(self, what: str, message: Message) -> None:
        with self._hearing:
            do = self._at_once.get(what)
            if do is None:
                self._early = [*self._early[-MOST_EARLY:], message]
        if do is not None:
            with contextlib.suppress(
                RealityGapError
            ):  # a robot that fails is met by the loop, which tells of it
                do(message)


def _read(line: str) -> Message:
    with contextlib.suppress(ValueError):
        message = json.loads(line)
        if isinstance(message, Mapping):
            return dict(message)
    return {}


TOLD_S = 0.2
"""Time between two messages that a robot has answered [s]: it answers after every command."""


class Pulse:
    """Reports whether a trial is driven, and that its robot answers, at a limited rate.

    Args:
        channel: To the server.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._is_driving = False
        self._told_s = 0.0

    def tell(self, is_driving: bool) -> None:
        """Report that the robot has answered in a trial, or that the trial has ended."""
        now = time.monotonic()
        if is_driving and self._is_driving and now - self._told_s < TOLD_S:
            return
        self._is_driving, self._told_s = is_driving, now
        self._channel.say("pulse", is_driving=is_driving)
