"""A study: started or resumed, with a robot that drives it or without.

`StudyJob` is what pages see; `run` runs in a process of its own.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from realitygap.emulator import connect_witness
from realitygap.errors import StudyError
from realitygap.records import ResultsFolder
from realitygap.runs import Condition
from realitygap.study import (
    ConditionNotes,
    Progress,
    ReportSection,
    Study,
    StudySection,
    TrialsSection,
    check_files,
    drive_study,
    parse_study,
    run_study,
)
from realitygap.trials import Operator

from . import _messages as messages
from ._channel import Channel
from ._files import refuse_camera, refuse_code, refuse_port
from ._job import MOST_POINTS, Job
from ._mistakes import Mistakes
from ._page_operator import PageOperator, WatchedOperator, under_camera


def sitting_mistakes(root: Path, values: Mapping[str, Any]) -> Mistakes:
    """Return what is wrong in the fields of trials on a robot; a field that is missing is not checked."""
    mistakes = Mistakes()
    if "port" in values:
        with mistakes.in_field("port"):
            refuse_port(root, values["port"])
    with mistakes.in_field("camera"):
        camera = str(values.get("camera") or "")
        refuse_camera(root, camera)
        if values.get("counts") == "camera" and not camera:
            raise StudyError("Enter the number of the camera that scores, such as 0.")
    return mistakes


class StudyJob(Job):
    """A study at work.

    Attributes:
        name: Of the study.
        work: What its process was told; it has the port of the robot and how it is connected.
        progress: How far its simulated runs are; None before the first word.
        card: Of the trial that is being driven; None while none is.
        step: Its last step.
        line: (x, y) [m] where an emulated robot has been in it; `pose` is where it is.
        cells: Cells that it has entered.
        label: Of the robot: REAL or EMULATED; empty before one was met.
        preflight: What its pre-flight found.
        camera_note: What the camera above the robot did not see last; empty if it saw everything.

    Args:
        name: Of the study.
        work: What the process is told first.
        root: Where it works.
        changed: Called after each change, from another thread.
    """

    QUIET = (messages.RobotPose, messages.Step)
    STOPPED = "Paused. Published runs and scores are saved. You can resume."
    LOST = "The process of the study ended (status {status}). Published runs and scores are saved. You can resume."

    def __init__(self, name: str, work: messages.StudyWork, root: Path, changed: Callable[[], None]) -> None:
        self.name = name
        self.work = work
        self.port = work.port
        self.progress: messages.StudyProgress | None = None
        self.card: messages.TrialCard | None = None
        self.step: messages.Step | None = None
        self.pose: list[float] | None = None
        self.line: list[list[float]] = []
        self.cells: list[int] = []
        self.label = ""
        self.preflight: messages.PreflightResult | None = None
        self.camera_note = ""
        self.n_live = 0
        self._ending: tuple[str, bool] | None = None
        super().__init__(work, root, changed)

    @property
    def has_met(self) -> bool:
        """True if a robot has answered."""
        return bool(self.label)

    @property
    def robot_action(self) -> str:
        """Sentence that names the trial that is being driven; empty if there is none."""
        card = self.card
        return "" if card is None else f"The robot is driving trial {card['trial']}."

    def stop_robot(self) -> None:
        """Stop the motors, and with them the trial."""
        self._child.tell(messages.Stop())

    def _take(self, message: messages.Message) -> None:
        match message:
            case messages.StudyProgress():
                self.progress = message
            case messages.RobotMet():
                self.label = message.label
            case messages.PreflightResult():
                self.preflight = message
            case messages.TrialBegun():
                self._answered_s = time.monotonic()
                self.card, self.step = message.card, None
                self.pose, self.line, self.cells = None, [], []
            case messages.Step():
                self.step = message
                self._answered_s = None if self.card is None else time.monotonic()
                self.n_live += 1
            case messages.RobotPose():
                self.pose, self.cells = message.pose, message.cells
                self.n_live += 1
                if not self.line or self.line[-1] != message.pose[:2]:
                    self.line = [*self.line[-MOST_POINTS:], message.pose[:2]]
            case messages.CameraNote():
                self.camera_note = message.text
            case messages.TrialDriven():
                self._leave_trial()
            case messages.StudyDone():
                self._conclude(message.waiting or "Complete.")
            case messages.Question():
                super()._take(message)
                self._leave_trial()
            case messages.Ended():
                self._leave_trial()
                if self._ending is not None:
                    self.outcome, self.is_failed = self._ending
                super()._take(message)
            case _:
                super()._take(message)

    def _leave_trial(self) -> None:
        self.card = self._answered_s = None

    def _conclude(self, outcome: str, *, is_failed: bool = False) -> None:
        """Keep the outcome until the process has ended: its folder is in use until then."""
        self._ending = (outcome, is_failed)


# in a process


def run(channel: Channel, work: messages.StudyWork) -> None:
    """Run a study, or resume it."""
    folder = Path(work.folder)
    study = _study(work, folder)
    refuse_code(study, work.allow_code)

    def tell(progress: Progress) -> None:
        channel.report(messages.StudyProgress(**vars(progress)), is_last=progress.n_done >= progress.n_runs)

    result = run_study(study, folder, tell=tell, threads=work.threads, allow_code=work.allow_code)
    if work.port:
        with _operated(channel, work, study, folder) as operator:
            locking: dict[str, Any] = {"lock": work.lock, "who": work.who or None}
            result = drive_study(
                study, work.port, folder, operator=operator, allow_code=work.allow_code, **locking
            )
    physical = result.physical
    channel.say(messages.StudyDone("" if physical is None else physical.waiting))


def _study(work: messages.StudyWork, folder: Path) -> Study:
    if work.text is not None:
        return parse_study(work.text, str(folder.parent / f"{folder.name}.toml"))
    study = study_of(ResultsFolder.open(folder).description)
    check_files(study, folder.parent)
    if work.replicates:
        about = study.about.model_copy(update={"replicates": work.replicates})
        return study.model_copy(update={"about": about})
    return study


def study_of(description: Mapping[str, Any]) -> Study:
    """The study as resolved, from what its folder says of it.

    Raises:
        RecordVersionError: A condition has settings of another version.
        ValueError: It is no description of a study.
    """
    about = {key: description[key] for key in ("name", "title", "note", "seed", "replicates", "pair")}
    conditions = description["conditions"]
    return Study(
        about=StudySection(**about),
        report=ReportSection(**description["report"]),
        trials=TrialsSection(**(description.get("trials") or {})),
        conditions=tuple(
            Condition.from_settings(condition["name"], condition["settings"]) for condition in conditions
        ),
        notes=tuple(
            ConditionNotes(**{key: condition[key] for key in ConditionNotes.model_fields if key in condition})
            for condition in conditions
        ),
    )


@contextlib.contextmanager
def _operated(channel: Channel, work: messages.StudyWork, study: Study, folder: Path) -> Iterator[Operator]:
    """Return the operator of the robot, with a camera if one is named."""
    remote = connect_witness(work.witness) if work.witness else None
    if work.counts == "witness":
        if work.camera:
            raise StudyError(
                "A camera cannot see an emulated robot, which its witness scores. Leave the field 'Camera' empty, "
                "or choose another scorer."
            )
        yield WatchedOperator(channel, remote)
        return
    operator = PageOperator(channel, folder, when=work.when, witness=remote)
    if not work.camera:
        yield operator
        return

    def say(text: str) -> None:
        channel.say(messages.CameraNote(text))

    with under_camera(work.camera, study, operator, say, asks=work.counts != "camera") as looking:
        yield looking
