"""Watch: a study as it goes, and its trials played."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from typing import Any

from nicegui import app, run, ui
from starlette.responses import FileResponse, PlainTextResponse, Response

from realitygap.errors import RealityGapError
from realitygap.lab._access import FOREIGN_HEADERS
from realitygap.lab._counts import Counts
from realitygap.lab._lab import Lab
from realitygap.lab._studies import StudyState
from realitygap.lab._study_job import StudyJob
from realitygap.lab._watcher import Watcher
from realitygap.platforms import emulated_robots

from ._driving import Driving
from ._frame import framed, hint, section, text_of, whole_of
from ._notices import attempt, told
from ._part import Part, watching
from ._player import LivePlayer, Player

MOST_FILES = 200
"""Files of the lab's folder that are proposed."""
LOOK_S = 1.0
"""How often the study's folder is looked at [s]."""

_TITLES = {
    "scores": "Score by generation",
    "coverage": "Coverage by generation",
    "paths": "Best paths",
    "networks": "Networks",
    "species": "Species",
    "archive": "Archive of novelty",
}
_EACH = {
    "": "One trial: the best of a generation, or an individual",
    "individual": "Each individual of a generation",
    "generation": "The best of each generation",
    "condition": "The best of each condition",
}


def add_watch(lab: Lab) -> None:
    """Add the page, and the files that it shows."""

    @ui.page("/watch/{name}", response_timeout=30)
    async def watch(name: str) -> None:
        state = await run.io_bound(lab.studies.state, name)
        with framed(lab, f"Study {name}", ""):
            if state is None or state.problem:
                ui.label(state.problem if state else "The lab is closing.").classes("lab-problem")
                return
            opened = await run.io_bound(_open, lab, state)
            if opened is not None:
                _Page(lab, state, opened).show()

    @app.get("/figures/{name}/{figure}-{width}.svg")
    def figure(name: str, figure: str, width: str) -> Response:
        watcher = lab.watchers.get(name)
        drawn = {} if watcher is None else watcher.figures.get(figure, {})
        if width not in ("wide", "narrow") or width not in drawn:
            return PlainTextResponse("There is no such figure.", 404)
        packed = {"cache-control": "no-store", "content-encoding": "gzip"}  # which every browser reads
        headers = {**FOREIGN_HEADERS, **packed}
        return Response(drawn[width], media_type="image/svg+xml", headers=headers)

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

    watcher: Watcher
    counts: Counts | None
    conditions: list[str]
    files: list[str]


def _open(lab: Lab, state: StudyState) -> _Opened:
    counts = lab.counts(state.name) if state.has_robot else None
    if counts is not None:
        counts.look()
    files = sorted(path.name for path in lab.root.glob("*.toml"))[:MOST_FILES]
    conditions = list(lab.studies.results(state.name).conditions)
    return _Opened(lab.watcher(state.name), counts, conditions, files)


class _Page:
    def __init__(self, lab: Lab, state: StudyState, opened: _Opened) -> None:
        self._lab = lab
        self._state = state
        self._name = state.name
        self._opened = opened
        self._watcher = opened.watcher
        self._has_report = False
        self._key = secrets.token_hex(8)
        self._asked = False
        self._report_stamp = self._watcher.report_stamp

    def show(self) -> None:
        hint(self._state.note)
        self._bar = ui.linear_progress(0, show_value=False)
        self._said = ui.label("").props('role="status"')
        self._show_progress()
        self._n_drawn, self._lived = self._watcher.n_drawn, self._live_stand()
        self._drive = Part(self._driven, self._show_driving)
        self._drive.show()
        self._figures = ui.refreshable(self._show_figures)
        with ui.column().classes("lab-cards"):
            self._figures()
        self._show_replay()
        with ui.row().classes("lab-row"):
            ui.button("Write the report", on_click=lambda: attempt(self._watcher.write_report)).props(
                "outline no-caps"
            )
            self._report = ui.refreshable(self._show_report)
            self._report()
        watching(self._lab, self._look)
        ui.timer(LOOK_S, self._look_at_disk)

    # how far it is

    def _job(self) -> StudyJob | None:
        return self._lab.jobs.get(self._name)

    def _driven(self) -> tuple[StudyJob, dict[str, Any]] | None:
        """The trial that is being driven."""
        job = self._job()
        card = None if job is None or job.is_over else job.card
        return None if job is None or card is None else (job, card)

    async def _look(self) -> None:
        self._show_progress()
        if self._opened.counts is not None:
            await run.io_bound(self._opened.counts.look)
        self._drive.look()
        if self._n_drawn != self._watcher.n_drawn:
            self._n_drawn = self._watcher.n_drawn
            self._figures.refresh()
        if self._asked and self._key in self._watcher.replays:
            self._asked = False
            self._stage.refresh()
        if self._lived != (now := self._live_stand()):
            self._lived = now
            self._live.refresh()
        if self._report_stamp != (stamp := self._watcher.report_stamp):
            self._report_stamp = stamp
            self._report.refresh()

    async def _look_at_disk(self) -> None:
        found = await run.io_bound(self._read_disk)
        if found is None:
            return
        state, has_report = found
        if state != self._state:
            self._state = state
            self._show_progress()
        if has_report != self._has_report:
            self._has_report = has_report
            self._report.refresh()

    def _read_disk(self) -> tuple[StudyState, bool]:
        """Read how far the study is and whether it has a report; ask for new figures if they are due."""
        state = self._lab.studies.lately(self._name)
        if state.n_done or state.n_driven_done:
            self._watcher.look((state.n_done, state.n_driven_done))
        return state, (self._lab.root / self._name / "report.html").is_file()

    def _show_progress(self) -> None:
        """Texts alone are changed: it happens often, and at every page that watches."""
        state, job = self._state, self._job()
        n_done = state.n_done
        progress = None if job is None or job.is_over else job.progress
        if progress:
            n_done = max(n_done, progress["n_done"])
        share = (n_done + state.n_driven_done) / max(state.n_runs + state.n_driven_runs, 1)
        self._bar.value = share
        self._bar.props(f'aria-label="{100 * share:.0f} % done"')
        said = []
        if state.n_runs:
            said.append(f"{n_done:,} of {state.n_runs:,} simulated runs")
        if state.n_driven_runs:
            said.append(f"{state.n_driven_done} of {state.n_driven_runs} runs on a robot")
        if progress and progress["n_computed"] and progress["seconds"] > 0 and n_done < state.n_runs:
            rate = progress["n_computed"] / progress["seconds"]
            said.append(f"{rate:,.0f} runs/s, {(state.n_runs - n_done) / rate:,.0f} s left")
        self._said.text = "; ".join(said) or "Nothing yet."

    def _show_driving(self, driven: tuple[StudyJob, dict[str, Any]] | None) -> None:
        if driven is not None and self._opened.counts is not None:
            Driving(*driven, self._opened.counts).show()

    # figures

    def _show_figures(self) -> None:
        if not self._watcher.figures:
            ui.label("Figures come as soon as there are runs.")
        for name, figure in self._watcher.figures.items():
            section(_TITLES[name.partition("-")[0]])
            if "text" in figure:
                hint(figure["text"])
                continue
            with ui.element("picture").classes("lab-figure"):
                address = f"/figures/{self._name}/{name}"
                version = f"?v={self._watcher.n_drawn}"
                ui.element("source").props(
                    f'media="(max-width: 700px)" srcset="{address}-narrow.svg{version}"'
                )
                image = ui.element("img").props(f'src="{address}-wide.svg{version}"')
                image._props["alt"] = figure["alt"]
            hint(figure["caption"])

    # replays

    def _show_replay(self) -> None:
        section("Play trials")
        names = self._opened.conditions
        with ui.row().classes("lab-row"):
            each = ui.select(_EACH, value="", label="What").classes("lab-wide").props("outlined dense")
            condition = (
                ui.select(names, value=names[0], label="Condition")
                .classes("lab-wide")
                .props("outlined dense")
            )
            numbers = {
                key: ui.number(label, min=0, precision=0).props("outlined dense").classes("lab-number")
                for key, label in (
                    ("replicate", "Run"),
                    ("generation", "Generation"),
                    ("individual", "Individual"),
                )
            }

        def given() -> dict[str, Any]:
            return {key: value for key, field in numbers.items() if (value := whole_of(field)) is not None}

        async def ask() -> None:
            wish: dict[str, Any] = {"each": each.value or None}
            if each.value != "condition":
                wish["condition"] = condition.value
            if told(lambda: wish.update(given())):
                self._asked = True
                self._stage.refresh()
                await attempt(lambda: self._watcher.replay(self._key, **wish))

        def drive() -> None:
            chosen = {"condition": condition.value, "platform": text_of(platform)}
            self._lab.drive_live(self._name, {**chosen, **given()})

        with ui.row().classes("lab-row"):
            ui.button("Show", on_click=ask).props("unelevated no-caps")
            platform = (
                ui.input("Live on (else where the study has it)", autocomplete=self._platforms())
                .props("outlined dense")
                .classes("lab-wide")
            )
            ui.button("Drive it live", on_click=lambda: attempt(drive)).props("outline no-caps")
        hint(
            "Where no run is named, it is the typical one. Trials of a robot are shown where somebody saw their lines."
        )
        self._live = ui.refreshable(self._show_live)
        self._live()
        self._stage = ui.refreshable(self._show_stage)
        self._stage()

    def _platforms(self) -> list[str]:
        """On which a network may be seen live; files are those in the lab's folder."""
        return ["sim", "jyro", *emulated_robots(), *(f"twin:{name}" for name in self._opened.files)]

    def _show_live(self) -> None:
        job = self._lab.lives.get(self._name)
        if job is None:
            return
        LivePlayer(self._lab, job).show()
        if not job.is_over:
            ui.button("End it", on_click=job.ask_to_end).props("flat no-caps")
        elif job.scene is not None:
            ui.label(job.outcome or "").classes("lab-problem" if job.is_failed else "lab-hint").props(
                'role="status"'
            )

    def _live_stand(self) -> Any:
        job = self._lab.lives.get(self._name)
        return None if job is None else (id(job), job.scene is None, job.is_over)

    def _show_stage(self) -> None:
        if self._asked:
            ui.label("Computing the trials again ...").props('role="status"')
            return
        found = self._watcher.replays.get(self._key)
        if found is None:
            return
        if "text" in found:
            ui.label(found["text"]).classes("lab-problem")
        else:
            Player(found["scene"], found["trials"])

    def _show_report(self) -> None:
        if self._watcher.report_said:
            ui.label(self._watcher.report_said).classes("lab-problem")
        if self._has_report:
            ui.link("The report", f"/reports/{self._name}", new_tab=True)
