"""Touch a network: change its weights, cut its sensors, and compare the trial with the recorded one."""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable
from functools import partial

from nicegui import ui

from realitygap.lab._messages import Replay, ReplayRefused, TrialChoice
from realitygap.lab._watcher import Watcher

from ._elements import Player
from ._frame import hint

MOST_WEIGHT = 8.0
"""Largest weight that a slider has; a larger one of a network widens all sliders."""


class Touch:
    """The network of a trial, to be changed and run again in its simulator.

    Args:
        watcher: Runs it.
        chosen: Returns the trial that the page shows; None if it shows none.
    """

    def __init__(self, watcher: Watcher, chosen: Callable[[], TrialChoice | None]) -> None:
        self._watcher, self._chosen = watcher, chosen
        self._key = secrets.token_hex(8)
        self._trial: TrialChoice | None = None
        self._answer: Replay | ReplayRefused | None = None
        self._sliders: dict[str, ui.slider] = {}
        self._sensors: dict[str, ui.checkbox] = {}

    def show(self) -> None:
        """Show it, closed."""
        self._box = ui.expansion("Change the network", on_value_change=self.look).classes("lab-expansion")
        with self._box:
            hint("Runs in the simulator with the noise of the recorded trial. The study stays as it is.")
            self._form = ui.column().classes("lab-cards")
            self._result = ui.column().classes("lab-cards")

    def look(self) -> None:
        """Show the network of the trial that is chosen, and the answer that has come."""
        if self._box.value and self._chosen() != self._trial:
            self._trial = self._chosen()
            self._sliders, self._sensors = {}, {}
            self._form.clear()
            self._run()
        answer = self._watcher.replays.get(self._key)
        if answer is None or answer is self._answer:
            return
        self._answer = answer
        self._result.clear()
        if isinstance(answer, Replay) and not self._sensors:
            with self._form:
                self._show_form(answer)
        with self._result:
            if isinstance(answer, Replay):
                Player(answer.scene, answer.trials)
            else:
                ui.label(answer.text).classes("lab-problem").props('role="alert"')

    def _show_form(self, network: Replay) -> None:
        self._evolved = {link: round(weight, 2) for link, weight in network.weights.items()}
        with ui.row().classes("lab-row").props('role="group" aria-label="Sensors"'):
            self._sensors = {name: ui.checkbox(name, value=True) for name in network.inputs}
        most = max([MOST_WEIGHT, *(math.ceil(abs(weight)) for weight in network.weights.values())])
        with ui.element("div").classes("lab-gauges"):
            for link in self._evolved:
                with ui.element("div"):
                    words = ui.label().classes("lab-value")
                    slider = ui.slider(min=-most, max=most, step=0.05, value=self._evolved[link])
                    slider.props(f'aria-label="{link}"')
                    words.bind_text_from(slider, "value", partial(_words, link))
                    self._sliders[link] = slider
        ui.button("Run again", on_click=self._run).props("unelevated no-caps")

    def _run(self) -> None:
        """Run the trial with the weights and sensors on the page."""
        if self._trial is not None:
            entered = {link: _number(slider.value) for link, slider in self._sliders.items()}
            weights = {link: value for link, value in entered.items() if value != self._evolved[link]}
            cut = [name for name, box in self._sensors.items() if not box.value]
            self._watcher.touch(self._key, self._trial, weights, cut)


def _words(link: str, weight: object) -> str:
    return f"{link}: {_number(weight):+.2f}".replace("-", "−")


def _number(value: object) -> float:
    """Return a weight; 0 for what is none, which some other program sent."""
    is_number = isinstance(value, int | float) and math.isfinite(value)
    return float(value) if is_number and isinstance(value, int | float) else 0.0
