"""The divergence of replayed commands from the target's trials, step by step."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from realitygap.drawing import Ink
from realitygap.report._drawing import Drawing, draw_wide, new_figure, place_axes
from realitygap.report._marks import Panel, Series
from realitygap.study import GapStudy

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_gap_replay(gap: GapStudy) -> Drawing | None:
    """Draw distance and difference in heading over steps, compared with noise alone; None if no poses were recorded."""
    replay = gap.replay
    if replay is None:
        return None
    last = replay.distance.shape[1] - 1
    ends = float(replay.distance[:, last].mean()), float(replay.noise_distance[:, last].mean())
    caption = (
        f"Open-loop replay: the commands of {replay.n} trials on {gap.target.name} ({gap.target.label}) given to the "
        f"robot of {gap.source.name} ({gap.source.label}) from the same start, four times each. Line: how far the two "
        f"robots are apart after each step, mean, with the 10th to 90th percentile of trials; thin: between two "
        f"replays, which noise alone drives apart. After {last} steps {ends[0]:.2f} m and {ends[1]:.2f} m."
    )
    alt = (
        f"Curves of the distance between target and replay, which reaches {ends[0]:.2f} m after {last} steps."
    )
    panels = (
        ("apart [m]", replay.distance, replay.noise_distance, None),
        ("headings apart [rad]", replay.heading, replay.noise_heading, math.pi),
    )

    def draw(width: float) -> Figure:
        columns = 2 if width > 6 else 1
        high, across = 1.6, (width - 0.1) / columns - 0.62
        figure = new_figure(width, (2 // columns) * (high + 0.55))
        for k, (title, between, noise, most) in enumerate(panels):
            row, column = divmod(k, columns)
            axes = place_axes(
                figure, 0.55 + column * (across + 0.62), 0.1 + row * (high + 0.55), across, high
            )
            steps = np.arange(between.shape[1])
            low, top = np.percentile(between, [10, 90], axis=0)
            axes.fill_between(steps, low, top, color=Ink.BAND, alpha=0.55, linewidth=0)
            axes.plot(steps, between.mean(axis=0), color=Ink.OURS, linewidth=1.8, label="target and replay")
            axes.plot(
                steps,
                noise.mean(axis=0),
                color=Ink.RUN,
                linewidth=1.0,
                linestyle=(0, (5, 1.5)),
                label="noise alone",
            )
            axes.set_gid(f"replay-{k}")
            axes.set_xlim(0, steps[-1])
            axes.set_ylim(0, most or max(1.08 * float(top.max()), 0.02))
            axes.set_xlabel("step", labelpad=2)
            axes.set_ylabel(title, labelpad=3)
            if k == 0:
                axes.legend(loc="upper left", frameon=False, fontsize=7.5)
        return figure

    marks = tuple(
        Panel(f"replay-{k}", tuple(_marks_of_curves(title, between, noise)), (0, 4))
        for k, (title, between, noise, _) in enumerate(panels)
    )
    return draw_wide(draw, "gap-replay", caption, alt, marks=marks)


def _marks_of_curves(title: str, between: npt.NDArray[Any], noise: npt.NDArray[Any]) -> Iterator[Series]:
    name, _, unit = title.partition(" [")
    steps = np.unique(np.linspace(0, between.shape[1] - 1, 200).astype(int))
    for which, values in (("target and replay", between), ("noise alone", noise)):
        points = np.column_stack([steps, values.mean(axis=0)[steps]])
        yield Series(f"{{name}}, step {{x}}: {name} {{y}} {unit.rstrip(']')}", points, which)
