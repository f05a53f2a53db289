"""A study runs in its own process."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from realitygap.errors import StudyError
from realitygap.records import ResultsFolder
from realitygap.study import Progress, Study, check_files, drive_study, parse_study, run_study
from realitygap.trials import Operator

from ._channel import Channel, Message
from ._described import study_of
from ._files import refuse_code
from ._page_operator import PageOperator, WatchedOperator

_TOLD_S = 0.5
"""Time between two messages on the progress of a study [s]."""


def work(channel: Channel, order: Message) -> None:
    """Run a study, or resume it.

    Args:
        channel: To the server.
        order: `folder` of the results; `text` of the study file where it is new; `replicates` if there are to be more;
            `port` of the robot and `camera` above it, where there are any; `allow_code` if Python files of tasks may
            run.
    """
    folder = Path(order["folder"])
    study = _study(order, folder)
    allow_code = bool(order.get("allow_code"))
    refuse_code(study, allow_code)
    port = order.get("port") or None
    told = _Telling(channel)
    result = run_study(study, folder, tell=told.show, threads=order.get("threads"), allow_code=allow_code)
    if port is not None:
        with _operated(channel, order, study, folder) as operator:
            result = drive_study(study, port, folder, operator=operator, allow_code=allow_code)
    physical = result.physical
    channel.say("done", waiting="" if physical is None else physical.waiting)


def _study(order: Message, folder: Path) -> Study:
    if order.get("text") is not None:
        return parse_study(order["text"], str(folder.parent / f"{folder.name}.toml"))
    study = study_of(ResultsFolder.open(folder).description)
    check_files(study, folder.parent)
    if order.get("replicates"):
        about = study.about.model_copy(update={"replicates": int(order["replicates"])})
        return study.model_copy(update={"about": about})
    return study


@contextlib.contextmanager
def _operated(channel: Channel, order: Message, study: Study, folder: Path) -> Iterator[Operator]:
    """Return the operator of the robot, with a camera if one is named."""
    from realitygap.emulator import connect_witness

    address, camera, counts = order.get("witness") or None, order.get("camera") or None, order.get("counts")
    remote = None if address is None else connect_witness(address)
    if counts == "witness":
        if camera is not None:
            raise StudyError(
                "A camera cannot see an emulated robot, which its witness scores. Leave the field 'Camera' empty, "
                "or choose another scorer."
            )
        yield WatchedOperator(channel, remote)
        return
    operator = PageOperator(channel, folder, when=order.get("when", "sheet"), witness=remote)
    if camera is None:
        yield operator
        return
    from ._camera import under_camera

    def say(text: str) -> None:
        channel.say("said", text=text)

    with under_camera(camera, study, operator, say, asks=counts != "camera") as looking:
        yield looking


class _Telling:
    """Reports the progress of the study at a limited rate."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._last = 0.0

    def show(self, progress: Progress) -> None:
        """Report the progress, unless the last report is recent."""
        now = time.monotonic()
        if now - self._last < _TOLD_S and progress.n_done < progress.n_runs:
            return
        self._last = now
        values: dict[str, Any] = vars(progress)
        self._channel.say("progress", **values)
