"""Where bodies meet walls and obstacles most deeply, in lanes.

A body is convex polygons grown by a radius each, in the frame of its axle; obstacles and open walls are likewise,
in the world; the walls of an enclosed room are half-planes. Two polygons that are apart, or overlap a little, are
nearest at the face of either of them that has the other one farthest in front of it: either there or, where the way
to the other leads past an end of the face, at that end (a face of the Minkowski difference that is farthest from the
origin has the point nearest to it).
"""

from __future__ import annotations

import numpy as np

from ._compile import kernel, stage
from ._sim_lanes import NEAR
from ._sim_outline import PER_CORNER

FAR = 1e9  # farther than any wall [m]

# Of parallel faces each is met at corners that follow from the other's: their normals are turned by so much
# [rad] for the search, so that none of the corners is met by chance.
TILT = 1e-5
SURELY = 1e-5  # [m] by which boxes must be apart for what is in them to be so: more than rounding does
# A face that is passed at its end gives way to one that is not and is nearly as far in front.
OVERHANG = 1e-3


@stage
def clear_touch(near):
    """Nothing is near."""
    real = near.gap.dtype.type
    gap = near.gap
    for k in range(NEAR):
        gap[k] = real(FAR)


@stage
def _see(normal_x, normal_y, offset, pose, center, along, across):
    x, y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    for k in range(NEAR):
        n_x = normal_x[k]
        n_y = normal_y[k]
        center[k] = n_x * x[k] + n_y * y[k] - offset[k]
        along[k] = n_x * cosine[k] + n_y * sine[k]
        across[k] = n_y * cosine[k] - n_x * sine[k]


@stage
def _first(value, low):
    real = low.dtype.type
    for k in range(NEAR):
        low[k] = real(value)


@stage
def _lower(along, across, x, y, low, point_x, point_y):
    """Keep the corner that lies lowest along a normal."""
    for k in range(NEAR):
        c_x = x[k]
        c_y = y[k]
        height = along[k] * c_x + across[k] * c_y
        least = low[k]
        p_x = point_x[k]
        p_y = point_y[k]
        lower = height < least
        low[k] = height if lower else least
        point_x[k] = c_x if lower else p_x
        point_y[k] = c_y if lower else p_y


@stage
def _lower_of_two(along, across, x, y, other_x, other_y, low, point_x, point_y):
    for k in range(NEAR):
        c_x = x[k]
        c_y = y[k]
        d_x = other_x[k]
        d_y = other_y[k]
        one = along[k] * c_x + across[k] * c_y
        two = along[k] * d_x + across[k] * d_y
        least = low[k]
        p_x = point_x[k]
        p_y = point_y[k]
        second = two < one
        height = two if second else one
        c_x = d_x if second else c_x
        c_y = d_y if second else c_y
        lower = height < least
        low[k] = height if lower else least
        point_x[k] = c_x if lower else p_x
        point_y[k] = c_y if lower else p_y


@stage
def _lowest(p, outline, n, along, across, low, point_x, point_y):
    _first(FAR, low)
    for pair in range(n >> 1):
        row = outline + 2 * PER_CORNER * pair
        _lower_of_two(
            along, across, p[row], p[row + 1], p[row + PER_CORNER], p[row + PER_CORNER + 1], low, point_x, point_y
        )  # fmt: skip
    if n & 1:
        row = outline + PER_CORNER * (n - 1)
        _lower(along, across, p[row], p[row + 1], low, point_x, point_y)


@stage
def _deeper_in_wall(low, center, radius, along, across, x, y, near_gap, facing, beside, point_x, point_y):
    for k in range(NEAR):
        gap = low[k] + center[k] - radius[k]
        a = along[k]
        b = across[k]
        c_x = x[k] - radius[k] * a
        c_y = y[k] - radius[k] * b
        least = near_gap[k]
        f = facing[k]
        g = beside[k]
        p_x = point_x[k]
        p_y = point_y[k]
        deeper = gap < least
        near_gap[k] = gap if deeper else least
        facing[k] = a if deeper else f
        beside[k] = b if deeper else g
        point_x[k] = c_x if deeper else p_x
        point_y[k] = c_y if deeper else p_y


@stage
def _height(along, across, x, y, low):
    """How low the lowest corner lies along a normal."""
    for k in range(NEAR):
        height = along[k] * x[k] + across[k] * y[k]
        least = low[k]
        low[k] = height if height < least else least


@stage
def _height_of_two(along, across, x, y, other_x, other_y, low):
    for k in range(NEAR):
        a = along[k]
        b = across[k]
        one = a * x[k] + b * y[k]
        two = a * other_x[k] + b * other_y[k]
        least = low[k]
        height = two if two < one else one
        low[k] = height if height < least else least


@stage
def _low_height(p, outline, n, along, across, low):
    _first(FAR, low)
    for pair in range(n >> 1):
        row = outline + 2 * PER_CORNER * pair
        _height_of_two(along, across, p[row], p[row + 1], p[row + PER_CORNER], p[row + PER_CORNER + 1], low)
    if n & 1:
        row = outline + PER_CORNER * (n - 1)
        _height(along, across, p[row], p[row + 1], low)


@stage
def _nearer_wall(low, center, along, across, best, best_center, best_along, best_across):
    for k in range(NEAR):
        c = center[k]
        a = along[k]
        b = across[k]
        gap = low[k] + c
        least = best[k]
        b_c = best_center[k]
        b_a = best_along[k]
        b_b = best_across[k]
        deeper = gap < least
        best[k] = gap if deeper else least
        best_center[k] = c if deeper else b_c
        best_along[k] = a if deeper else b_a
        best_across[k] = b if deeper else b_b


@stage
def touch_walls(shape, near):
    """Deepen the touch by the walls of an enclosed room: where, is asked of the nearest wall only."""
    p, spare = near.p, near.spare
    center, along, across, low, x, y = spare[0], spare[1], spare[2], spare[3], spare[4], spare[5]
    best, best_center, best_along, best_across = spare[8], spare[9], spare[10], spare[11]
    for part in range(shape.part_corners.size):
        n, outline = shape.part_corners[part], shape.row_outline[part]
        _first(FAR, best)
        for w in range(shape.n_walls):
            plane = shape.row_plane + 3 * w
            _see(p[plane], p[plane + 1], p[plane + 2], near.pose, center, along, across)
            _low_height(p, outline, n, along, across, low)
            _nearer_wall(low, center, along, across, best, best_center, best_along, best_across)
        _lowest(p, outline, n, best_along, best_across, low, x, y)
        _deeper_in_wall(
            low, best_center, p[shape.row_part[part] + 2 * n], best_along, best_across, x, y,
            near.gap, near.facing, near.beside, near.point_x, near.point_y,
        )  # fmt: skip


@stage
def _corner_to_body(x, y, normal_x, normal_y, pose, to_x, to_y, to_normal_x, to_normal_y):
    from_x, from_y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    for k in range(NEAR):
        d_x = x[k] - from_x[k]
        d_y = y[k] - from_y[k]
        to_x[k] = d_x * cosine[k] + d_y * sine[k]
        to_y[k] = d_y * cosine[k] - d_x * sine[k]
        to_normal_x[k] = normal_x[k] * cosine[k] + normal_y[k] * sine[k]
        to_normal_y[k] = normal_y[k] * cosine[k] - normal_x[k] * sine[k]


@stage
def _tilt(normal_x, normal_y, tilt, tilted_x, tilted_y):
    real = tilted_x.dtype.type
    for k in range(NEAR):
        n_x = normal_x[k]
        n_y = normal_y[k]
        tilted_x[k] = n_x + real(tilt) * n_y
        tilted_y[k] = n_y - real(tilt) * n_x


@stage
def _consider_face(
    x, y, end_x, end_y, normal_x, normal_y, length, sign, q_x, q_y,
    score, apart, at_end, n_x, n_y, on_x, on_y, way_x, way_y,
):  # fmt: skip
    """Keep a face if it has the other outline farther in front of it than any before.

    Args:
        x, y, end_x, end_y, normal_x, normal_y, length: The face.
        sign: 1 for a face of the obstacle, -1 for one of the body.
        q_x, q_y: The other's corner that is lowest over it.
        score, apart, at_end, n_x, n_y, on_x, on_y, way_x, way_y: Of the best one so far: score, separation, how far
            the end is passed, normal towards the body, point on the body, and the way to it from the end.
    """
    real = x.dtype.type
    for k in range(NEAR):
        a = normal_x[k]
        b = normal_y[k]
        low_x = q_x[k]
        low_y = q_y[k]
        from_x = x[k]
        from_y = y[k]
        to_x = end_x[k]
        to_y = end_y[k]
        off_x = low_x - from_x
        off_y = low_y - from_y
        gap = a * off_x + b * off_y
        along = a * off_y - b * off_x
        past = along - length[k]
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
        most = score[k]
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
    for k in range(NEAR):
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
    apart, at_end, n_x, n_y, on_x, on_y, way_x, way_y,
    body_radius, radius, near_gap, facing, beside, point_x, point_y,
):  # fmt: skip
    """Keep the deeper contact; of two as deep, the one more to the left, so that no order of shapes decides."""
    real = near_gap.dtype.type
    for k in range(NEAR):
        d_x = way_x[k]
        d_y = way_y[k]
        size = np.sqrt(d_x * d_x + d_y * d_y)
        gap = apart[k]
        face_x = n_x[k]
        face_y = n_y[k]
        corner = (at_end[k] > real(0.0)) & (gap > real(0.0)) & (size > real(0.0))
        scale = real(1.0) / (size if corner else real(1.0))
        a = d_x * scale if corner else face_x
        b = d_y * scale if corner else face_y
        gap = (size if corner else gap) - (body_radius[k] + radius[k])
        c_x = on_x[k] - body_radius[k] * a
        c_y = on_y[k] - body_radius[k] * b
        least = near_gap[k]
        f = facing[k]
        g = beside[k]
        p_x = point_x[k]
        p_y = point_y[k]
        deeper = (gap < least) | ((gap == least) & (c_y + b > p_y + g))
        near_gap[k] = gap if deeper else least
        facing[k] = a if deeper else f
        beside[k] = b if deeper else g
        point_x[k] = c_x if deeper else p_x
        point_y[k] = c_y if deeper else p_y


@stage
def _apart_by_corner(x, y, normal_x, normal_y, bounds, sides, apart):
    """Raise `apart` to how far a body is beyond a face at least, and widen `sides` by the corner it begins at."""
    real = x.dtype.type
    least_x, most_x, least_y, most_y = bounds[0], bounds[1], bounds[2], bounds[3]
    low_x, high_x, low_y, high_y = sides[0], sides[1], sides[2], sides[3]
    for k in range(NEAR):
        u = x[k]
        v = y[k]
        a = normal_x[k]
        b = normal_y[k]
        x_0 = least_x[k]
        x_1 = most_x[k]
        y_0 = least_y[k]
        y_1 = most_y[k]
        gap = a * ((x_0 if a > real(0.0) else x_1) - u) + b * ((y_0 if b > real(0.0) else y_1) - v)
        so_far = apart[k]
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
    for k in range(NEAR):
        ahead = low_x[k] - most_x[k]
        behind = least_x[k] - high_x[k]
        left = low_y[k] - most_y[k]
        right = least_y[k] - high_y[k]
        along = ahead if ahead > behind else behind
        across = left if left > right else right
        gap = along if along > across else across
        so_far = apart[k]
        apart[k] = (gap if gap > so_far else so_far) - (radius[k] + real(SURELY))


@stage
def _count_not_apart(shape, near, m, radius):
    """In how many lanes the box around the body is not apart from the obstacle whose m corners are in `seen`."""
    seen, spare = near.seen, near.spare
    bounds, sides, apart = near.p[shape.row_bounds : shape.row_bounds + 4], spare[8:12], spare[12]
    _first(-FAR, apart)
    for side in range(4):
        _first(-FAR if side & 1 else FAR, sides[side])
    for corner in range(m):
        to = PER_CORNER * corner
        _apart_by_corner(seen[to], seen[to + 1], seen[to + 2], seen[to + 3], bounds, sides, apart)
    _apart_by_sides(bounds, sides, radius, apart)
    return count_touching(apart)


@kernel
def touch_shape(shape, near, q):
    """Deepen the touch by one obstacle or open wall."""
    p, spare, seen, best = near.p, near.spare, near.seen, near.best
    low, x, y, t_x, t_y = spare[3], spare[4], spare[5], spare[6], spare[7]
    m, first = shape.shape_corners[q], shape.row_shape[q]
    for corner in range(m):
        row, to = first + PER_CORNER * corner, PER_CORNER * corner
        _corner_to_body(
            p[row], p[row + 1], p[row + 2], p[row + 3], near.pose, seen[to], seen[to + 1], seen[to + 2], seen[to + 3]
        )  # fmt: skip
    if _count_not_apart(shape, near, m, p[first + PER_CORNER * m]) == 0:
        return
    for part in range(shape.part_corners.size):
        n, outline = shape.part_corners[part], shape.row_outline[part]
        _begin_pair(
            p[outline],
            p[outline + 1],
            seen[0],
            seen[1],
            best[0],
            best[1],
            best[2],
            best[3],
            best[4],
            best[5],
            best[6],
            best[7],
            best[8],
        )
        if m > 1:
            for corner in range(m):
                row = PER_CORNER * corner
                end = row + PER_CORNER if corner + 1 < m else 0
                _tilt(seen[row + 2], seen[row + 3], -TILT, t_x, t_y)
                _lowest(p, outline, n, t_x, t_y, low, x, y)
                _consider_face(
                    seen[row], seen[row + 1], seen[end], seen[end + 1], seen[row + 2], seen[row + 3],
                    p[first + row + 4], 1, x, y,
                    best[0], best[1], best[2], best[3], best[4], best[5], best[6], best[7], best[8],
                )  # fmt: skip
        if n > 1:
            for corner in range(n):
                row = outline + PER_CORNER * corner
                end = row + PER_CORNER if corner + 1 < n else outline
                _tilt(p[row + 2], p[row + 3], TILT, t_x, t_y)
                _lowest(seen, 0, m, t_x, t_y, low, x, y)
                _consider_face(
                    p[row],
                    p[row + 1],
                    p[end],
                    p[end + 1],
                    p[row + 2],
                    p[row + 3],
                    p[row + 4],
                    -1,
                    x,
                    y,
                    best[0],
                    best[1],
                    best[2],
                    best[3],
                    best[4],
                    best[5],
                    best[6],
                    best[7],
                    best[8],
                )
        _deeper_in_shape(
            best[1], best[2], best[3], best[4], best[5], best[6], best[7], best[8],
            p[shape.row_part[part] + 2 * n], p[first + PER_CORNER * m],
            near.gap, near.facing, near.beside, near.point_x, near.point_y,
        )  # fmt: skip


@kernel
def touch(shape, near):
    """The deepest contact of each body at `near.pose`: gap [m], normal and point in the body's frame.

    Args:
        shape: Structure.
        near: Numbers and poses are read; `gap`, `facing`, `beside`, `point_x` and `point_y` written.

    Returns:
        In how many lanes bodies touch or overlap something.
    """
    clear_touch(near)
    if shape.enclosed:
        touch_walls(shape, near)
    for q in range(shape.row_shape.size):
        touch_shape(shape, near, q)
    return count_touching(near.gap)


@stage
def count_touching(gap):
    """In how many lanes the gap is zero or less."""
    real = gap.dtype.type
    n = np.int32(0)
    for k in range(NEAR):
        n = np.int32(n + np.int32(gap[k] <= real(0.0)))
    return n
