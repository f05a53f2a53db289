"""Control of the robot: the visitor who operates it, and visitors who request control."""

from __future__ import annotations

from nicegui import ui

from realitygap.lab._lab import HANDOVER_S, Lab, RobotRequest, Visitor

from ._notices import try_now
from ._part import Part, watching


def show_holder(lab: Lab, visitor: Visitor) -> None:
    """Show a visitor who watches which visitor operates the robot, and how to request control."""

    def show(request: RobotRequest | None) -> None:
        own = request if request is not None and request.visitor.key == visitor.key else None
        with ui.row().classes("lab-row"):
            ui.label(f"{lab.operator_name} is operating the robot. You are watching.")
            if own is not None and own.state == "asked":
                ui.label(
                    f"You requested control. {lab.operator_name} has {HANDOVER_S:.0f} s to answer."
                ).props('role="status"')
                return
            if own is not None and own.state == "unanswered":
                ui.label(f"{lab.operator_name} did not answer.").props('role="status"')
                ui.button("Take control anyway", on_click=lambda: _confirm(lab, visitor)).props(
                    "outline no-caps"
                )
                return
            if own is not None:
                ui.label(f"{lab.operator_name} keeps the robot.").props('role="status"')
            ui.button("Request control", on_click=lambda: try_now(lambda: lab.ask_for_robot(visitor))).props(
                "outline no-caps"
            )

    _show_part(lab, Part(lambda: lab.request, show))


def show_request(lab: Lab, visitor: Visitor) -> None:
    """Show the operator, on every page, which visitor requests control."""

    def show(request: RobotRequest | None) -> None:
        if request is None or request.state == "kept" or request.operator.key != visitor.key:
            return
        with ui.row().classes("lab-row lab-question").props('role="alert"'):
            ui.label(f"{request.visitor.who or 'Another visitor'} requests control of the robot.")
            for text, yes in (("Hand over", True), ("Keep", False)):
                button = ui.button(text, on_click=lambda yes=yes: _answer(lab, visitor, yes=yes))
                button.props("outline no-caps")

    _show_part(lab, Part(lambda: lab.request, show))


def _show_part(lab: Lab, part: Part[RobotRequest | None]) -> None:
    part.show()
    watching(lab, part.look)


def _confirm(lab: Lab, visitor: Visitor) -> None:
    """Show what the robot is doing before the visitor takes control without consent."""
    with ui.dialog(value=True).props('aria-label="Take control"') as dialog, ui.card():
        state = ui.label("").props('role="status"')
        ui.label(f"{lab.operator_name} did not answer, and may have a hand on the robot.")

        def take() -> None:
            if try_now(lambda: lab.take_over(visitor)):
                dialog.close()

        with ui.row().classes("lab-row"):
            button = ui.button("Take control", on_click=take).props("unelevated no-caps")
            ui.button("Cancel", on_click=dialog.close).props("flat no-caps")

        def look() -> None:
            state.text = lab.robot_action or "The robot is standing still."
            button.set_enabled(not lab.robot_moves)

        look()
        ui.timer(0.2, look)


def _answer(lab: Lab, operator: Visitor, *, yes: bool) -> None:
    try_now(lambda: lab.answer_request(operator, yes=yes))
