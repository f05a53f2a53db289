"""State that all pages share: studies, running work, and the operator of the robot."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from realitygap.errors import StudyError
from realitygap.orders import CalibrateOrder, GapOrder
from realitygap.platforms import names_a_port, platform_of
from realitygap.records import refuse_links
from realitygap.robots import typed_port
from realitygap.runs import NAME_PATTERN
from realitygap.settings import shown

from ._checks import Checks
from ._counts import Counts
from ._drawer import Drawer
from ._files import plain_files, refuse_camera, refuse_outside, refuse_port
from ._hand import Hand
from ._identify_job import IdentifyJob
from ._job import Job
from ._live_job import LiveJob
from ._measuring_jobs import CalibrationJob, GapJob
from ._photos import Photos
from ._problem import Mistakes
from ._standing import Standing, standing_of
from ._studies import Studies, used_by
from ._study_job import StudyJob
from ._video_job import ENDINGS, VideoJob, videos_in
from ._watcher import Watcher


@dataclass(frozen=True)
class Visitor:
    """A visitor at a page.

    Attributes:
        key: Of their browser.
        who: The name that they gave; empty before.
    """

    key: str
    who: str = ""


_NAME_RULE = "Use letters, digits, '.', '-', and '_'. Start with a letter or digit."


def _is_name(text: str) -> bool:
    """Return True if files of the lab can have this name."""
    return re.fullmatch(NAME_PATTERN, text) is not None and len(text) <= 80


def _check_name(text: str) -> None:
    """Raise a StudyError if files of the lab cannot have this name."""
    if not _is_name(text):
        raise StudyError(f"{_NAME_RULE} You entered {shown(text)}.")


MOST_REPORTS = 50
"""Number of reports of gaps that a page lists."""

HANDOVER_S = 20.0
"""Time that an operator has to answer a visitor who requests control of the robot [s]."""

STOPPED_S = 5.0
"""Time for which pages show that the robot was stopped [s]."""


@dataclass(frozen=True)
class RobotRequest:
    """A visitor's request to control the robot that another visitor operates.

    Attributes:
        visitor: The visitor who requests control.
        operator: The visitor who operates the robot.
        state: `asked`; `kept` after the operator refused; `unanswered` after `HANDOVER_S` without an answer.
    """

    visitor: Visitor
    operator: Visitor
    state: Literal["asked", "kept", "unanswered"] = "asked"


_RobotUser = Hand | StudyJob | GapJob | CalibrationJob


def _port_of(job: _RobotUser) -> str:
    """Return the port of the robot that something uses or used; empty if it needs none."""
    if isinstance(job, GapJob | CalibrationJob):
        return typed_port(job.platform) if names_a_port(job.platform) else ""
    return job.port


class Lab:
    """The lab of a folder of studies.

    Attributes:
        root: The folder.
        allow_code: Whether Python files of tasks may run.
        studies: In it.
        checks: Study files that are being checked.
        jobs: Studies that go on, or went on since the lab was opened, by name.
        drawer: The process that draws the figures of all studies.
        watchers: The figures of studies that somebody has watched, by name.
        hand: The robot that is driven by hand, or was last; None before.
        gap: The gap that is measured, or was last; None before.
        calibration: The calibration that goes on, or was last; None before.
        operator: Who has the robot: one visitor at a time, while others watch; None while nobody has.
        request: Last request to control the robot; None if there was none, or the robot was handed over since.
        videos: The video of each study that is tracked, or was last, by the study's name.
        lives: The robot that a network of each study drives for those who look, by the study's name.
        version: Counts changes, so that a page knows when to look.
    """

    def __init__(self, root: Path, *, allow_code: bool = False) -> None:
        self.root = root
        self.allow_code = allow_code
        self.studies = Studies(root)
        self.checks = Checks(root, allow_code=allow_code)
        self.jobs: dict[str, StudyJob] = {}
        self.version = 0
        self.operator: Visitor | None = None
        self.request: RobotRequest | None = None
        self.hand: Hand | None = None
        self._asked: dict[str, Hand | IdentifyJob] = {}
        self.gap: GapJob | None = None
        self.calibration: CalibrationJob | None = None
        self.drawer = Drawer(root)
        self.watchers: dict[str, Watcher] = {}
        self._counts: dict[str, Counts] = {}
        self._photos: dict[str, Photos] = {}
        self.videos: dict[str, VideoJob] = {}
        self.lives: dict[str, LiveJob] = {}
        self._lock = threading.RLock()
        self._stopped_s = -STOPPED_S
        self._last_user: _RobotUser | None = None
        self._lost_before = ""

    def changed(self) -> None:
        """Something has changed; may be called from any thread."""
        self.version += 1

    # studies

    def counts(self, name: str) -> Counts:
        """The trials of a study, for who counts."""
        path, description = self.studies.path(name), self.studies.results(name).description
        known = self._counts.get(name)
        if known is None or known.description != description:
            known = self._counts[name] = Counts(path, description)
        return known

    def photos(self, name: str) -> Photos:
        """The photographs of a study's sheets.

        Raises:
            StudyError: There is no study of this name.
        """
        path = self.studies.path(name)
        with self._lock:
            if name not in self._photos:
                self._photos[name] = Photos(path, self.root, self.changed)
            return self._photos[name]

    def video_mistakes(self, values: Mapping[str, Any]) -> Mistakes:
        """Return what is wrong in the fields of a video to track; a field that is missing is not checked."""
        mistakes = Mistakes()
        if "video" in values and values["video"] not in videos_in(self.root):
            with mistakes.in_field("video"):
                refuse_outside(self.root, values["video"])
                raise StudyError(
                    f"There is no video {values['video']!r} in the lab's folder. Put it there; its name ends in "
                    f"{', '.join(ENDINGS)}."
                )
        with mistakes.in_field("tags"):
            refuse_camera(self.root, f"?{values.get('tags') or ''}")
        return mistakes

    def track(self, name: str, spec: str, trials: Sequence[int]) -> None:
        """Look for trials of a study in a video.

        Args:
            name: Of the study.
            spec: Of the video, as `read_camera` takes it; its file is in the lab's folder.
            trials: Their numbers.

        Raises:
            StudyError: There is no such study or video, no trial is named, or a video is being tracked already.
        """
        folder, (video, _, tags) = self.studies.path(name), spec.partition("?")
        self.video_mistakes({"video": video, "tags": tags}).refuse()
        if not trials:
            raise StudyError("There are no trials to score from a video. Drive a trial first.")
        with self._lock:
            if any(not each.is_over for each in self.videos.values()):
                raise StudyError("A video is being tracked. Wait until it is complete, or stop it.")
            self.videos[name] = VideoJob(folder, self.root, spec, trials, self.changed)
        self.changed()

    def live_mistakes(self, values: Mapping[str, Any]) -> Mistakes:
        """Return what is wrong in the fields of a live drive."""
        mistakes, platform = Mistakes(), str(values.get("platform") or "")
        with mistakes.in_field("platform"):
            refuse_port(self.root, platform) if "://" in platform else refuse_outside(self.root, platform)
        return mistakes

    def drive_live(self, name: str, wish: dict[str, Any]) -> None:
        """Have a network of a study drive a robot that everyone at its page sees.

        Args:
            name: Of the study.
            wish: `platform` and which trial, as `_live_work` takes them.

        Raises:
            StudyError: There is no such study, or a file outside the lab's folder is named.
        """
        folder = self.studies.path(name)
        self.live_mistakes(wish).refuse()
        with self._lock:
            before = self.lives.pop(name, None)
            if before is not None:
                before.ask_to_end()
            self.lives[name] = LiveJob({**wish, "folder": str(folder)}, self.root, self.changed)
        self.changed()

    def watcher(self, name: str) -> Watcher:
        """The figures of a study.

        Raises:
            StudyError: There is none of this name.
        """
        path = self.studies.path(name)
        with self._lock:
            if name not in self.watchers:
                self.watchers[name] = Watcher(path, self.drawer, self.changed)
            return self.watchers[name]

    def start_new(self, name: str, text: str) -> None:
        """Begin a study.

        Args:
            name: Of the study, as a check found it in the file.
            text: Of its file.

        Raises:
            StudyError: The name is taken.
        """
        with self._lock:
            if self.job(name) is not None:
                raise StudyError(f"The study {name!r} is running. Choose another name.")
            folder = self.studies.new_path(name)
            self._begin(name, {"work": "study", "folder": str(folder), "text": text})

    def name_mistakes(self, name: str) -> Mistakes:
        """Return whether a study has this name already; a check of the study finds other mistakes in a name."""
        mistakes = Mistakes()
        with mistakes.in_field("study.name"):
            if _is_name(name):
                self.studies.new_path(name)
        return mistakes

    def go_on(self, name: str, **options: Any) -> StudyJob:
        """Resume a study.

        Args:
            name: Of the study.
            options: `replicates` if there are to be more; `port` of a robot that drives it, and what goes with it.

        Raises:
            StudyError: It goes on already, or another study has the robot.
        """
        folder = self.studies.path(name)
        with self._lock:
            if self.job(name) is not None:
                raise StudyError(f"The study {name!r} is running.")
            if said := used_by(folder):
                raise StudyError(f"{name!r} is in use: {said} writes to it. Wait until it ends, or stop it.")
            if options.get("port"):
                self.sitting_mistakes(options).refuse()
                self.refuse_second_robot()
            return self._begin(name, {"work": "study", "folder": str(folder), **options})

    def sitting_mistakes(self, values: Mapping[str, Any]) -> Mistakes:
        """Return what is wrong in the fields of trials on a robot; a field that is missing is not checked."""
        mistakes = Mistakes()
        if "port" in values:
            with mistakes.in_field("port"):
                refuse_port(self.root, values["port"])
        with mistakes.in_field("camera"):
            camera = str(values.get("camera") or "")
            refuse_camera(self.root, camera)
            if values.get("counts") == "camera" and not camera:
                raise StudyError("Enter the number of the camera that scores, such as 0.")
        return mistakes

    def _begin(self, name: str, order: dict[str, Any]) -> StudyJob:
        order["allow_code"] = self.allow_code

        def change() -> None:
            job = self.jobs.get(name)
            if job is not None and job.is_over:
                self.studies.forget(name)  # its state is read after its end, never before
            self.changed()

        job = self.jobs[name] = StudyJob(name, order, self.root, change)
        self._note_user(job)
        self.changed()
        return job

    def standing(self, name: str) -> Standing:
        """Return the state of a study, as every page shows it."""
        job = self.jobs.get(name)
        is_over = job is not None and job.is_over
        state = self.studies.lately(name)
        if job is not None and job.is_over and not is_over:
            state = self.studies.lately(name)  # it ended in the meantime
        return standing_of(state, job)

    def standings(self) -> list[Standing]:
        """Return the states of all studies, the last one changed first."""
        return [self.standing(name) for name in self.studies.names()]

    def job(self, name: str) -> StudyJob | None:
        """Return the job of a study while it runs."""
        job = self.jobs.get(name)
        return None if job is None or job.is_over else job

    # gaps

    def measure_gap(self, name: str, values: dict[str, Any], visitor: Visitor) -> None:
        """Measure a gap.

        Args:
            name: Name of its files in the folder `gaps`.
            values: Fields of the order.
            visitor: Operator of the robot, if the target is one.

        Raises:
            FormError: Names or platforms that cannot be used.
            StudyError: A gap is being measured, or the robot is in use.
        """
        self.gap_mistakes({**values, "name": name}).refuse()
        page = self.root / "gaps" / f"{name}.html"
        with self._lock:
            if self.gap is not None and not self.gap.is_over:
                raise StudyError("A gap is being measured. Wait until it is complete, or stop it.")
            kept = page.with_suffix(".jsonl")
            refuse_links(self.root, page, kept)
            if names_a_port(values["target"]):
                self.refuse_second_robot()
                self.operator, self.request = visitor, None
            page.parent.mkdir(exist_ok=True)
            self.gap = GapJob(GapOrder(**values, results=kept), page, self.root, self.changed)
            self._note_user(self.gap)
        self.changed()

    def gap_mistakes(self, values: Mapping[str, Any]) -> Mistakes:
        """Return what is wrong in the fields of a gap; a field that is missing is not checked."""
        mistakes = Mistakes()
        if "name" in values:
            with mistakes.in_field("name"):
                _check_name(values["name"])
        mistakes.in_order(GapOrder, values, self.root)
        if "target" in values and "target" not in mistakes.problems and not values.get("witness"):
            with mistakes.in_field("target"):
                if platform_of(values["target"]).needs_person:
                    raise StudyError(
                        "In the lab, a gap needs a target without an operator. For an emulator in another program, "
                        "enter its witness. For a robot, use the command: realitygap gap"
                    )
        return mistakes

    def gap_page(self, name: str) -> Path | None:
        """Return the file of a gap's report; None if a gap cannot have this name."""
        return self.root / "gaps" / f"{name}.html" if _is_name(name) else None

    def gap_reports(self) -> list[str]:
        """Return the names of the reports of gaps, the last one first."""
        reports = plain_files(self.root / "gaps", (".html",))
        return [path.stem for path in reports if self.gap_page(path.stem) == path][:MOST_REPORTS]

    # calibrations

    def calibrate(self, name: str, values: dict[str, Any], visitor: Visitor) -> None:
        """Calibrate, or continue a calibration that was stopped.

        Args:
            name: Name of its file in the lab's folder, without .toml.
            values: Fields of the order.
            visitor: Operator of the robot, if the platform is one.

        Raises:
            FormError: Names, platforms, or files that cannot be used.
            StudyError: A calibration is running, or the robot is in use.
        """
        self.calibration_mistakes({**values, "name": name}).refuse()
        out = self.root / f"{name}.toml"
        refuse_links(self.root, out, out.with_suffix(".trials.jsonl"), out.with_suffix(".svg"))
        is_robot = names_a_port(values["robot"])
        with self._lock:
            if self.calibration is not None and not self.calibration.is_over:
                raise StudyError("A calibration is running. Wait until it is complete, or stop it.")
            if is_robot:
                self.refuse_second_robot()
                self.operator, self.request = visitor, None
            self.calibration = CalibrationJob(CalibrateOrder(**values, out=out), self.root, self.changed)
            self._note_user(self.calibration)
        self.changed()

    def calibration_mistakes(self, values: Mapping[str, Any]) -> Mistakes:
        """Return what is wrong in the fields of a calibration; a field that is missing is not checked."""
        mistakes = Mistakes()
        if "name" in values:
            with mistakes.in_field("name"):
                _check_name(values["name"])
                out = self.root / f"{values['name']}.toml"
                if out.exists() and not out.with_suffix(".trials.jsonl").exists():
                    raise StudyError(f"There is another file {out.name}. Choose another name.")
        mistakes.in_order(CalibrateOrder, values, self.root)
        return mistakes

    # the robot

    @property
    def robot_job(self) -> StudyJob | None:
        """The study that has the robot; None where none has."""
        return next((job for job in list(self.jobs.values()) if job.port and not job.is_over), None)

    @property
    def has_robot(self) -> bool:
        """True if something here has a robot."""
        others = (each for each in (self.gap, self.calibration) if each is not None)
        is_measured = any(each.has_robot for each in others)
        return is_measured or self.robot_job is not None or (self.hand is not None and not self.hand.is_over)

    def connect(self, port: str, witness: str, visitor: Visitor) -> None:
        """Connect a robot, to be driven by hand by this visitor.

        Raises:
            StudyError: No port is named, or a robot is in use.
        """
        mistakes = Mistakes()
        with mistakes.in_field("port"):
            if not port:
                raise StudyError("This field is empty. Enter a port such as /dev/rfcomm0 or COM3.")
            refuse_port(self.root, port)
        mistakes.refuse()
        with self._lock:
            self.refuse_second_robot()
            if self._is_identifying(port):
                raise StudyError(f"A robot is being looked for on {port}. Wait until the answer is shown.")
            self.hand = self._asked[port] = Hand({"port": port, "witness": witness}, self.root, self.changed)
            self._note_user(self.hand)
            self.operator, self.request = visitor, None
        self.changed()

    def reply_on(self, port: str) -> str:
        """Return what answered on a port when it was last asked; empty if it was not."""
        asked = self._asked.get(port)
        return "" if asked is None else asked.reply

    def identify(self, port: str) -> None:
        """Ask the robot on a port for its name. This sends bytes to the device, whatever it is.

        Raises:
            StudyError: The port cannot be used, or something uses it.
        """
        refuse_port(self.root, port)
        with self._lock:
            if self._is_identifying(port):
                return
            if self.has_robot and self.robot_port == port:
                raise StudyError(f"The robot on {port} is in use. Disconnect it first.")
            self._asked[port] = IdentifyJob(port, self.root, self.changed)
        self.changed()

    def _is_identifying(self, port: str) -> bool:
        asked = self._asked.get(port)
        return isinstance(asked, IdentifyJob) and not asked.is_over

    def take_robot(self, visitor: Visitor) -> None:
        """Make the visitor who began to use a robot its operator."""
        with self._lock:
            self.operator, self.request = visitor, None
        self.changed()

    def ask_for_robot(self, visitor: Visitor) -> None:
        """Request control of the robot; a robot that nobody operates is handed over immediately.

        Raises:
            StudyError: Another visitor's request is waiting for an answer.
        """
        with self._lock:
            operator, asked = self.operator, self.request
            if self.may_operate(visitor) or operator is None:
                self.take_robot(visitor)
                return
            if asked is not None and asked.state == "asked":
                if asked.visitor.key == visitor.key:
                    return
                raise StudyError(
                    f"{asked.visitor.who or 'Another visitor'} has requested control. Wait for the answer."
                )
            self.request = request = RobotRequest(visitor, operator)
        waiting = threading.Timer(HANDOVER_S, self._end_request, (request, "unanswered"))
        waiting.daemon = True
        waiting.start()
        self.changed()

    def answer_request(self, operator: Visitor, *, yes: bool) -> None:
        """Hand the robot over to the visitor who requests control, or keep it.

        Raises:
            StudyError: No visitor requests control from this operator.
        """
        request = self.request
        if request is None or request.operator.key != operator.key or request.state == "kept":
            raise StudyError("The request for control has ended.")
        if yes:
            self._hand_over(request)
        else:
            self._end_request(request, "kept")

    def take_over(self, visitor: Visitor) -> None:
        """Take control of the robot from an operator who did not answer.

        Raises:
            StudyError: The operator has not had the time to answer, or the robot is moving.
        """
        with self._lock:
            request = self.request
            if request is None or request.visitor.key != visitor.key or request.state != "unanswered":
                raise StudyError(f"Request control first, and wait {HANDOVER_S:.0f} s for the answer.")
            if self.robot_moves:
                raise StudyError("The robot is moving. Wait until it stands still, or stop it.")
            self._hand_over(request)

    def _hand_over(self, request: RobotRequest) -> None:
        with self._lock:
            if self.request is not request:
                raise StudyError("The request for control has ended.")
            self.operator, self.request = request.visitor, None
            if self.hand is not None and not self.hand.is_over:
                self.hand.stop()  # a drive pad that is still held drives no more
        self.changed()

    def _end_request(self, request: RobotRequest, state: Literal["kept", "unanswered"]) -> None:
        with self._lock:
            if self.request is request:
                is_current = self.operator is not None and self.operator.key == request.operator.key
                self.request = replace(request, state=state) if is_current else None
        self.changed()

    def may_operate(self, visitor: Visitor) -> bool:
        """Return True if this visitor has the robot, or nobody has."""
        return not self.has_robot or self.operator is None or self.operator.key == visitor.key

    @property
    def operator_name(self) -> str:
        """Name of the visitor who operates the robot."""
        return (self.operator.who if self.operator else "") or "Another visitor"

    def refuse_second_robot(self) -> None:
        """Refuse to take the robot while something has it.

        Raises:
            StudyError: Something has it.
        """
        if self.robot_job is not None:
            raise StudyError(f"The study {self.robot_job.name!r} uses the robot. Disconnect it there first.")
        if self.has_robot:
            raise StudyError(
                "A robot is connected for driving by hand, a gap, or a calibration. Disconnect it there first."
            )

    @property
    def robot_port(self) -> str:
        """Port of the robot that is connected; empty if none is."""
        if self.robot_job is not None:
            return self.robot_job.port
        if self.hand is not None and not self.hand.is_over:
            return self.hand.port
        measured = (each for each in (self.gap, self.calibration) if each is not None and each.has_robot)
        return next((_port_of(each) for each in measured), "")

    @property
    def lost_port(self) -> str:
        """Port of the last robot if the link to it failed, and no robot has answered since; empty otherwise."""
        last = self._last_user
        if last is None or not last.has_met:
            return self._lost_before
        return _port_of(last) if last.is_lost else ""

    def _note_user(self, job: _RobotUser) -> None:
        """Remember what uses the robot, and whether the link to the robot before it is lost."""
        if _port_of(job):
            self._lost_before, self._last_user = self.lost_port, job

    @property
    def is_robot_silent(self) -> bool:
        """True if the robot in use has not answered for a while."""
        if self.robot_job is not None:
            return self.robot_job.silent_s > 0
        if self.hand is not None and not self.hand.is_over:
            return self.hand.is_silent
        measured = (each for each in (self.gap, self.calibration) if each is not None and each.has_robot)
        return any(each.silent_s > 0 for each in measured)

    @property
    def robot_action(self) -> str:
        """Sentence that states what the robot is doing now; empty if it stands still."""
        job, hand = self.robot_job, self.hand
        if job is not None:
            return f"The robot is driving trial {job.card['trial']}." if job.card is not None else ""
        if hand is not None and not hand.is_over:
            return "The robot is driven by hand." if hand.senses is not None and hand.senses["moves"] else ""
        if self.gap is not None and self.gap.has_robot:
            return "The robot is driving trials of a gap."
        if self.calibration is not None and self.calibration.has_robot and self.calibration.ask is None:
            return "The robot is driving a trial of a calibration."
        return ""

    @property
    def robot_moves(self) -> bool:
        """True if the robot is driving, as far as its process has reported."""
        return bool(self.robot_action)

    @property
    def is_just_stopped(self) -> bool:
        """True if a visitor stopped the robot in the last seconds, and it has not been driven since."""
        return time.monotonic() - self._stopped_s < STOPPED_S and not self.robot_moves

    def stop_robot(self) -> bool:
        """Stop the motors of the robot in use; return False if there is none."""
        job, hand, is_used = self.robot_job, self.hand, self.has_robot
        if job is not None:
            job.stop_robot()
        if hand is not None and not hand.is_over:
            hand.stop()
        for each in (self.gap, self.calibration):
            if each is not None and each.has_robot:
                each.ask_to_end()
        if is_used:
            self._stopped_s = time.monotonic()
        return is_used

    def close(self) -> None:
        """End all processes, robots first."""
        with self._lock:
            single = [each for each in (self.hand, self.gap, self.calibration) if each is not None]
            asked = [each for each in self._asked.values() if isinstance(each, IdentifyJob)]
            working: list[Job] = [
                *self.jobs.values(),
                *self.videos.values(),
                *self.lives.values(),
                *single,
                *asked,
            ]
        going = [each for each in working if not each.is_over]
        for job in going:
            job.ask_to_end()
        for job in going:
            job.end()
        self.drawer.end()
        for photos in self._photos.values():
            photos.end()
        self.checks.end()
