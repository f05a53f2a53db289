"""Means to stop the motors if this program ends: signals that leave `with` blocks, and a process that outlives it."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

from realitygap.errors import RobotError

from ._guardian_process import BEAT_S, GIVE_UP_S, MOVING, QUIT, READY, STANDING, STOPPED, STOPPING

PROGRAM = Path(__file__).with_name("_guardian_process.py")
START_S = 10.0
"""Maximum time until the guardian has started [s]. It needs some 20 ms."""
END_S = 2.0
"""Maximum time until the guardian has ended [s]."""
MOST_UNHEARD = 100
"""Number of beats without an answer after which the guardian counts as frozen: 2 s of a program that runs itself."""


def descriptor_of(port: object) -> int | None:
    """Return the descriptor of an open port, None for one that has none.

    None is also returned on Windows, where a process cannot inherit a serial port.
    """
    if os.name != "posix":
        return None
    try:
        return _descriptor(port)
    except (AttributeError, OSError):  # a port in this process, which needs no guardian
        return None


class Guardian:
    """A process that stops the motors if this one is killed, or is silent for a second while they run.

    Args:
        descriptor: Descriptor of the open port.
        on_death: Called from a thread if the guardian ends before `end` is called. A frozen one is killed.
        stop: Bytes that stop the motors.
        answer: Regular expression for the bytes with which the robot answers them; empty if it does not answer.

    Raises:
        RobotError: The guardian cannot be started.
    """

    def __init__(
        self, descriptor: int, on_death: Callable[[], None], stop: bytes, answer: bytes = b""
    ) -> None:
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._is_moving = False
        self._is_ready = False
        self._is_stopping = False
        self._has_stopped = False
        self._n_unheard = 0
        self._on_death = on_death
        try:
            self._process: subprocess.Popen[bytes] = subprocess.Popen(
                [
                    *(sys.executable, "-I", "-S", str(PROGRAM)),
                    *(str(descriptor), str(os.getpid()), stop.hex(), answer.hex()),
                ],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                bufsize=0,
                cwd="/",
                pass_fds=(descriptor,),
                start_new_session=True,  # so that Ctrl-C and a closed terminal do not reach it
            )
        except (OSError, TypeError) as error:  # TypeError: no interpreter is known
            raise RobotError(_not_started(str(error))) from error
        self._in, self._out = _descriptor(self._process.stdin), _descriptor(self._process.stdout)
        os.set_blocking(self._in, False)
        threading.Thread(target=self._beat, daemon=True).start()

    @property
    def process_id(self) -> int:
        """Number of the guardian's process."""
        return self._process.pid

    def expect_motion(self) -> None:
        """Report to the guardian that the motors will run. Call this before they can.

        Raises:
            RobotError: The guardian did not start.
        """
        with self._lock:
            if not self._is_ready:
                self._listen(START_S)
            if not self._is_ready:
                raise RobotError(_not_started("it does not answer"))
            self._is_moving = True
            self._tell(MOVING)

    def expect_rest(self) -> None:
        """Report to the guardian that the motors are off."""
        with self._lock:
            if self._is_moving:
                self._is_moving = False
                self._tell(STANDING)

    def has_stopped_motors(self) -> bool:
        """Return whether the guardian stopped the motors since the last call because this program was silent.

        Wait while it does.
        """
        with self._lock:
            self._listen(0.0)
            if self._is_stopping:
                self._listen(GIVE_UP_S + END_S)
            has_stopped, self._has_stopped = self._has_stopped or self._is_stopping, False
            return has_stopped

    def end(self) -> None:
        """End the guardian. Then only this program has the port open. This is safe if called twice."""
        with self._lock:
            if self._ended.is_set():
                return
            self._ended.set()
            self._tell(QUIT)
            try:
                self._process.wait(END_S)
            except subprocess.TimeoutExpired:  # it is frozen itself
                self._process.kill()
                self._process.wait()
            for pipe in (self._process.stdin, self._process.stdout):
                if pipe is not None:
                    pipe.close()

    def _beat(self) -> None:
        while not self._ended.wait(BEAT_S):
            with self._lock:
                if self._is_moving and not self._ended.is_set():
                    self._tell(MOVING)
                    self._check_answer()
            if self._process.poll() is not None and not self._ended.is_set():
                self._on_death()
                return

    def _check_answer(self) -> None:
        """Kill the guardian if it has not answered for many beats: it could not stop the motors."""
        self._n_unheard += 1
        self._listen(0.0)
        if self._n_unheard > MOST_UNHEARD and not self._is_stopping:
            self._process.kill()

    def _tell(self, message: bytes) -> None:
        try:
            os.write(self._in, message)
        except BlockingIOError:  # it has not read for minutes: it is of no use
            self._process.kill()
        except OSError:
            pass  # it is gone, and the thread will notice

    def _listen(self, timeout_s: float) -> None:
        """Handle the guardian's messages within a time [s], to the end of its present action."""
        while not self._ended.is_set() and select.select([self._out], [], [], timeout_s)[0]:
            messages = os.read(self._out, 64)
            if not messages:
                self._is_stopping = False
                return
            self._n_unheard = 0
            self._is_ready = self._is_ready or READY in messages
            if STOPPING in messages or STOPPED in messages:
                self._is_stopping = messages.rfind(STOPPING) > messages.rfind(STOPPED)
            self._has_stopped = self._has_stopped or STOPPING in messages
            if not self._is_stopping:
                timeout_s = 0.0


def _descriptor(pipe: Any) -> int:
    return int(pipe.fileno())


def _not_started(reason: str) -> str:
    return (
        f"The process that stops the robot if this program is killed cannot be started: {reason}. Nothing was driven. "
        f"Can this account start {sys.executable or 'a Python interpreter'}?"
    )


_Handler = Callable[[int, FrameType | None], object] | int | signal.Handlers | None
_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]
"""Signals that end a program without an exception by default: from `kill`, or a closed terminal or window."""


class Exits:
    """While a robot is open, converts signals that end the program to `SystemExit`, so that `with` blocks are left.

    This affects only signals that have no other handler. It works in the main thread only, as Python requires. Each
    open robot registers once.
    """

    def __init__(self) -> None:
        self._n_open = 0
        self._changed: dict[signal.Signals, _Handler] = {}
        self._lock = threading.Lock()

    def hold(self) -> None:
        """Register one more open robot."""
        with self._lock:
            self._n_open += 1
            if self._changed or threading.current_thread() is not threading.main_thread():
                return
            for number in _ENDING:
                if signal.getsignal(number) is signal.SIG_DFL:
                    self._changed[number] = signal.signal(number, _end)

    def release(self) -> None:
        """Unregister an open robot."""
        with self._lock:
            self._n_open -= 1
            if self._n_open or threading.current_thread() is not threading.main_thread():
                return
            for number, handler in self._changed.items():
                with contextlib.suppress(ValueError):
                    if signal.getsignal(number) is _end:
                        signal.signal(number, handler)
            self._changed.clear()


def _end(number: int, _: FrameType | None) -> None:
    raise SystemExit(128 + number)


EXITS = Exits()
