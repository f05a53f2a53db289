"""Robots that may touch something in a step, gathered from a block, so that only they pay for contact."""

from __future__ import annotations

from ._compile import kernel, stage
from ._lanes import LANES
from ._math import TWO_PI
from ._sim_lanes import NEAR
from ._sim_shape import WHEELS

FAR = 1e9  # farther than anything [m]
IS_NEAR, TOUCHES = 1.0, 2.0  # flags of robots that may touch something in a step, or do so at its end


@kernel
def list_near(flag, first, near_lane):
    """List lanes that are flagged, from `first` on, at most NEAR; returns how many, and where to go on.

    Where most lanes are, it lists all, in their order: rows are then copied many at a time.
    """
    n = 0
    lane = first
    while lane < LANES and n < NEAR:
        if flag[lane] > 0:
            near_lane[n] = lane
            n += 1
        lane += 1
    for k in range(n, NEAR):
        near_lane[k] = near_lane[max(n - 1, 0)]
    return n, lane


@stage
def _copy_side_by_side(source, first, target):
    for k in range(NEAR):
        target[k] = source[first + k]


@kernel
def _copy_rows(source, lane, together, rows, to_rows, target):
    for row in range(rows, to_rows):
        if together:
            _copy_side_by_side(source[row], lane[0], target[row])
        else:
            for k in range(NEAR):
                target[row, k] = source[row, lane[k]]


@stage
def _to_axle(x, y, sine, cosine, axle, to_x, to_y):
    for k in range(NEAR):
        to_x[k] = x[k] + axle[k] * cosine[k]
        to_y[k] = y[k] + axle[k] * sine[k]


@stage
def copy_poses(pose, other):
    """The same poses in another place."""
    for k in range(NEAR):
        other.x[k] = pose.x[k]
        other.y[k] = pose.y[k]
        other.heading[k] = pose.heading[k]
        other.sine[k] = pose.sine[k]
        other.cosine[k] = pose.cosine[k]


@kernel
def gather(shape, lanes, near, together):
    """Copy what contact needs of the lanes that `near.lane` lists; poses become those of the axle."""
    lane = near.lane
    for part in range(shape.part_corners.size):
        radius = shape.row_part[part] + 2 * shape.part_corners[part]
        _copy_rows(lanes.p, lane, together, radius, radius + 1, near.p)
    _copy_rows(lanes.p, lane, together, shape.row_contact, shape.row_contact + 4, near.p)
    axle = shape.row_drive + 2
    _copy_rows(lanes.p, lane, together, axle, axle + 1, near.p)
    _copy_rows(lanes.p, lane, together, shape.row_outline[0], shape.row_ray, near.p)
    if shape.row_shape.size > 0:
        _copy_rows(lanes.p, lane, together, shape.row_shape[0], shape.n_all_rows, near.p)
    _copy_rows(lanes.moved, lane, together, 0, 4, near.moved)
    pose = lanes.pose
    real = near.low.dtype.type
    for k in range(NEAR):
        near.low[k] = real(0.0) if lanes.spare[0, lane[k]] == real(TOUCHES) else real(FAR)
        near.pose.x[k] = pose.x[lane[k]]
        near.pose.y[k] = pose.y[lane[k]]
        near.pose.heading[k] = pose.heading[lane[k]]
        near.pose.sine[k] = pose.sine[lane[k]]
        near.pose.cosine[k] = pose.cosine[lane[k]]
    _to_axle(
        near.pose.x, near.pose.y, near.pose.sine, near.pose.cosine, near.p[axle], near.pose.x, near.pose.y
    )


@kernel
def scatter(shape, lanes, near, n):
    """Where flagged robots are after the step, and 0 to `lanes.low` where they stall, 1 elsewhere."""
    real = lanes.low.dtype.type
    axle = near.p[shape.row_drive + 2]
    to = lanes.proposed
    for k in range(n):
        lane = near.lane[k]
        if lanes.spare[0, lane] == real(0.0):
            continue
        lanes.low[lane] = near.gap[k]
        if near.low[k] <= real(0.0) or shape.mixing == WHEELS:
            to.x[lane] = near.pose.x[k] - axle[k] * near.pose.cosine[k]
            to.y[lane] = near.pose.y[k] - axle[k] * near.pose.sine[k]
            to.heading[lane] = near.pose.heading[k]
            to.sine[lane] = near.pose.sine[k]
            to.cosine[lane] = near.pose.cosine[k]


@stage
def flag_near_disc(x, y, radius, from_x, from_y, far, flag):
    """Flag where a disc is nearer to points than `far`."""
    real = flag.dtype.type
    for lane in range(LANES):
        dx = from_x[lane] - x[lane]
        dy = from_y[lane] - y[lane]
        reach = far[lane] + radius[lane]
        before = flag[lane]
        near = (before < real(IS_NEAR)) & (dx * dx + dy * dy <= reach * reach)
        flag[lane] = real(IS_NEAR) if near else before


@stage
def beyond_face(x, y, normal_x, normal_y, from_x, from_y, most):
    """Raise `most` to how far points are beyond the line through a face."""
    for lane in range(LANES):
        gap = normal_x[lane] * (from_x[lane] - x[lane]) + normal_y[lane] * (from_y[lane] - y[lane])
        so_far = most[lane]
        most[lane] = gap if gap > so_far else so_far


@stage
def beyond_ends(x, y, normal_x, normal_y, length, from_x, from_y, most):
    """Raise `most` to how far points are beyond the ends of an edge, along it."""
    for lane in range(LANES):
        along = normal_x[lane] * (from_y[lane] - y[lane]) - normal_y[lane] * (from_x[lane] - x[lane])
        gap = along - length[lane]
        gap = gap if gap > -along else -along
        so_far = most[lane]
        most[lane] = gap if gap > so_far else so_far


@stage
def flag_near(most, radius, far, flag):
    """Flag where `most` is below `far`."""
    real = flag.dtype.type
    for lane in range(LANES):
        before = flag[lane]
        near = (before < real(IS_NEAR)) & (most[lane] - radius[lane] <= far[lane])
        flag[lane] = real(IS_NEAR) if near else before


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
    """What a part of a step asks for, as lengths [m]: straight on, and of the farthest point by turning."""
    real = length.dtype.type
    for lane in range(NEAR):
        length[lane] = length[lane] + abs(asked[lane])
        turn[lane] = turn[lane] + abs(around[lane]) * (real(TWO_PI) * reach[lane])
