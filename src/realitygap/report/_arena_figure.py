"""Figure 2: the arena with its reachable cells, and the robot in it, to scale."""

from __future__ import annotations

from realitygap.report._tally import DescribedCondition, Tally, label_of, settings_of
from realitygap.report.charts.house import Drawing, draw_wide
from realitygap.report.charts.shapes import draw_picture
from realitygap.report.charts.sheet import IS_WIDE, Sheet
from realitygap.runs import Condition
from realitygap.world import arena_picture


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
    resolved = tally.resolved(condition)
    robot = resolved.on.picture()
    picture = arena_picture(resolved.placed_arena, resolved.on.body, resolved.on.sensors)
    alt = f"{picture.description} {robot.description}"
    caption = _caption(tally, resolved, described)

    def draw(width: float) -> Sheet:
        if width >= IS_WIDE:
            sheet = Sheet(width, [["arena", "robot"]], [None], widths=[0.6, 0.37], gap=0.2, pad=0)
        else:
            sheet = Sheet(width, [["arena"], ["robot"]], [None, None], gap=0, pad=0.1)
        for name, shown in (("arena", picture), ("robot", robot)):
            draw_picture(sheet.panels[name], shown, scale=1.0 if sheet.is_wide else 0.92)
        sheet.panels["robot"].set_anchor("S")
        return sheet

    return draw_wide(draw, name, caption, alt)


def _caption(tally: Tally, condition: Condition, described: DescribedCondition) -> str:
    start = condition.arena.pose()
    same = len({str(settings_of(each).get("arena")) for each in tally.conditions}) == 1
    whose = "" if same else f" of {condition.name}"
    platform = condition.on
    simulated = "" if condition.is_physical else " as simulated"
    return (
        f"Arena{whose} with its reachable cells outlined, and robot{simulated}, to scale. Trials start at "
        f"({start.x:.4f}, {start.y:.4f}) m, facing along the arrow. Gray: the outline that collides, "
        f"{platform.outline_words}. Dashed: range of the {len(platform.sensors.mounts)} sensors. "
        f"{label_of(described)}. Drawn from the study’s settings."
    )
