"""Scoring: the visitor marks the cells that a line crosses; each tap is saved."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from nicegui import run, ui

from realitygap._wording import counted
from realitygap.errors import LedgerError
from realitygap.lab._counts import CountCard, CountedTrial, Counts
from realitygap.lab._lab import Lab
from realitygap.lab._photos import Photos
from realitygap.lab._scoring_files import Draft, Proposal
from realitygap.records import ScoreRole

from ._elements import NO_TRACE, CellGrid, Trace, ink_of
from ._frame import hint, text_of
from ._notices import attempt

_ROLES: dict[ScoreRole, str] = {
    "score": "Selection uses this score.",
    "second": "A second score measures the agreement. You do not see the first one.",
    "correction": "Reports use this correction. The generation is closed.",
}

_HOW = "Tap a cell, or draw along the line. Each tap is saved. Keys: arrows, Space to mark, Enter to save the score."
_FRAMED = " Check the framed cells: they are less than 90 % certain."


class Counting:
    """The trials to score, and the grid for one of them.

    Args:
        lab: Whose page it is.
        counts: The trials of the study.
        photos: Those of its sheets.
        who: The name of who counts.
    """

    def __init__(self, lab: Lab, counts: Counts, photos: Photos, who: Callable[[], str]) -> None:
        self._lab = lab
        self._counts = counts
        self._photos = photos
        self._who = who
        self._chosen: int | None = None
        self._corrects = False
        self._draft = Draft([])
        self._shown: Any = None
        self._loaded: tuple[Any, CountCard] | None = None  # what is shown, and what was read of it

    async def show(self) -> None:
        """Show it."""
        self._lists = ui.refreshable(self._show_lists)
        self._card = ui.refreshable(self._show_card)
        self._lists()
        self._shown = self._chosen_now()
        self._n_seen = self._seen()
        await self._load()
        self._card()

    async def refresh(self) -> None:
        """Update the lists, and the grid if another trial or role was chosen."""
        self._lists.refresh()
        now, seen = self._chosen_now(), self._seen()
        if (now, seen) != (self._shown, self._n_seen):
            self._shown, self._n_seen = now, seen
            await self._load()
            self._card.refresh()

    async def choose(self, number: int | None, *, corrects: bool = False) -> None:
        """Count this trial."""
        self._chosen, self._corrects = number, corrects
        await self.refresh()

    # inside

    def _chosen_now(self) -> tuple[int, ScoreRole, str] | None:
        """Trial that is counted, role, and visitor; the first trial without a score if none was chosen."""
        who = self._who()
        listed = self._counts.trials()
        chosen = next((each for each in listed if each.number == self._chosen), None)
        role = self._role(chosen, who)
        if chosen is None or role is None:
            chosen, role = next((each for each in listed if each.trial.state == "driven"), None), "score"
        return None if chosen is None else (chosen.number, role, who)

    async def look(self) -> None:
        """Update the trial if it has a new proposal."""
        if self._seen() != self._n_seen:
            await self.refresh()

    async def _load(self) -> None:
        """Read what is shown of the trial."""
        shown = self._shown
        if shown is not None:
            number, role, who = shown
            card = await run.io_bound(self._counts.card, number, who, role)
            self._loaded = None if card is None else (shown, card)

    def _seen(self) -> tuple[str, ...]:
        """Return the proposals for the trial on the grid."""
        if self._shown is None:
            return ()
        return tuple(each.mark for each in self._counts.proposals(self._shown[0]))

    def _show_lists(self) -> None:
        who = self._who()
        listed = self._counts.trials()
        shown = self._chosen_now()
        number = None if shown is None else shown[0]
        self._list("To score", [each for each in listed if each.role_of(who) == "score"], number)
        if who:
            second = [each for each in listed if each.role_of(who) == "second"]
            self._list("To score a second time", second, number)
        self._show_counted(listed)
        self._corrections(listed)

    def _show_card(self) -> None:
        if self._shown is None:
            ui.label("No trials to score. Drive a trial first.")
        elif self._loaded is not None and self._loaded[0] == self._shown:
            number, role, who = self._shown
            self._show_trial(self._counts.trial(number), role, who, self._loaded[1])

    def _role(self, chosen: CountedTrial | None, who: str) -> ScoreRole | None:
        if chosen is None:
            return None
        if self._corrects and chosen.trial.is_closed:
            return "correction"
        return chosen.role_of(who)

    def _list(self, title: str, trials: list[CountedTrial], chosen: int | None) -> None:
        if not trials:
            return
        ui.label(f"{title}: {len(trials)}")
        with ui.row().classes("lab-row"):
            for each in trials:
                is_chosen = each.number == chosen
                ui.button(_name_of(each), on_click=lambda number=each.number: self.choose(number)).props(
                    f"{'unelevated' if is_chosen else 'outline'} no-caps dense padding='4px 10px'"
                )

    def _show_counted(self, listed: list[CountedTrial]) -> None:
        """Show the scores that can be undone."""
        counted = [each for each in listed if each.trial.state == "scored" and not each.trial.is_closed]
        if not counted:
            return
        with ui.expansion(f"Scored, not closed: {len(counted)}").classes("lab-expansion"):
            for each in counted:
                with ui.row().classes("lab-row"):
                    ui.label(f"{_name_of(each)}, by {each.first}")
                    ui.button("Undo", on_click=lambda number=each.number: self._undo(number)).props(
                        f'flat dense no-caps aria-label="Undo the score of trial {each.number}"'
                    )

    async def _undo(self, number: int) -> None:
        said = f"The score of trial {number} is undone. Score it again."
        await attempt(lambda: self._counts.undo(number), said)
        self._lab.changed()
        await self.choose(number)

    def _corrections(self, listed: list[CountedTrial]) -> None:
        closed = {each.number: _name_of(each) for each in listed if each.trial.is_closed}
        closed = {
            number: text
            for number, text in closed.items()
            if self._counts.trial(number).trial.state == "scored"
        }
        if closed:
            ui.select(
                closed,
                label="Correct a score of a closed generation",
                on_change=lambda event: self.choose(event.value, corrects=True),
            ).classes("lab-wide").props("outlined dense")

    def _show_trial(self, each: CountedTrial, role: ScoreRole, who: str, loaded: CountCard) -> None:
        self._draft, arena, proposals = loaded.draft, loaded.arena, loaded.proposals
        chosen = next((one for one in proposals if one.mark == self._draft.proposal), None)
        with ui.card().classes("lab-card").props(f'data-counting="{each.number}"'):
            with ui.row().classes("lab-row no-wrap"):
                ui.element("span").classes("lab-pen").style(f"background: {ink_of(each.pen)}")
                line = (
                    "" if each.label == "EMULATED" else f": the {each.pen} line on sheet {each.trial.sheet}"
                )
                ui.label(f"Trial {each.number}{line}").classes("lab-section")
            hint(f"{each.title}. {_ROLES[role]}")
            for one in proposals:
                self._show_proposal(each, role, one, is_chosen=one is chosen)
            n_marked = ui.label(self._said(arena.grid.n_cells)).props('role="status"')

            def put(draft: Draft) -> None:
                self._draft = draft
                text, loop = self._said(arena.grid.n_cells), asyncio.get_running_loop()

                def show(saved: Future[None]) -> None:
                    problem = saved.exception()
                    shown = text if problem is None else f"{text}, not saved: {problem}"
                    loop.call_soon_threadsafe(n_marked.set_text, shown)

                # A count that is shown is on the disk.
                self._counts.keep(each.number, who, role, draft).add_done_callback(show)

            grid = CellGrid(
                arena,
                cells=self._draft.cells,
                line=[] if chosen else loaded.line,
                trace=Trace(chosen.lines, chosen.sure, self._picture(chosen)) if chosen else NO_TRACE,
                ink=each.pen,
                name=f"Cells crossed in trial {each.number}",
                change=lambda cells: put(Draft(cells, self._draft.proposal)),
            )
            grid.on("save", lambda: self._enter(each, role))
            hint(_HOW + (_FRAMED if chosen and chosen.doubtful else ""))
            with ui.row().classes("lab-row"):
                ui.button("Save score", on_click=lambda: self._enter(each, role)).props(
                    "unelevated no-caps"
                ).classes("lab-primary")

                async def clear() -> None:
                    put(Draft([]))
                    grid.put([])
                    if chosen:
                        await self._load()
                        self._card.refresh()

                ui.button("Clear", on_click=clear).props("flat no-caps")
            self._more(each)

    def _show_proposal(
        self, each: CountedTrial, role: ScoreRole, proposal: Proposal, *, is_chosen: bool
    ) -> None:
        """Show a proposal, and a button to begin with it."""
        doubt = f", {len(proposal.doubtful)} to check" if proposal.doubtful else ""
        name = proposal.name[:1].upper() + proposal.name[1:]
        with ui.row().classes("lab-row").props(f'data-proposal="{proposal.kind}"'):
            ui.label(f"{name}: {counted(len(proposal.cells), 'cell')}{doubt}.")
            if is_chosen:
                ui.label("In use").classes("lab-state")
            else:
                ui.button(
                    f"Use its cells ({proposal.kind})",
                    on_click=lambda: self._take(each, role, proposal),
                ).props("outline no-caps dense")
        if proposal.said:
            ui.label(proposal.said).classes("lab-problem")

    async def _take(self, each: CountedTrial, role: ScoreRole, proposal: Proposal) -> None:
        self._counts.keep(each.number, self._who(), role, Draft(proposal.cells, proposal.mark))
        await self._load()
        self._card.refresh()

    def _picture(self, proposal: Proposal) -> tuple[str, list[float]] | None:
        """The sheet below the cells, where they are of a photograph."""
        photo = self._photos.photo(proposal.mark)
        if photo is None or photo.state != "read":
            return None
        return f"/photos/{self._counts.name}/{photo.mark}.jpg", photo.box

    def _said(self, n_cells: int) -> str:
        return f"{len(self._draft.cells)} of {n_cells} cells"

    async def _enter(self, each: CountedTrial, role: ScoreRole) -> None:
        draft = self._draft

        def enter() -> None:
            self._counts.look()
            if self._counts.trial(each.number).trial.state != each.trial.state:
                raise LedgerError(f"Another visitor has just changed trial {each.number}. Check it again.")
            self._counts.score(each.number, draft, self._who(), role)

        said = f"Trial {each.number}: {counted(len(draft.cells), 'cell')} saved."
        if await attempt(enter, said, type="positive"):
            self._chosen, self._corrects = None, False
        self._lab.changed()
        await self.refresh()

    def _more(self, each: CountedTrial) -> None:
        """A note, and the ways to say that it does not count."""
        with ui.expansion("Note or void").classes("lab-expansion"):
            text = ui.input("Note or reason").props("outlined dense").classes("lab-wide")

            async def note() -> None:
                said, who = text_of(text), self._who()
                if await attempt(lambda: self._counts.note(each.number, said, who), "Note saved."):
                    self._lab.changed()

            async def void() -> None:
                said = f"Trial {each.number} is void. It will be repeated."
                if await attempt(lambda: self._counts.void(each.number, text_of(text)), said):
                    self._lab.changed()

            with ui.row().classes("lab-row"):
                ui.button("Save note", on_click=note).props("outline no-caps")
                ui.button("Void trial", on_click=void).props("outline no-caps").set_enabled(
                    not each.trial.is_closed
                )


def _name_of(each: CountedTrial) -> str:
    """Return the number of a trial, and its pen; an emulated robot draws on no paper."""
    return f"Trial {each.number}" if each.label == "EMULATED" else f"Trial {each.number}, {each.pen}"
