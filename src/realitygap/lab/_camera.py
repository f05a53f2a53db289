"""A camera above the robot of a sitting: what it sees of a trial is proposed to who counts."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from realitygap.errors import StudyError
from realitygap.records import Score
from realitygap.study import CameraOperator, Looking, Study, physical_conditions, read_camera
from realitygap.trials import Card, DrivenTrial, Operator
from realitygap.vision import CameraDevice, LiveTrack
from realitygap.world import Grid

from ._proposals import Proposal, keep_proposal


@contextlib.contextmanager
def under_camera(
    spec: str, study: Study, folder: Path, operator: Operator, say: Callable[[str], None], *, asks: bool
) -> Iterator[Operator]:
    """The operator of a sitting with a camera above the robot.

    Args:
        spec: Of the camera, as `read_camera` takes it.
        study: Whose first physical condition says in which arena.
        folder: Of its results.
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
        if asks:
            yield ProposingCamera(operator, live, arena.grid, say, folder, f"camera {name}")
        else:
            yield CameraOperator(operator, live, arena.grid, say)


class ProposingCamera(CameraOperator):
    """Keeps what it sees of each trial beside the ledger, for whoever counts.

    Args:
        beside: Who places the robot and closes generations.
        camera: Who looks.
        grid: Of the arena that it looks at.
        say: Told what was not seen.
        folder: Of the study.
        name: Of the camera.
    """

    def __init__(
        self,
        beside: Operator,
        camera: Looking,
        grid: Grid,
        say: Callable[[str], None],
        folder: Path,
        name: str,
    ) -> None:
        super().__init__(beside, camera, grid, say)
        self._folder, self._name = folder, name

    def drawn(self, card: Card, driven: DrivenTrial) -> Score | None:
        """Nothing yet: what the camera saw waits for somebody to look at it."""
        seen = super().drawn(card, driven)
        if seen is not None:
            told = f"Cells and path by {self._name}, looked at by who entered them."
            keep_proposal(self._folder, card.trial.trial, track_proposal(seen, self._name, self._name, told))
        return None


def track_proposal(seen: Score, mark: str, source: str, told: str, said: str = "") -> Proposal:
    """What a camera saw of a trial.

    Args:
        seen: Its cells and path.
        mark: By which it is known.
        source: The video's file, or the camera.
        told: The note for the ledger.
        said: What has to be said of it.
    """
    path = [[round(float(part), 5) for part in row] for row in seen.path or ()]
    return Proposal(
        kind="track",
        mark=mark,
        source=source,
        time=time.time(),
        cells=sorted(seen.cells),
        lines=[[row[:2] for row in path]],
        n_ends=seen.n_ends,
        path=path,
        said=said,
        told=told,
    )
