"""Which robots may touch something in a step, so that only blocks with such robots pay for contact."""

from __future__ import annotations

from realitygap.kernels.compile.decorators import stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.elementary import TWO_PI
from realitygap.kernels.math.lanes import LANES, fill

from .outline import FAR, PER_CORNER

IS_NEAR, TOUCHES = 1.0, 2.0  # flags of robots that may touch something in a step, or do so at its end


@stage
def to_axles(pose, axle, other):
    """The same poses, from the axles."""
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    to_x, to_y, to_heading, to_sine, to_cosine = other.x, other.y, other.heading, other.sine, other.cosine
    for lane in range(LANES):
        s = sine[lane]
        c = cosine[lane]
        to_x[lane] = x[lane] + axle[lane] * c
        to_y[lane] = y[lane] + axle[lane] * s
        to_heading[lane] = heading[lane]
        to_sine[lane] = s
        to_cosine[lane] = c


@stage
def copy_poses(pose, other):
    """The same poses in another place."""
    for k in range(LANES):
        other.x[k] = pose.x[k]
        other.y[k] = pose.y[k]
        other.heading[k] = pose.heading[k]
        other.sine[k] = pose.sine[k]
        other.cosine[k] = pose.cosine[k]


@stage
def flag_near_disc(x, y, radius, from_x, from_y, far, flag):
    """Flag where a disc is nearer to points than `far`."""
    real = flag.dtype.type
    for lane in range(LANES):
        dx = from_x[lane] - x[lane]
        dy = from_y[lane] - y[lane]
        reach = far[lane] + radius[lane]
        before = unmasked(flag[lane])
        near = (before < real(IS_NEAR)) & (dx * dx + dy * dy <= reach * reach)
        flag[lane] = real(IS_NEAR) if near else before


@stage
def beyond_face(x, y, normal_x, normal_y, from_x, from_y, most):
    """Raise `most` to how far points are beyond the line through a face."""
    for lane in range(LANES):
        gap = normal_x[lane] * (from_x[lane] - x[lane]) + normal_y[lane] * (from_y[lane] - y[lane])
        so_far = unmasked(most[lane])
        most[lane] = gap if gap > so_far else so_far


@stage
def beyond_ends(x, y, normal_x, normal_y, length, from_x, from_y, most):
    """Raise `most` to how far points are beyond the ends of an edge, along it."""
    for lane in range(LANES):
        along = normal_x[lane] * (from_y[lane] - y[lane]) - normal_y[lane] * (from_x[lane] - x[lane])
        gap = along - length[lane]
        gap = gap if gap > -along else -along
        so_far = unmasked(most[lane])
        most[lane] = gap if gap > so_far else so_far


@stage
def flag_near(most, apart, radius, far, flag):
    """Flag where `most` is below `far` and the boxes around both, of `swept`, are not apart."""
    real = flag.dtype.type
    for lane in range(LANES):
        before = unmasked(flag[lane])
        r = radius[lane]
        near = (before < real(IS_NEAR)) & (most[lane] - r <= far[lane]) & (apart[lane] <= r)
        flag[lane] = real(IS_NEAR) if near else before


@stage
def swept(asked, around, then_asked, then_around, reach, bounds, box):
    """The box, in the frame that the axle has before it, within which a body stays during a step.

    A point of the body turns by at most its distance from the axle times the angle; the axle leaves the straight line
    by at most half its way times the angle, and by what the first part of the step turned the second one.

    Args:
        asked, around, then_asked, then_around: Length [m] and turn [turns] of both parts of the step.
        reach: Of the body from its axle [m].
        bounds: (4, LANES) of the body.
        box: (4, LANES) written: middle and half the size, along and across [m].
    """
    real = reach.dtype.type
    least_x, most_x, least_y, most_y = bounds[0], bounds[1], bounds[2], bounds[3]
    mid_x, half_x, mid_y, half_y = box[0], box[1], box[2], box[3]
    for lane in range(LANES):
        one = asked[lane]
        two = then_asked[lane]
        first = abs(around[lane]) * real(TWO_PI)
        second = abs(then_around[lane]) * real(TWO_PI)
        spread = reach[lane] * (first + second) + real(1e-4)
        spread = spread + abs(one) * (real(0.5) * first) + abs(two) * (first + real(0.5) * second)
        low = least_x[lane] + (
            (one if one < real(0.0) else real(0.0)) + (two if two < real(0.0) else real(0.0))
        )
        high = most_x[lane] + (
            (one if one > real(0.0) else real(0.0)) + (two if two > real(0.0) else real(0.0))
        )
        right = least_y[lane]
        left = most_y[lane]
        mid_x[lane] = real(0.5) * (low + high)
        half_x[lane] = real(0.5) * (high - low) + spread
        mid_y[lane] = real(0.5) * (right + left)
        half_y[lane] = real(0.5) * (left - right) + spread


@stage
def box_from_corner(x, y, normal_x, normal_y, from_x, from_y, pose, box, sides, apart):
    """Raise `apart` to how far a body's box is beyond a face, and widen `sides` by the corner the face begins at.

    Args:
        x, y, normal_x, normal_y: Corner and face.
        from_x, from_y, pose: The axle and its heading.
        box: Of `swept`.
        sides: (4, LANES) least and most of the corners' distances from the middle of the box, along and across.
        apart: (LANES,) [m].
    """
    sine, cosine = pose.sine, pose.cosine
    mid_x, half_x, mid_y, half_y = box[0], box[1], box[2], box[3]
    least_x, most_x, least_y, most_y = sides[0], sides[1], sides[2], sides[3]
    for lane in range(LANES):
        d_x = x[lane] - from_x[lane]
        d_y = y[lane] - from_y[lane]
        n_x = normal_x[lane]
        n_y = normal_y[lane]
        s = sine[lane]
        c = cosine[lane]
        u = d_x * c + d_y * s - mid_x[lane]
        v = d_y * c - d_x * s - mid_y[lane]
        a = n_x * c + n_y * s
        b = n_y * c - n_x * s
        gap = -(a * u + b * v) - abs(a) * half_x[lane] - abs(b) * half_y[lane]
        so_far = unmasked(apart[lane])
        apart[lane] = gap if gap > so_far else so_far
        low = least_x[lane]
        high = most_x[lane]
        right = least_y[lane]
        left = most_y[lane]
        least_x[lane] = u if u < low else low
        most_x[lane] = u if u > high else high
        least_y[lane] = v if v < right else right
        most_y[lane] = v if v > left else left


@stage
def beyond_box(box, sides, apart):
    """Raise `apart` to how far all corners are beyond a side of a body's box."""
    half_x, half_y = box[1], box[3]
    least_x, most_x, least_y, most_y = sides[0], sides[1], sides[2], sides[3]
    for lane in range(LANES):
        ahead = least_x[lane]
        behind = -most_x[lane]
        left = least_y[lane]
        right = -most_y[lane]
        along = (ahead if ahead > behind else behind) - half_x[lane]
        across = (left if left > right else right) - half_y[lane]
        gap = along if along > across else across
        so_far = unmasked(apart[lane])
        apart[lane] = gap if gap > so_far else so_far


@stage
def look_ahead(first, second, reach, axle, pose, from_x, from_y, far):
    """The axles' places, and how far from them any point of the bodies can be during a step."""
    x, y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    real = far.dtype.type
    for lane in range(LANES):
        from_x[lane] = x[lane] + axle[lane] * cosine[lane]
        from_y[lane] = y[lane] + axle[lane] * sine[lane]
        far[lane] = reach[lane] + abs(first[lane]) + abs(second[lane]) + real(1e-4)


@stage
def sizes_asked(asked, around, reach, length, turn):
    """Add the lengths that a part of a step asks for [m]: straight on, and of the farthest point by turning."""
    real = length.dtype.type
    for lane in range(LANES):
        length[lane] = length[lane] + abs(asked[lane])
        turn[lane] = turn[lane] + abs(around[lane]) * (real(TWO_PI) * reach[lane])


@stage
def flag_near_shapes(shape, lanes, flag):
    """Flag robots that some obstacle or open wall is near enough to be met by in the step."""
    real = lanes.low.dtype.type
    p, spare = lanes.p, lanes.spare
    x, y, far, most, apart, box, sides = (
        spare[1], spare[2], spare[3], spare[4], spare[5], spare[6:10], spare[10:14],
    )  # fmt: skip
    moved, bounds = lanes.moved, p[shape.row_bounds : shape.row_bounds + 4]
    swept(moved[0], moved[1], moved[2], moved[3], p[shape.row_reach], bounds, box)
    look_ahead(
        lanes.moved[0], lanes.moved[2], p[shape.row_reach], p[shape.row_drive + 2], lanes.pose, x, y, far
    )
    for q in range(shape.row_shape.size):
        n, first = shape.shape_corners[q], shape.row_shape[q]
        radius = first + PER_CORNER * n
        if n == 1:
            flag_near_disc(p[first], p[first + 1], p[radius], x, y, far, flag)
        else:
            fill(most, real(-FAR))
            fill(apart, real(-FAR))
            for side in range(4):
                fill(sides[side], real(-FAR if side & 1 else FAR))
            for corner in range(n):
                row = first + PER_CORNER * corner
                beyond_face(p[row], p[row + 1], p[row + 2], p[row + 3], x, y, most)
                box_from_corner(
                    p[row], p[row + 1], p[row + 2], p[row + 3], x, y, lanes.pose, box, sides, apart
                )
            if n == 2:
                beyond_ends(p[first], p[first + 1], p[first + 2], p[first + 3], p[first + 4], x, y, most)
            beyond_box(box, sides, apart)
            flag_near(most, apart, p[radius], far, flag)
