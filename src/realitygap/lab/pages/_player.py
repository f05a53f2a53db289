"""The player: trials played, or a robot that is being driven."""

from __future__ import annotations

import json
from typing import Any

from nicegui import ui
from nicegui.element import Element

from realitygap.lab._lab import Lab
from realitygap.lab._live_job import LiveJob

LIVE_S = 0.05
"""Time between two looks at a robot that is driven [s]."""


class Player(Element, component="player.js"):
    """Player of trials; `live` shows a trial that is being driven."""

    def __init__(self, scene: dict[str, Any], trials: list[dict[str, Any]], *, live: bool = False) -> None:
        super().__init__()
        # One text, because NiceGUI watches each list within a value, which takes much of the server's time.
        self._props |= {"shown": json.dumps({"scene": scene, "trials": trials}), "live": live}


class LivePlayer:
    """A robot that is driven for those who look, until it can be played again.

    Args:
        lab: Whose page it is.
        job: What drives it.
    """

    def __init__(self, lab: Lab, job: LiveJob) -> None:
        self._lab, self._job = lab, job
        self._n_told = 0
        self._is_ready = False
        self._is_live = job.is_live

    def show(self) -> None:
        """Show it."""
        job = self._job
        if job.outcome is not None and job.scene is None:
            ui.label(job.outcome).classes("lab-problem").props('role="status"')
            return
        if job.scene is None:
            ui.label("Getting the robot ready ...").props('role="status"')
            return
        self._player = Player(job.scene, job.trials, live=job.is_live)
        self._player.on("all", self._ready)
        if job.is_live:
            self._timer = ui.timer(LIVE_S, self._look)

    def _ready(self) -> None:
        """Begin to send the trial, because the page is ready."""
        self._is_ready, self._n_told = True, 0

    def _look(self) -> None:
        job = self._job
        if self._is_ready and (messages := job.since(self._n_told)):
            self._n_told = job.n_told
            self._player.run_method("told", messages)
        if not job.is_live:
            self._timer.deactivate()
            self._player.run_method("ended", job.trials)
