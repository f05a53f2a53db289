"""The response of a body that meets a wall or an obstacle, in lanes.

`freeze`: the whole step is refused (Jyro). `stop`: translation is refused, turning goes on where the body allows it.
`slide`: the body is pushed free of the deepest two contacts, and turns and skids along them (`push.py`).
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import kernel, shared_stage, stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.elementary import TWO_PI
from realitygap.kernels.math.lanes import LANES, any_above_zero, copy_row, fill, keep_where_low

from .drive import AXLE, along_arc, arc_of
from .near import TOUCHES, copy_poses, flag_near_shapes, sizes_asked, to_axles
from .outline import FAR
from .push import CLEAR, SATURATION, give_way, go, saturated, unsaturated
from .shape import FREEZE, SLIDE, WHEELS
from .touch import count_touching, touch
from .turn import sin_cos_of
from .walls import choose_walls, clearance, face_nearest_wall

STALL_SHARE = 0.5  # of what was asked, of which less is done where a robot stalls
SLIGHT = 0.05  # of all that was asked, below which nothing stalls
N_SECANTS = 4  # of grip, each to the slip that the one before leads to
N_RESCUES = 4  # straight pushes at the end of a step before it is refused
OPPOSED = -0.6  # cosine of the angle between the normals of two pushes, below which a body is wedged


@stage
def _flag_touching(low, flag):
    real = flag.dtype.type
    for lane in range(LANES):
        flag[lane] = real(TOUCHES) if low[lane] <= real(0.0) else real(0.0)


@stage
def _divide(length, turn, part, arc):
    """Compute the arc of each of equal parts of a motion.

    Args:
        length, turn: Of the whole motion [m, turns].
        part: Share of the motion in a part.
        arc: (4, LANES) written: chord [m], sine and cosine of half the turn, and the turn [turns].
    """
    chord, half_sine, half_cosine, turned = arc[0], arc[1], arc[2], arc[3]
    real = length.dtype.type
    for k in range(LANES):
        around = turn[k] * real(part)
        to, s, c = arc_of(length[k] * real(part), around)
        chord[k] = to
        half_sine[k] = s
        half_cosine[k] = c
        turned[k] = around


@stage
def _go_part(arc, pose, before):
    """Apply a part of a motion to poses of axles, and keep the poses before it."""
    chord, half_sine, half_cosine, turn = arc[0], arc[1], arc[2], arc[3]
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    old_x, old_y, old_heading = before.x, before.y, before.heading
    old_sine, old_cosine = before.sine, before.cosine
    for k in range(LANES):
        was_x = x[k]
        was_y = y[k]
        was = heading[k]
        was_s = sine[k]
        was_c = cosine[k]
        dx, dy, turned, s, c = along_arc(chord[k], half_sine[k], half_cosine[k], turn[k], was, was_s, was_c)
        old_x[k] = was_x
        old_y[k] = was_y
        old_heading[k] = was
        old_sine[k] = was_s
        old_cosine[k] = was_c
        x[k] = was_x + dx
        y[k] = was_y + dy
        heading[k] = turned
        sine[k] = s
        cosine[k] = c


@stage
def _note_touch(gap, low):
    for k in range(LANES):
        least = unmasked(low[k])
        now = gap[k]
        low[k] = now if now < least else least


@stage
def _push_straight(contact, facing_before, beside_before, pose, active):
    """Move bodies that touch something straight away from it, except wedged ones, and flag those that moved.

    A body is wedged if it came from the opposite side. It stays where it is, and is wedged at the next call, too.

    Args:
        contact: The deepest contact.
        facing_before, beside_before: Normal of the last push, written; 0 before the first push.
        pose: Written.
        active: Written.
    """
    x, y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    gap, facing, beside = contact.gap, contact.facing, contact.beside
    real = gap.dtype.type
    for k in range(LANES):
        now = gap[k]
        a = facing[k]
        b = beside[k]
        is_wedged = a * facing_before[k] + b * beside_before[k] < real(OPPOSED)
        moves = (now <= real(0.0)) & (not is_wedged)
        deep = real(CLEAR) - now if moves else real(0.0)
        x[k] = x[k] + deep * (a * cosine[k] - b * sine[k])
        y[k] = y[k] + deep * (a * sine[k] + b * cosine[k])
        facing_before[k] = -a if is_wedged else a
        beside_before[k] = -b if is_wedged else b
        active[k] = real(TOUCHES) if moves else real(0.0)


@stage
def _put_back_places(gap, before, pose):
    keep = gap
    real = gap.dtype.type
    x, y, old_x, old_y = pose.x, pose.y, before.x, before.y
    for k in range(LANES):
        now_x = unmasked(x[k])
        now_y = y[k]
        was_x = old_x[k]
        was_y = old_y[k]
        back = keep[k] <= real(0.0)
        x[k] = was_x if back else now_x
        y[k] = was_y if back else now_y


@stage
def _put_back_turns(gap, before, pose):
    real = gap.dtype.type
    heading, sine, cosine = pose.heading, pose.sine, pose.cosine
    old_heading, old_sine, old_cosine = before.heading, before.sine, before.cosine
    for k in range(LANES):
        now = unmasked(heading[k])
        now_s = sine[k]
        now_c = cosine[k]
        was = old_heading[k]
        was_s = old_sine[k]
        was_c = old_cosine[k]
        back = gap[k] <= real(0.0)
        heading[k] = was if back else now
        sine[k] = was_s if back else now_s
        cosine[k] = was_c if back else now_c


@stage
def _note_done(length, turn, before, pose, went, turned):
    """Add what a part of a step did of what it was asked: along the heading halfway, and around."""
    real = went.dtype.type
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    old_x, old_y, old_heading = before.x, before.y, before.heading
    old_sine, old_cosine = before.sine, before.cosine
    for k in range(LANES):
        c = real(0.5) * (cosine[k] + old_cosine[k])
        s = real(0.5) * (sine[k] + old_sine[k])
        forward = (x[k] - old_x[k]) * c + (y[k] - old_y[k]) * s
        angle = heading[k] - old_heading[k]
        angle = angle - np.floor(angle + real(0.5))
        went[k] = went[k] + (forward if length[k] >= real(0.0) else -forward)
        turned[k] = turned[k] + (angle if turn[k] >= real(0.0) else -angle)


@stage
def _judge(reach, length, turn, went, turned, low, stall):
    """0 where a robot stalls: less was done than a share of what was asked, and it touched something."""
    real = low.dtype.type
    for k in range(LANES):
        asked = length[k]
        around = turn[k]
        slight = real(SLIGHT) * (asked + around)
        lost = asked - went[k]
        lost = lost if lost < asked else asked
        held = around - turned[k] * (real(TWO_PI) * reach[k])
        held = held if held < around else around
        blocked = (lost > real(STALL_SHARE) * asked + slight) | (held > real(STALL_SHARE) * around + slight)
        stall[k] = real(0.0) if (low[k] <= real(0.0)) & blocked else real(1.0)


@kernel
def _push(shape, p, seconds, parts, near):
    """Push bodies free of the things that they touch after one of `parts` parts of a motion."""
    row = shape.row_contact
    unsaturated(p, row, near.give)
    times = N_SECANTS if any_above_zero(p[row + SATURATION]) else 0
    for time in range(times + 1):
        if time > 0:
            saturated(p, row, seconds, parts, near.moved, near.give)
        give_way(near.first, near.second, p[row], near.give, near.pose, near.before, near.pushes, near.moved)
    go(near.moved, near.pose)


@kernel
def _answer_part(shape, p, seconds, parts, near, sweep):
    """Give way after a part of a step, `sweep` times before; returns whether what touches then is of interest."""
    if shape.contact == FREEZE:
        return False
    if shape.contact == SLIDE:
        _push(shape, p, seconds, parts, near)
        return False
    _put_back_places(near.first.gap, near.before, near.pose)
    if sweep == 1:
        _put_back_turns(near.first.gap, near.before, near.pose)
    return sweep == 0


@kernel
def _leave_free(near, sweep):
    """Push what still touches something straight out, and where that fails go back to the beginning of the step.

    Returns:
        Whether to look again, at what was pushed.
    """
    if sweep == 0:
        for row in range(2):
            fill(near.pushes[row], near.low.dtype.type(0.0))
    if sweep < N_RESCUES:
        _push_straight(near.first, near.pushes[0], near.pushes[1], near.pose, near.active)
        if any_above_zero(near.active):
            return True
    _put_back_places(near.first.gap, near.start, near.pose)
    _put_back_turns(near.first.gap, near.start, near.pose)
    return False


@kernel
def _resolve(shape, lanes, near):
    """Execute a step of robots that may touch something.

    In parts; in each of them, and once more at the end, the bodies give way until nothing touches, or long enough.
    All is one loop for the sake of a single place that asks what touches: that is most of the code.
    """
    p, reach = lanes.p, lanes.p[shape.row_reach]
    length, turn, went, turned = near.effort[0], near.effort[1], near.effort[2], near.effort[3]
    for k in range(4):
        fill(near.effort[k], reach.dtype.type(0.0))
    copy_poses(near.pose, near.start)
    copy_row(lanes.spare[0], near.active)
    fill(near.first.gap, reach.dtype.type(FAR))
    fill(near.second.gap, reach.dtype.type(FAR))
    early = shape.substeps
    if shape.mixing == WHEELS:
        early = shape.late_substeps if shape.late else 0
    last = early + shape.substeps
    part, sweep = 0, 0
    while True:
        row = 2 if part >= early else 0
        asked, around = lanes.moved[row], lanes.moved[row + 1]
        parts, seconds = (early if part < early else shape.substeps), lanes.lasts[row // 2]
        if sweep == 0 and part < last:
            if part == 0 or part == early:
                sizes_asked(asked, around, reach, length, turn)
                _divide(asked, around, 1.0 / parts, near.arc)
            _go_part(near.arc, near.pose, near.before)
        if shape.contact == FREEZE and shape.mixing != WHEELS and part == early - 1:
            part += 1  # Jyro looks where a step ends, and not before it turns there
            continue
        if part == last and shape.enclosed:
            # Straight pushes turn nothing.
            clearance(shape, p, near.pose, sweep == 0, near, near.active, near.first.gap)
            choose_walls(shape, p, near)
        if part == last and shape.enclosed and shape.row_shape.size == 0:
            # A straight push follows the normal of the nearest wall, and needs no corner.
            face_nearest_wall(near)
            n_touching = count_touching(near.first.gap)
        else:
            n_touching = touch(shape, p, near)
        again = False
        if n_touching > 0:
            _note_touch(near.first.gap, near.low)
            again = (
                _answer_part(shape, p, seconds, parts, near, sweep)
                if part < last
                else _leave_free(near, sweep)
            )
        if again:
            if part < last:
                # What does not touch has not moved.
                _flag_touching(near.first.gap, near.active)
            sweep += 1
            continue
        if part < last and shape.contact != FREEZE:
            _note_done(asked, around, near.before, near.pose, went, turned)
        if sweep > 0:
            copy_row(lanes.spare[0], near.active)
        part, sweep = part + 1, 0
        if part > last or (part == last and shape.contact == FREEZE):
            break
    if shape.contact == FREEZE:
        _put_back_places(near.low, near.start, near.pose)
        _put_back_turns(near.low, near.start, near.pose)
        _stall_of_touch(near.low, near.first.gap)
        return
    _judge(reach, length, turn, went, turned, near.low, near.first.gap)


@stage
def _stall_of_touch(low, stall):
    real = low.dtype.type
    for k in range(LANES):
        stall[k] = real(0.0) if low[k] <= real(0.0) else real(1.0)


@stage
def _begin(flag, low):
    real = low.dtype.type
    for lane in range(LANES):
        low[lane] = real(0.0) if flag[lane] == real(TOUCHES) else real(1.0)


@stage
def _end(flag, touched, stall, axle, pose, low, proposed):
    """Write the poses after the step of flagged robots that touched something; 0 to `low` if they stall, else 1."""
    real = low.dtype.type
    x, y, heading = pose.x, pose.y, pose.heading
    to_x, to_y, to_heading = proposed.x, proposed.y, proposed.heading
    to_sine, to_cosine = proposed.sine, proposed.cosine
    for lane in range(LANES):
        angle = heading[lane]
        s, c = sin_cos_of(angle)
        new_x = x[lane] - axle[lane] * c
        new_y = y[lane] - axle[lane] * s
        free_x = to_x[lane]
        free_y = to_y[lane]
        free_angle = to_heading[lane]
        free_s = to_sine[lane]
        free_c = to_cosine[lane]
        stalls = stall[lane]
        met = (flag[lane] > real(0.0)) & (touched[lane] <= real(0.0))
        low[lane] = stalls if met else real(1.0)
        to_x[lane] = new_x if met else free_x
        to_y[lane] = new_y if met else free_y
        to_heading[lane] = angle if met else free_angle
        to_sine[lane] = s if met else free_s
        to_cosine[lane] = c if met else free_c


@kernel
def _meet(shape, lanes, near):
    """Execute the step of the lanes flagged in the first row of `spare`."""
    flag, axle = lanes.spare[0], lanes.p[shape.row_drive + AXLE]
    if not any_above_zero(flag):
        return
    if shape.enclosed:
        choose_walls(shape, lanes.p, near)
    to_axles(lanes.pose, axle, near.pose)
    _begin(flag, near.low)
    _resolve(shape, lanes, near)
    _end(flag, near.low, near.first.gap, axle, near.pose, lanes.low, lanes.proposed)


@stage
def _note_stalls(low, stalled, n_stalls):
    real = low.dtype.type
    for lane in range(LANES):
        so_far = n_stalls[lane]
        hit = low[lane] <= real(0.0)
        stalled[lane] = real(1.0) if hit else real(0.0)
        n_stalls[lane] = np.int32(so_far + np.int32(1 if hit else 0))


@stage
def _accept(pose, proposed):
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    to_x, to_y, to_heading = proposed.x, proposed.y, proposed.heading
    to_sine, to_cosine = proposed.sine, proposed.cosine
    for lane in range(LANES):
        x[lane] = to_x[lane]
        y[lane] = to_y[lane]
        heading[lane] = to_heading[lane]
        sine[lane] = to_sine[lane]
        cosine[lane] = to_cosine[lane]


@shared_stage
def settle(shape, lanes, near):
    """Go where the step would end as far as contact allows."""
    pose, proposed, low = lanes.pose, lanes.proposed, lanes.low
    to_axles(proposed, lanes.p[shape.row_drive + AXLE], near.pose)
    fill(near.active, low.dtype.type(1.0))
    clearance(shape, lanes.p, near.pose, True, near, near.active, low)
    if shape.contact == FREEZE and shape.row_shape.size == 0:
        _note_stalls(low, lanes.stalled, lanes.n_stalls)
        keep_where_low(low, pose.x, proposed.x)
        keep_where_low(low, pose.y, proposed.y)
        keep_where_low(low, pose.heading, proposed.heading)
        keep_where_low(low, pose.sine, proposed.sine)
        keep_where_low(low, pose.cosine, proposed.cosine)
        return
    _flag_touching(low, lanes.spare[0])
    if shape.row_shape.size > 0:
        flag_near_shapes(shape, lanes, lanes.spare[0])
    _meet(shape, lanes, near)
    _note_stalls(low, lanes.stalled, lanes.n_stalls)
    _accept(pose, proposed)
