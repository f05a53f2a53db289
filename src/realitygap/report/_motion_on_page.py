"""Trials that move on a page, in the player that notebooks and the lab have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import resources
from typing import Any

from markupsafe import Markup

from realitygap.playback import MovingTrial, pack_scene, pack_trials
from realitygap.report._placed import as_json, hash_of
from realitygap.report._template import template_text

SPEED = 4
"""Speed at which trials begin to move."""


@dataclass(frozen=True)
class MotionOnPage:
    """Trials in one arena that a page plays.

    Attributes:
        title: What they show.
        data: Scene and trials, for the script.
    """

    title: str
    data: Markup

    @classmethod
    def of(cls, title: str, trials: Sequence[tuple[str, MovingTrial]]) -> MotionOnPage:
        """Return trials by their names, ready for a page."""
        named = [replace(trial, title=name) for name, trial in trials]
        values = {
            "scene": pack_scene(named[0].arena, title),
            "trials": pack_trials(named),
            "speed": SPEED,
            "live": False,
            "was_live": False,
        }
        return cls(title, as_json(values))


def motion_content() -> dict[str, Any]:
    """Return what a page needs to play trials: `motion_css`, `motion_script`, and `motion_hash`."""
    player = resources.files("realitygap.playback")
    module = player.joinpath("player.js").read_text("utf-8").replace("export default { render };", "")
    script = f'"use strict";\n(() => {{\n{module}{template_text("motion.js")}}})();\n'
    css = player.joinpath("player.css").read_text("utf-8") + template_text("motion.css")
    return {"motion_css": Markup(css), "motion_script": Markup(script), "motion_hash": hash_of(script)}
