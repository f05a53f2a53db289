"""The deepest contacts of bodies with walls and obstacles, in lanes.

A body is convex polygons grown by a radius each, in the frame of its axle; obstacles and open walls are likewise,
in the world; the walls of an enclosed room are half-planes. Two polygons that are apart, or overlap a little, are
nearest at the face of either of them that has the other one farthest in front of it: either there or, where the way
to the other leads past an end of the face, at that end (a face of the Minkowski difference that is farthest from the
origin has the point nearest to it).
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, kernel, stage
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.math.vectors import (
    WIDTH,
    any_of,
    load,
    load_row,
    pick,
    root,
    spread,
    store,
    store_row,
)

from .outline import FAR, PER_CORNER, SURELY, low_height, lowest
from .walls import touch_walls

# Of parallel faces each is met at corners that follow from the other's: their normals are turned by so much
# [rad] for the search, so that none of the corners is met by chance.
TILT = 1e-5
# A quarter of a body's reach: in a part of a step it moves less. An obstacle that is farther is no contact. The
# limit depends on the lane alone, so a trial goes the same way in any team.
WITHIN = 0.25
# A face that is passed at its end gives way to one that is not and is nearly as far in front.
OVERHANG = 1e-3


@inlined
def _see_face(face, q_x, q_y, overhang, outward):
    """Measure how far in front of a face the other outline is.

    Args:
        face: x, y, normal and length.
        q_x, q_y: The other's corner that is lowest over it.
        overhang: `OVERHANG`.
        outward: Whether it is a face of the obstacle.

    Returns:
        Score, separation, how far the end is passed, normal towards the body, point on the body, and the way to it
        from the end.
    """
    from_x, from_y, a, b, size = face
    zero = size - size
    off_x, off_y = q_x - from_x, q_y - from_y
    gap = a * off_x + b * off_y
    along = a * off_y - b * off_x
    past = along - size
    over = pick(past > -along, past, -along)
    over = pick(over > zero, over, zero)
    beyond = past > zero
    v_x, v_y = pick(beyond, from_x - b * size, from_x), pick(beyond, from_y + a * size, from_y)
    d_x, d_y = q_x - v_x, q_y - v_y
    on_x, on_y = q_x, q_y
    if not outward:
        past_end = over > zero
        on_x, on_y = pick(past_end, v_x, q_x - gap * a), pick(past_end, v_y, q_y - gap * b)
        a, b, d_x, d_y = -a, -b, -d_x, -d_y
    return gap - overhang * over, gap, over, a, b, on_x, on_y, d_x, d_y


@inlined
def _better_face(one, two):
    """Pick the one of two results of `_see_face` with the higher score."""
    score, apart, at_end, n_x, n_y, on_x, on_y, way_x, way_y = one
    worth, gap, over, a, b, x, y, d_x, d_y = two
    better = worth > score
    return (
        pick(better, worth, score), pick(better, gap, apart), pick(better, over, at_end),
        pick(better, a, n_x), pick(better, b, n_y), pick(better, x, on_x), pick(better, y, on_y),
        pick(better, d_x, way_x), pick(better, d_y, way_y),
    )  # fmt: skip


@inlined
def _deeper_in_shape(found, r, radius, within, counts, first, second, lane):
    """Merge a contact that is not too far into the deepest two.

    Of two as deep, the one more to the left comes first, so that no order decides.
    """
    _, now, at_end, a, b, u, v, d_x, d_y = found
    one = spread(first.gap.dtype.type(1.0))
    zero = one - one
    size = root(d_x * d_x + d_y * d_y)
    corner = (at_end > zero) & (now > zero) & (size > zero)
    scale = one / pick(corner, size, one)
    a, b = pick(corner, d_x * scale, a), pick(corner, d_y * scale, b)
    now = pick(corner, size, now) - (r + radius)
    left = v + (one - r) * b
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
    counts = counts & (now <= within)
    deeper = counts & ((now < f) | ((now == f) & (left > f_y + (one - f_r) * f_b)))
    next_one = counts & ((now < s) | ((now == s) & (left > s_y + (one - s_r) * s_b)))
    store_row(pick(deeper, now, f), first.gap, lane)
    store_row(pick(deeper, a, f_a), first.facing, lane)
    store_row(pick(deeper, b, f_b), first.beside, lane)
    store_row(pick(deeper, u, f_x), first.corner_x, lane)
    store_row(pick(deeper, v, f_y), first.corner_y, lane)
    store_row(pick(deeper, r, f_r), first.radius, lane)
    store_row(pick(deeper, f, pick(next_one, now, s)), second.gap, lane)
    store_row(pick(deeper, f_a, pick(next_one, a, s_a)), second.facing, lane)
    store_row(pick(deeper, f_b, pick(next_one, b, s_b)), second.beside, lane)
    store_row(pick(deeper, f_x, pick(next_one, u, s_x)), second.corner_x, lane)
    store_row(pick(deeper, f_y, pick(next_one, v, s_y)), second.corner_y, lane)
    store_row(pick(deeper, f_r, pick(next_one, r, s_r)), second.radius, lane)


@inlined
def _see_shape(shape, p, near, q, seen, lane):
    """Write the corners of an obstacle, as bodies see them, into `seen`; return which bodies it may be near.

    That is where the boxes around both are not apart along the axes of the body or the normals of the obstacle.
    """
    real = p.dtype.type
    pose, m, first, bounds = near.pose, shape.shape_corners[q], shape.row_shape[q], shape.row_bounds
    from_x, from_y = load_row(pose.x, lane), load_row(pose.y, lane)
    sine, cosine = load_row(pose.sine, lane), load_row(pose.cosine, lane)
    least_x, most_x = load(p, bounds, lane), load(p, bounds + 1, lane)
    least_y, most_y = load(p, bounds + 2, lane), load(p, bounds + 3, lane)
    zero, far = spread(real(0.0)), spread(real(FAR))
    apart, low_x, high_x, low_y, high_y = -far, far, -far, far, -far
    for corner in range(m):
        row, to = first + PER_CORNER * corner, PER_CORNER * corner
        d_x, d_y = load(p, row, lane) - from_x, load(p, row + 1, lane) - from_y
        n_x, n_y = load(p, row + 2, lane), load(p, row + 3, lane)
        u, v = d_x * cosine + d_y * sine, d_y * cosine - d_x * sine
        a, b = n_x * cosine + n_y * sine, n_y * cosine - n_x * sine
        store(u, seen, to, lane)
        store(v, seen, to + 1, lane)
        store(a, seen, to + 2, lane)
        store(b, seen, to + 3, lane)
        store(load(p, row + 4, lane), seen, to + 4, lane)
        gap = a * (pick(a > zero, least_x, most_x) - u) + b * (pick(b > zero, least_y, most_y) - v)
        apart = pick(gap > apart, gap, apart)
        low_x, high_x = pick(u < low_x, u, low_x), pick(u > high_x, u, high_x)
        low_y, high_y = pick(v < low_y, v, low_y), pick(v > high_y, v, high_y)
    for gap in (low_x - most_x, least_x - high_x, low_y - most_y, least_y - high_y):
        apart = pick(gap > apart, gap, apart)
    radius, within = load(p, first + PER_CORNER * m, lane), _within(shape, p, lane)
    store(radius, seen, PER_CORNER * m, lane)
    return apart - (radius + within + spread(real(SURELY))) <= zero


@inlined
def _within(shape, p, lane):
    return spread(p.dtype.type(WITHIN)) * load(p, shape.row_reach, lane)


@inlined
def _farthest_face(p, corners, n, others, other, m, lane):
    """Return the face, among an outline's n faces, that has the other outline of m corners farthest in front of it."""
    best = spread(-p.dtype.type(FAR))
    x, y, a, b, length = best, best, best, best, best
    for corner in range(n):
        row = corners + PER_CORNER * corner
        c_x, c_y = load(p, row, lane), load(p, row + 1, lane)
        n_x, n_y = load(p, row + 2, lane), load(p, row + 3, lane)
        gap = low_height(others, other, m, n_x, n_y, lane) - (n_x * c_x + n_y * c_y)
        better = gap > best
        best, x, y = pick(better, gap, best), pick(better, c_x, x), pick(better, c_y, y)
        a, b, length = (
            pick(better, n_x, a),
            pick(better, n_y, b),
            pick(better, load(p, row + 4, lane), length),
        )
    return x, y, a, b, length


@inlined
def _touch_seen(shape, p, near, m, counts, lane):
    """Deepen the touch in some lanes by the obstacle or open wall of m corners that `near.met` has for each."""
    real = p.dtype.type
    met, one, tilt, overhang = (
        near.met,
        spread(real(1.0)),
        spread(real(TILT)),
        spread(real(OVERHANG)),
    )
    radius, within = load(met, PER_CORNER * m, lane), _within(shape, p, lane)
    for part in range(shape.part_corners.size):
        n, outline = shape.part_corners[part], shape.row_outline[part]
        # Of two corners, which is all that two discs have.
        x, y = load(p, outline, lane), load(p, outline + 1, lane)
        way_x, way_y = x - load(met, 0, lane), y - load(met, 1, lane)
        found = (spread(-real(FAR)), one, one, one, one - one, x, y, way_x, way_y)
        if m > 1:
            face = _farthest_face(met, 0, m, p, outline, n, lane)
            x, y = lowest(p, outline, n, face[2] - tilt * face[3], face[3] + tilt * face[2], lane)
            found = _see_face(face, x, y, overhang, True)
        if n > 1:
            face = _farthest_face(p, outline, n, met, 0, m, lane)
            x, y = lowest(met, 0, m, face[2] + tilt * face[3], face[3] - tilt * face[2], lane)
            found = _better_face(found, _see_face(face, x, y, overhang, False))
        r = load(p, shape.row_part[part] + 2 * n, lane)
        _deeper_in_shape(found, r, radius, within, counts, near.first, near.second, lane)


@inlined
def _touch_shapes(shape, p, near, first, stop, lane):
    """Deepen the touch by obstacles or open walls `first` to `stop`, which have the same number of corners.

    Most bodies are near at most one of them. So all lanes meet their first at the same time, then their second.
    """
    real = p.dtype.type
    m, met = shape.shape_corners[first], near.met
    before = spread(real(-1.0))
    while True:
        now, is_last = before, True
        for q in range(first, stop):
            # What the first one leaves in other lanes, the next ones replace, or nothing reads.
            seen = met if q == first else near.seen
            number = spread(real(q))
            waits = _see_shape(shape, p, near, q, seen, lane) & (number > before)
            takes = waits & (now == before)
            is_last = is_last and not any_of(waits & (now > before))
            if any_of(takes):
                now = pick(takes, number, now)
                if q > first:
                    for row in range(PER_CORNER * m + 1):
                        store(pick(takes, load(seen, row, lane), load(met, row, lane)), met, row, lane)
        counts = now > before
        if any_of(counts):
            _touch_seen(shape, p, near, m, counts, lane)
        if is_last:
            return
        before = now


@kernel
def touch(shape, p, near):
    """The deepest two contacts of each body at `near.pose`.

    A wall of a room can have both; an obstacle or open wall has one with each part of a body.

    Args:
        shape: Structure.
        near: Poses are read, and `active`: above 0 where they are of interest. `first` and `second` are written in
            vectors with such a lane.

    Returns:
        In how many lanes bodies touch or overlap something.
    """
    real = p.dtype.type
    far = spread(real(FAR))
    for lane in range(0, LANES, WIDTH):
        if not any_of(load_row(near.active, lane) > spread(real(0.0))):
            continue
        if shape.enclosed:
            touch_walls(shape, p, near, lane)
        else:
            store_row(far, near.first.gap, lane)
            store_row(far, near.second.gap, lane)
        first = 0
        while first < shape.row_shape.size:
            stop = first + 1
            while stop < shape.row_shape.size and shape.shape_corners[stop] == shape.shape_corners[first]:
                stop += 1
            _touch_shapes(shape, p, near, first, stop, lane)
            first = stop
    return count_touching(near.first.gap)


@stage
def count_touching(gap):
    """In how many lanes the gap is zero or less."""
    real = gap.dtype.type
    n = np.int32(0)
    for k in range(LANES):
        n = np.int32(n + np.int32(gap[k] <= real(0.0)))
    return n
