"""A process that stops a robot's motors when the program that drives it is killed or frozen.

It is run as `python -I -S FILE PORT PROGRAM STOP [ANSWER]`: the descriptor of the open port, which it inherits, the
process number of the program, and in hexadecimal the bytes that stop the robot, and a regular expression for its
answer to them. Standard input is a pipe from the program, standard output one to it; each message is one byte.

The bytes are sent again and again, so that the motors stop even if the program wrote only a part of its last message:
the first bytes may complete that one.
"""

from __future__ import annotations

import contextlib
import os
import re
import select
import signal
import sys
import time

MOVING, STANDING, QUIT = b"m", b"s", b"q"
"""Messages from the program: the motors may run (repeated every `BEAT_S`); the motors are off; the port will be closed.
"""
READY, HEARD, STOPPING, STOPPED = b"r", b"h", b"f", b"d"
"""Messages to the program: watching; answer to `MOVING`; stopping the motors, because the program was silent; stopped,
or given up."""

BEAT_S = 0.02
"""Time between two messages of a program whose robot may be moving [s]."""
SILENT_S = 1.0
"""Silence after which a program whose robot may be moving counts as frozen [s]."""
LOOK_S = 0.1
"""Time between two checks of whether the program still exists [s]. Another process may hold its pipe open."""
ROUND_S = 0.1
"""Time between two packets "motors off" [s]."""
GIVE_UP_S = 10.0
"""Time after which the guardian gives up on a robot that does not answer [s]. A tone may keep it busy for 8 s."""

MOST_HEARD = 4096


def main() -> None:
    """Watch until the program closes the port or ends."""
    port, program = int(sys.argv[1]), int(sys.argv[2])
    stop, answer = (bytes.fromhex(word) for word in (*sys.argv[3:], "")[:2])
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)  # what ends the program must not end its guardian first
    os.set_blocking(1, False)  # a program that reads nothing must not hold up its guardian
    _tell(READY)
    is_moving, heard_s = False, time.monotonic()
    while True:
        if select.select([0], [], [], LOOK_S)[0]:
            messages = os.read(0, 4096)
            if QUIT in messages:
                return
            if not messages:
                break
            is_moving, heard_s = messages.endswith(MOVING), time.monotonic()
            if is_moving:
                _tell(HEARD)
        elif os.getppid() != program:
            break
        elif is_moving and time.monotonic() - heard_s > SILENT_S:
            _tell(STOPPING)
            stop_motors(port, stop, answer)
            _tell(STOPPED)
            is_moving = False
    if is_moving:  # otherwise the rest of a packet must not be filled up with what it was not meant to have
        stop_motors(port, stop, answer)


def stop_motors(port: int, stop: bytes, answer: bytes = b"") -> bool:
    """Send "motors off" until the robot has answered twice, because the first answer may belong to an earlier packet.

    Args:
        port: Descriptor of the port.
        stop: Bytes that stop the motors.
        answer: Regular expression for the robot's answer. The bytes are sent three times if there is none.

    Returns:
        True if the robot answered, or if all bytes were sent.
    """
    if not answer:
        return _send_often(port, stop)
    heard = b""
    give_up_s = time.monotonic() + GIVE_UP_S
    try:
        _send(port, stop + stop, give_up_s)
        while (now := time.monotonic()) < give_up_s:
            round_s = now + ROUND_S
            while select.select([port], [], [], max(0.0, round_s - time.monotonic()))[0]:
                data = os.read(port, MOST_HEARD)
                if not data:
                    return False
                heard = (heard + data)[-MOST_HEARD:]
                if n_answers(heard, answer) >= 2:
                    return True
            _send(port, stop, give_up_s)
    except OSError:  # the port hung up
        pass
    return False


def _send_often(port: int, stop: bytes) -> bool:
    """Send bytes three times, because the first bytes may complete an earlier message."""
    try:
        for _ in range(3):
            _send(port, stop, time.monotonic() + ROUND_S)
            time.sleep(ROUND_S)
    except OSError:  # the port hung up
        return False
    return True


def n_answers(heard: bytes, answer: bytes) -> int:
    """Return how often an answer was heard."""
    return len(re.findall(answer, heard, re.DOTALL))


def _send(port: int, data: bytes, give_up_s: float) -> None:
    while data and select.select([], [port], [], max(0.0, give_up_s - time.monotonic()))[1]:
        with contextlib.suppress(BlockingIOError):
            data = data[os.write(port, data) :]


def _tell(message: bytes) -> None:
    with contextlib.suppress(OSError):  # the program is gone
        os.write(1, message)


if __name__ == "__main__":
    main()
    os._exit(0)
