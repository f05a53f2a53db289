"""Bodies and the walls of an enclosed room, each of which is a half-plane, in lanes.

How far each body is from each wall is asked once a step for all walls; while a body gives way, only of the two that
it would be nearest to at the end of the step.
"""

from __future__ import annotations

from ._bits import unmasked
from ._compile import stage
from ._lanes import LANES, fill
from ._sim_rays import see_plane
from ._sim_support import FAR, low_height, lowest_two

N_NEAREST = 2
PER_WALL = 4  # rows of a wall that is near: normal x, y, offset, gap


@stage
def _keep_nearer(low, center, radius, gap):
    for lane in range(LANES):
        now = low[lane] + center[lane] - radius[lane]
        least = unmasked(gap[lane])
        gap[lane] = now if now < least else least


@stage
def _keep_least(gap, low):
    for lane in range(LANES):
        now = gap[lane]
        least = unmasked(low[lane])
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
        a = unmasked(one_gap[lane])
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
def _deeper_in_wall(low, next_low, center, radius, along, across, x, y, next_x, next_y, first, second):
    """Merge a wall's lowest two corners into the deepest two contacts."""
    gap, facing, beside, corner_x, corner_y, rounding = first
    then, then_facing, then_beside, then_x, then_y, then_rounding = second
    for lane in range(LANES):
        a = along[lane]
        b = across[lane]
        r = radius[lane]
        one = low[lane] + center[lane] - r
        two = next_low[lane] + center[lane] - r
        u = x[lane]
        v = y[lane]
        next_u = next_x[lane]
        next_v = next_y[lane]
        f = unmasked(gap[lane])
        f_a = facing[lane]
        f_b = beside[lane]
        f_x = corner_x[lane]
        f_y = corner_y[lane]
        f_r = rounding[lane]
        s = then[lane]
        s_a = then_facing[lane]
        s_b = then_beside[lane]
        s_x = then_x[lane]
        s_y = then_y[lane]
        s_r = then_rounding[lane]
        deeper = one < f
        gap[lane] = one if deeper else f
        facing[lane] = a if deeper else f_a
        beside[lane] = b if deeper else f_b
        corner_x[lane] = u if deeper else f_x
        corner_y[lane] = v if deeper else f_y
        rounding[lane] = r if deeper else f_r
        # What is left: the wall's next corner and what was deepest, or its lowest and what was next.
        one = two if deeper else one
        u = next_u if deeper else u
        v = next_v if deeper else v
        s = f if deeper else s
        s_a = f_a if deeper else s_a
        s_b = f_b if deeper else s_b
        s_x = f_x if deeper else s_x
        s_y = f_y if deeper else s_y
        s_r = f_r if deeper else s_r
        deeper = one < s
        then[lane] = one if deeper else s
        then_facing[lane] = a if deeper else s_a
        then_beside[lane] = b if deeper else s_b
        then_x[lane] = u if deeper else s_x
        then_y[lane] = v if deeper else s_y
        then_rounding[lane] = r if deeper else s_r


@stage
def touch_walls(shape, p, near):
    """Deepen the touch by the walls in `near.walls`: by two corners of each part of the body at each."""
    spare, walls = near.spare, near.walls
    center, along, across, low, x, y = spare[0], spare[1], spare[2], spare[3], spare[4], spare[5]
    next_low, next_x, next_y = spare[6], spare[7], spare[8]
    for k in range(N_NEAREST):
        wall = PER_WALL * k
        see_plane(walls[wall], walls[wall + 1], walls[wall + 2], near.pose, center, along, across)
        for part in range(shape.part_corners.size):
            n = shape.part_corners[part]
            lowest_two(p, shape.row_outline[part], n, along, across, low, x, y, next_low, next_x, next_y)
            _deeper_in_wall(
                low, next_low, center, p[shape.row_part[part] + 2 * n], along, across, x, y, next_x, next_y,
                near.first, near.second,
            )  # fmt: skip
