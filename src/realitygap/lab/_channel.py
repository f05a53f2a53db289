"""The end of a process of the lab in the channel to its server."""

from __future__ import annotations

import contextlib
import queue
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TextIO, TypeVar, cast

from realitygap._interrupts import interrupt
from realitygap.errors import RealityGapError

from . import _messages as messages

MOST_EARLY = 100
"""Largest number of messages that are kept until a function handles them."""
LOOK_S = 0.2
"""Longest single wait [s]. An interrupt is handled between two waits, because a library lets a wait outlast a
signal."""
REPORT_S = 0.5
"""Time between two reports of the same progress [s]. With each one, every open page looks at what it shows."""

W = TypeVar("W", bound=messages.Wish)


class Channel:
    """The end of the process that works.

    What must not wait, such as a stop, is taken by the thread that reads; answers wait for who asked. When the server
    says `Quit`, or is gone, whatever is going on is interrupted as by Ctrl-C: motors stop, and what was scored is safe.

    Args:
        source: Of lines.
        sink: Of lines.
    """

    def __init__(self, source: TextIO, sink: TextIO) -> None:
        self._source, self._sink = source, sink
        self._lock = threading.RLock()
        self._answers: queue.Queue[messages.Answer] = queue.Queue()
        self._at_once: dict[type[messages.Message], Callable[[Any], None]] = {}
        self._hearing = threading.Lock()
        self._early: list[messages.Message] = []
        self._n_asked = 0
        self._reported_s: dict[str, float] = {}
        self._waiting: dict[str, messages.Report] = {}

    def begin(self) -> messages.Work:
        """Return the work, with which a server begins."""
        line = self._source.readline()
        if not line:
            raise SystemExit(0)
        threading.Thread(target=self._listen, daemon=True).start()
        return cast(messages.Work, messages.from_line(line))

    def at_once(self, kind: type[W], act: Callable[[W], None]) -> None:
        """Have the reading thread handle these messages as they arrive; handle the earlier ones now."""
        with self._hearing:
            self._at_once[kind] = act
            early = [message for message in self._early if isinstance(message, kind)]
            self._early = [message for message in self._early if not isinstance(message, kind)]
        for message in early:
            act(message)

    def say(self, message: messages.Report | messages.Question) -> None:
        """Send a message to the server, after reports that wait; do nothing if the server is gone."""
        with self._lock:
            waiting, self._waiting = self._waiting, {}
            lines = [messages.to_line(each) for each in (*waiting.values(), message)]
            with contextlib.suppress(OSError, ValueError):
                self._sink.write("".join(lines))
                self._sink.flush()

    def report(self, progress: messages.Report, key: str = "", *, is_last: bool = False) -> None:
        """Send a report of progress, at most one in `REPORT_S`; a later one takes the place of one that waits.

        Args:
            progress: The report.
            key: Tells reports of one kind apart.
            is_last: Send it now, such as the last one of several.
        """
        key = f"{type(progress).__name__} {key}"
        with self._lock:
            now = time.monotonic()
            left_s = REPORT_S - (now - self._reported_s.get(key, -REPORT_S))
            if is_last or left_s <= 0:
                self._waiting.pop(key, None)
                self._reported_s[key] = now
                self.say(progress)
                return
            is_timed, self._waiting[key] = key in self._waiting, progress
        if not is_timed:
            timer = threading.Timer(left_s, self._say_waiting, (key,))
            timer.daemon = True
            timer.start()

    def _say_waiting(self, key: str) -> None:
        with self._lock:
            progress = self._waiting.pop(key, None)
            if progress is not None:
                self._reported_s[key] = time.monotonic()
                self.say(progress)

    def ask(self, question: messages.Question, until: Callable[[], bool] = lambda: False) -> messages.Answer:
        """Ask the visitors, and wait for an answer.

        Args:
            question: The question, without its number.
            until: Looked at now and then; True ends the waiting, with an empty answer.
        """
        self._n_asked += 1
        number = self._n_asked
        self.say(replace(question, number=number))
        try:
            while not until():
                with contextlib.suppress(queue.Empty):
                    answer = self._answers.get(timeout=LOOK_S)
                    if answer.number == number:
                        return answer
            return messages.Answer()
        finally:
            self.say(messages.Answered(number))

    def _listen(self) -> None:
        try:
            with contextlib.suppress(OSError, ValueError):
                for line in self._source:
                    message = _read(line)
                    if isinstance(message, messages.Quit):
                        break
                    if isinstance(message, messages.Answer):
                        self._answers.put(message)
                    elif message is not None:
                        self._act(message)
        finally:  # also after a mistake here: a process that hears nothing must not drive on
            interrupt()

    def _act(self, message: messages.Message) -> None:
        with self._hearing:
            act = self._at_once.get(type(message))
            if act is None:
                self._early = [*self._early[-MOST_EARLY:], message]
        if act is not None:
            with contextlib.suppress(RealityGapError):  # the loop meets a robot that fails, and tells of it
                act(message)


def _read(line: str) -> messages.Message | None:
    """Return the message of a line; None for a line that is none, which stops no work."""
    try:
        return messages.from_line(line)
    except ValueError as error:
        sys.stderr.write(f"{error}\n")
        return None


class Pulses:
    """Reports whether a trial is driven, and that its robot answers.

    Args:
        channel: To the server.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._is_driving = False

    def tell(self, is_driving: bool) -> None:
        """Report that the robot has answered in a trial, or that the trial has ended."""
        has_changed, self._is_driving = is_driving != self._is_driving, is_driving
        if is_driving or has_changed:
            self._channel.report(messages.Pulse(is_driving), is_last=has_changed)
