"""Figure 2: the arena with its reachable cells, and the robot in it, to scale."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from realitygap.report._drawing import Drawing, draw_wide, new_figure, place_axes
from realitygap.report._shapes_drawing import draw_picture
from realitygap.report._tally import Tally, label_of, settings_of
from realitygap.runs import Condition
from realitygap.world import arena_picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_arena_and_robot(tally: Tally, condition: str, *, name: str) -> Drawing:
    """The arena of a condition with the robot at its start, and the robot by itself, as the paper's Figure 2.

    Args:
        tally: Tally of the study.
        condition: Condition to draw.
        name: First part of the ids.

    Raises:
        ValueError: there is no such condition.
        RecordVersionError: its settings are not those of this version.
    """
    described = tally.condition(condition)
    resolved = Condition.from_settings(condition, dict(settings_of(described)))
    robot = resolved.on.picture()
    picture = arena_picture(resolved.placed_arena, resolved.on.body, resolved.on.sensors)
    alt = f"{picture.description} {robot.description}"
    caption = _caption(tally, resolved, described)

    def draw(width: float) -> Figure:
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
        return figure

    return draw_wide(draw, name, caption, alt)


def _caption(tally: Tally, condition: Condition, described: Mapping[str, Any]) -> str:
    start = condition.arena.pose()
    same = len({str(settings_of(each).get("arena")) for each in tally.conditions}) == 1
    whose = "All conditions have this arena." if same else f"Shown is condition {condition.name}."
    platform = condition.on
    simulated = "" if condition.is_physical else " as simulated"
    return (
        f"The arena, with its reachable cells outlined, and the robot{simulated}, both to scale. Trials begin at "
        f"({start.x:.4f}, {start.y:.4f}) m with the robot facing as the arrow does; the gray outline is what can "
        f"collide, the dashed lines are how far its {len(platform.sensors.mounts)} sensors see. {whose} The outline is "
        f"{platform.outline_words}. "
        f"{label_of(described)}: a drawing of the settings; n and interval do not apply."
    )
