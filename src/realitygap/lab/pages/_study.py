"""Study: its state, with the tabs of its results, replays, and report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from nicegui import app, events, run, ui
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, PlainTextResponse, Response

from realitygap._wording import counted
from realitygap.drawing import themed_file
from realitygap.errors import RealityGapError
from realitygap.lab._access import FOREIGN_HEADERS
from realitygap.lab._choices import Choices, platform_choices
from realitygap.lab._counts import Counts
from realitygap.lab._figure_cache import read_thumbnail
from realitygap.lab._lab import Lab
from realitygap.lab._messages import TrialCard
from realitygap.lab._standing import Standing
from realitygap.lab._study import StudyJob
from realitygap.lab._watcher import Watcher
from realitygap.orders import Limits

from ._fields import Form
from ._frame import framed, hint, section
from ._home import show_control, show_state
from ._notices import attempt
from ._part import Part, watching
from ._replay import Replays
from ._results import GROWING, Results
from ._sitting import Driving
from ._status import Progress

MOST_REPLICATES = 1_000_000_000
"""Largest number of runs per condition that a study takes."""
LOOK_S = 0.5
"""Time between two looks at the study's folder [s]."""


def add_study(lab: Lab) -> None:
    """Add the page, and the files that it shows."""

    @ui.page("/study/{name}", response_timeout=30)
    async def study(name: str) -> None:
        above = [("Studies", "/")]
        found = await run.io_bound(_open, lab, name)
        if found is None and lab.jobs.get(name) is None:
            raise HTTPException(404, name)
        if found is None:
            with framed(lab, name, "", above=above, is_wide=True):
                _Starting(lab, name).show()
        elif found.standing.word == "Failed" and not found.conditions:
            with framed(lab, name, "", above=above):
                ui.label(found.standing.message).classes("lab-problem lab-lines")
        else:
            with framed(lab, found.standing.state.title, "", above=above, is_wide=True):
                _Page(lab, found).show()

    @app.get("/figures/{name}/{figure}-{width}.svg")
    def figure(name: str, figure: str, width: str) -> Response:
        watcher = lab.watchers.get(name)
        packed = None if watcher is None else watcher.figures.get(figure)
        drawn = None if packed is None or width not in ("wide", "narrow") else packed.get(width)
        if drawn is None:
            return PlainTextResponse("There is no such figure.", 404)
        encoding = {"cache-control": "no-store", "content-encoding": "gzip"}  # which every browser reads
        return Response(drawn, media_type="image/svg+xml", headers={**FOREIGN_HEADERS, **encoding})

    @app.get("/figures/{name}/thumbnail.svg")
    def thumbnail(name: str) -> Response:
        try:
            svg = read_thumbnail(lab.studies.path(name))
        except RealityGapError:
            svg = None
        if svg is None:
            return PlainTextResponse("There is no such picture.", 404)
        headers = {**FOREIGN_HEADERS, "cache-control": "no-store"}
        themed = themed_file(svg.decode("utf-8", "replace"))
        return Response(themed, media_type="image/svg+xml", headers=headers)

    @app.get("/reports/{name}")
    def report(name: str) -> Response:
        try:
            path = lab.studies.path(name) / "report.html"
        except RealityGapError as error:
            return PlainTextResponse(str(error), 404)
        if not path.is_file() or path.is_symlink():
            return PlainTextResponse("There is no report yet.", 404)
        headers = {**FOREIGN_HEADERS, "cache-control": "no-store"}
        return FileResponse(path, media_type="text/html", headers=headers)


@dataclass(frozen=True)
class _Opened:
    """Facts about a study that are read when its page is opened."""

    standing: Standing
    watcher: Watcher
    counts: Counts | None
    conditions: list[str]
    platforms: Choices


def _open(lab: Lab, name: str) -> _Opened | None:
    """Read what the page shows; None if there is no study of this name."""
    try:
        lab.studies.path(name)
    except RealityGapError:
        return None
    standing = lab.standing(name)
    state = standing.state
    conditions: list[str] = []
    counts = None
    if state.n_all:
        conditions = list(lab.studies.results(name).conditions)
        counts = lab.counts(name) if state.has_robot else None
    if counts is not None:
        counts.look()
    platforms = platform_choices(lab.root, "target")
    watcher = lab.watcher(name)
    if state.n_all_done:  # saved figures are on the page from the start
        watcher.look(state.done, is_running=standing.word in GROWING)
    elif standing.word == "Running":
        lab.drawer.prepare()
    return _Opened(standing, watcher, counts, conditions, platforms)


class _Starting:
    """A study whose process has not made its folder yet."""

    def __init__(self, lab: Lab, name: str) -> None:
        self._lab, self._name = lab, name

    def show(self) -> None:
        Part(self._state, self._show).show()
        self._timer = ui.timer(0.2, self._look)

    def _state(self) -> str:
        job = self._lab.jobs[self._name]
        return job.outcome or ""

    def _show(self, outcome: str) -> None:
        ui.label("Starting the study…").props('role="status"')
        ui.skeleton().classes("lab-skeleton")

    async def _look(self) -> None:
        if await run.io_bound(self._lab.studies.has, self._name):
            self._timer.deactivate()
            ui.navigate.reload()
        elif self._state():
            self._timer.deactivate()
            ui.label(self._state()).classes("lab-problem lab-lines").props('role="alert"')
            ui.link("New study", "/new")


class _Page:
    def __init__(self, lab: Lab, opened: _Opened) -> None:
        self._lab = lab
        self._standing = standing = opened.standing
        self._name = name = standing.state.name
        self._counts, self._watcher = opened.counts, opened.watcher
        self._results = Results(standing, opened.watcher, opened.conditions)
        self._replays = Replays(lab, name, opened.watcher, opened.conditions, opened.platforms)
        self._has_report = standing.state.has_report
        self._replicates = standing.state.replicates
        self._is_writing = self._is_looking = False
        self._report_stamp = self._watcher.report_stamp

    def show(self) -> None:
        self._dialogs = ui.element("div")  # apart from the state, which is drawn again while a dialog is open
        self._state = Part(lambda: self._standing.steady, self._show_state)
        self._state.show()
        with ui.tabs().props("no-caps align=left") as tabs:
            overview = ui.tab("Overview")
            if self._standing.state.has_robot:
                ui.tab("Trials")
            replay, report = ui.tab("Replay"), ui.tab("Report")
        self._panels_box = ui.tab_panels(tabs, value=overview, on_change=self._turn).classes("lab-panels")
        with self._panels_box.props("keep-alive"):
            with ui.tab_panel(overview):
                self._show_overview()
            with ui.tab_panel(replay).classes("lab-replay"):
                self._replays.show()
            with ui.tab_panel(report):
                self._show_reporting()
        watching(self._lab, self._look)
        ui.timer(LOOK_S, self._look_at_disk)

    async def _turn(self, event: events.ValueChangeEventArguments[Any]) -> None:
        """Open the page of trials; play the typical run when the replays are opened for the first time."""
        if event.value == "Trials":
            self._open_trials()
        if event.value == "Replay" and self._standing.state.n_done:
            await self._replays.play_first()

    def _show_overview(self) -> None:
        self._drive = Part(self._driven, self._show_driving)
        self._drive.show()
        self._results.show()
        if self._standing.state.note:
            hint(self._standing.state.note)

    # state

    def _show_state(self, standing: Standing) -> None:
        with ui.row().classes("lab-row"):
            show_state(standing)
            self._progress = Progress()
            self._progress.show_words().props('role="status"')
            show_control(self._lab, standing)
            if standing.state.has_robot:
                ui.button("Open trials", on_click=self._open_trials).props("outline no-caps")
            if standing.state.n_all_done:
                ui.button("Open report", on_click=self._report_now).props("outline no-caps")
            if standing.word == "Complete":
                ui.button("Add runs", on_click=self._ask_replicates).props("outline no-caps")
        if standing.word != "Complete":
            self._progress.show_bar()
        self._progress.put(self._standing)
        if standing.message:
            ui.label(standing.message).classes("lab-problem lab-lines")

    def _open_trials(self) -> None:
        ui.navigate.to(f"/study/{self._name}/trials")

    async def _report_now(self) -> None:
        """Open the report; write it if there is none."""
        if self._has_report:
            ui.navigate.to(f"/reports/{self._name}", new_tab=True)
            return
        self._panels_box.value = "Report"
        if not self._is_writing:
            await self._write()

    def _ask_replicates(self) -> None:
        """Ask how many runs each condition is to have, and run those that are missing."""
        now = self._replicates
        with (
            self._dialogs,
            ui.dialog(value=True).props('aria-label="Add runs"') as dialog,
            ui.card(),
        ):
            form = Form()
            section("Add runs")
            form.summary()
            form.number(
                "replicates",
                "Runs per condition",
                2 * now,
                Limits(now + 1, MOST_REPLICATES),
                explanation=f"Each condition has {counted(now, 'run')}. They are kept.",
            )

            async def start() -> None:
                if await form.submit(lambda values: self._lab.go_on(self._name, **values)):
                    dialog.close()

            with ui.row().classes("lab-row"):
                ui.button("Run", on_click=start).props("unelevated no-caps")
                ui.button("Cancel", on_click=dialog.close).props("flat no-caps")

    def _job(self) -> StudyJob | None:
        return self._lab.jobs.get(self._name)

    def _driven(self) -> tuple[StudyJob, TrialCard] | None:
        """The trial that is being driven."""
        job = self._job()
        card = None if job is None or job.is_over else job.card
        return None if job is None or card is None else (job, card)

    async def _look(self) -> None:
        await self._look_at_disk()
        if self._counts is not None:
            await run.io_bound(self._counts.look)
        self._drive.look()
        self._replays.look()
        if self._report_stamp != (stamp := self._watcher.report_stamp):
            self._report_stamp, self._is_writing = stamp, False
            self._report.refresh()

    async def _look_at_disk(self) -> None:
        if self._is_looking:
            return
        self._is_looking = True
        try:
            found = await run.io_bound(self._read_disk)
        finally:
            self._is_looking = False
        if found is None:
            return
        self._standing, has_report = found
        if not self._standing.state.problem:
            self._replicates = self._standing.state.replicates
        self._state.look()
        self._progress.put(self._standing)
        self._results.put(self._standing)
        if has_report != self._has_report:
            self._has_report = has_report
            self._report.refresh()

    def _read_disk(self) -> tuple[Standing, bool]:
        """Read the state of the study; ask for new figures if they are due."""
        standing = self._lab.standing(self._name)
        state = self._lab.studies.lately(self._name)
        if state.n_all_done:
            self._watcher.look(state.done, is_running=standing.word in GROWING)
        return standing, (self._lab.root / self._name / "report.html").is_file()

    def _show_driving(self, driven: tuple[StudyJob, TrialCard] | None) -> None:
        if driven is not None and self._counts is not None:
            Driving(*driven, self._counts).show()

    # report

    def _show_reporting(self) -> None:
        hint(
            "The report is one HTML file with all tables and figures. It is written into the study's folder."
        )
        self._report = ui.refreshable(self._show_report)
        self._report()

    async def _write(self) -> None:
        self._is_writing = True
        self._report.refresh()
        await attempt(self._watcher.write_report)

    def _show_report(self) -> None:
        ui.button("Write report", on_click=self._write).props("unelevated no-caps").set_enabled(
            not self._is_writing
        )
        if self._is_writing:
            ui.label("Writing the report…").props('role="status"')
        if self._watcher.report_problem:
            ui.label(self._watcher.report_problem).classes("lab-problem").props('role="alert"')
        if self._has_report:
            ui.link("Open report", f"/reports/{self._name}", new_tab=True)
