"""Study: its finding, figures that grow while it runs, replays, and its report."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from typing import Any

from nicegui import app, events, run, ui
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, PlainTextResponse, Response

from realitygap._wording import Basis, counted, highest, highest_median, undecided_highest
from realitygap.drawing import themed_file
from realitygap.errors import RealityGapError, StudyError
from realitygap.lab._access import FOREIGN_HEADERS
from realitygap.lab._counts import Counts
from realitygap.lab._figure_cache import read_thumbnail
from realitygap.lab._files import plain_files
from realitygap.lab._lab import Lab
from realitygap.lab._standing import Standing
from realitygap.lab._study_job import StudyJob
from realitygap.lab._watcher import Watcher
from realitygap.orders import Limits
from realitygap.platforms import emulated_robots
from realitygap.stats import runs_for_a_claim

from ._driving import Driving
from ._fields import Form
from ._frame import framed, hint, section
from ._home import show_control, show_state
from ._notices import attempt
from ._part import Part, watching
from ._player import LivePlayer, Player
from ._plots import Curves
from ._status import Progress

MOST_REPLICATES = 1_000_000_000
"""Largest number of runs per condition that a study takes."""
MOST_FILES = 200
"""Number of files of the lab's folder that are proposed."""
LOOK_S = 0.5
"""Time between two looks at the study's folder [s]."""

_BASIS = Basis("the report tries the best networks again")

_TITLES = {
    "scores": "Best score by generation",
    "coverage": "Coverage of every run",
    "paths": "Best path of each generation",
    "networks": "Networks",
    "species": "Species",
    "archive": "Archive of novelty search",
}
MOST_TRIALS = 4
"""Number of trials that are played together: more robots cover each other."""
_GROWING = ("Running", "In use")
"""States in which runs are published."""
_CONDITION = """
<q-td :props="props">
  <q-btn flat dense no-caps align="left" class="lab-choose-row" :label="props.value"
         :aria-pressed="String(props.row.chosen)" @click.stop="$parent.$emit('choose', props.value)" />
</q-td>
"""
"""Name of a condition in the table: a press shows this condition alone."""
_COLUMNS_AT_END = '["condition", "median", "n", "label"]'
_ALL_COLUMNS = '["condition", "median", "n", "progress", "label"]'
_ROW = "(event, row) => emit(row)"


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
            with framed(lab, found.standing.title, "", above=above, is_wide=True):
                _Page(lab, found).show()

    @app.get("/figures/{name}/{figure}-{width}.svg")
    def figure(name: str, figure: str, width: str) -> Response:
        watcher = lab.watchers.get(name)
        drawn = {} if watcher is None else watcher.figures.get(figure, {})
        if width not in ("wide", "narrow") or width not in drawn:
            return PlainTextResponse("There is no such figure.", 404)
        packed = {"cache-control": "no-store", "content-encoding": "gzip"}  # which every browser reads
        headers = {**FOREIGN_HEADERS, **packed}
        return Response(drawn[width], media_type="image/svg+xml", headers=headers)

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
    replicates: int
    files: list[str]


def _open(lab: Lab, name: str) -> _Opened | None:
    """Read what the page shows; None if there is no study of this name."""
    try:
        lab.studies.path(name)
    except RealityGapError:
        return None
    standing = lab.standing(name)
    conditions: list[str] = []
    replicates = 1
    counts = None
    if standing.n_runs or standing.n_driven_runs:
        results = lab.studies.results(name)
        conditions, replicates = list(results.conditions), int(results.description["replicates"])
        counts = lab.counts(name) if standing.has_robot else None
    if counts is not None:
        counts.look()
    files = sorted(path.name for path in plain_files(lab.root, (".toml",)))[:MOST_FILES]
    watcher = lab.watcher(name)
    if standing.n_done or standing.n_driven_done:  # saved figures are on the page from the start
        watcher.look((standing.n_done, standing.n_driven_done), is_running=standing.word in _GROWING)
    elif standing.word == "Running":
        lab.drawer.prepare()
    return _Opened(standing, watcher, counts, conditions, replicates, files)


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
        self._standing = opened.standing
        self._name = opened.standing.name
        self._opened = opened
        self._watcher = opened.watcher
        self._has_report = opened.standing.has_report
        self._replicates = opened.replicates
        self._is_writing = False
        self._is_looking = False
        self._key = secrets.token_hex(8)
        self._asked = self._has_played = False
        self._chosen = ""
        self._choices: list[dict[str, Any]] = []
        self._report_stamp = self._watcher.report_stamp
        self._shown_curves: Any = None

    def show(self) -> None:
        if self._standing.note:
            hint(self._standing.note)
        self._dialogs = ui.element("div")  # apart from the state, which is drawn again while a dialog is open
        self._state = Part(lambda: self._standing.steady, self._show_state)
        self._state.show()
        with ui.tabs().props("no-caps align=left") as tabs:
            overview = ui.tab("Overview")
            if self._standing.has_robot:
                ui.tab("Trials")
            replay, report = ui.tab("Replay"), ui.tab("Report")
        self._panels_box = ui.tab_panels(tabs, value=overview, on_change=self._turn).classes("lab-panels")
        with self._panels_box.props("keep-alive"):
            with ui.tab_panel(overview):
                self._show_overview()
            with ui.tab_panel(replay).classes("lab-replay"):
                self._show_replay()
            with ui.tab_panel(report):
                self._show_reporting()
        watching(self._lab, self._look)
        ui.timer(LOOK_S, self._look_at_disk)

    async def _turn(self, event: events.ValueChangeEventArguments[Any]) -> None:
        """Open the page of trials; play the typical run when the replays are opened for the first time."""
        if event.value == "Trials":
            self._open_trials()
        if event.value == "Replay" and not self._has_played and self._standing.n_done:
            await self._replay()

    def _show_overview(self) -> None:
        self._drive = Part(self._driven, self._show_driving)
        self._drive.show()
        self._finding = Part(self._found, self._show_finding)
        self._finding.show()
        self._waiting = Part(self._waiting_for, self._show_waiting)
        self._waiting.show()
        self._filtered = Part(lambda: self._chosen, self._show_filter)
        self._filtered.show()
        with ui.element("div").classes("lab-panels-two") as self._panels:
            with ui.column().classes("lab-panel") as self._curves_box:
                section("Best coverage by generation")
                self._curves = Curves([], "Median best coverage by generation, one line per condition")
            with ui.column().classes("lab-panel"):
                section("Best path")
                self._path = Part(self._typical, self._show_path)
                self._path.show()
        self._table_box = ui.column().classes("lab-cards")
        self._table: ui.table | None = None
        self._gallery = ui.column().classes("lab-cards")
        self._images: dict[str, _Image] = {}
        self._n_drawn = 0
        self._renew_figures()

    # state

    def _show_state(self, standing: Standing) -> None:
        with ui.row().classes("lab-row"):
            show_state(standing)
            self._progress = Progress()
            self._progress.show_words().props('role="status"')
            show_control(self._lab, standing)
            if standing.has_robot:
                ui.button("Open trials", on_click=self._open_trials).props("outline no-caps")
            if standing.n_done or standing.n_driven_done:
                ui.button("Report", on_click=self._report_now).props("outline no-caps")
            if standing.word == "Complete":
                ui.button("Run more replicates", on_click=self._ask_replicates).props("outline no-caps")
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
            ui.dialog(value=True).props('aria-label="Run more replicates"') as dialog,
            ui.card(),
        ):
            form = Form()
            section("Run more replicates")
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

    def _driven(self) -> tuple[StudyJob, dict[str, Any]] | None:
        """The trial that is being driven."""
        job = self._job()
        card = None if job is None or job.is_over else job.card
        return None if job is None or card is None else (job, card)

    async def _look(self) -> None:
        await self._look_at_disk()
        if self._opened.counts is not None:
            await run.io_bound(self._opened.counts.look)
        self._drive.look()
        if self._asked and self._key in self._watcher.replays:
            self._asked = False
            if "text" in self._watcher.replays[self._key]:
                self._choices = self._choices[:-1]
            self._stage.refresh()
        self._live.look()
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
        self._standing, has_report, self._replicates = found
        self._state.look()
        self._progress.put(self._standing)
        self._renew_figures()
        if has_report != self._has_report:
            self._has_report = has_report
            self._report.refresh()

    def _read_disk(self) -> tuple[Standing, bool, int]:
        """Read the state of the study and its runs per condition; ask for new figures if they are due."""
        standing = self._lab.standing(self._name)
        state = self._lab.studies.lately(self._name)
        if state.n_done or state.n_driven_done:
            done = (state.n_done, state.n_driven_done)
            self._watcher.look(done, is_running=standing.word in _GROWING)
        replicates = self._replicates if state.problem else state.replicates
        return standing, (self._lab.root / self._name / "report.html").is_file(), replicates

    def _show_driving(self, driven: tuple[StudyJob, dict[str, Any]] | None) -> None:
        if driven is not None and self._opened.counts is not None:
            Driving(*driven, self._opened.counts).show()

    # finding and figures

    def _rows(self) -> list[dict[str, Any]]:
        """Conditions with known coverage, the highest median first."""
        known = [row for row in self._watcher.rows if row["line_median"] is not None]
        return sorted(known, key=lambda row: -row["line_median"])

    def _found(self) -> str:
        """The finding; empty as long as there is none."""
        rows = {row["condition"]: row for row in self._rows()}
        leaders = highest({name: row["line_median"] for name, row in rows.items()})
        if not leaders:
            return ""
        score = "best coverage" + (" so far" if self._standing.n_runs > self._standing.n_done else "")
        needed = runs_for_a_claim(len(rows) - 1, paired=True)
        if len(rows) > 1 and min(row["n"] for row in rows.values()) < needed:
            medians = [row["line_median"] for row in rows.values()]
            return _BASIS.claim(
                undecided_highest(f"median {score}", medians, _about(list(rows.values())), needed)
            )
        of_leaders = [rows[name] for name in leaders]
        estimates = [_estimate(row) for row in of_leaders[:2]]
        claim = highest_median(leaders, estimates, score, n_conditions=len(rows))
        return _BASIS.claim(f"{claim} ({_about(of_leaders)})")

    def _show_finding(self, finding: str) -> None:
        if finding:
            ui.label(finding).classes("lab-finding")

    def _waiting_for(self) -> str | None:
        """Why there are no figures; None once there are some."""
        if self._watcher.curves or self._drawn():
            return None
        standing = self._standing
        n = standing.n_done + standing.n_driven_done
        return f"Drawing figures for {counted(n, 'run')}…" if n else ""

    def _drawn(self) -> list[str]:
        """Names of the figures that can be shown."""
        return [name for name, figure in list(self._watcher.figures.items()) if "text" not in figure]

    def _show_waiting(self, reason: str | None) -> None:
        if reason:
            ui.label(reason).props('role="status"')
            ui.skeleton().classes("lab-skeleton")
        elif reason is not None:
            ui.label("No runs yet. Figures appear when the first run finishes.")

    def _renew_figures(self) -> None:
        """Update the figures, and add new ones below those on the page; nothing else moves."""
        watcher = self._watcher
        for part in (self._waiting, self._finding):
            part.look()
        is_new = self._n_drawn != watcher.n_drawn
        self._n_drawn = watcher.n_drawn
        self._renew_panels()
        for name in self._drawn():
            if name not in self._images:
                with self._gallery:
                    self._images[name] = _Image(name, watcher.figures[name])
                self._images[name].load(self._name, self._n_drawn)
            elif is_new:
                self._images[name].load(self._name, self._n_drawn)

    def _renew_panels(self) -> None:
        """Update the two panels and the table of conditions."""
        curves = self._watcher.curves
        self._panels.set_visibility(bool(curves) or bool(self._drawn()))
        self._curves_box.set_visibility(bool(curves))
        if curves and curves is not self._shown_curves:
            self._shown_curves = curves
            self._curves.put(curves)
        self._path.look()
        if self._rows():
            self._renew_table()

    def _renew_table(self) -> None:
        rows = [
            {
                "condition": row["condition"],
                "median": _estimate(row),
                "n": row["n"],
                "progress": f"{100 * row['n'] / self._replicates:.0f} %",
                "label": row["label"],
                "chosen": row["condition"] == self._chosen,
            }
            for row in self._rows()
        ]
        if self._table is None:
            with self._table_box:
                section("Conditions")
                self._table = self._make_table()
                hint(
                    "Choose a condition to show it alone. Best coverage of a run, along the robot's path. Brackets: "
                    "95 % interval of the median."
                )
        is_growing = self._standing.share < 1
        columns = _ALL_COLUMNS if is_growing else _COLUMNS_AT_END
        if (
            self._table.props.get(":visible-columns") != columns
        ):  # each change draws the buttons in the rows again
            self._table.props[":visible-columns"] = columns
        if self._table.rows != rows:
            self._table.rows = rows

    def _make_table(self) -> ui.table:
        columns = [
            {"name": key, "label": label, "field": key, "align": align, "sortable": True}
            for key, label, align in (
                ("condition", "Condition", "left"),
                ("median", "Median best coverage", "left"),
                ("n", "Runs", "right"),
                ("progress", "Progress", "right"),
                ("label", "Label", "left"),
            )
        ]
        table = ui.table(rows=[], columns=columns, row_key="condition").classes("lab-table lab-choosable")
        table.props("flat bordered dense wrap-cells")
        table.props[":table-row-class-fn"] = "(row) => row.chosen ? 'lab-chosen' : ''"
        table.add_slot("body-cell-condition", _CONDITION)
        table.on("choose", lambda event: self._choose(event.args))
        table.on("rowClick", lambda event: self._choose(event.args["condition"]), js_handler=_ROW)
        return table

    def _choose(self, condition: Any) -> None:
        """Show one condition alone in both panels; all if it was chosen already."""
        names = [row["condition"] for row in self._rows()]
        self._chosen = condition if condition in names and condition != self._chosen else ""
        self._curves.choose(self._chosen)
        self._filtered.look()
        self._renew_panels()

    def _show_filter(self, chosen: str) -> None:
        if chosen:
            with ui.row().classes("lab-row"):
                ui.label(f"Showing {chosen}.").props('role="status"')
                ui.button("Show all", on_click=lambda: self._choose("")).props("flat no-caps")

    def _typical(self) -> tuple[str, bool, dict[str, Any] | None]:
        """Condition of the path that is shown, whether there is one, and its replay; None while it is computed."""
        rows, standing = self._rows(), self._standing
        condition = self._chosen or (rows[0]["condition"] if rows else "")
        if not condition and self._drawn():
            condition = self._opened.conditions[0]
        if not condition:
            return "", False, None
        is_growing = standing.word in _GROWING
        done = 0 if is_growing else standing.n_done + standing.n_driven_done
        return condition, True, self._watcher.typical(condition, done)

    def _show_path(self, typical: tuple[str, bool, dict[str, Any] | None]) -> None:
        condition, is_known, replay = typical
        if not is_known:
            return
        if replay is None:
            ui.label("Computing the path…").props('role="status"')
            ui.skeleton().classes("lab-skeleton")
        elif "text" in replay:
            ui.label(replay["text"]).classes("lab-problem")
        else:
            Player(replay["scene"], replay["trials"])
            hint(f"Best trial of the typical run of {condition}: the run with the median best coverage.")

    # replays

    def _show_replay(self) -> None:
        self._form = form = Form()
        form.summary()
        names = self._opened.conditions
        with ui.element("div").classes("lab-fields"):
            form.choice("condition", "Condition", names, names[0])
            for key, label in (
                ("replicate", "Run"),
                ("generation", "Generation"),
                ("individual", "Individual"),
            ):
                form.number(key, label, None, Limits(0, 2**31))
        hint("If you don't choose a run, the run with the median best coverage is shown.")

        def chosen(values: dict[str, Any]) -> dict[str, Any]:
            keys = ("condition", "replicate", "generation", "individual")
            return {key: values[key] for key in keys if values[key] is not None}

        def drive(values: dict[str, Any]) -> None:
            self._lab.drive_live(self._name, {**chosen(values), "platform": values["platform"]})

        async def show(*, compares: bool = False) -> None:
            before = self._choices if compares else []

            def ask(values: dict[str, Any]) -> None:
                if len(before) >= MOST_TRIALS:
                    raise StudyError(
                        f"{MOST_TRIALS} trials are shown. Show one trial, then compare others with it."
                    )
                if (choice := chosen(values)) in before:
                    raise StudyError(
                        "This trial is shown already. Choose another condition, run, or generation."
                    )
                self._watcher.replay(self._key, [*before, choice])
                self._choices = [*before, choice]

            self._has_played = self._asked = True
            self._key = secrets.token_hex(8)  # what was asked for before comes too late
            if not await form.submit(ask):
                self._asked = False
                return
            self._stage.refresh()

        self._replay = show
        with ui.row().classes("lab-row"):
            ui.button("Show trial", on_click=lambda: show()).props("unelevated no-caps")
            ui.button("Compare", on_click=lambda: show(compares=True)).props("outline no-caps")
        hint(f"Compare adds the chosen trial to those shown, up to {MOST_TRIALS}.")
        self._stage = ui.refreshable(self._show_stage)
        self._stage()
        section("Drive live")
        with ui.element("div").classes("lab-form"):
            form.text(
                "platform",
                "Platform",
                options=self._platforms(),
                explanation="For example sim, jyro, or twin:FILE. Default: the platform of the condition.",
            )
        ui.button("Drive live", on_click=lambda: form.submit(drive, self._lab.live_mistakes)).props(
            "outline no-caps"
        )
        self._live = Part(self._live_state, self._show_live)
        self._live.show()

    def _platforms(self) -> list[str]:
        """Platforms on which a network can be driven live; files are those in the lab's folder."""
        return ["sim", "jyro", *emulated_robots(), *(f"twin:{name}" for name in self._opened.files)]

    def _show_live(self, state: Any) -> None:
        job = self._lab.lives.get(self._name)
        if job is None:
            return
        LivePlayer(self._lab, job).show()
        if not job.is_over:
            ui.button("End drive", on_click=job.ask_to_end).props("flat no-caps")
        elif job.scene is not None:
            ui.label(job.outcome or "").classes("lab-problem" if job.is_failed else "lab-hint").props(
                'role="status"'
            )

    def _live_state(self) -> Any:
        job = self._lab.lives.get(self._name)
        return None if job is None else (id(job), job.scene is None, job.is_over)

    def _show_stage(self) -> None:
        if self._asked:
            ui.label("Computing the trial…").props('role="status"')
            return
        found = self._watcher.replays.get(self._key)
        if found is None:
            return
        if "text" in found:
            ui.label(found["text"]).classes("lab-problem").props('role="alert"')
        else:
            Player(found["scene"], found["trials"])

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
        if self._watcher.report_said:
            ui.label(self._watcher.report_said).classes("lab-problem").props('role="alert"')
        if self._has_report:
            ui.link("Open report", f"/reports/{self._name}", new_tab=True)


class _Image:
    """A figure in its two widths, with its caption."""

    def __init__(self, name: str, figure: dict[str, Any]) -> None:
        self._name = name
        section(_TITLES[name.partition("-")[0]])
        with ui.element("picture").classes("lab-figure"):
            self._narrow = ui.element("source").props('media="(max-width: 700px)"')
            self._wide = ui.element("img")
            self._wide.props["alt"] = figure["alt"]
        self._caption = hint(figure["caption"])

    def load(self, study: str, version: int) -> None:
        """Load the drawing of this version."""
        address = f"/figures/{study}/{self._name}"
        self._narrow.props["srcset"] = f"{address}-narrow.svg?v={version}"
        self._wide.props["src"] = f"{address}-wide.svg?v={version}"


def _about(rows: list[dict[str, Any]]) -> str:
    """Return the labels of conditions, and the number of their runs."""
    labels = " and ".join(dict.fromkeys(row["label"] for row in rows))
    return f"{labels}, {counted(max(row['n'] for row in rows), 'run')}{' each' if len(rows) > 1 else ''}"


def _estimate(row: dict[str, Any]) -> str:
    """The median with its interval, if there are enough runs for one."""
    if row["line_low"] is None:
        return f"{row['line_median']:.3f}"
    return f"{row['line_median']:.3f} [{row['line_low']:.3f}, {row['line_high']:.3f}]"
