"""Figures and replays of a study, drawn in a separate process."""

from __future__ import annotations

import contextlib
import os
import queue
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.errors import RealityGapError
from realitygap.playback import pack_scene, pack_trials
from realitygap.records import ResultsFolder
from realitygap.report import (
    NARROW,
    Drawing,
    choose_moving,
    draw_archive,
    draw_coverage,
    draw_networks,
    draw_paths,
    draw_scores,
    draw_species,
    summarize,
    write_report,
)

from ._channel import Channel, Message
from ._figure_cache import keep_figures

FIGURES: dict[str, Callable[..., Drawing | list[Drawing]]] = {
    "scores": draw_scores,
    "coverage": draw_coverage,
    "paths": draw_paths,
    "networks": draw_networks,
    "species": draw_species,
    "archive": draw_archive,
}
_COLUMNS = ["condition", "label", "n", "line_median", "line_low", "line_high"]
IDLE_S = 60.0
"""After so long without a wish the process ends; the next wish begins another [s]."""
_POLITE = 10
"""How much it stands back behind what computes."""


def work(channel: Channel, order: Message) -> None:
    """Draw what is wished for, until nobody wishes for anything.

    Args:
        channel: To the server.
        order: `folder` of the study.
    """
    if hasattr(os, "nice"):
        os.nice(_POLITE)
    wishes: queue.Queue[Message] = queue.Queue()
    channel.at_once("want", wishes.put)
    folder = Path(order["folder"])
    last = time.monotonic()
    while time.monotonic() - last < IDLE_S:
        try:
            wish = wishes.get(timeout=0.2)
        except queue.Empty:
            continue
        _grant(channel, folder, wish)
        last = time.monotonic()


def _grant(channel: Channel, folder: Path, wish: Message) -> None:
    what = wish.get("what")
    try:
        if what == "figures":
            _draw_all(channel, folder, wish)
        elif what == "replay":
            channel.say("replay", key=wish["key"], **_replay(folder, wish))
        elif what == "report":
            write_report(ResultsFolder.open(folder))
            channel.say("report")
    except (RealityGapError, ValueError, TypeError, OSError) as error:
        channel.say("refused", key=wish.get("key", ""), text=str(error))


def _draw_all(channel: Channel, folder: Path, wish: Message) -> None:
    """Summarize the published runs, and draw their figures."""
    began = time.process_time()
    rows: list[Any] = []
    figures: dict[str, Any] = {}
    names = wish.get("names")

    def tell(name: str, **figure: str) -> None:
        figures[name] = figure
        channel.say("figure", name=name, **figure)

    with contextlib.suppress(RealityGapError):  # the figures state why there is nothing to show
        rows = summarize(folder).select(_COLUMNS).to_dicts()
        channel.say("summary", rows=rows)
    for name, draw in FIGURES.items():
        if names and name not in names:
            continue
        try:
            drawn = draw(folder)
        except (RealityGapError, ValueError) as error:
            tell(name, text=str(error))
            continue
        for number, wide in enumerate(drawn if isinstance(drawn, list) else [drawn]):
            tell(
                f"{name}-{number}" if number else name,
                caption=wide.caption,
                alt=wide.alt,
                wide=wide.svg,
                narrow=wide.in_width(NARROW).svg,
            )
    if not names:
        keep_figures(folder, wish["done"], rows, figures)
    channel.say("drawn", seconds=time.process_time() - began)


def _replay(folder: Path, wish: Message) -> dict[str, Any]:
    """The scene and the trials that a player shows."""
    each = wish.get("each") or None
    numbers = {
        key: wish[key] for key in ("condition", "replicate", "generation", "individual") if key in wish
    }
    title, trials = choose_moving([folder], each, **numbers)
    return {"scene": pack_scene(trials[0].arena, title), "trials": pack_trials(trials)}
