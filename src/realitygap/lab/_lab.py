"""State that all pages share: studies, and the jobs of the lab."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from realitygap.errors import StudyError
from realitygap.orders import CalibrateOrder, GapOrder
from realitygap.records import existing_trials, refuse_links
from realitygap.robots import is_in_this_program

from ._calibration import CalibrationJob, calibration_mistakes
from ._checks import Checks
from ._class import Classroom
from ._control import RobotControl, Visitor
from ._counts import Counts
from ._design import TOO_LATE
from ._drawing import Drawer
from ._files import is_name, plain_files
from ._gap import GapJob, gap_mistakes
from ._job import Job
from ._live import LiveJob, live_mistakes
from ._messages import LiveWork, StudyWork, TrialChoice, VideoWork
from ._mistakes import FormError, Mistakes, refuse_unnamed
from ._own_robots import OwnRobots
from ._photos import Photos
from ._standing import Standing, standing_of
from ._studies import Studies, used_by
from ._study import StudyJob, sitting_mistakes
from ._video import VideoJob, video_mistakes
from ._watcher import Watcher

MOST_REPORTS = 50
"""Number of reports of gaps that a page lists."""


class Lab:
    """The lab of a folder of studies.

    Attributes:
        root: The folder.
        allow_code: Whether Python files of tasks may run.
        studies: In it.
        checks: Study files that are being checked.
        jobs: Studies that go on, or went on since the lab was opened, by name.
        robot: Control of the robot.
        drawer: The process that draws the figures of all studies.
        watchers: The figures of studies that somebody has watched, by name.
        gap: The gap that is measured, or was last; None before.
        calibration: The calibration that goes on, or was last; None before.
        videos: The video of each study that is tracked, or was last, by the study's name.
        lives: The robot that a network of each study drives for those who look, by the study's name.
        classroom: The class; None if the lab has none.
        version: Counts changes, so that a page knows when to look.
    """

    def __init__(self, root: Path, *, allow_code: bool = False) -> None:
        self.root = root
        self.allow_code = allow_code
        self.studies = Studies(root)
        self.checks = Checks(root, allow_code=allow_code)
        self._lock = threading.RLock()
        self.robot = RobotControl(root, self._lock, self.changed)
        self._own_robots = OwnRobots(root, self._lock, self.changed)
        self.jobs: dict[str, StudyJob] = {}
        self.version = 0
        self.gap: GapJob | None = None
        self.calibration: CalibrationJob | None = None
        self.drawer = Drawer(root, allow_code=allow_code)
        self.watchers: dict[str, Watcher] = {}
        self._counts: dict[str, Counts] = {}
        self._photos: dict[str, Photos] = {}
        self.videos: dict[str, VideoJob] = {}
        self.lives: dict[str, LiveJob] = {}
        self.classroom: Classroom | None = None

    def changed(self) -> None:
        """Something has changed; may be called from any thread."""
        self.version += 1

    # robots

    def robot_of(self, visitor: Visitor) -> RobotControl:
        """Return the control of the visitor's emulated robot if there is one, otherwise of the lab's robot."""
        own = self._own_robots.of(visitor)
        return self.robot if own is None or (own.job is None and self.robot.job is not None) else own

    def connect(self, port: str, witness: str, visitor: Visitor) -> None:
        """Connect a robot to be driven by hand: the lab's robot, or an emulated one for this visitor alone.

        Raises:
            StudyError: No port is named, or a robot is in use.
        """
        (self._own_robots if is_in_this_program(port) else self.robot).connect(port, witness, visitor)

    def stop_robots(self, visitor: Visitor) -> bool:
        """Stop the lab's robot and the visitor's emulated one; return False if there is neither."""
        stopped = [robot.stop() for robot in {self.robot, self.robot_of(visitor)}]
        return any(stopped)

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
        folder, (video, _, tags) = self.studies.path(name), spec.partition("?")
        video_mistakes(self.root, {"video": video, "tags": tags}).refuse()
        if not trials:
            raise StudyError("There are no trials to score from a video. Drive a trial first.")
        with self._lock:
            if any(not job.is_over for job in self.videos.values()):
                raise StudyError("A video is being tracked. Wait until it is complete, or stop it.")
            work = VideoWork(str(folder), str(self.root), spec, list(trials))
            self.videos[name] = VideoJob(work, self.root, self.changed)
        self.changed()

    def drive_live(self, name: str, platform: str, trial: TrialChoice) -> None:
        """Have a network of a study drive a robot that everyone at its page sees.

        Args:
            name: Of the study.
            platform: Platform, as `open_robot` takes it; empty for that of the condition.
            trial: Trial whose network drives.

        Raises:
            StudyError: There is no such study, or a file outside the lab's folder is named.
        """
        folder = self.studies.path(name)
        live_mistakes(self.root, {"platform": platform}).refuse()
        with self._lock:
            before = self.lives.pop(name, None)
            if before is not None:
                before.ask_to_end()
            self.lives[name] = LiveJob(LiveWork(str(folder), platform, trial), self.root, self.changed)
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
            self._begin(name, StudyWork(str(folder), self.allow_code, text))

    def name_mistakes(self, name: str) -> Mistakes:
        """Return whether a study has this name already; a check of the study finds other mistakes in a name."""
        mistakes = Mistakes()
        with mistakes.in_field("study.name"):
            if is_name(name):
                self.studies.new_path(name)
        return mistakes

    def go_on(self, name: str, **options: Any) -> StudyJob:
        """Resume a study.

        Args:
            name: Of the study.
            options: Fields of a `StudyWork`: `replicates` if there are to be more; `port` of a robot that drives it,
                and what goes with it.

        Raises:
            StudyError: It goes on already, or another study has the robot.
        """
        folder = self.studies.path(name)
        with self._lock:
            if self.job(name) is not None:
                raise StudyError(f"The study {name!r} is running.")
            if program := used_by(folder):
                raise StudyError(
                    f"{name!r} is in use: {program} writes to it. Wait until it ends, or stop it."
                )
            if options.get("port"):
                sitting_mistakes(self.root, options).refuse()
                if options.get("lock"):
                    refuse_unnamed(options.get("who", ""))
                    counts = self.counts(name)
                    counts.look()
                    if counts.has_begun:
                        raise FormError({"lock": TOO_LATE})
                self.robot.refuse_second()
            return self._begin(name, StudyWork(str(folder), self.allow_code, **options))

    def _begin(self, name: str, work: StudyWork) -> StudyJob:
        def change() -> None:
            job = self.jobs.get(name)
            if job is not None and job.is_over:
                self.studies.forget(name)  # its state is read after its end, never before
            self.changed()

        job = self.jobs[name] = StudyJob(name, work, self.root, change)
        self.robot.note(job)
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

    # gaps and calibrations

    def measure_gap(
        self, name: str, values: dict[str, Any], visitor: Visitor, *, closes: bool = False
    ) -> None:
        """Measure a gap.

        Args:
            name: Name of its files in the folder `gaps`.
            values: Fields of the order.
            visitor: Operator of the robot, if the target is one.
            closes: True to calibrate then, and to measure again.

        Raises:
            FormError: Names or platforms that cannot be used.
            StudyError: A gap is being measured, or the robot is in use.
        """
        gap_mistakes(self.root, {**values, "name": name}, closes=closes).refuse()
        page = self.root / "gaps" / f"{name}.html"
        with self._lock:
            if self.gap is not None and not self.gap.is_over:
                raise StudyError("A gap is being measured. Wait until it is complete, or stop it.")
            trials = page.with_suffix(".sqlite")
            refuse_links(self.root, page, trials)
            order = GapOrder(**values, results=existing_trials(trials))
            self.robot.take_for(order.target, visitor)
            page.parent.mkdir(exist_ok=True)
            self.gap = GapJob(order, page, self.root, self.changed, closes=closes)
            self.robot.note(self.gap, order.target)
        self.changed()

    def gap_page(self, name: str) -> Path | None:
        """Return the file of a gap's report; None if a gap cannot have this name."""
        return self.root / "gaps" / f"{name}.html" if is_name(name) else None

    def gap_reports(self) -> list[str]:
        """Return the names of the reports of gaps, the last one first."""
        reports = plain_files(self.root / "gaps", (".html",))
        return [path.stem for path in reports if self.gap_page(path.stem) == path][:MOST_REPORTS]

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
        calibration_mistakes(self.root, {**values, "name": name}).refuse()
        out = self.root / f"{name}.toml"
        refuse_links(self.root, out, out.with_suffix(".trials.sqlite"), out.with_suffix(".svg"))
        with self._lock:
            if self.calibration is not None and not self.calibration.is_over:
                raise StudyError("A calibration is running. Wait until it is complete, or stop it.")
            self.robot.take_for(values["robot"], visitor)
            self.calibration = CalibrationJob(CalibrateOrder(**values, out=out), self.root, self.changed)
            self.robot.note(self.calibration, values["robot"])
        self.changed()

    def close(self) -> None:
        """End all processes, robots first."""
        if self.classroom is not None:
            self.classroom.close()
        with self._lock:
            single: list[Job | None] = [self.gap, self.calibration]
            jobs = [
                *self.robot.jobs(),
                *self._own_robots.jobs(),
                *self.jobs.values(),
                *self.videos.values(),
                *self.lives.values(),
                *single,
            ]
        running = [job for job in jobs if job is not None and not job.is_over]
        for job in running:
            job.ask_to_end()
        for job in running:
            job.end()
        self.drawer.end()
        for photos in self._photos.values():
            photos.end()
        self.checks.end()
