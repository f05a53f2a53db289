"""Studies: the list of all studies, with the state of each and what to do next."""

from __future__ import annotations

import contextlib
from functools import partial
from importlib import resources

from nicegui import events, run, ui

from realitygap._wording import values_between
from realitygap.errors import RealityGapError
from realitygap.lab._lab import Lab
from realitygap.lab._standing import Standing

from ._frame import framed, hint, section
from ._notices import attempt
from ._part import Part, watching
from ._status import Progress

DISK_S = 2.0
"""Time between two looks at the folders of the studies [s]: other programs may write to them."""

MOST_CARDS = 30
"""Number of studies that are shown at first."""

MOST_DRAWN = 10
"""Number of studies without a picture that are drawn for the list."""

_AT_REST = ("Paused", "Complete", "Failed", "Waiting for robot")
PAPER = "paper"
_ORDERS = {"changed": "Newest", "name": "Name", "state": "State"}


def add_home(lab: Lab) -> None:
    """Add the page."""

    @ui.page("/", response_timeout=30)
    async def home() -> None:
        standings = list(await run.io_bound(lab.standings) or ())
        if any(standing.state.n_done for standing in standings):
            lab.drawer.prepare()  # the page of a study then has its figures sooner
        with framed(lab, "Studies", "/", is_wide=True):
            _Page(lab, standings).show()


def start_paper(lab: Lab) -> None:
    """Start the paper's simulated study.

    Raises:
        StudyError: There is a study of this name.
    """
    text = (resources.files("realitygap.study") / "studies" / f"{PAPER}.toml").read_text("utf-8")
    lab.start_new(PAPER, text)


class _Page:
    def __init__(self, lab: Lab, standings: list[Standing]) -> None:
        self._lab = lab
        self._standings = standings
        self._n_shown = MOST_CARDS
        self._is_looking = False
        self._filter = ""
        self._order = "changed"
        self._progress: dict[str, Progress] = {}

    def show(self) -> None:
        with ui.row().classes("lab-row") as self._tools:
            ui.button("New study", on_click=lambda: ui.navigate.to("/new")).props("unelevated no-caps")
            search = ui.input(placeholder="Filter", on_change=self._search)
            search.props('outlined dense clearable debounce=200 aria-label="Filter studies"')
            order = ui.select(_ORDERS, value=self._order, on_change=self._sort)
            order.props('outlined dense aria-label="Order of studies"')
        self._list = Part(self._now, self._show_list)
        with ui.column().classes("lab-cards").props('aria-live="polite"'):
            self._list.show()
        self._work = Part(self._other, self._show_other)
        with ui.column().classes("lab-cards"):
            self._work.show()
        watching(self._lab, self._look)
        ui.timer(DISK_S, self._look)

    async def _look(self) -> None:
        """Read all states, then show the cards of which the state has changed."""
        self._work.look()
        if self._is_looking:
            return
        self._is_looking = True
        try:
            found = await run.io_bound(self._lab.standings)
        finally:
            self._is_looking = False
        if found is not None:
            self._standings = found
            self._list.look()
            self._put_progress()

    def _put_progress(self) -> None:
        for standing in self._standings:
            if standing.state.name in self._progress:
                self._progress[standing.state.name].put(standing)

    def _search(self, event: events.ValueChangeEventArguments[str | None]) -> None:
        self._filter = event.value or ""
        self._list.refresh()

    def _sort(self, event: events.ValueChangeEventArguments[str]) -> None:
        self._order = event.value
        self._list.refresh()

    def _now(self) -> tuple[Standing, ...]:
        wanted = self._filter.lower()
        names = [(standing, f"{standing.state.name} {standing.state.title}") for standing in self._standings]
        chosen = [standing for standing, name in names if wanted in name.lower()]
        if self._order == "name":
            chosen.sort(key=lambda standing: standing.state.name)
        elif self._order == "state":
            chosen.sort(key=lambda standing: standing.word)
        return tuple(standing.steady for standing in chosen)

    def _show_list(self, standings: tuple[Standing, ...]) -> None:
        self._tools.set_visibility(bool(self._standings))
        if not self._standings:
            ui.label("No studies yet. Run the paper's study (takes seconds) or create your own.")
            with ui.row().classes("lab-row"):
                ui.button("Run the paper's study", on_click=self._start_paper).props("unelevated no-caps")
                ui.button("Create a study", on_click=lambda: ui.navigate.to("/new")).props("outline no-caps")
            return
        if not standings:
            ui.label("No study has this text in its name or title. Clear the filter.")
        now = {standing.state.name: standing for standing in self._standings}
        shown = [now[standing.state.name] for standing in standings[: self._n_shown]]
        self._progress = {standing.state.name: Progress() for standing in shown}
        for standing in shown:
            _show_study(self._lab, standing, self._progress[standing.state.name])
        self._put_progress()
        self._want_thumbnails(shown)
        if len(standings) > self._n_shown:
            ui.button(f"Show {len(standings) - self._n_shown:,} more", on_click=self._show_more).props(
                "outline no-caps"
            )

    def _want_thumbnails(self, standings: list[Standing]) -> None:
        """Request the missing pictures of the first studies."""
        states = [standing.state for standing in standings if standing.word in _AT_REST]
        missing = [state for state in states if state.n_done and not state.medians]
        for state in missing[:MOST_DRAWN]:
            with contextlib.suppress(RealityGapError):  # it was removed in this moment
                self._lab.watcher(state.name).want_thumbnail(state.done)

    def _show_more(self) -> None:
        self._n_shown += MOST_CARDS
        self._list.refresh()

    async def _start_paper(self) -> None:
        if await attempt(partial(start_paper, self._lab)):
            ui.navigate.to(f"/study/{PAPER}")

    def _other(self) -> tuple[tuple[str, str, str], ...]:
        """Return the title, progress, and address of the current or last measurements."""
        found = []
        gap, calibration = self._lab.gap, self._lab.calibration
        if gap is not None:
            found.append((f"Gap {gap.name}", gap.progress, "/gap"))
        if calibration is not None:
            found.append((f"Calibration {calibration.name}", calibration.progress, "/calibrate"))
        return tuple(found)

    def _show_other(self, works: tuple[tuple[str, str, str], ...]) -> None:
        if works:
            section("Other work")
        for title, progress, address in works:
            with ui.row().classes("lab-row"):
                ui.link(title, address)
                ui.label(progress)


def _show_study(lab: Lab, standing: Standing, progress: Progress) -> None:
    state = standing.state
    address = f"/study/{state.name}"
    row = ui.element("div").classes("lab-study").props(f'data-study="{state.name}"')
    with row:
        with ui.element("div").classes("lab-thumbnail"):
            if state.has_thumbnail:
                picture = ui.element("img").props('loading="lazy"')
                picture.props["alt"] = f"Best path of {state.title}"
                picture.props["src"] = f"/figures/{state.name}/thumbnail.svg?v={state.n_done}"
        with ui.element("div").classes("lab-study-words"):
            with ui.row().classes("lab-row"):
                ui.label(state.title).props('role="heading" aria-level="2"').classes("lab-section")
                show_state(standing)
            if state.title != state.name:
                hint(state.name)
            if standing.word != "Complete" and state.n_all:
                progress.show_bar()
            if standing.progress:
                progress.show_words()
            if standing.message:
                ui.label(standing.message).classes("lab-problem")
        with ui.element("div").classes("lab-study-medians"):
            if state.medians:
                _show_medians(state.medians)
        with ui.row().classes("lab-row lab-study-actions"):
            _show_actions(lab, standing, address)


def _show_actions(lab: Lab, standing: Standing, address: str) -> None:
    """Show the buttons of a study; one of them is the primary action."""
    state = standing.state
    needs_robot = state.has_robot and (standing.is_asking or standing.word == "Waiting for robot")
    main, other = "unelevated no-caps", "outline no-caps"
    if state.n_all:
        ui.button("Open", on_click=lambda: ui.navigate.to(address)).props(other if needs_robot else main)
    if state.has_robot:
        text = "Answer question" if standing.is_asking else "Open trials"
        ui.button(text, on_click=lambda: ui.navigate.to(f"{address}/trials")).props(
            main if needs_robot else other
        )
    if state.has_report and standing.word == "Complete":
        report = f"/reports/{state.name}"
        ui.button("Report", on_click=lambda: ui.navigate.to(report, new_tab=True)).props(other)
    show_control(lab, standing)


def _show_medians(medians: tuple[float, ...]) -> None:
    """Show the median of each condition as a bar."""
    highest = max(max(medians), 1e-9)
    bars = "".join(
        f'<rect x="{8 * k}" y="{24 - 24 * value / highest:.1f}" width="6" height="{24 * value / highest:.1f}"/>'
        for k, value in enumerate(medians)
    )
    by = " by condition" if len(medians) > 1 else ""
    words = f"Median best coverage{by}: {values_between(medians)}"
    with ui.element("div"):
        ui.html(
            f'<svg viewBox="0 0 {8 * len(medians)} 24" width="{8 * len(medians)}" height="24" aria-hidden="true" '
            f'class="lab-bars">{bars}</svg>',
            sanitize=False,
        )
        hint(words)


def show_state(standing: Standing) -> None:
    """Show the state of a study, and the labels of its results."""
    ui.label(standing.word).classes(f"lab-state lab-state-{standing.word.partition(' ')[0].lower()}")
    for label in standing.state.labels:
        ui.label(label).classes(f"lab-badge lab-label-{label.lower()}")


def show_control(lab: Lab, standing: Standing) -> None:
    """Show the button that pauses or resumes a study."""
    name = standing.state.name
    job = lab.job(name)
    if job is not None:
        ui.button("Pause", on_click=job.ask_to_end).props("outline no-caps")
    elif standing.can_resume:
        text = "Resume" if standing.state.n_done else "Start"
        ui.button(text, on_click=lambda: attempt(lambda: lab.go_on(name))).props("outline no-caps")
