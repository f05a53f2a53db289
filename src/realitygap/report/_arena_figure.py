"""Figure 2: the arena with its reachable cells, and the robot in it, to scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from realitygap._version import __version__
from realitygap.errors import RecordVersionError
from realitygap.records import ResultsFolder
from realitygap.report._drawing import WIDE, Drawing, house_style, new_figure, place_axes, to_svg
from realitygap.report._shapes_drawing import draw_picture
from realitygap.report._tally import Tally, label_of, read_tally, settings_of
from realitygap.runs import Condition
from realitygap.world import arena_picture


def draw_arena_and_robot(
    folder: ResultsFolder | str | Path, condition: str | None = None, *, width: float = WIDE
) -> Drawing:
    """The arena of a condition with the robot at its start, and the robot by itself, as the paper's Figure 2.

    Args:
        folder: the results of a study, or the path to them.
        condition: of which; the first one when not given.
        width: of the figure [in]; in a narrow one the robot stands below the arena.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        ValueError: there is no such condition.
    """
    tally = read_tally(folder)
    (drawing,) = draw_tally_arena(tally, tally.name_of(condition), widths=[width])
    return drawing


def draw_tally_arena(
    tally: Tally, condition: str, *, widths: Sequence[float] = (WIDE,), name: str = "arena"
) -> list[Drawing]:
    """As `draw_arena_and_robot`, of what was read already, in several widths; ids begin with `name`.

    Raises:
        ValueError: there is no such condition.
        RecordVersionError: its settings are not those of this version.
    """
    described = tally.condition(condition)
    resolved = Condition.from_settings(condition, dict(settings_of(described)))
    robot = resolved.tried_on.picture()
    picture = arena_picture(resolved.placed_arena, resolved.tried_on.body, resolved.tried_on.sensors)
    alt = f"{picture.description} {robot.description}"
    caption = _caption(tally, resolved, described)
    drawings = []
    with house_style():
        for index, width in enumerate(widths):
            is_wide = width >= 6
            heights = [
                (picture.top - picture.bottom) / (picture.right - picture.left),
                (robot.top - robot.bottom) / (robot.right - robot.left),
            ]
            across = [0.60 * width, 0.37 * width] if is_wide else [width, 0.86 * width]
            up = [share * each for share, each in zip(heights, across, strict=True)]
            figure = new_figure(width, max(up) if is_wide else sum(up) + 0.1)
            scale = 1.0 if is_wide else 0.92
            draw_picture(place_axes(figure, 0.0, 0.0, across[0], up[0]), picture, scale=scale)
            place = (across[0] + 0.03 * width, up[0] - up[1]) if is_wide else (0.07 * width, up[0] + 0.1)
            draw_picture(place_axes(figure, *place, across[1], up[1]), robot, scale=scale)
            drawings.append(Drawing(to_svg(figure, f"{name}-{index}", alt), caption, alt, figure))
    return drawings


def _caption(tally: Tally, condition: Condition, described: Mapping[str, Any]) -> str:
    start = condition.arena.pose()
    same = len({str(settings_of(each).get("arena")) for each in tally.conditions}) == 1
    whose = "All conditions have this arena." if same else f"Shown is condition {condition.name}."
    platform = condition.tried_on
    simulated = "" if condition.is_physical else " as simulated"
    outline = {
        "jyro": "Jyro’s; the paper does not state the start and where the sensors are mounted",
        "sim": f"that of robot {condition.sim.model.name}",
        "twin": "the box that holds a Scribbler’s, and the sensors are that robot’s: the twin’s own are in its file",
        "scribbler": "the box that holds the robot’s; the paper does not state the start and where the sensors are "
        "mounted",
    }[condition.platform]
    return (
        f"The arena, with its reachable cells outlined, and the robot{simulated}, both to scale. Trials begin at "
        f"({start.x:.4f}, {start.y:.4f}) m with the robot facing as the arrow does; the gray outline is what can "
        f"collide, the dashed lines are how far its {len(platform.sensors.mounts)} sensors see. {whose} The outline is "
        f"{outline}. "
        f"{label_of(described)}: a drawing of the settings; n and interval do not apply."
    )


def content(tally: Tally, widths: Sequence[float]) -> list[Drawing] | str:
    """The figure in these widths, or why it is missing."""
    condition = tally.runs["condition"][0]
    try:
        return draw_tally_arena(tally, condition, widths=widths, name="figure-2")
    except RecordVersionError:
        return (
            f"Figure 2 is missing: this realitygap ({__version__}) cannot read the settings of condition {condition}. "
            "Use the version that ran the study."
        )
