"""One network on two or more platforms, side by side, and the divergence of its trials."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from realitygap.drawing import Ink
from realitygap.errors import did_you_mean, whole_number
from realitygap.evolution import Genome
from realitygap.platforms import known_specs, platform_class, platform_names, split_spec, trace_genome
from realitygap.playback import (
    Divergence,
    MovingTrial,
    in_motion,
    measure_divergence,
    own_divergence,
    placed,
    ray_ends,
)
from realitygap.records import ResultsFolder, refuse_results
from realitygap.report._driven import refuse_replay
from realitygap.report._formats import captioned, check_ending, save_drawing
from realitygap.report._tally import Tally, read_tally
from realitygap.report._trial_figure import ChosenTrial, choose_trial
from realitygap.report.charts.arena import draw_arena, draw_cells
from realitygap.report.charts.house import WIDE, Drawing, draw_wide, shorten
from realitygap.report.charts.lines import Dash, area_key, draw_band, draw_dots, draw_line, head, line_key
from realitygap.report.charts.marks import Panel, Series
from realitygap.report.charts.sheet import Sheet, grid
from realitygap.runs import Condition, genome_of
from realitygap.trials import NoiseKey

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

_COLORS = (Ink.OURS, Ink.PUBLISHED, Ink.PEN3)
_DASHES: tuple[Dash, ...] = ("solid", (0, (5, 1.5)), (0, (1, 1)))
"""Dashes of the platforms."""

_GHOSTS = 7
"""Robots drawn along a path."""

_MOST_TRAILS = 30
"""Repeats whose paths are drawn; more would be a blot."""


@dataclass(frozen=True)
class Side:
    """A platform of the figure.

    Attributes:
        name: Name of the platform.
        trials: Repeats of one network on it, each with its own noise. The first is drawn with its robot.
    """

    name: str
    trials: tuple[MovingTrial, ...]


def save_divergence(
    results: ResultsFolder | str | Path,
    path: str | Path,
    *,
    against: str,
    condition: str | None = None,
    replicate: int | None = None,
    generation: int | None = None,
    individual: int | None = None,
    repeats: int = 30,
) -> Path:
    """Draw one network's trials next to its trials elsewhere, and their divergence, into a file.

    Args:
        results: Results of a study, or the path to them.
        path: Path that ends in .svg, .pdf or .png. An existing file is replaced.
        against: Platform to compare with the network's own condition: another condition of the study, or a platform
            with its defaults (jyro, sim, sim:FILE, twin:FILE), or two of them with a comma in between.
        condition: Condition of the network. Default: the first one.
        replicate: Run. Default: the typical one.
        generation: Generation of the run. Default: that of its best trial.
        individual: Individual of the generation. Default: the best one by the task.
        repeats: Number of trials on each side, each with fresh noise, 2 to 1000.

    Returns:
        The path.

    Raises:
        RecordError: there are no such results, or a robot drove one of the two; or the file cannot be written.
        ValueError: there is no such trial, condition, platform or ending, or the number of repeats is out of range.
    """
    path = Path(path)
    check_ending(path, (".pdf", ".png", ".svg"))
    refuse_results(path)
    which, sides = _compare(results, against, repeats, (condition, replicate, generation, individual))
    title = " and ".join(side.name for side in sides)
    drawing = draw_divergence(*sides, of=which)
    return save_drawing(captioned(drawing, "divergence"), path, title=title)


def compare_trials(
    results: ResultsFolder | str | Path,
    *,
    against: str,
    condition: str | None = None,
    replicate: int | None = None,
    generation: int | None = None,
    individual: int | None = None,
    repeats: int = 30,
) -> tuple[Side, ...]:
    """Return trials of one network on its own platform and elsewhere, each with separate noise.

    Arguments and errors as in `save_divergence`.
    """
    return _compare(results, against, repeats, (condition, replicate, generation, individual))[1]


def _compare(
    results: ResultsFolder | str | Path,
    against: str,
    repeats: int,
    which: tuple[str | None, int | None, int | None, int | None],
) -> tuple[str, tuple[Side, ...]]:
    """Return the network's name and its trials on all sides; `which` has the arguments of `choose_trial`."""
    whole_number("repeats", repeats, 2, 1000)
    names = [name.strip() for name in against.split(",")]
    if not 1 <= len(names) < len(_COLORS):
        raise ValueError(f"against names {len(names)}, expected one or two, with a comma between.")
    tally = read_tally(results)
    trial = choose_trial(tally, *which)
    others = [_beside(tally, trial.condition, name) for name in names]
    for each in (trial.condition, *others):
        if each.is_physical:
            raise refuse_replay(each.name)
    genome = genome_of(trial.condition, trial.row)
    own = trial.condition.platform if all(map(_is_platform, names)) else trial.condition.name
    called = [own, *map(_called, names)]
    tried = zip(called, (trial.condition, *others), strict=True)
    return trial.title, tuple(_try_again(trial, on, name, genome, repeats) for name, on in tried)


def _called(name: str) -> str:
    """A condition or a platform without the folder of its file."""
    platform, file = split_spec(name)
    return f"{platform}:{Path(file).stem}" if file else name


def _is_platform(name: str) -> bool:
    platform = split_spec(name)[0]
    return platform in platform_names() and platform_class(platform).is_for_studies


def _beside(tally: Tally, own: Condition, against: str) -> Condition:
    """Return the condition on which the network is tried for comparison."""
    names = [condition["name"] for condition in tally.conditions]
    if against in names:
        return tally.resolved(against)
    if _is_platform(against):
        fresh = Condition.model_validate({"name": own.name, "platform": against})
        return own.model_copy(update={"platform": fresh.platform, "noise": fresh.noise, "on": fresh.on})
    raise ValueError(
        f"Unknown condition or platform {against!r}. {did_you_mean(against, [*names, *known_specs()])}"
    )


def _try_again(trial: ChosenTrial, on: Condition, name: str, genome: Genome, repeats: int) -> Side:
    row, arena = trial.row, trial.condition.arena.arena().alone
    key = NoiseKey(row["key"], row["replicate"], row["generation"], row["individual"])
    trials = []
    for repeat in range(1, repeats + 1):
        trajectory = trace_genome(
            on.on,
            arena,
            genome,
            noise=on.noise,
            noise_key=replace(key, repeat=repeat),
            inputs=trial.condition.network_inputs,
        )
        trials.append(in_motion(trajectory, on.arena_of(trajectory), on.on, title=name, label=on.label))
    return Side(name, tuple(trials))


# drawing


def draw_divergence(one: Side, *others: Side, of: str = "", width: float = WIDE) -> Drawing:
    """Draw trials of one network on two or three platforms, side by side, and their divergence step by step.

    Args:
        one, others: Equal numbers of repeats. Repeat k of one is compared with repeat k + 1 of another, so that the two
            never have the same noise, which makes the comparison fair to that of repeats on one platform.
        of: Name of the network.
        width: Width of the figure [in].

    Raises:
        ValueError: there are more repeats of the one than of another, or fewer than two; or not one or two others.
    """
    if not 1 <= len(others) < len(_COLORS):
        raise ValueError(f"There are {len(others)} sides beside the first, expected one or two.")
    sides = (one, *others)
    between = tuple(measure_divergence(one.trials, [*other.trials[1:], other.trials[0]]) for other in others)
    within = tuple(own_divergence(side.trials) for side in sides)
    caption, alt = _words(sides, between, within, of)
    return draw_wide(
        lambda width: _draw(sides, between, within, width), "divergence", caption, alt, width=width
    )


def draw_distance(pairs: Sequence[tuple[str, Side, Side]]) -> Drawing:
    """Draw how far one network's trials on two platforms are apart after each step.

    Args:
        pairs: Panels: a title, and the two sides, with equal numbers of repeats.
    """
    measured = [_measured(one, other) for _, one, other in pairs]
    most = max(float(np.percentile(between.distance, 90, axis=0).max()) for between, _ in measured)
    means = [f"{between.distance[:, 1:].mean():.2f} m" for between, _ in measured]
    n, last = measured[0][0].n_pairs, measured[0][0].n_steps
    caption = (
        f"Distance between the two robots after each step: mean and 10th to 90th percentile of n = {n}. Thin: distance "
        f"between repeats on one platform, which noise alone causes. Mean over {last} steps: {', then '.join(means)}."
    )

    def draw(width: float) -> Sheet:
        sheet, places = grid(width, len(pairs), len(pairs), 1.05)
        for k, (axes, (title, *_), (between, within)) in enumerate(zip(places, pairs, measured, strict=True)):
            axes.set_gid(f"distance-{k}")
            _draw_curves(axes, (between,), within, "distance")
            axes.set_ylim(0, 1.08 * max(most, 0.02))
            axes.set_ylabel("apart [m]", labelpad=3)
            if title:
                head(axes, title)
        _, one, other = pairs[-1]
        sheet.key(_keys((one if len(pairs) == 1 else replace(one, name="simulator"), other)))
        return sheet

    marks = tuple(
        Panel(f"distance-{k}", (_marks_of(between),), (0, 3)) for k, (between, _) in enumerate(measured)
    )
    alt = f"Curves of the distance between the two robots, with a mean of {' and '.join(means)}."
    return draw_wide(draw, "distance", caption, alt, marks=marks)


def _measured(one: Side, other: Side) -> tuple[Divergence, tuple[Divergence, ...]]:
    """Return the divergence between two sides, and that of repeats on each, if there are repeats."""
    between = measure_divergence(one.trials, other.trials)
    alone = [side.trials for side in (one, other) if len(side.trials) > 1]
    return between, tuple(map(own_divergence, alone))


def _marks_of(divergence: Divergence) -> Series:
    means = divergence.distance.mean(axis=0)
    return Series("step {x}: {y} m apart", np.column_stack([np.arange(len(means)), means]))


def _words(
    sides: tuple[Side, ...], between: tuple[Divergence, ...], within: tuple[Divergence, ...], of: str
) -> tuple[str, str]:
    """Caption and alternative text."""
    one, *others = sides
    n = between[0].n_pairs
    ends = [
        (each.n_steps, *(values[:, -1].mean() for values in (each.distance, each.heading)))
        for each in between
    ]
    own = [
        float(each.distance[:, min(each.n_steps, between[max(k - 1, 0)].n_steps)].mean())
        for k, each in enumerate(within)
    ]
    labels = " and ".join(dict.fromkeys(side.trials[0].label for side in sides))
    steps = " and ".join(
        f"{side.trials[0].n_steps} steps of {side.trials[0].step_s:g} s ({side.name})" for side in sides
    )
    shown = f" of the first {_MOST_TRAILS} repeats" if n > _MOST_TRAILS else ""
    tried = " and ".join(f"{n} times on {side.name}" for side in sides)
    alone = " and ".join(f"{way:.2f} m on {side.name} alone" for way, side in zip(own, sides, strict=True))
    apart = " ".join(
        f"After {last} steps {distance:.2f} m apart{'' if len(others) == 1 else f' ({one.name} and {other.name})'}"
        f"{f', {alone}' if len(others) == 1 else ''}; headings differ by {turned:.2f} rad "
        "(random headings by 1.57 on average)."
        for (last, distance, turned), other in zip(ends, others, strict=True)
    )
    rest = "" if len(others) == 1 else f" Noise alone: {alone}."
    caption = (
        f"One network{f' ({of})' if of else ''}, tried {tried}, each on "
        f"noise of its own; {labels}, {steps}. Above: all paths{shown}; the first "
        "with its robot, what it sees and the cells that it visits. Below: how far repeat k on the one is from repeat "
        f"k + 1 on {'the other' if len(others) == 1 else 'another'} after each step, mean and 10th to 90th percentile "
        f"of n = {n}; thin lines: what noise alone does, the mean between repeat k and k + 1 on one platform. "
        f"{apart}{rest}"
    )
    rise = " and ".join(f"{distance:.2f} m and {turned:.2f} rad" for _, distance, turned in ends)
    alt = (
        f"Paths of one network on {' and on '.join(side.name for side in sides)}, and curves of the distance and of "
        f"the difference in heading between them, which rise to {rise} on average."
    )
    return caption, alt


def _draw(
    sides: tuple[Side, ...], between: tuple[Divergence, ...], within: tuple[Divergence, ...], width: float
) -> Sheet:
    n = len(sides)
    above = [str(k) for k in range(n) for _ in range(6 // n)]
    sheet = Sheet(width, [above, ["distance"] * 3 + ["heading"] * 3], [None, 1.35], gap=0.1, pad=0.16)
    for k, side in enumerate(sides):
        axes = sheet.panels[str(k)]
        draw_arena(axes, side.trials[0].arena)
        _draw_side(axes, side, _COLORS[k])
        _write_head(axes, side, _COLORS[k], is_narrow=n > 2)
    for name, unit in (("distance", "apart [m]"), ("heading", "headings apart [rad]")):
        axes = sheet.panels[name]
        _draw_curves(axes, between, within, name)
        axes.set_ylabel(unit, labelpad=3)
    sheet.key(_keys(sides))
    return sheet


def _draw_side(axes: Axes, side: Side, color: str) -> None:
    first = side.trials[0]
    draw_cells(axes, first.cells, first.arena)
    for trial in side.trials[1:_MOST_TRAILS]:
        draw_line(axes, *trial.poses.T[:2], color=color, linewidth=0.5, alpha=0.22, zorder=4)
    draw_line(axes, *first.poses.T[:2], color=color, linewidth=1.7, zorder=6, solid_joinstyle="round")
    rows = np.unique(np.linspace(0, len(first.poses) - 1, _GHOSTS).round().astype(int))
    for row in rows:
        _draw_robot(axes, first, int(row), color, strong=row == rows[-1])
    ends = np.array([trial.poses[-1, :2] for trial in side.trials[1:]])
    draw_dots(axes, ends[:, 0], ends[:, 1], 2.2, color=color, alpha=0.7, markeredgewidth=0, zorder=7)


def _draw_robot(axes: Axes, trial: MovingTrial, row: int, color: str, *, strong: bool) -> None:
    moment = trial.at(row / trial.parts * trial.step_s)
    for outline in trial.shape.outlines:
        corners = placed([*outline, outline[0]], moment.pose)
        if strong:
            axes.fill(corners[:, 0], corners[:, 1], color=Ink.GROUND, alpha=0.75, linewidth=0, zorder=7.5)
        ink, width, order = (color, 1.6, 8) if strong else (Ink.BODY, 0.6, 5)
        draw_line(axes, *corners.T, color=ink, linewidth=width, zorder=order)
    if not strong:
        return
    for (x1, y1), (x2, y2) in ray_ends(trial.shape, moment):
        draw_line(axes, [x1, x2], [y1, y2], color=Ink.RUN, linewidth=0.9, linestyle=(0, (3, 1.5)), zorder=8)
    front = trial.shape.front
    nose = placed([(0.5 * front, 0.3 * front), (0.85 * front, 0.0), (0.5 * front, -0.3 * front)], moment.pose)
    draw_line(axes, nose[:, 0], nose[:, 1], color=color, linewidth=1.4, zorder=8)


def _write_head(axes: Axes, side: Side, color: str, *, is_narrow: bool) -> None:
    n_cells = side.trials[0].arena.grid.n_cells
    mean = np.mean([len(trial.cells) for trial in side.trials]) / n_cells
    facts = (
        f"{side.trials[0].label}, n = {len(side.trials)}, {'' if is_narrow else 'mean '}coverage {mean:.2f}"
    )
    head(axes, shorten(side.name, 14 if is_narrow else 30), facts, color=color)


def _draw_curves(
    axes: Axes, between: tuple[Divergence, ...], within: tuple[Divergence, ...], name: str
) -> None:
    highest = 0.02
    for divergence, color in zip(between, _between_colors(between), strict=True):
        values: npt.NDArray[np.float64] = getattr(divergence, name)
        low, high = np.percentile(values, [10, 90], axis=0)
        draw_band(axes, np.arange(len(low)), low, high, 0.55)
        axes.plot(np.arange(len(low)), values.mean(axis=0), color=color, linewidth=1.8)
        highest = max(highest, float(high.max()))
    for own, color, dashes in zip(within, _COLORS, _DASHES, strict=False):
        mean = getattr(own, name).mean(axis=0)
        axes.plot(np.arange(len(mean)), mean, color=color, linewidth=1.0, linestyle=dashes)
    axes.set_ylim(0, math.pi if name == "heading" else 1.08 * highest)
    axes.set_xlim(0, max(each.n_steps for each in between))
    if name == "heading":
        axes.set_yticks([0, math.pi / 2, math.pi], ["0", "π/2", "π"])
        axes.axhline(math.pi / 2, color=Ink.RULE, linewidth=0.8, zorder=0)
    axes.set_xlabel("step", labelpad=2)


def _between_colors(between: tuple[Divergence, ...]) -> tuple[str, ...]:
    """Return the colors of the curves: black if there is one, otherwise that of the side compared with the first."""
    return (Ink.TEXT,) if len(between) == 1 else _COLORS[1 : len(between) + 1]


def _keys(sides: tuple[Side, ...]) -> list[Artist]:
    one, *others = sides
    if len(others) == 1:
        curves = [line_key("between the two", color=Ink.TEXT, linewidth=1.8)]
    else:
        curves = [
            line_key(f"{shorten(other.name, 12)} from {one.name}", color=color, linewidth=1.8)
            for other, color in zip(others, _COLORS[1:], strict=False)
        ]
    alone = [
        line_key(f"{shorten(side.name, 16)}, noise alone", color=color, linestyle=dashes, linewidth=1.0)
        for side, color, dashes in zip(
            [side for side in sides if len(side.trials) > 1], _COLORS, _DASHES, strict=False
        )
    ]
    return [*curves, area_key("10th to 90th percentile", Ink.BAND, 0.55), *alone]
