"""Figures and replays of studies, drawn in one process for all of them: starting it takes longer than drawing.

`Drawer` is its end in the server; `draw` runs in the process.
"""

from __future__ import annotations

import contextlib
import os
import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import numpy as np
from pydantic import TypeAdapter

from realitygap.drawing import picture_of
from realitygap.errors import RealityGapError
from realitygap.playback import pack_scene, pack_trials
from realitygap.records import ResultsFolder
from realitygap.report import (
    NARROW,
    Drawing,
    Tally,
    choose_moving,
    choose_run,
    draw_archive,
    draw_coverage,
    draw_networks,
    draw_paths,
    draw_scores,
    draw_species,
    elite_maps,
    read_tally,
    summarize,
    touch_network,
    write_report,
)
from realitygap.stats import median_interval

from . import _messages as messages
from ._channel import Channel
from ._child import Child
from ._figure_cache import keep_figures, keep_rows, keep_thumbnail

DrawingWish = (
    messages.FiguresWish
    | messages.ThumbnailWish
    | messages.ReplayWish
    | messages.RunWish
    | messages.ArchiveWish
    | messages.TouchWish
    | messages.ReportWish
)
FIGURES: dict[str, Callable[..., Drawing | list[Drawing]]] = {
    "scores": draw_scores,
    "coverage": draw_coverage,
    "paths": draw_paths,
    "networks": draw_networks,
    "species": draw_species,
    "archive": draw_archive,
}
OF_ONE = ("paths", "networks", "species", "archive")
"""Figures that show one condition, which is the last part of their names."""
_COLUMNS = list(messages.SummaryRow.__annotations__)
_ROWS = TypeAdapter(list[messages.SummaryRow])
IDLE_S = 600.0
"""Time without a wish after which the process ends; the next wish starts another [s]."""
_POLITE = 10
"""Lowers the priority of the process below that of studies."""
_QUICK = (
    messages.ReplayWish,
    messages.RunWish,
    messages.ArchiveWish,
    messages.TouchWish,
    messages.ReportWish,
)
"""Wishes that are granted between two figures, because a visitor waits for them."""
_DIGITS = 4
MOST_GENERATIONS, MOST_PATHS, MOST_SLOW = 40, 12, 20
"""Number of generations whose paths are shown, of paths in each, and of paths of a run whose trials are slow."""


class Drawer:
    """Passes wishes of all studies to one process, and its answers back.

    Args:
        root: Folder in which the process works.
    """

    def __init__(self, root: Path, *, allow_code: bool) -> None:
        self._root, self._allow_code = root, allow_code
        self._child: Child | None = None
        self._hearers: dict[str, Callable[[messages.Message], None]] = {}
        self._lock = threading.Lock()

    def prepare(self) -> None:
        """Start the process, so that it is ready when a figure is needed."""
        with self._lock:
            self._start()

    def want(self, wish: DrawingWish, hear: Callable[[messages.Message], None]) -> None:
        """Ask for something about a study.

        Args:
            wish: The wish.
            hear: Takes each answer about this study, and the end of the process, in another thread.
        """
        with self._lock:
            self._hearers[wish.folder] = hear
            self._start().tell(wish)

    def end(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.end()

    @property
    def process_id(self) -> int | None:
        """Number of the process; None if there is none."""
        return None if self._child is None else self._child.process_id

    def _start(self) -> Child:
        if self._child is None or not self._child.is_alive:
            self._child = Child(messages.DrawingWork(self._allow_code), self._root, self._hear)
        return self._child

    def _hear(self, message: messages.Message) -> None:
        if isinstance(message, messages.Ended):
            for hear in list(self._hearers.values()):
                hear(message)
        elif (
            isinstance(message, messages.StudyReport)
            and (hearer := self._hearers.get(message.folder)) is not None
        ):
            hearer(message)


# in the process


def draw(channel: Channel, work: messages.DrawingWork) -> None:
    """Draw what is wished for, until nobody wishes for anything."""
    if hasattr(os, "nice"):
        os.nice(_POLITE)
    wishes = _Wishes(channel)
    import_module(
        "matplotlib.backends.backend_svg"
    )  # this and the first interval take longer than the first figure
    median_interval(np.arange(12.0))
    last = time.monotonic()
    while time.monotonic() - last < IDLE_S:
        wish = wishes.next(timeout=0.2)
        if wish is not None:
            _grant(channel, wish, wishes, allow_code=work.allow_code)
            last = time.monotonic()


class _Wishes:
    """Wishes that have come and are not granted yet."""

    def __init__(self, channel: Channel) -> None:
        self._queue: queue.Queue[DrawingWish] = queue.Queue()
        self._waiting: deque[DrawingWish] = deque()
        for kind in get_args(DrawingWish):
            channel.at_once(kind, self._queue.put)

    def next(self, timeout: float) -> DrawingWish | None:
        """Return the first quick wish, otherwise the first one; None if none comes in this time [s]."""
        if not self._waiting:
            with contextlib.suppress(queue.Empty):
                self._waiting.append(self._queue.get(timeout=timeout))
        quick = self.quick()
        return quick if quick is not None else self._waiting.popleft() if self._waiting else None

    def quick(self) -> DrawingWish | None:
        """Return the first quick wish; None if there is none."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._waiting.append(self._queue.get_nowait())
        for wish in self._waiting:
            if isinstance(wish, _QUICK):
                self._waiting.remove(wish)
                return wish
        return None


def _grant(channel: Channel, wish: DrawingWish, wishes: _Wishes, *, allow_code: bool) -> None:
    folder = Path(wish.folder)
    try:
        match wish:
            case messages.FiguresWish():
                _draw_all(channel, wish, lambda: _grant_quick(channel, wishes, allow_code=allow_code))
            case messages.ThumbnailWish():
                rows = _rows(read_tally(folder, with_uncounted=True))
                keep_thumbnail(folder, _thumbnail(folder, rows))
                keep_rows(folder, wish.done, rows)
                channel.say(messages.ThumbnailDrawn(wish.folder))
            case messages.ReplayWish():
                channel.say(_replay(folder, wish))
            case messages.RunWish():
                channel.say(_paths_of_run(folder, wish))
            case messages.ArchiveWish():
                maps = elite_maps(ResultsFolder.open(folder), wish.condition)
                channel.say(messages.Archive(wish.folder, wish.key, {} if maps is None else maps._asdict()))
            case messages.TouchWish():
                moving, weights, inputs = touch_network(folder, wish.weights, wish.cut, **wish.choice)
                scene = pack_scene(moving[0].arena, "As evolved, and changed")
                trials = pack_trials(moving)
                channel.say(messages.Replay(wish.folder, wish.key, scene, trials, weights, list(inputs)))
            case messages.ReportWish():
                write_report(ResultsFolder.open(folder), allow_code=allow_code)
                channel.say(messages.ReportWritten(wish.folder))
    except (RealityGapError, ValueError, TypeError, OSError) as error:
        match wish:
            case messages.FiguresWish() if not wish.condition:
                channel.say(messages.FiguresDrawn(wish.folder, 0.0))
            case messages.ReplayWish() | messages.RunWish() | messages.ArchiveWish() | messages.TouchWish():
                channel.say(messages.ReplayRefused(wish.folder, wish.key, str(error)))
            case messages.ReportWish():
                channel.say(messages.ReportWritten(wish.folder, str(error)))


def _grant_quick(channel: Channel, wishes: _Wishes, *, allow_code: bool) -> None:
    while (wish := wishes.quick()) is not None:
        _grant(channel, wish, wishes, allow_code=allow_code)


def _rows(tally: Tally) -> list[messages.SummaryRow]:
    return _ROWS.validate_python(summarize(tally).select(_COLUMNS).to_dicts())


def _draw_all(channel: Channel, wish: messages.FiguresWish, pause: Callable[[], None]) -> None:
    """Summarize the published runs, and draw their figures; `pause` is called between figures.

    All are of one look at the folder, so that their numbers of runs agree.
    """
    folder, began = Path(wish.folder), time.process_time()
    rows: list[messages.SummaryRow] = []
    curves: list[messages.Curve] = []
    figures: dict[str, messages.Figure] = {}

    def tell(name: str, figure: messages.Figure) -> None:
        figures[name] = figure
        channel.say(messages.FigureDrawn(wish.folder, name, figure))

    tally = read_tally(folder, with_uncounted=True)
    if not wish.condition:
        rows, curves = _rows(tally), curves_of(tally)
        channel.say(messages.StudySummary(wish.folder, rows, curves))
    condition = wish.condition or _best(rows) or tally.conditions[0]["name"]
    for kind, draw in FIGURES.items():
        pause()
        if wish.names and kind not in wish.names:
            continue
        name, options = (f"{kind}-{condition}", {"condition": condition}) if kind in OF_ONE else (kind, {})
        try:
            drawn = draw(folder if kind == "scores" else tally.counted_only(), **options)
        except (RealityGapError, ValueError) as error:
            tell(name, {"text": str(error)})
            continue
        for number, wide in enumerate(drawn if isinstance(drawn, list) else [drawn]):
            narrow = wide.in_width(NARROW).svg
            figure: messages.Figure = {
                "caption": wide.caption,
                "alt": wide.alt,
                "wide": wide.svg,
                "narrow": narrow,
            }
            tell(f"{name}-{number}" if number else name, figure)
    if not wish.names:
        with contextlib.suppress(RealityGapError, ValueError):
            keep_thumbnail(folder, _thumbnail(folder, rows))
        keep_figures(folder, wish.done, rows, curves, figures)
    if not wish.condition:
        channel.say(messages.FiguresDrawn(wish.folder, time.process_time() - began))


def curves_of(tally: Tally) -> list[messages.Curve]:
    """Return the median best coverage by generation of each condition with known coverage."""
    curves: list[messages.Curve] = []
    for condition in tally.conditions:
        columns = [
            values[np.isfinite(values)]
            for values in tally.generation_bests(condition["name"], tally.measure).T
        ]
        points = [_point(values) for values in columns if len(values)]
        if points:
            settings = condition["settings"]
            curves.append(
                {
                    "condition": condition["name"],
                    "label": str(condition.get("label", "")),
                    "search": str(settings.get("selection", "")),
                    "noise": float(settings.get("noise", 0.0)),
                    "points": points,
                }
            )
    return curves


def _point(values: np.ndarray[Any, np.dtype[np.float64]]) -> messages.CurvePoint:
    interval = median_interval(values).ends
    return {
        "n": len(values),
        "median": round(float(np.median(values)), _DIGITS),
        "low": None if interval is None else round(interval[0], _DIGITS),
        "high": None if interval is None else round(interval[1], _DIGITS),
    }


def _thumbnail(folder: Path, rows: list[messages.SummaryRow]) -> str:
    """Return the path of the typical run of the condition with the highest median, as SVG."""
    trial = choose_moving([folder], condition=_best(rows))[1][0]
    return picture_of(trial).to_svg(240.0)


def _best(rows: list[messages.SummaryRow]) -> str | None:
    """Return the condition with the highest median; None if no median is known."""
    known = {row["condition"]: median for row in rows if (median := row["line_median"]) is not None}
    return max(known, key=known.__getitem__) if known else None


def _paths_of_run(folder: Path, wish: messages.RunWish) -> messages.Replay:
    """Return the paths of the best individuals of each generation of a run."""
    tally = read_tally(folder)
    run = choose_run(
        tally, wish.condition, int(tally.replicates(wish.condition)[-1]) if wish.is_last else None
    )
    known = run.rows["generation"].unique().sort().to_numpy()
    most = MOST_PATHS if run.condition.on.is_simulator else max(MOST_SLOW // len(known), 1)
    chosen = known[np.unique(np.linspace(0, len(known) - 1, MOST_GENERATIONS).round().astype(int))]
    rows = run.rows.filter(run.rows["generation"].is_in(chosen.tolist()))
    rows = rows.sort("generation", tally.score_column(wish.condition))
    paths, _ = run.trace(rows.group_by("generation", maintain_order=True).tail(most))
    generations: list[messages.GenerationPaths] = []
    for path in paths:
        if not generations or generations[-1]["generation"] != path.generation:
            generations.append({"generation": path.generation, "coverage": 0.0, "paths": []})
        last = generations[-1]
        last["coverage"] = round(path.coverage, _DIGITS)
        last["paths"] += [
            (1000 * poses[:, :2]).round().astype(int).ravel().tolist() for poses, _ in path.tracks
        ]
    title = f"{run.label}: {wish.condition}, run {run.replicate}"
    return messages.Replay(wish.folder, wish.key, pack_scene(run.arena, title), [], generations=generations)


def _replay(folder: Path, wish: messages.ReplayWish) -> messages.Replay:
    """Return the scene and the trials that a player shows: one for each of `choices`."""
    chosen = [choose_moving([folder], **choice) for choice in wish.choices]
    trials = [trial for _, moving in chosen for trial in moving]
    title = chosen[0][0] if len(chosen) == 1 else f"{len(chosen)} trials"
    if any(trial.arena != trials[0].arena for trial in trials):
        raise ValueError("These trials are in different arenas. Compare trials of one arena.")
    return messages.Replay(wish.folder, wish.key, pack_scene(trials[0].arena, title), pack_trials(trials))
