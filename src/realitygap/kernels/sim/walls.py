"""Bodies and the walls of an enclosed room, each of which is a half-plane, in lanes.

How far each body is from each wall is asked once a step for all walls; while a body gives way, only of the two that
it would be nearest to at the end of the step.
"""

from __future__ import annotations

from realitygap.kernels.compile.decorators import inlined, kernel, stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.lanes import LANES, fill
from realitygap.kernels.math.vectors import WIDTH, any_of, load, load_row, pick, spread, store, store_row

from .outline import FAR, SURELY, low_height, lowest_two

N_NEAREST = 2
PER_WALL = 4  # rows of a wall that is near: normal x, y, offset, gap


@inlined
def _see_plane(rows, row, pose, lane):
    """A line as bodies see it: distance of their axles, and its normal ahead and to the left."""
    n_x, n_y = load(rows, row, lane), load(rows, row + 1, lane)
    sine, cosine = load_row(pose.sine, lane), load_row(pose.cosine, lane)
    gap = n_x * load_row(pose.x, lane) + n_y * load_row(pose.y, lane) - load(rows, row + 2, lane)
    return gap, n_x * cosine + n_y * sine, n_y * cosine - n_x * sine


@kernel
def clearance(shape, p, pose, turned, near, active, low):
    """Compute the distance of bodies from each wall of a room [m], below zero inside it.

    Args:
        shape, p: Structure and numbers.
        pose: Of the axles.
        turned: Whether headings may be others than at the last call. If not, `near.heights` has how low bodies reach.
        near: `gaps` and `heights` are written.
        active: (LANES,) above 0 where it is of interest; `low` is written in vectors with such a lane.
        low: Written: the least of the gaps.
    """
    real = low.dtype.type
    for lane in range(0, LANES, WIDTH):
        if not any_of(load_row(active, lane) > spread(real(0.0))):
            continue
        least = spread(real(FAR))
        for w in range(shape.n_walls if shape.enclosed else 0):
            center, along, across = _see_plane(p, shape.row_plane + 3 * w, pose, lane)
            gap = spread(real(FAR))
            for part in range(shape.part_corners.size):
                n, row = shape.part_corners[part], shape.part_corners.size * w + part
                if turned:
                    height = low_height(p, shape.row_outline[part], n, along, across, lane)
                    store(height, near.heights, row, lane)
                height = load(near.heights, row, lane)
                now = height + center - load(p, shape.row_part[part] + 2 * n, lane)
                gap = pick(now < gap, now, gap)
            store(gap, near.gaps, w, lane)
            least = pick(gap < least, gap, least)
        store_row(least, low, lane)


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
    """Choose the walls of a room that `clearance` found nearest, into `near.walls`."""
    walls = near.walls
    for k in range(N_NEAREST):
        fill(walls[PER_WALL * k + 3], walls.dtype.type(FAR))
    for w in range(shape.n_walls):
        plane = shape.row_plane + 3 * w
        _keep_two(
            near.gaps[w], p[plane], p[plane + 1], p[plane + 2],
            walls[0], walls[1], walls[2], walls[3], walls[4], walls[5], walls[6], walls[7],
        )  # fmt: skip


@kernel
def face_nearest_wall(near):
    """Write the normal of the wall that `choose_walls` found nearest to the deepest contact."""
    for lane in range(0, LANES, WIDTH):
        _, a, b = _see_plane(near.walls, 0, near.pose, lane)
        store_row(a, near.first.facing, lane)
        store_row(b, near.first.beside, lane)


@inlined
def _deeper_in_wall(one, u, v, two, next_u, next_v, r, a, b, first, second, lane):
    """Merge a wall's lowest two corners into the deepest two contacts."""
    f, f_a, f_b = load_row(first.gap, lane), load_row(first.facing, lane), load_row(first.beside, lane)
    f_x, f_y, f_r = (
        load_row(first.corner_x, lane),
        load_row(first.corner_y, lane),
        load_row(first.radius, lane),
    )
    s, s_a, s_b = load_row(second.gap, lane), load_row(second.facing, lane), load_row(second.beside, lane)
    s_x, s_y, s_r = (
        load_row(second.corner_x, lane),
        load_row(second.corner_y, lane),
        load_row(second.radius, lane),
    )
    deeper = one < f
    store_row(pick(deeper, one, f), first.gap, lane)
    store_row(pick(deeper, a, f_a), first.facing, lane)
    store_row(pick(deeper, b, f_b), first.beside, lane)
    store_row(pick(deeper, u, f_x), first.corner_x, lane)
    store_row(pick(deeper, v, f_y), first.corner_y, lane)
    store_row(pick(deeper, r, f_r), first.radius, lane)
    # What is left: the wall's next corner and what was deepest, or its lowest and what was next.
    one, u, v = pick(deeper, two, one), pick(deeper, next_u, u), pick(deeper, next_v, v)
    s, s_a, s_b = pick(deeper, f, s), pick(deeper, f_a, s_a), pick(deeper, f_b, s_b)
    s_x, s_y, s_r = pick(deeper, f_x, s_x), pick(deeper, f_y, s_y), pick(deeper, f_r, s_r)
    deeper = one < s
    store_row(pick(deeper, one, s), second.gap, lane)
    store_row(pick(deeper, a, s_a), second.facing, lane)
    store_row(pick(deeper, b, s_b), second.beside, lane)
    store_row(pick(deeper, u, s_x), second.corner_x, lane)
    store_row(pick(deeper, v, s_y), second.corner_y, lane)
    store_row(pick(deeper, r, s_r), second.radius, lane)


@inlined
def _write(contact, gap, a, b, u, v, r, lane):
    store_row(gap, contact.gap, lane)
    store_row(a, contact.facing, lane)
    store_row(b, contact.beside, lane)
    store_row(u, contact.corner_x, lane)
    store_row(v, contact.corner_y, lane)
    store_row(r, contact.radius, lane)


@inlined
def _may_reach(shape, p, center, a, b, gap, lane):
    """Return whether the box around any body reaches deeper into a wall than a gap."""
    zero, bounds = center - center, shape.row_bounds
    least_x, most_x = load(p, bounds, lane), load(p, bounds + 1, lane)
    least_y, most_y = load(p, bounds + 2, lane), load(p, bounds + 3, lane)
    low = a * pick(a > zero, least_x, most_x) + b * pick(b > zero, least_y, most_y)
    return any_of(center + low - spread(p.dtype.type(SURELY)) < gap)


@inlined
def touch_walls(shape, p, near, lane):
    """The touch by the walls in `near.walls`: by two corners of each part of the body at each."""
    for k in range(N_NEAREST):
        center, a, b = _see_plane(near.walls, PER_WALL * k, near.pose, lane)
        if k > 0 and not _may_reach(shape, p, center, a, b, load_row(near.second.gap, lane), lane):
            continue
        for part in range(shape.part_corners.size):
            n = shape.part_corners[part]
            r = load(p, shape.row_part[part] + 2 * n, lane)
            low, u, v, next_low, next_u, next_v = lowest_two(p, shape.row_outline[part], n, a, b, lane)
            one, two = low + center - r, next_low + center - r
            if k + part == 0:
                _write(near.first, one, a, b, u, v, r, lane)
                _write(near.second, two, a, b, next_u, next_v, r, lane)
            else:
                _deeper_in_wall(one, u, v, two, next_u, next_v, r, a, b, near.first, near.second, lane)
