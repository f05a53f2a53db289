"""The goal as a robot senses it, even through obstacles: its quarter around the robot, and its distance.

Source: Lehman & Stanley (2011), the four pie-slice sensors; the distance is ours.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import stage
from realitygap.kernels.math.lanes import LANES

AHEAD, LEFT, BEHIND, RIGHT = 0, 1, 2, 3  # quarters, each around its direction


@stage
def see_goal_sector(goal_x, goal_y, sector, pose, value):
    """1 where the goal is in a quarter around the robot, else 0; on a border it is in the one that comes first.

    Args:
        goal_x, goal_y: (LANES,) [m].
        sector: AHEAD, LEFT, BEHIND or RIGHT.
        pose: Where the robots are.
        value: Written.
    """
    real = value.dtype.type
    x, y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    for lane in range(LANES):
        dx = goal_x[lane] - x[lane]
        dy = goal_y[lane] - y[lane]
        ahead = dx * cosine[lane] + dy * sine[lane]
        left = dy * cosine[lane] - dx * sine[lane]
        in_front = ahead >= abs(left)
        to_left = (left >= abs(ahead)) & (not in_front)
        behind = (-ahead >= abs(left)) & (not in_front) & (not to_left)
        found = BEHIND if behind else RIGHT
        found = LEFT if to_left else found
        found = AHEAD if in_front else found
        value[lane] = real(1.0) if found == sector else real(0.0)


@stage
def see_goal_distance(goal_x, goal_y, start_x, start_y, pose, value):
    """Compute the distance to the goal as a part of its distance from the start, at most 1; 1 if that is 0.

    Args:
        goal_x, goal_y, start_x, start_y: (LANES,) [m].
        pose: Where the robots are.
        value: Written.
    """
    real = value.dtype.type
    x, y = pose.x, pose.y
    for lane in range(LANES):
        dx = goal_x[lane] - x[lane]
        dy = goal_y[lane] - y[lane]
        from_x = goal_x[lane] - start_x[lane]
        from_y = goal_y[lane] - start_y[lane]
        now = np.sqrt(dx * dx + dy * dy)
        first = np.sqrt(from_x * from_x + from_y * from_y)
        nearer = now < first
        value[lane] = now / (first if nearer else real(1.0)) if nearer else real(1.0)
