"""The locked design of trials: its deviations, and how to amend and unblind it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from nicegui import ui

from realitygap._wording import counted
from realitygap.errors import StudyError
from realitygap.lab._design import LONGEST_TEXT, amend, shown_value, unblind
from realitygap.lab._mistakes import refuse_unnamed
from realitygap.records import LockedDesign
from realitygap.study import DesignReport

from ._fields import Form, needed
from ._frame import hint, section
from ._notices import notify, show_error, try_now
from ._part import Part

_NOT_OPERATOR = "Only the operator of the robot can change the design."


class DesignFold:
    """A section with the locked design of trials. It is hidden if no design is locked.

    Args:
        source: Returns the file of trials, or the folder of a study.
        report: Returns the design as last read; None if none is locked.
        who: Returns the name of the visitor.
        may: Returns whether the visitor may change the design now.
        changed: Called after a change.
    """

    def __init__(
        self,
        source: Callable[[], Path],
        report: Callable[[], DesignReport | None],
        who: Callable[[], str],
        may: Callable[[], bool],
        changed: Callable[[], Awaitable[None]],
    ) -> None:
        self._source, self._report, self._who, self._may, self._changed = source, report, who, may, changed
        self._sentences = Part(report, self._show_sentences)
        # apart: trials may change the deviations while a form is filled in
        self._forms = Part(lambda: (self._design(), may()), lambda state: self._show_forms(*state))

    def show(self) -> None:
        """Show the section."""
        fold = ui.expansion("").classes("lab-expansion").props('header-class="lab-fold" data-fold="Design"')
        with fold as self._fold:
            self._sentences.show()
            self._forms.show()
        self._dialogs = ui.element("div")
        self.look()

    def look(self) -> None:
        """Update what has changed."""
        self._sentences.look()
        self._forms.look()
        report = self._report()
        self._fold.set_visibility(report is not None)
        if report is not None:
            n = len(report.deviations)
            deviations = counted(n, "deviation") if n else "no deviations"
            self._fold.text = f"Design locked, {report.design.sha256[:8]}: {deviations}"

    def _design(self) -> LockedDesign | None:
        report = self._report()
        return None if report is None else report.design

    def _show_sentences(self, report: DesignReport | None) -> None:
        with ui.element("div").classes("lab-design").props('role="status"'):
            for sentence in () if report is None else report.sentences:
                ui.label(sentence.replace("`", ""))

    def _show_forms(self, design: LockedDesign | None, may: bool) -> None:
        if design is None:
            return
        if not may:
            hint(_NOT_OPERATOR)
            return
        settings: dict[str, Any] = design.design["settings"]
        form = Form()
        with ui.element("div").classes("lab-form lab-design-form"):
            section("Amend the design")
            form.summary()
            names = {"": "None: a change outside the program", **{name: name for name in settings}}
            setting = form.choice("setting", "Setting", names, "", "The change is listed as a deviation.")
            with ui.element("div") as box:
                value = form.text("value", "New value", explanation="Empty: the setting has no value.")
                value.props(f"maxlength={LONGEST_TEXT}")
            _ask_reason(form, "The old design, the new one, and your reason stay in the file.")

            def choose() -> None:
                box.set_visibility(bool(setting.value))
                value.value = shown_value(settings.get(setting.value))

            setting.on_value_change(choose)
            choose()
            with ui.row().classes("lab-row"):
                send = ui.button("Amend design", on_click=lambda: self._change(form, amend))
                ask = ui.button("Unblind", on_click=self._ask_unblind)
                for button in (send, ask):
                    button.props("outline no-caps")
                ask.set_visibility(design.is_blind)

    async def _change(self, form: Form, act: Callable[..., None]) -> bool:
        """Change the design with the values of a form; return whether it succeeded."""
        who = self._who()
        if not try_now(lambda: refuse_unnamed(who)):
            return False
        if not self._may():
            show_error(StudyError(_NOT_OPERATOR))
            return False
        if not await form.submit(lambda values: act(self._source(), who, **values)):
            return False
        await self._changed()
        notify("The change of the design is saved.")
        return True

    def _ask_unblind(self) -> None:
        """Ask for a reason, and confirm."""
        report = self._report()
        with self._dialogs, ui.dialog(value=True).props('aria-label="Unblind"') as dialog, ui.card() as card:
            card.classes("lab-design-form")
            section("Unblind the design")
            form = Form()
            form.summary()
            ui.label("" if report is None else f"{report.progress}.")
            hint(
                "Results are then shown by controller. You cannot undo this. Before the planned end, it is listed as a "
                "deviation."
            )
            _ask_reason(form, "Such as: all trials are driven.")

            async def send() -> None:
                with ui.context.client:  # the button that was pressed may be gone by then
                    if await self._change(form, unblind):
                        dialog.close()

            with ui.row().classes("lab-row"):
                ui.button("Unblind results", on_click=send).props("unelevated no-caps")
                ui.button("Cancel", on_click=dialog.close).props("flat no-caps")


def _ask_reason(form: Form, explanation: str) -> None:
    form.text("reason", "Reason", explanation=explanation, parse=needed).props(f"maxlength={LONGEST_TEXT}")
