"""Figures and replays of studies, drawn in a separate process."""

from __future__ import annotations

import contextlib
import os
import queue
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.drawing import picture_of
from realitygap.errors import RealityGapError
from realitygap.playback import pack_scene, pack_trials
from realitygap.records import ResultsFolder
from realitygap.report import (
    NARROW,
    Drawing,
    Tally,
    choose_moving,
    draw_archive,
    draw_coverage,
    draw_networks,
    draw_paths,
    draw_scores,
    draw_species,
    read_tally,
    summarize,
    write_report,
)
from realitygap.stats import median_interval

from ._channel import Channel, Message
from ._figure_cache import keep_figures, keep_rows, keep_thumbnail

FIGURES: dict[str, Callable[..., Drawing | list[Drawing]]] = {
    "scores": draw_scores,
    "coverage": draw_coverage,
    "paths": draw_paths,
    "networks": draw_networks,
    "species": draw_species,
    "archive": draw_archive,
}
_COLUMNS = ["condition", "label", "n", "line_median", "line_low", "line_high"]
IDLE_S = 600.0
"""Time without a wish after which the process ends; the next wish starts another [s]."""
_POLITE = 10
"""Lowers the priority of the process below that of studies."""
_QUICK = ("replay", "report")
"""Wishes that are granted between two figures, because a visitor waits for them."""
_DIGITS = 4


def work(channel: Channel, order: Message) -> None:
    """Draw what is wished for, until nobody wishes for anything.

    Args:
        channel: To the server. Each answer names the folder of its study.
        order: Empty; each wish names the folder of its study.
    """
    if hasattr(os, "nice"):
        os.nice(_POLITE)
    wishes = _Wishes()
    channel.at_once("want", wishes.put)
    import_module(
        "matplotlib.backends.backend_svg"
    )  # this and the first interval take longer than the first figure
    median_interval(np.arange(12.0))
    last = time.monotonic()
    while time.monotonic() - last < IDLE_S:
        wish = wishes.next(timeout=0.2)
        if wish is not None:
            _grant(channel, wish, wishes)
            last = time.monotonic()


class _Wishes:
    """Wishes that have come and are not granted yet."""

    def __init__(self) -> None:
        self._queue: queue.Queue[Message] = queue.Queue()
        self._waiting: deque[Message] = deque()
        self.put = self._queue.put

    def next(self, timeout: float) -> Message | None:
        """Return the first quick wish, otherwise the first one; None if none comes in this time [s]."""
        if not self._waiting:
            with contextlib.suppress(queue.Empty):
                self._waiting.append(self._queue.get(timeout=timeout))
        quick = self.quick()
        return quick if quick is not None else self._waiting.popleft() if self._waiting else None

    def quick(self) -> Message | None:
        """Return the first quick wish; None if there is none."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._waiting.append(self._queue.get_nowait())
        for wish in self._waiting:
            if wish.get("what") in _QUICK:
                self._waiting.remove(wish)
                return wish
        return None


def _grant(channel: Channel, wish: Message, wishes: _Wishes) -> None:
    folder, what = Path(wish["folder"]), wish.get("what")
    say = partial(channel.say, folder=wish["folder"])
    try:
        if what == "figures":
            _draw_all(say, folder, wish, lambda: _grant_quick(channel, wishes))
        elif what == "thumbnail":
            rows = summarize(read_tally(folder, with_uncounted=True)).select(_COLUMNS).to_dicts()
            keep_thumbnail(folder, _thumbnail(folder, rows))
            keep_rows(folder, wish["done"], rows)
            say("thumbnail")
        elif what == "replay":
            say("replay", key=wish["key"], **_replay(folder, wish))
        elif what == "report":
            write_report(ResultsFolder.open(folder))
            say("report")
    except (RealityGapError, ValueError, TypeError, OSError) as error:
        say("refused", key=wish.get("key", ""), text=str(error))
        if what == "figures":
            say("drawn", seconds=0.0)


def _grant_quick(channel: Channel, wishes: _Wishes) -> None:
    while (wish := wishes.quick()) is not None:
        _grant(channel, wish, wishes)


def _draw_all(say: Callable[..., None], folder: Path, wish: Message, pause: Callable[[], None]) -> None:
    """Summarize the published runs, and draw their figures; `pause` is called between figures."""
    began = time.process_time()
    rows: list[Any] = []
    curves: list[Any] = []
    figures: dict[str, Any] = {}
    names = wish.get("names")

    def tell(name: str, **figure: str) -> None:
        figures[name] = figure
        say("figure", name=name, **figure)

    with contextlib.suppress(RealityGapError):  # the figures state why there is nothing to show
        tally = read_tally(folder, with_uncounted=True)
        rows = summarize(tally).select(_COLUMNS).to_dicts()
        curves = curves_of(tally)
        say("summary", rows=rows, curves=curves)
    for name, draw in FIGURES.items():
        pause()
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
        with contextlib.suppress(RealityGapError, ValueError):
            keep_thumbnail(folder, _thumbnail(folder, rows))
        keep_figures(folder, wish["done"], rows, curves, figures)
    say("drawn", seconds=time.process_time() - began)


def curves_of(tally: Tally) -> list[dict[str, Any]]:
    """Return the median best coverage of each condition in each generation, ready for JSON.

    Args:
        tally: The study.

    Returns:
        For each condition with known coverage: `condition`, `label`, and for each generation `n`, the number of runs,
        `median`, and the bounds `low` and `high` of its 95 % interval, null below six runs.
    """
    found = []
    for condition in tally.conditions:
        columns = [
            values[np.isfinite(values)]
            for values in tally.generation_bests(condition["name"], tally.measure).T
        ]
        points = [_point(values) for values in columns if len(values)]
        if points:
            found.append(
                {"condition": condition["name"], "label": str(condition.get("label", "")), "points": points}
            )
    return found


def _point(values: np.ndarray[Any, np.dtype[np.float64]]) -> dict[str, Any]:
    interval = median_interval(values).ends
    return {
        "n": len(values),
        "median": round(float(np.median(values)), _DIGITS),
        "low": None if interval is None else round(interval[0], _DIGITS),
        "high": None if interval is None else round(interval[1], _DIGITS),
    }


def _thumbnail(folder: Path, rows: list[Any]) -> str:
    """Return the path of the typical run of the condition with the highest median, as SVG."""
    known = [row for row in rows if row["line_median"] is not None]
    best = max(known, key=lambda row: row["line_median"])["condition"] if known else None
    trial = choose_moving([folder], condition=best)[1][0]
    return picture_of(trial).to_svg(240.0)


def _replay(folder: Path, wish: Message) -> dict[str, Any]:
    """Return the scene and the trials that a player shows: one for each of `choices`."""
    chosen = [choose_moving([folder], **choice) for choice in wish["choices"]]
    trials = [trial for _, moving in chosen for trial in moving]
    title = chosen[0][0] if len(chosen) == 1 else f"{len(chosen)} trials"
    if any(trial.arena != trials[0].arena for trial in trials):
        raise ValueError("These trials are in different arenas. Compare trials of one arena.")
    return {"scene": pack_scene(trials[0].arena, title), "trials": pack_trials(trials)}
