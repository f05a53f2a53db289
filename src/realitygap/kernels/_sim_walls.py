"""Bodies and the walls of an enclosed room, each of which is a half-plane, in lanes.

How far each body is from each wall is asked once a step for all walls; while a body gives way, only of the two that
it would be nearest to at the end of the step.
"""

from __future__ import annotations

from ._compile import stage
from ._lanes import LANES, fill
from ._sim_rays import see_plane
from ._sim_support import FAR, low_height, lowest

N_NEAREST = 2
PER_WALL = 4  # rows of a wall that is near: normal x, y, offset, gap


@stage
def _keep_nearer(low, center, radius, gap):
    for lane in range(LANES):
        now = low[lane] + center[lane] - radius[lane]
        least = gap[lane]
        gap[lane] = now if now < least else least


@stage
def _keep_least(gap, low):
    for lane in range(LANES):
        now = gap[lane]
        least = low[lane]
        low[lane] = now if now < least else least


@stage
def clearance(shape, p, pose, near, low):
    """How far bodies are from each wall of a room [m], below zero inside it.

    Args:
        shape, p: Structure and numbers.
        pose: Of the axles.
        near: `gaps` is written, `spare` used.
        low: Written: the least of the gaps.
    """
    real = low.dtype.type
    spare = near.spare
    center, along, across, lowest_ = spare[0], spare[1], spare[2], spare[3]
    fill(low, real(FAR))
    for w in range(shape.n_walls if shape.enclosed else 0):
        plane, gap = shape.row_plane + 3 * w, near.gaps[w]
        see_plane(p[plane], p[plane + 1], p[plane + 2], pose, center, along, across)
        fill(gap, real(FAR))
        for part in range(shape.part_corners.size):
            n = shape.part_corners[part]
            low_height(p, shape.row_outline[part], n, along, across, lowest_)
            _keep_nearer(lowest_, center, p[shape.row_part[part] + 2 * n], gap)
        _keep_least(gap, low)


@stage
def _keep_two(
    gap, normal_x, normal_y, offset, one_x, one_y, one_offset, one_gap, two_x, two_y, two_offset, two_gap
):
    for lane in range(LANES):
        now = gap[lane]
        x = normal_x[lane]
        y = normal_y[lane]
        o = offset[lane]
        a = one_gap[lane]
        a_x = one_x[lane]
        a_y = one_y[lane]
        a_o = one_offset[lane]
        b = two_gap[lane]
        b_x = two_x[lane]
        b_y = two_y[lane]
        b_o = two_offset[lane]
        first = now < a
        second = now < b
        one_gap[lane] = now if first else a
        one_x[lane] = x if first else a_x
        one_y[lane] = y if first else a_y
        one_offset[lane] = o if first else a_o
        now = a if first else now
        x = a_x if first else x
        y = a_y if first else y
        o = a_o if first else o
        two_gap[lane] = now if second else b
        two_x[lane] = x if second else b_x
        two_y[lane] = y if second else b_y
        two_offset[lane] = o if second else b_o


@stage
def choose_walls(shape, p, near):
    """Of the walls of a room those that `clearance` found nearest, into `near.walls`."""
    walls = near.walls
    for k in range(N_NEAREST):
        fill(walls[PER_WALL * k + 3], walls.dtype.type(FAR))
    for w in range(shape.n_walls):
        plane = shape.row_plane + 3 * w
        _keep_two(
            near.gaps[w], p[plane], p[plane + 1], p[plane + 2],
            walls[0], walls[1], walls[2], walls[3], walls[4], walls[5], walls[6], walls[7],
        )  # fmt: skip


@stage
def _deeper_in_wall(low, center, radius, along, across, x, y, near_gap, facing, beside, point_x, point_y):
    for lane in range(LANES):
        a = along[lane]
        b = across[lane]
        r = radius[lane]
        gap = low[lane] + center[lane] - r
        c_x = x[lane] - r * a
        c_y = y[lane] - r * b
        least = near_gap[lane]
        f = facing[lane]
        g = beside[lane]
        p_x = point_x[lane]
        p_y = point_y[lane]
        deeper = gap < least
        near_gap[lane] = gap if deeper else least
        facing[lane] = a if deeper else f
        beside[lane] = b if deeper else g
        point_x[lane] = c_x if deeper else p_x
        point_y[lane] = c_y if deeper else p_y


@stage
def touch_walls(shape, p, near):
    """Deepen the touch by the walls in `near.walls`."""
    spare, walls = near.spare, near.walls
    center, along, across, low, x, y = spare[0], spare[1], spare[2], spare[3], spare[4], spare[5]
    for k in range(N_NEAREST):
        wall = PER_WALL * k
        see_plane(walls[wall], walls[wall + 1], walls[wall + 2], near.pose, center, along, across)
        for part in range(shape.part_corners.size):
            n = shape.part_corners[part]
            lowest(p, shape.row_outline[part], n, along, across, low, x, y)
            _deeper_in_wall(
                low, center, p[shape.row_part[part] + 2 * n], along, across, x, y,
                near.gap, near.facing, near.beside, near.point_x, near.point_y,
            )  # fmt: skip
