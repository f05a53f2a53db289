"""A video of trials is tracked; a person checks the cells."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from nicegui import run, ui

from realitygap._wording import counted
from realitygap.lab._counts import Counts
from realitygap.lab._lab import Lab
from realitygap.lab._video import VideoJob, video_mistakes, videos_in

from ._fields import Form, needed
from ._frame import hint


class Videos:
    """Trials looked for in a video of the camera above the robot.

    Args:
        lab: Whose page it is.
        counts: The trials of the study.
        jump: Shows a trial to be counted.
    """

    def __init__(self, lab: Lab, counts: Counts, jump: Callable[[int], Any]) -> None:
        self._lab, self._counts, self._jump = lab, counts, jump
        self._files: list[str] = []

    async def load(self) -> None:
        """Read the list of videos in the lab's folder."""
        self._files = await run.io_bound(videos_in, self._lab.root) or []

    def stand(self) -> Any:
        """Return a value that changes with the content of the section."""
        job = self._job()
        shown = None if job is None else (id(job), job.outcome)
        return shown, bool(self._waiting())

    @property
    def has_job(self) -> bool:
        """True if a video is tracked, or was."""
        return self._job() is not None

    def show(self) -> None:
        """Show the section; if there is no line to count, show only the result of a video."""
        job = self._job()
        if job is not None and not job.is_over:
            self._show_tracking(job)
            return
        if job is not None:
            self._show_outcome(job)
        if self._waiting():
            with ui.expansion("Score from a video").classes("lab-expansion"):
                self._show_form()

    # inside

    def _job(self) -> VideoJob | None:
        return self._lab.videos.get(self._counts.name)

    def _waiting(self) -> list[int]:
        return [each.number for each in self._counts.trials() if each.trial.state == "driven"]

    def _show_tracking(self, job: VideoJob) -> None:
        bar = ui.linear_progress(job.share, show_value=False).props('aria-label="Of the video gone through"')
        ui.label(f"Tracking {job.spec}… You can leave this page.").props('role="status"')
        ui.timer(0.3, lambda: bar.set_value(round(job.share, 3)))
        ui.button("Stop tracking", on_click=job.ask_to_end).props("outline no-caps")

    def _show_outcome(self, job: VideoJob) -> None:
        ui.label(job.outcome or "").classes("lab-problem" if job.is_failed else "").props('role="status"')
        for text in job.missed:
            hint(text)
        waiting = set(self._waiting())
        with ui.row().classes("lab-row"):
            for number in job.found:
                if number in waiting:
                    ui.button(
                        f"Check trial {number}", on_click=lambda number=number: self._jump(number)
                    ).props("outline no-caps")

    def _show_form(self) -> None:
        found, waiting = self._files, self._waiting()
        hint(
            "Film the arena with its corner tags and the robot with its tag, from before a trial until the robot "
            "stands still. Put the video into the lab's folder."
        )
        form = Form()
        form.summary()
        videos = {"Videos in this folder": {name: name for name in found}}
        form.text("video", "Video", found[-1] if found else "", choices=videos, parse=needed)
        form.text(
            "tags",
            "Tags",
            "tag=10&tag-height=0.1",
            explanation="As for realitygap track: tag, tag-size, tag-height, tag-at, corner-size, corner-inset, lens.",
        )
        which = {0: f"All unscored: {counted(len(waiting), 'trial')}"} | {
            number: f"Trial {number}" for number in waiting
        }
        form.choice("trial", "Trials in the video", which, 0)

        def track(values: dict[str, Any]) -> None:
            spec, trial = f"{values['video']}?{values['tags']}", values["trial"]
            self._lab.track(self._counts.name, spec, [trial] if trial else self._waiting())

        find = partial(video_mistakes, self._lab.root)
        ui.button("Track video", on_click=lambda: form.submit(track, find)).props("unelevated no-caps")
