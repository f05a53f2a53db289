"""Handing the robot from one visitor to another: the visitor who asks, and the one who has it."""

from __future__ import annotations

from nicegui import ui

from realitygap.lab._lab import HANDOVER_S, Lab, RobotRequest, Visitor

from ._notices import told
from ._part import Part, watching

_UNANSWERED = f"Without an answer within {HANDOVER_S:.0f} s"


def show_holder(lab: Lab, visitor: Visitor) -> None:
    """Show a visitor who watches which visitor has the robot, and how to ask for it."""

    def show(request: RobotRequest | None) -> None:
        has_asked = request is not None and request.visitor.key == visitor.key
        with ui.row().classes("lab-row"):
            ui.label(f"{lab.operator_name} has the robot; you are watching.")
            if request is not None and has_asked and not request.is_refused:
                ui.label(f"You asked for it. {_UNANSWERED} you get it.").props('role="status"')
                return
            if has_asked:
                ui.label(f"{lab.operator_name} keeps the robot for now.").props('role="status"')
            ui.button("Ask for the robot", on_click=lambda: _confirm(lab, visitor)).props("outline no-caps")

    _show_part(lab, Part(lambda: lab.request, show))


def show_request(lab: Lab, visitor: Visitor) -> None:
    """Show the operator, on whatever page, which visitor asks for the robot."""

    def show(request: RobotRequest | None) -> None:
        if request is None or request.is_refused or request.operator.key != visitor.key:
            return
        with ui.row().classes("lab-row lab-question").props('role="alert"'):
            who = request.visitor.who or "Somebody at another page"
            ui.label(f"{who} asks for the robot. {_UNANSWERED} it is handed over.")
            for text, yes in (("Hand it over", True), ("Keep it", False)):
                button = ui.button(text, on_click=lambda yes=yes: _answer(lab, visitor, yes=yes))
                button.props("outline no-caps")

    _show_part(lab, Part(lambda: lab.request, show))


def _show_part(lab: Lab, part: Part[RobotRequest | None]) -> None:
    part.show()
    watching(lab, part.look)


def _confirm(lab: Lab, visitor: Visitor) -> None:
    """Have the visitor confirm, because its operator is working with the robot."""
    with ui.dialog(value=True) as dialog, ui.card():
        ui.label(
            f"{lab.operator_name} works with the robot and will be asked to hand it over. {_UNANSWERED} you get it. "
            "Make sure that nobody has a hand on it."
        )

        def ask() -> None:
            dialog.close()
            told(lambda: lab.ask_for_robot(visitor))

        with ui.row().classes("lab-row"):
            ui.button("Ask now", on_click=ask).props("unelevated no-caps")
            ui.button("Cancel", on_click=dialog.close).props("flat no-caps")


def _answer(lab: Lab, operator: Visitor, *, yes: bool) -> None:
    told(lambda: lab.answer_request(operator, yes=yes))
