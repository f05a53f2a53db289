"""What the pages of the lab share: the studies, what goes on, and who has the robot."""

from __future__ import annotations

import re
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from realitygap.errors import StudyError
from realitygap.platforms import names_a_port
from realitygap.records import refuse_links
from realitygap.runs import NAME_PATTERN
from realitygap.settings import shown

from ._calibration_job import CalibrationJob
from ._checks import Checks
from ._counts import Counts
from ._files import refuse_camera, refuse_outside, refuse_platform, refuse_port
from ._gap_job import GapJob
from ._hand import Hand
from ._job import Job
from ._live_job import LiveJob
from ._photos import Photos
from ._studies import Studies, used_by
from ._study_job import StudyJob
from ._video_job import ENDINGS, VideoJob, videos_in
from ._watcher import Watcher


@dataclass(frozen=True)
class Visitor:
    """Somebody at a page.

    Attributes:
        key: Of their browser.
        who: The name that they gave; empty before.
    """

    key: str
    who: str = ""


HANDOVER_S = 20.0
"""Time that the operator of a robot has to answer who asks for it; after that the robot is handed over [s]."""


@dataclass(frozen=True)
class RobotRequest:
    """A visitor who asks for the robot that another visitor has.

    Attributes:
        visitor: Who asks.
        operator: Who has the robot.
        is_refused: Whether the operator keeps the robot.
    """

    visitor: Visitor
    operator: Visitor
    is_refused: bool = False


class Lab:
    """The lab of a folder of studies.

    Attributes:
        root: The folder.
        allow_code: Whether Python files of tasks may run.
        studies: In it.
        checks: Study files that are being checked.
        jobs: Studies that go on, or went on since the lab was opened, by name.
        watchers: The figures of studies that somebody has watched, by name.
        hand: The robot that is driven by hand, or was last; None before.
        gap: The gap that is measured or planned, or was last; None before.
        calibration: The calibration that goes on, or was last; None before.
        operator: Who has the robot: one visitor at a time, while others watch; None while nobody has.
        request: Who asked last for the robot that somebody else has; None where nobody did, or it was handed over.
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
        self.gap: GapJob | None = None
        self.calibration: CalibrationJob | None = None
        self.watchers: dict[str, Watcher] = {}
        self._counts: dict[str, Counts] = {}
        self._photos: dict[str, Photos] = {}
        self.videos: dict[str, VideoJob] = {}
        self.lives: dict[str, LiveJob] = {}
        self._lock = threading.RLock()

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

    def track(self, name: str, spec: str, trials: Sequence[int]) -> None:
        """Look for trials of a study in a video.

        Args:
            name: Of the study.
            spec: Of the video, as `read_camera` takes it; its file is in the lab's folder.
            trials: Their numbers.

        Raises:
            StudyError: There is no such study or video, no trial is named, or a video is being tracked already.
        """
        folder, video = self.studies.path(name), spec.partition("?")[0]
        refuse_camera(self.root, spec)
        if not trials:
            raise StudyError("No trial waits to be counted: there is nothing to look for in a video.")
        if video not in videos_in(self.root):
            raise StudyError(
                f"There is no video {video!r} in {self.root}. Put it there; its name ends in {', '.join(ENDINGS)}."
            )
        with self._lock:
            if any(not each.is_over for each in self.videos.values()):
                raise StudyError("A video is being tracked already. Wait until that is done, or stop it.")
            self.videos[name] = VideoJob(folder, self.root, spec, trials, self.changed)
        self.changed()

    def drive_live(self, name: str, wish: dict[str, Any]) -> None:
        """Have a network of a study drive a robot that everyone at its page sees.

        Args:
            name: Of the study.
            wish: `platform` and which trial, as `_live_work` takes them.

        Raises:
            StudyError: There is no such study, or a file outside the lab's folder is named.
        """
        folder, platform = self.studies.path(name), str(wish.get("platform") or "")
        refuse_port(self.root, platform) if "://" in platform else refuse_outside(self.root, platform)
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
                self.watchers[name] = Watcher(path, self.root, self.changed)
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
                raise StudyError(f"The study {name!r} is running already. Give this one another name.")
            folder = self.studies.new_path(name)
            self._begin(name, {"work": "study", "folder": str(folder), "text": text})

    def go_on(self, name: str, **options: Any) -> StudyJob:
        """Have a study go on where it stopped.

        Args:
            name: Of the study.
            options: `port` of a robot that drives it, and what goes with it.

        Raises:
            StudyError: It goes on already, or another study has the robot.
        """
        folder = self.studies.path(name)
        with self._lock:
            if self.job(name) is not None:
                raise StudyError(f"The study {name!r} goes on already.")
            if said := used_by(folder):
                raise StudyError(f"{name!r} is in use: {said} writes to it. Wait until it ends, or stop it.")
            if options.get("port"):
                refuse_port(self.root, options["port"])
                refuse_camera(self.root, str(options.get("camera") or ""))
                self.refuse_second_robot()
            return self._begin(name, {"work": "study", "folder": str(folder), **options})

    def _begin(self, name: str, order: dict[str, Any]) -> StudyJob:
        order["allow_code"] = self.allow_code
        job = self.jobs[name] = StudyJob(name, order, self.root, self.changed)
        self.changed()
        return job

    def job(self, name: str) -> StudyJob | None:
        """The job of a study, while it goes on."""
        job = self.jobs.get(name)
        return None if job is None or job.is_over else job

    # gaps

    def measure_gap(self, name: str, values: dict[str, Any]) -> None:
        """Measure a gap.

        Args:
            name: Of its files in the folder `gaps`.
            values: The arguments of `gap_between`.

        Raises:
            StudyError: A name that cannot be, a file outside the lab's folder, or something is at work already.
        """
        page = self.gap_page(name)
        if page is None:
            raise StudyError(
                f"A gap cannot be named {shown(name)}: expected letters, digits, '.', '-' and '_'."
            )
        for spec in (values["sim"], values["target"], values["controllers"]):
            refuse_platform(self.root, spec)
        with self._lock:
            if names_a_port(values["target"]):
                self.refuse_second_robot()
            kept = page.with_suffix(".jsonl")
            refuse_links(self.root, page, kept)
            page.parent.mkdir(exist_ok=True)
            order = {"measure": values, "page": str(page), "kept": str(kept)}
            self._begin_gap(name, order)

    def plan_gap(self, question: str, value: float) -> None:
        """Plan how many controllers and trials a question takes.

        Raises:
            StudyError: Something is at work already.
        """
        with self._lock:
            self._begin_gap("", {"plan": {"question": question, "value": value}})

    def _begin_gap(self, name: str, order: dict[str, Any]) -> None:
        if self.gap is not None and not self.gap.is_over:
            raise StudyError("A gap is being measured or planned already. Wait until it is done, or stop it.")
        self.gap = GapJob(name, order, self.root, self.changed)
        self.changed()

    def gap_page(self, name: str) -> Path | None:
        """Where the report of a gap is to be; None where it cannot have this name."""
        if not re.fullmatch(NAME_PATTERN, name) or len(name) > 80:
            return None
        return self.root / "gaps" / f"{name}.html"

    # calibrations

    def calibrate(self, name: str, values: dict[str, Any], visitor: Visitor) -> None:
        """Carry out a calibration, or what is missing of it.

        Args:
            name: Of its file in the lab's folder, without .toml.
            values: What, of which platform and how, as `_calibrate_work` takes it.
            visitor: Who has the robot, where there is one.

        Raises:
            StudyError: A name that cannot be, a file outside the lab's folder, or something is at work already.
        """
        if not re.fullmatch(NAME_PATTERN, name) or len(name) > 80:
            raise StudyError(
                f"A calibration cannot be named {shown(name)}: expected letters, digits, '.', '-' and '_'."
            )
        out = self.root / f"{name}.toml"
        if out.exists() and not out.with_suffix(".trials.jsonl").exists():
            raise StudyError(f"There is a file {out.name} already, of something else. Give another name.")
        refuse_links(self.root, out, out.with_suffix(".trials.jsonl"), out.with_suffix(".svg"))
        refuse_outside(self.root, values["base"])
        refuse_platform(self.root, values["platform"])
        is_robot = names_a_port(values["platform"])
        with self._lock:
            if self.calibration is not None and not self.calibration.is_over:
                raise StudyError("A calibration goes on already. Wait until it is done, or stop it.")
            if is_robot:
                self.refuse_second_robot()
                self.operator, self.request = visitor, None
            order = {**values, "out": str(out)}
            self.calibration = CalibrationJob(order, self.root, self.changed)
        self.changed()

    # the robot

    @property
    def robot_job(self) -> StudyJob | None:
        """The study that has the robot; None where none has."""
        return next((job for job in list(self.jobs.values()) if job.port and not job.is_over), None)

    @property
    def has_robot(self) -> bool:
        """Whether something here has a robot."""
        others = (each for each in (self.gap, self.calibration) if each is not None)
        is_measured = any(each.has_robot for each in others)
        return is_measured or self.robot_job is not None or (self.hand is not None and not self.hand.is_over)

    def connect(self, port: str, witness: str, visitor: Visitor) -> None:
        """Connect a robot, to be driven by hand by this visitor.

        Raises:
            StudyError: No port is named, or a robot is in use.
        """
        if not port:
            raise StudyError("No port was named. Expected one such as /dev/rfcomm0 or COM3.")
        refuse_port(self.root, port)
        with self._lock:
            self.refuse_second_robot()
            self.hand = Hand({"port": port, "witness": witness}, self.root, self.changed)
            self.operator, self.request = visitor, None
        self.changed()

    def take_robot(self, visitor: Visitor) -> None:
        """Have the visitor who began to use a robot be its operator."""
        with self._lock:
            self.operator, self.request = visitor, None
        self.changed()

    def ask_for_robot(self, visitor: Visitor) -> None:
        """Ask the operator for the robot; after `HANDOVER_S` without an answer it is handed over.

        Raises:
            StudyError: Somebody else asks already.
        """
        with self._lock:
            operator, asked = self.operator, self.request
            if self.may_operate(visitor) or operator is None:
                self.take_robot(visitor)
                return
            if asked is not None and not asked.is_refused:
                if asked.visitor.key == visitor.key:
                    return
                raise StudyError(
                    f"{asked.visitor.who or 'Somebody else'} asks for the robot already. Wait a moment."
                )
            self.request = request = RobotRequest(visitor, operator)
        waiting = threading.Timer(HANDOVER_S, self._answer, (request,), {"yes": True})
        waiting.daemon = True
        waiting.start()
        self.changed()

    def answer_request(self, operator: Visitor, *, yes: bool) -> None:
        """Hand the robot over to the visitor who asks for it, or keep it.

        Raises:
            StudyError: Nobody asks this operator any more.
        """
        request = self.request
        if request is None or request.operator.key != operator.key or not self._answer(request, yes=yes):
            raise StudyError("Nobody asks you for the robot any more.")

    def _answer(self, request: RobotRequest, *, yes: bool) -> bool:
        """Answer a request; False if it was answered before, or the robot has another operator by now."""
        with self._lock:
            if self.request is not request or request.is_refused:
                return False
            if self.operator is None or self.operator.key != request.operator.key:
                self.request = None
                return False
            self.request = None if yes else replace(request, is_refused=True)
            if yes:
                self.operator = request.visitor
                if self.hand is not None and not self.hand.is_over:
                    self.hand.stop()  # a handle that is still held drives no more
        self.changed()
        return True

    def may_operate(self, visitor: Visitor) -> bool:
        """Whether this visitor has the robot, or nobody has."""
        return not self.has_robot or self.operator is None or self.operator.key == visitor.key

    @property
    def operator_name(self) -> str:
        """Of who has the robot."""
        return (self.operator.who if self.operator else "") or "Somebody at another page"

    def refuse_second_robot(self) -> None:
        """Refuse to take the robot while something has it.

        Raises:
            StudyError: Something has it.
        """
        if self.robot_job is not None:
            raise StudyError(f"The study {self.robot_job.name!r} has the robot. End its sitting first.")
        if self.has_robot:
            raise StudyError(
                "A robot is in use, by hand, for a gap or for a calibration. Let it go there first."
            )

    def stop_robot(self) -> bool:
        """Stop the motors of whatever robot is in use; False where none is."""
        job, hand, is_used = self.robot_job, self.hand, self.has_robot
        if job is not None:
            job.stop_robot()
        if hand is not None and not hand.is_over:
            hand.stop()
        for each in (self.gap, self.calibration):
            if each is not None and each.has_robot:
                each.ask_to_end()
        return is_used

    def close(self) -> None:
        """End all processes, robots first."""
        with self._lock:
            single = [each for each in (self.hand, self.gap, self.calibration) if each is not None]
            working: list[Job] = [*self.jobs.values(), *self.videos.values(), *self.lives.values(), *single]
        going = [each for each in working if not each.is_over]
        for job in going:
            job.ask_to_end()
        for job in going:
            job.end()
        for watcher in self.watchers.values():
            watcher.end()
        for photos in self._photos.values():
            photos.end()
        self.checks.end()
