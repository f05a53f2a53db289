"""Instructions for placing a robot for a calibration, and the parsing of measured lengths."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np

from realitygap.calibration import distance_of, end_pose_of
from realitygap.records import TrialRecord
from realitygap.trials import TrialPlan
from realitygap.world import INCH, Arena, RobotModel

_NUMBER = re.compile(r"^(-?)(?:(\d+(?:\.\d*)?|\.\d+)(?:[ -](\d+)/(\d+))?|(\d+)/(\d+))$")


def placing_words(plan: TrialPlan, arena: Arena, robot: RobotModel) -> str:
    """Return the instructions for placing the robot for a trial of a calibration, and its next motion."""
    if plan.purpose == "sensors":
        inches = distance_of(plan, arena, robot) / INCH
        start = plan.start or arena.start
        side = "" if math.cos(start.heading) > 0 else ", its back to it"
        return (
            f"put it square to a wall{side}, its sensors {inches:g} in from it and nothing else near. It reads "
            f"{len(plan.commands)} times and does not move."
        )
    n = int(np.any(plan.commands != 0, axis=1).sum())
    if plan.purpose == "path" and plan.commands[0, 0] != 0:
        return f"put it with 24 in free ahead, and mark where it stands. It drives {n} full steps ahead."
    if plan.purpose == "path":
        return f"put it free on all sides, and mark which way it faces. It turns for {n} full steps."
    start = plan.start or arena.start
    left = min(x for wall in arena.walls for x in wall[::2])
    lower = min(y for wall in arena.walls for y in wall[1::2])
    return (
        f"put its middle {(start.x - left) / INCH:.1f} in from the left wall and {(start.y - lower) / INCH:.1f} "
        f"in from the lower one, turned by {math.degrees(start.heading):.0f} degrees to the left from facing "
        f"right. It drives {len(plan.commands) or plan.steps} steps."
    )


def parse_length(text: str) -> float | None:
    """Return a number as read from a ruler, such as 13 3/4 or -.5; None if the text is no number."""
    match = _NUMBER.match(text.strip())
    if match is None:
        return None
    sign, whole, over, under, alone_over, alone_under = match.groups()
    if 0 in (int(under or 1), int(alone_under or 1)):
        return None
    value = float(whole) if whole else int(alone_over) / int(alone_under)
    value += int(over) / int(under) if over else 0.0
    return -value if sign else value


def with_ruled_end(trial: TrialRecord, ahead_in: float, left_in: float, turned_deg: float) -> TrialRecord:
    """Return a path with its measured end: inches ahead and to the left of its start, degrees to the left."""
    end = end_pose_of(trial, ahead_in * INCH, left_in * INCH, math.radians(turned_deg))
    return replace(trial, end_pose=end)
