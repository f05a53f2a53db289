"""The picture of one moment: an arena in which robots leave trails, with what they see and have visited."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import PENS, Disc, Ink, Line, Shape
from realitygap.world import Arena, floor_shapes, things_in

from ._moving import Moment, MovingTrial, extent, nearness, placed, ray_ends

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.text import Text
    from PIL.Image import Image

A = TypeVar("A", bound="Artist")

LETTERS = "ABCDEFGH"
"""Letters of the pens, as on the page of a report."""

MOST_TRIALS = len(LETTERS)
"""Shown together: one a pen."""

FAR, MIDDLE, NEAR = "#a9b4c2", "#e39a1b", "#c2182b"
"""Colors of a ray, by the nearness of the object that it meets."""

TILE, TILE_VISITED, TILE_OFTEN = "#f3f5f8", "#cfe0f1", "#7fb0dd"
"""Colors of a cell that no robot visited, that one visited, and that all of several visited."""

_EDGE, _HEAD, _FOOT, _ROW = 0.12, 0.36, 0.26, 0.21
_NAME = 1.9
"""Width of a name below the arena."""

_DOTS = 90
"""Dots per inch of a picture. A picture below 4.8 in would have smaller letters."""

_ROOMY = 6.0
"""A picture of this width has room for words in its head [in]."""

_FAN = 0.042
"""Distance of a robot's letter from its middle if several robots are at one place, as a part of the width."""


_DOT = 1e-4
"""A line so short is a dot [m]."""


def rgb(color: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255, of #rrggbb."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def paler(color: str, share: float) -> tuple[int, int, int]:
    """Return a color, 0 to 255, of which only a share covers the ground."""
    red, green, blue = (round(255 * part) for part in _mixed(Ink.GROUND, color, share))
    return red, green, blue


def _mixed(start: str, end: str, share: float) -> tuple[float, float, float]:
    """Return a color between two, 0 to 1."""
    red, green, blue = (
        (first + share * (second - first)) / 255 for first, second in zip(rgb(start), rgb(end), strict=True)
    )
    return red, green, blue


def ray_color(near: float) -> tuple[float, float, float]:
    """Return the color of a ray that meets something as near as this, 0 (nothing) to 1 (touching)."""
    if near <= 0:
        return _mixed(FAR, FAR, 0.0)
    return _mixed(FAR, MIDDLE, 2 * near) if near < 0.5 else _mixed(MIDDLE, NEAR, 2 * near - 1)


@contextmanager
def plain_style() -> Iterator[None]:
    """Draw with matplotlib's own settings and font instead of the user's."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update({"font.family": ["DejaVu Sans"], "text.parse_math": False})
        yield


class Screen:
    """Draws moments of trials as pictures of one size; use under `plain_style`.

    Fixed parts are drawn once, and moving parts are drawn over them.

    Args:
        trials: At most eight trials in one arena.
        width: Width of the pictures [px].
        title: Title in the head. Default: that of the trial, if there is one trial.
    """

    def __init__(self, trials: Sequence[MovingTrial], width: int, title: str = "") -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.trials = trials
        self.n_steps = max(trial.n_steps for trial in trials)
        self.duration_s = max(trial.duration_s for trial in trials)
        self._several = len(trials) > 1
        self._title = title or (trials[0].title if len(trials) == 1 else f"{len(trials)} trials")
        left, right, bottom, top = extent(trials[0].arena)
        self._wide = max(4.8, width / _DOTS)
        self._columns = max(1, int((self._wide - _EDGE) / _NAME))
        rows = math.ceil(len(trials) / self._columns) if self._several else 0
        across = self._wide - 2 * _EDGE
        up = across * (top - bottom) / (right - left)
        height = _HEAD + up + _ROW * rows + _FOOT + 0.02
        dots = width / self._wide
        pixels = [2 * round(width / 2), 2 * round(height * dots / 2)]  # video wants even numbers
        self._figure = Figure(figsize=(pixels[0] / dots, pixels[1] / dots), dpi=dots, facecolor=Ink.GROUND)
        canvas: Any = FigureCanvasAgg(self._figure)  # without types in Matplotlib
        self._canvas = canvas
        height = pixels[1] / dots
        self._all = self._figure.add_axes((0, 0, 1, 1))
        self._all.set(xlim=(0, self._wide), ylim=(height, 0))
        self._all.set_axis_off()
        box = (_EDGE / self._wide, 1 - (_HEAD + up) / height, across / self._wide, up / height)
        self._field = self._figure.add_axes(box)
        self._field.set(xlim=(left, right), ylim=(bottom, top))
        self._field.set_axis_off()
        self._moving: list[tuple[Axes, Artist]] = []
        self._draw_arena(trials[0].arena)
        self._draw_head()
        self._robots = [_Robot(trial, pen, several=self._several) for pen, trial in enumerate(trials)]
        for layer in zip(*(robot.artists for robot in self._robots), strict=True):
            for artist in layer:
                self._add(self._field, artist)
        self._draw_names(_HEAD + up + 0.06)
        self._draw_foot(height - _FOOT + 0.02)
        self._visits: list[float] = []

    def picture(self, time: float) -> Image:
        """Return the moment at a time since the start [s]."""
        from PIL import Image

        moments = [trial.at(time) for trial in self.trials]
        self._move_cells(moments)
        for robot, trial, moment in zip(self._robots, self.trials, moments, strict=True):
            robot.move(trial, moment)
        self._move_letters(moments)
        self._move_words(time, moments)
        self._canvas.restore_region(self._ground)
        for axes, artist in self._moving:
            axes.draw_artist(artist)
        return Image.fromarray(np.asarray(self._canvas.buffer_rgba())[..., :3].copy())

    # what stands still

    def _draw_arena(self, arena: Arena) -> None:
        from matplotlib.collections import LineCollection, PolyCollection

        grid, gap = arena.grid, 0.035 * arena.grid.cell
        tiles = []
        for cell in range(grid.n_cells):
            x, y = grid.corners(cell)[0]
            tiles.append([(x + dx, y + dy) for dx in (gap, grid.cell - gap) for dy in (gap, grid.cell - gap)])
        corners = np.array(tiles)[:, [0, 1, 3, 2]]
        self._tiles = PolyCollection(list(corners), linewidths=0, zorder=0.1)
        self._field.add_artist(self._tiles)
        for shape in (*floor_shapes(arena.floor), *things_in(arena)):
            _draw_shape(self._field, shape)
        walls = [[(x1, y1), (x2, y2)] for x1, y1, x2, y2 in arena.walls]
        self._field.add_artist(
            LineCollection(walls, colors=Ink.TEXT, linewidths=3.2, capstyle="projecting", clip_on=False)
        )

    def _draw_head(self) -> None:
        x = _EDGE
        for label in dict.fromkeys(trial.label for trial in self.trials):
            badge = self._all.text(
                x + 0.07,
                _HEAD / 2 + 0.01,
                label,
                fontsize=8.5,
                weight="bold",
                color=Ink.GROUND,
                va="center_baseline",
                bbox={
                    "boxstyle": "round,pad=0.32",
                    "facecolor": getattr(Ink, label, Ink.MUTED),
                    "edgecolor": "none",
                },
            )
            box = badge.get_window_extent(self._canvas.get_renderer())
            x = box.x1 / self._figure.dpi + 0.2
        size, room = (10.0, 2.3) if self._wide >= _ROOMY else (8.5, 1.35)
        letters = int((self._wide - x - room) * 95 / size)
        self._all.text(
            x,
            _HEAD / 2 + 0.01,
            _short(self._title, letters),
            fontsize=size,
            weight="bold",
            color=Ink.TEXT,
            va="center_baseline",
        )
        self._clock = self._all.text(
            self._wide - _EDGE,
            _HEAD / 2 + 0.01,
            "",
            fontsize=size - 0.5,
            color=Ink.MUTED,
            ha="right",
            va="center_baseline",
        )
        self._add(self._all, self._clock)

    def _draw_names(self, top: float) -> None:
        """Draw letter, pen, and name of each trial and its present coverage below the arena."""
        self._words: list[Text] = []
        if not self._several:
            return
        wide = (self._wide - 2 * _EDGE) / self._columns
        for pen, trial in enumerate(self.trials):
            x, y = _EDGE + wide * (pen % self._columns), top + _ROW * (pen // self._columns) + 0.09
            color, dashes = PENS[pen]
            self._all.plot([x, x + 0.28], [y, y], color=color, lw=2.0, dashes=dashes or (1, 0))
            name = f"{LETTERS[pen]}  {_short(trial.title, 16)}"
            self._all.text(x + 0.36, y, name, fontsize=8.2, color=Ink.TEXT, va="center_baseline")
            word = self._all.text(
                x + wide - 0.14, y, "", fontsize=8.2, color=Ink.MUTED, ha="right", va="center_baseline"
            )
            self._words.append(word)
            self._add(self._all, word)

    def _draw_foot(self, top: float) -> None:
        """Draw a line that fills as time goes by, and the meaning of the colors of rays."""
        from matplotlib.collections import LineCollection

        y = top + 0.1
        has_rays = any(trial.shape.mounts and np.isfinite(trial.rays).any() for trial in self.trials)
        right = self._wide - _EDGE
        if has_rays:
            xs = np.linspace(right - 0.84, right - 0.36, 17)
            pieces = [[(x, y), (onward, y)] for x, onward in itertools.pairwise(xs)]
            colors = [ray_color((k + 0.5) / len(pieces)) for k in range(len(pieces))]
            self._all.add_artist(LineCollection(pieces, colors=colors, linewidths=3.0))
            for x, text in ((right, "near"), (right - 0.9, "rays: far")):
                self._all.text(x, y, text, fontsize=7.5, color=Ink.MUTED, ha="right", va="center_baseline")
            right -= 1.65
        self._bar = (_EDGE, right)
        self._all.plot([_EDGE, right], [y, y], color=Ink.RULE, lw=2.4, solid_capstyle="round")
        (self._progress,) = self._all.plot([], [], color=Ink.OURS, lw=2.4, solid_capstyle="round")
        self._bar_y = y
        self._add(self._all, self._progress)

    # what moves

    def _add(self, axes: Axes, artist: A) -> A:
        artist.set_animated(True)
        if artist.axes is None:
            axes.add_artist(artist)
        self._moving.append((axes, artist))
        return artist

    def _move_cells(self, moments: Sequence[Moment]) -> None:
        """Fill the visited cells. They change seldom, so they are fixed parts, which are redrawn only on a change."""
        visits = np.zeros(self.trials[0].arena.grid.n_cells)
        for trial, moment in zip(self.trials, moments, strict=True):
            visits[list(trial.cells[: moment.n_cells])] += 1.0
        if visits.tolist() == self._visits:
            return
        self._visits = visits.tolist()
        most = max(len(self.trials) - 1, 1)
        self._tiles.set_facecolor(
            [
                _mixed(TILE_VISITED, TILE_OFTEN, (n - 1) / most) if n else _mixed(TILE, TILE, 0)
                for n in self._visits
            ]
        )
        self._canvas.draw()
        self._ground = self._canvas.copy_from_bbox(self._figure.bbox)

    def _move_letters(self, moments: Sequence[Moment]) -> None:
        """Place the letters on the robots, and around a place with several robots."""
        places = np.array([moment.pose[:2] for moment in moments])
        left, right = self._field.get_xlim()
        fan = _FAN * (right - left)
        for pen, robot in enumerate(self._robots):
            crowd = np.hypot(*(places - places[pen]).T) < fan
            angle = math.pi / 2 - math.tau * pen / len(self._robots)
            away = fan if crowd.sum() > 1 else 0.0
            robot.move_letter(places[pen] + away * np.array([math.cos(angle), math.sin(angle)]))

    def _move_words(self, time: float, moments: Sequence[Moment]) -> None:
        n_cells = self.trials[0].arena.grid.n_cells
        for word, moment in zip(self._words, moments, strict=False):
            blocked = "× " if moment.stalled else ""
            word.set_text(f"{blocked}{moment.n_cells / n_cells:.3f}")
            word.set_color(Ink.REACH if moment.stalled else Ink.MUTED)
        step = max(moment.step for moment in moments)
        counted = f"{step} of {self.n_steps}"
        is_roomy = self._wide >= _ROOMY
        parts = [f"step {counted}" if is_roomy else counted, f"{min(time, self.duration_s):.1f} s"]
        if not self._several and is_roomy:
            parts.append(f"coverage {moments[0].n_cells / n_cells:.3f}")
        if not self._several and moments[0].stalled:
            parts.insert(0, "× blocked" if is_roomy else "×")
        self._clock.set_text(" · ".join(parts))
        left, right = self._bar
        share = min(time / self.duration_s, 1.0) if self.duration_s else 1.0
        self._progress.set_data([left, left + share * (right - left)], [self._bar_y] * 2)


class _Robot:
    """Artists of one robot: trail, places where it was blocked, rays, outline, nose and letter."""

    def __init__(self, trial: MovingTrial, pen: int, *, several: bool) -> None:
        from matplotlib.collections import LineCollection, PolyCollection
        from matplotlib.lines import Line2D
        from matplotlib.text import Text

        color, dashes = PENS[pen] if several else (Ink.OURS, ())
        width = 2.0
        self._color = color
        self._blocked_color = color if several else Ink.REACH
        self._front = trial.shape.front
        self._trail = Line2D([], [], color=color, lw=width, zorder=4, dash_capstyle="butt")
        if dashes:
            self._trail.set_dashes([0.8 * part for part in dashes])
        self._trail.set_solid_joinstyle("round")
        self._blocked = Line2D(
            [],
            [],
            ls="",
            marker="x",
            color=Ink.REACH,
            markersize=4.0 if several else 5.5,
            markeredgewidth=1.1 if several else 1.5,
        )
        self._rays = LineCollection([], linewidths=1.3 if several else 1.8, capstyle="round")
        self._hits = LineCollection([], linewidths=3.6 if several else 5.5, capstyle="round")
        self._body = PolyCollection([], linewidths=1.5 if several else 1.8, edgecolors=color)
        self._body.set_facecolor("none" if several else (*_mixed(Ink.GROUND, color, 0.3), 0.5))
        self._nose = Line2D([], [], color=color, lw=1.8, solid_joinstyle="round", solid_capstyle="round")
        self._letter = Text(
            0, 0, LETTERS[pen] if several else "", fontsize=8.5, weight="bold", color=Ink.GROUND
        )
        self._letter.set(ha="center", va="center_baseline")
        self._letter.set_bbox({"boxstyle": "circle,pad=0.22", "facecolor": color, "edgecolor": Ink.GROUND})
        self.artists: list[Artist] = [
            self._trail,
            self._body,
            self._blocked,
            self._rays,
            self._hits,
            self._nose,
        ]
        if several:
            self.artists.append(self._letter)

    def move(self, trial: MovingTrial, moment: Moment) -> None:
        """Put it at its pose at a moment."""
        driven = np.vstack([trial.poses[: moment.row + 1, :2], moment.pose[:2]])
        self._trail.set_data(driven[:, 0], driven[:, 1])
        blocked = trial.poses[: moment.row + 1][trial.stalled[: moment.row + 1], :2]
        self._blocked.set_data(blocked[:, 0], blocked[:, 1])
        self._move_rays(trial, moment)
        self._body.set_verts([placed(outline, moment.pose) for outline in trial.shape.outlines])
        self._body.set_edgecolor(self._blocked_color if moment.stalled else self._color)
        self._body.set_linestyle((0, (2.0, 1.0)) if moment.stalled else "solid")
        nose = [(0.55 * self._front, 0.28 * self._front), (0.85 * self._front, 0.0)]
        nose.append((nose[0][0], -nose[0][1]))
        tip = placed(nose, moment.pose)
        self._nose.set_data(tip[:, 0], tip[:, 1])
        self._nose.set_color(self._blocked_color if moment.stalled else self._color)

    def _move_rays(self, trial: MovingTrial, moment: Moment) -> None:
        known = np.isfinite(moment.rays)
        near = nearness(trial.shape, moment.rays)
        ends: NDArray[np.float64] = ray_ends(trial.shape, moment)
        colors = [ray_color(float(share)) for share in near]
        self._rays.set_segments(list(ends[known]))
        self._rays.set_color([color for color, is_known in zip(colors, known, strict=True) if is_known])
        meets = known & (near > 0)
        self._hits.set_segments([[end, end + _DOT] for end in ends[meets, 1]])
        self._hits.set_color([color for color, is_met in zip(colors, meets, strict=True) if is_met])

    def move_letter(self, place: NDArray[np.float64]) -> None:
        """Put its letter at a place in the arena [m]."""
        self._letter.set_position((float(place[0]), float(place[1])))


def _draw_shape(axes: Axes, shape: Shape) -> None:
    """Draw a plain shape of an object in the arena."""
    if isinstance(shape, Line):
        points = np.array([*shape.points, shape.points[0]] if shape.closed else shape.points)
        if shape.fill is not None:
            axes.fill(points[:, 0], points[:, 1], color=shape.fill, linewidth=0, zorder=0.5)
        if shape.color is not None:
            dashes = tuple(part / shape.width for part in shape.dash)
            style = (0, dashes) if dashes else "solid"
            axes.plot(points[:, 0], points[:, 1], color=shape.color, lw=shape.width, ls=style, zorder=0.6)
    elif isinstance(shape, Disc):
        axes.plot([shape.x], [shape.y], "o", color=shape.fill, markersize=2 * shape.radius, mew=0, zorder=0.7)
    else:
        axes.annotate(
            shape.text,
            (shape.x, shape.y),
            shape.shift,
            textcoords="offset points",
            fontsize=shape.size,
            color=shape.color,
            ha="center",
            va="center",
            zorder=0.8,
        )


def _short(text: str, n_letters: int) -> str:
    plain = "".join(letter if letter.isprintable() else " " for letter in text)
    return plain if len(plain) <= n_letters else plain[: n_letters - 1] + "…"
