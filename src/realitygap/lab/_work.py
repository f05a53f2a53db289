"""Entry point of each process that runs a study or drives a robot: `python -m realitygap.lab._work`."""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Callable

from realitygap._caller import called_by
from realitygap._interrupts import kept_interrupts
from realitygap.errors import RealityGapError, RobotError
from realitygap.robot_families import load

from ._channel import Channel
from ._messages import Failure, Interrupted, Work
from ._mistakes import form_caller


def main() -> int:
    """Do what the first line asks for."""
    wire = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what anything prints is no message
    signal.signal(signal.SIGINT, signal.default_int_handler)  # also where a shell has it ignored
    channel = Channel(sys.stdin, wire)
    try:
        return _work(channel)
    except KeyboardInterrupt:  # also one that comes while a failure is reported
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # one that comes once more is the same one
        channel.say(Interrupted())
        return 130
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Python does not catch one while it ends


def _work(channel: Channel) -> int:
    try:
        work = channel.begin()
        act: Callable[[Channel, Work], None] = load(f"{__package__}.{work.function}")
        with kept_interrupts(), called_by(form_caller()):
            act(channel, work)
    except (RealityGapError, OSError, ValueError) as error:
        channel.say(Failure(str(error), isinstance(error, RobotError)))
        return 1
    except Exception as error:
        if isinstance(error.__cause__, KeyboardInterrupt):  # Python 3.11 reports one in a class body so
            raise KeyboardInterrupt from error
        traceback.print_exc()
        channel.say(
            Failure(f"This is a mistake in realitygap, and nothing that was written is lost: {error!r}.")
        )
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
