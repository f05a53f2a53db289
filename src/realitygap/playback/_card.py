"""The card of a trial, for notebooks: its path, and a player if the extra `notebook` is installed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from realitygap.drawing import Card, Disc, Ink, Line, Picture, Shape, card_of, picture_of, widget_of
from realitygap.errors import RealityGapError

from ._moving import MovingTrial
from ._player import play


@picture_of.register(MovingTrial)
def trial_picture(trial: MovingTrial) -> Picture:
    """Return the arena with the path of the trial, the cells on it, and the places where the robot was blocked."""
    arena = picture_of(trial.arena)
    grid = trial.arena.grid
    cells = [Line(grid.corners(cell), None, closed=True, fill=Ink.BAND) for cell in trial.cells]
    points = [(float(x), float(y)) for x, y, _ in trial.poses]
    path: list[Shape] = [Line(tuple(points), Ink.OURS, 1.4)] if len(points) > 1 else []
    blocked = {point for point, stall in zip(points, trial.stalled, strict=True) if stall}
    path += [Disc(x, y, 2.0, fill=Ink.REACH) for x, y in sorted(blocked)]
    path.append(Disc(*points[-1], 3.2, Ink.OURS, Ink.GROUND, 1.3))
    words = f"{trial.title}: {trial.n_steps} steps, {len(trial.cells)} cells visited, {len(blocked)} places blocked."
    return replace(
        arena,
        title=trial.title,
        description=words,
        shapes=(arena.shapes[0], *cells, *arena.shapes[1:], *path),
    )


@card_of.register(MovingTrial)
def moving_card(trial: MovingTrial) -> Card:
    """Return the path of a trial and its size."""
    share = len(trial.cells) / trial.arena.grid.n_cells
    lead = (
        f"{trial.n_steps} steps in {trial.duration_s:.1f} s; {len(trial.cells)} of {trial.arena.grid.n_cells} cells "
        f"visited ({share:.3f}); {int(trial.stalled.sum())} rows blocked."
    )
    return Card(
        trial.title, [trial.label], lead, parts=[picture_of(trial)], code=["realitygap.playback.play(trial)"]
    )


@widget_of.register(MovingTrial)
def trial_widget(trial: MovingTrial) -> Any:
    """Return the player of a trial; None if the extra `notebook` is not installed."""
    try:
        return play(trial)
    except RealityGapError:
        return None
