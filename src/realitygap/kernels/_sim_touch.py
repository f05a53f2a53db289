"""Where bodies meet walls and obstacles most deeply, in lanes.

A body is convex polygons grown by a radius each, in the frame of its axle; obstacles and open walls are likewise,
in the world; the walls of an enclosed room are half-planes. Two polygons that are apart, or overlap a little, are
nearest at the face of either of them that has the other one farthest in front of it: either there or, where the way
to the other leads past an end of the face, at that end (a face of the Minkowski difference that is farthest from the
origin has the point nearest to it).
"""

from __future__ import annotations

import numpy as np

from ._bits import unmasked
from ._compile import kernel, stage
from ._lanes import LANES, copy_row, fill
from ._sim_outline import PER_CORNER
from ._sim_support import FAR, low_height, lowest
from ._sim_walls import touch_walls

# Of parallel faces each is met at corners that follow from the other's: their normals are turned by so much
# [rad] for the search, so that none of the corners is met by chance.
TILT = 1e-5
SURELY = 1e-5  # [m] by which boxes must be apart for what is in them to be so: more than rounding does
# A face that is passed at its end gives way to one that is not and is nearly as far in front.
OVERHANG = 1e-3


@stage
def _corner_to_body(x, y, normal_x, normal_y, pose, to_x, to_y, to_normal_x, to_normal_y):
    from_x, from_y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    for k in range(LANES):
        d_x = x[k] - from_x[k]
        d_y = y[k] - from_y[k]
        to_x[k] = d_x * cosine[k] + d_y * sine[k]
        to_y[k] = d_y * cosine[k] - d_x * sine[k]
        to_normal_x[k] = normal_x[k] * cosine[k] + normal_y[k] * sine[k]
        to_normal_y[k] = normal_y[k] * cosine[k] - normal_x[k] * sine[k]


@stage
def _tilt(normal_x, normal_y, tilt, tilted_x, tilted_y):
    real = tilted_x.dtype.type
    for k in range(LANES):
        n_x = normal_x[k]
        n_y = normal_y[k]
        tilted_x[k] = n_x + real(tilt) * n_y
        tilted_y[k] = n_y - real(tilt) * n_x


@stage
def _keep_face(low, x, y, normal_x, normal_y, length, best_x, best_y, best_a, best_b, best_length, best):
    """Keep the face that has the other outline farthest in front of it; `low` is how low that lies along its normal."""
    for k in range(LANES):
        from_x = x[k]
        from_y = y[k]
        a = normal_x[k]
        b = normal_y[k]
        size = length[k]
        gap = low[k] - (a * from_x + b * from_y)
        most = unmasked(best[k])
        o_x = best_x[k]
        o_y = best_y[k]
        o_a = best_a[k]
        o_b = best_b[k]
        o_size = best_length[k]
        better = gap > most
        best[k] = gap if better else most
        best_x[k] = from_x if better else o_x
        best_y[k] = from_y if better else o_y
        best_a[k] = a if better else o_a
        best_b[k] = b if better else o_b
        best_length[k] = size if better else o_size


@stage
def _consider_face(
    x, y, normal_x, normal_y, length, sign, q_x, q_y,
    score, apart, at_end, n_x, n_y, on_x, on_y, way_x, way_y,
):  # fmt: skip
    """Keep a face if it has the other outline farther in front of it than the one before.

    Args:
        x, y, normal_x, normal_y, length: The face.
        sign: 1 for a face of the obstacle, -1 for one of the body.
        q_x, q_y: The other's corner that is lowest over it.
        score, apart, at_end, n_x, n_y, on_x, on_y, way_x, way_y: Of the one before: score, separation, how far
            the end is passed, normal towards the body, point on the body, and the way to it from the end.
    """
    real = x.dtype.type
    for k in range(LANES):
        a = normal_x[k]
        b = normal_y[k]
        low_x = q_x[k]
        low_y = q_y[k]
        from_x = x[k]
        from_y = y[k]
        size = length[k]
        to_x = from_x - b * size
        to_y = from_y + a * size
        off_x = low_x - from_x
        off_y = low_y - from_y
        gap = a * off_x + b * off_y
        along = a * off_y - b * off_x
        past = along - size
        beyond = past > real(0.0)
        over = past if past > -along else -along
        over = over if over > real(0.0) else real(0.0)
        v_x = to_x if beyond else from_x
        v_y = to_y if beyond else from_y
        worth = gap - real(OVERHANG) * over
        foot_x = low_x - gap * a
        foot_y = low_y - gap * b
        foot_x = v_x if over > real(0.0) else foot_x
        foot_y = v_y if over > real(0.0) else foot_y
        b_x = low_x if sign > 0 else foot_x
        b_y = low_y if sign > 0 else foot_y
        d_x = low_x - v_x
        d_y = low_y - v_y
        d_x = d_x if sign > 0 else -d_x
        d_y = d_y if sign > 0 else -d_y
        a = a if sign > 0 else -a
        b = b if sign > 0 else -b
        most = unmasked(score[k])
        o_apart = apart[k]
        o_end = at_end[k]
        o_nx = n_x[k]
        o_ny = n_y[k]
        o_x = on_x[k]
        o_y = on_y[k]
        o_wx = way_x[k]
        o_wy = way_y[k]
        better = worth > most
        score[k] = worth if better else most
        apart[k] = gap if better else o_apart
        at_end[k] = over if better else o_end
        n_x[k] = a if better else o_nx
        n_y[k] = b if better else o_ny
        on_x[k] = b_x if better else o_x
        on_y[k] = b_y if better else o_y
        way_x[k] = d_x if better else o_wx
        way_y[k] = d_y if better else o_wy


@stage
def _begin_pair(x, y, q_x, q_y, score, apart, at_end, n_x, n_y, on_x, on_y, way_x, way_y):
    """Of two corners, which is all that two discs have."""
    real = x.dtype.type
    for k in range(LANES):
        score[k] = real(-FAR)
        apart[k] = real(1.0)
        at_end[k] = real(1.0)
        n_x[k] = real(1.0)
        n_y[k] = real(0.0)
        on_x[k] = x[k]
        on_y[k] = y[k]
        way_x[k] = x[k] - q_x[k]
        way_y[k] = y[k] - q_y[k]


@stage
def _deeper_in_shape(
    apart, at_end, n_x, n_y, on_x, on_y, way_x, way_y, body_radius, radius, first, second
):  # fmt: skip
    """Merge a contact into the deepest two; of two as deep, the one more to the left, so that no order decides."""
    gap, facing, beside, corner_x, corner_y, rounding = first
    then, then_facing, then_beside, then_x, then_y, then_rounding = second
    real = gap.dtype.type
    for k in range(LANES):
        d_x = way_x[k]
        d_y = way_y[k]
        size = np.sqrt(d_x * d_x + d_y * d_y)
        now = apart[k]
        a = n_x[k]
        b = n_y[k]
        corner = (at_end[k] > real(0.0)) & (now > real(0.0)) & (size > real(0.0))
        scale = real(1.0) / (size if corner else real(1.0))
        r = body_radius[k]
        a = d_x * scale if corner else a
        b = d_y * scale if corner else b
        now = (size if corner else now) - (r + radius[k])
        u = on_x[k]
        v = on_y[k]
        left = v + (real(1.0) - r) * b
        f = unmasked(gap[k])
        f_a = facing[k]
        f_b = beside[k]
        f_x = corner_x[k]
        f_y = corner_y[k]
        f_r = rounding[k]
        s = then[k]
        s_a = then_facing[k]
        s_b = then_beside[k]
        s_x = then_x[k]
        s_y = then_y[k]
        s_r = then_rounding[k]
        deeper = (now < f) | ((now == f) & (left > f_y + (real(1.0) - f_r) * f_b))
        next_one = (now < s) | ((now == s) & (left > s_y + (real(1.0) - s_r) * s_b))
        gap[k] = now if deeper else f
        facing[k] = a if deeper else f_a
        beside[k] = b if deeper else f_b
        corner_x[k] = u if deeper else f_x
        corner_y[k] = v if deeper else f_y
        rounding[k] = r if deeper else f_r
        s = now if next_one else s
        s_a = a if next_one else s_a
        s_b = b if next_one else s_b
        s_x = u if next_one else s_x
        s_y = v if next_one else s_y
        s_r = r if next_one else s_r
        then[k] = f if deeper else s
        then_facing[k] = f_a if deeper else s_a
        then_beside[k] = f_b if deeper else s_b
        then_x[k] = f_x if deeper else s_x
        then_y[k] = f_y if deeper else s_y
        then_rounding[k] = f_r if deeper else s_r


@stage
def _apart_by_corner(x, y, normal_x, normal_y, bounds, sides, apart):
    """Raise `apart` to how far a body is beyond a face at least, and widen `sides` by the corner it begins at."""
    real = x.dtype.type
    least_x, most_x, least_y, most_y = bounds[0], bounds[1], bounds[2], bounds[3]
    low_x, high_x, low_y, high_y = sides[0], sides[1], sides[2], sides[3]
    for k in range(LANES):
        u = x[k]
        v = y[k]
        a = normal_x[k]
        b = normal_y[k]
        x_0 = least_x[k]
        x_1 = most_x[k]
        y_0 = least_y[k]
        y_1 = most_y[k]
        gap = a * ((x_0 if a > real(0.0) else x_1) - u) + b * ((y_0 if b > real(0.0) else y_1) - v)
        so_far = unmasked(apart[k])
        apart[k] = gap if gap > so_far else so_far
        behind = low_x[k]
        ahead = high_x[k]
        right = low_y[k]
        left = high_y[k]
        low_x[k] = u if u < behind else behind
        high_x[k] = u if u > ahead else ahead
        low_y[k] = v if v < right else right
        high_y[k] = v if v > left else left


@stage
def _apart_by_sides(bounds, sides, radius, apart):
    real = apart.dtype.type
    least_x, most_x, least_y, most_y = bounds[0], bounds[1], bounds[2], bounds[3]
    low_x, high_x, low_y, high_y = sides[0], sides[1], sides[2], sides[3]
    for k in range(LANES):
        ahead = low_x[k] - most_x[k]
        behind = least_x[k] - high_x[k]
        left = low_y[k] - most_y[k]
        right = least_y[k] - high_y[k]
        along = ahead if ahead > behind else behind
        across = left if left > right else right
        gap = along if along > across else across
        so_far = unmasked(apart[k])
        apart[k] = (gap if gap > so_far else so_far) - (radius[k] + real(SURELY))


@stage
def _count_not_apart(shape, p, near, m, radius):
    """In how many lanes the box around the body is not apart from the obstacle whose m corners are in `seen`."""
    seen, spare = near.seen, near.spare
    bounds, sides, apart = p[shape.row_bounds : shape.row_bounds + 4], spare[8:12], spare[12]
    fill(apart, apart.dtype.type(-FAR))
    for side in range(4):
        fill(sides[side], apart.dtype.type(-FAR if side & 1 else FAR))
    for corner in range(m):
        to = PER_CORNER * corner
        _apart_by_corner(seen[to], seen[to + 1], seen[to + 2], seen[to + 3], bounds, sides, apart)
    _apart_by_sides(bounds, sides, radius, apart)
    return count_touching(apart)


@stage
def _farthest_face(p, corners, n, others, other, m, low, face):
    """Of an outline's n faces that which has the other outline of m corners farthest in front of it, into `face`."""
    fill(face[5], low.dtype.type(-FAR))
    for corner in range(n):
        row = corners + PER_CORNER * corner
        low_height(others, other, m, p[row + 2], p[row + 3], low)
        _keep_face(
            low, p[row], p[row + 1], p[row + 2], p[row + 3], p[row + 4],
            face[0], face[1], face[2], face[3], face[4], face[5],
        )  # fmt: skip


@kernel
def touch_shape(shape, p, near, q):
    """Deepen the touch by one obstacle or open wall."""
    spare, seen, best, face = near.spare, near.seen, near.best, near.face
    low, x, y, t_x, t_y = spare[3], spare[4], spare[5], spare[6], spare[7]
    m, first = shape.shape_corners[q], shape.row_shape[q]
    for corner in range(m):
        row, to = first + PER_CORNER * corner, PER_CORNER * corner
        _corner_to_body(
            p[row], p[row + 1], p[row + 2], p[row + 3], near.pose, seen[to], seen[to + 1], seen[to + 2], seen[to + 3]
        )  # fmt: skip
        copy_row(p[row + 4], seen[to + 4])
    if _count_not_apart(shape, p, near, m, p[first + PER_CORNER * m]) == 0:
        return
    for part in range(shape.part_corners.size):
        n, outline = shape.part_corners[part], shape.row_outline[part]
        _begin_pair(
            p[outline], p[outline + 1], seen[0], seen[1],
            best[0], best[1], best[2], best[3], best[4], best[5], best[6], best[7], best[8],
        )  # fmt: skip
        if m > 1:
            _farthest_face(seen, 0, m, p, outline, n, low, face)
            _tilt(face[2], face[3], -TILT, t_x, t_y)
            lowest(p, outline, n, t_x, t_y, low, x, y)
            _consider_face(
                face[0], face[1], face[2], face[3], face[4], 1, x, y,
                best[0], best[1], best[2], best[3], best[4], best[5], best[6], best[7], best[8],
            )  # fmt: skip
        if n > 1:
            _farthest_face(p, outline, n, seen, 0, m, low, face)
            _tilt(face[2], face[3], TILT, t_x, t_y)
            lowest(seen, 0, m, t_x, t_y, low, x, y)
            _consider_face(
                face[0], face[1], face[2], face[3], face[4], -1, x, y,
                best[0], best[1], best[2], best[3], best[4], best[5], best[6], best[7], best[8],
            )  # fmt: skip
        _deeper_in_shape(
            best[1], best[2], best[3], best[4], best[5], best[6], best[7], best[8],
            p[shape.row_part[part] + 2 * n], p[first + PER_CORNER * m], near.first, near.second,
        )  # fmt: skip


@kernel
def touch(shape, p, near):
    """The deepest two contacts of each body at `near.pose`.

    A wall of a room can have both; an obstacle or open wall has one with each part of a body.

    Args:
        shape: Structure.
        near: Numbers and poses are read; `first` and `second` written.

    Returns:
        In how many lanes bodies touch or overlap something.
    """
    fill(near.first.gap, near.first.gap.dtype.type(FAR))
    fill(near.second.gap, near.first.gap.dtype.type(FAR))
    if shape.enclosed:
        touch_walls(shape, p, near)
    for q in range(shape.row_shape.size):
        touch_shape(shape, p, near, q)
    return count_touching(near.first.gap)


@stage
def count_touching(gap):
    """In how many lanes the gap is zero or less."""
    real = gap.dtype.type
    n = np.int32(0)
    for k in range(LANES):
        n = np.int32(n + np.int32(gap[k] <= real(0.0)))
    return n
