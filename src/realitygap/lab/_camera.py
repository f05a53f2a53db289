"""A camera above the robot of a sitting."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from realitygap.errors import StudyError
from realitygap.study import CameraObserver, Study, physical_conditions, read_camera
from realitygap.vision import CameraDevice, LiveTrack

from ._page_operator import PageOperator


@contextlib.contextmanager
def under_camera(
    spec: str, study: Study, operator: PageOperator, say: Callable[[str], None], *, asks: bool
) -> Iterator[PageOperator]:
    """The operator of a sitting with a camera above the robot.

    Args:
        spec: Of the camera, as `read_camera` takes it.
        study: Whose first physical condition says in which arena.
        operator: Without a camera.
        say: Told what the camera did not see.
        asks: Whether its cells wait for somebody to look at them; else they are entered as they are.

    Raises:
        StudyError: The camera's options cannot be.
        VisionError: There is no such camera.
    """
    arena = physical_conditions(study)[0].arena.arena()
    name, marks = read_camera(spec, arena)
    if not name.isdecimal():
        raise StudyError(
            f"The camera is {spec!r}, expected its number such as 0, or 0?tag=10&tag-height=0.1. A video is tracked "
            "after the sitting, below."
        )
    with LiveTrack(CameraDevice(int(name)), marks) as live:
        operator.observer = CameraObserver(live, arena, say=say)
        operator.proposer = f"camera {name}" if asks else ""
        yield operator
