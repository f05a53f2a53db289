"""What the pages of the lab share: the studies, what goes on, and who has the robot."""

from __future__ import annotations

import re
import threading
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realitygap.errors import RealityGapError, StudyError
from realitygap.runs import NAME_PATTERN
from realitygap.settings import shown
from realitygap.study import parse_study

from ._calibration_job import CalibrationJob
from ._counts import Counts
from ._files import refuse_camera, refuse_files_outside, refuse_outside, refuse_platform, refuse_port
from ._gap_job import ROBOT, GapJob
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


class Lab:
    """The lab of a folder of studies.

    Attributes:
        root: The folder.
        studies: In it.
        jobs: Studies that go on, or went on since the lab was opened, by name.
        watchers: The figures of studies that somebody has watched, by name.
        hand: The robot that is driven by hand, or was last; None before.
        gap: The gap that is measured or planned, or was last; None before.
        calibration: The calibration that goes on, or was last; None before.
        operator: Who has the robot: one visitor at a time, while others watch; None while nobody has.
        videos: The video of each study that is tracked, or was last, by the study's name.
        lives: The robot that a network of each study drives for those who look, by the study's name.
        version: Counts changes, so that a page knows when to look.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self.studies = Studies(root)
        self.jobs: dict[str, StudyJob] = {}
        self.version = 0
        self.operator: Visitor | None = None
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

    def start_new(self, text: str) -> str:
        """Begin a study.

        Args:
            text: Of its file.

        Returns:
            Its name.

        Raises:
            StudyError: There are mistakes in the file, it names files outside the lab's folder, or the name is taken.
        """
        refuse_files_outside(self.root, text)
        study = parse_study(text, str(self.root / "study.toml"))
        folder = self.studies.new_path(study.about.name)
        with self._lock:
            self._begin(study.about.name, {"work": "study", "folder": str(folder), "text": text})
        return study.about.name

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
        for key in ("sim", "target", "controllers"):
            refuse_platform(self.root, values[key])
        with self._lock:
            if values["target"].startswith(ROBOT):
                self.refuse_second_robot()
            page.parent.mkdir(exist_ok=True)
            order = {"measure": values, "page": str(page), "kept": str(page.with_suffix(".jsonl"))}
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
        refuse_outside(self.root, values["base"])
        refuse_platform(self.root, values["platform"])
        is_robot = values["platform"].startswith(ROBOT)
        with self._lock:
            if self.calibration is not None and not self.calibration.is_over:
                raise StudyError("A calibration goes on already. Wait until it is done, or stop it.")
            if is_robot:
                self.refuse_second_robot()
                self.operator = visitor
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
            self.operator = visitor
        self.changed()

    def take_robot(self, visitor: Visitor, *, over: bool = False) -> None:
        """Have a visitor be the operator.

        Raises:
            StudyError: Somebody else is, and it is not taken over.
        """
        with self._lock:
            if not over and not self.may_operate(visitor):
                raise StudyError(f"{self.operator_name} has the robot. Take it over first, if they agree.")
            self.operator = visitor
        self.changed()

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


def check_study(root: Path, text: str) -> str:
    """Whether a study can be begun from the text of a file: what is wrong with it, or nothing."""
    try:
        refuse_files_outside(root, text)
        parse_study(text, str(root / "study.toml"))
    except RealityGapError as error:
        return str(error)
    except tomllib.TOMLDecodeError as error:
        return f"This is not TOML: {error}."
    return ""
