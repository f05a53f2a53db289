"""From commands to motion, in lanes: wheel speeds, delay, lag, noise, and the arc of a step."""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, stage
from realitygap.kernels.jyro.trial import as_command, draw_lanes, wheels_to_commands
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.elementary import TWO_PI, exp, normal
from realitygap.kernels.math.lanes import LANES, any_above_zero, copy_row

from .shape import DRIVE_NUMBERS, INDEPENDENT
from .turn import sin_cos_of, turned_by

SPEED, TRACK, AXLE, TURN_RATE, GAIN_LEFT, GAIN_RIGHT, BIAS_LEFT, BIAS_RIGHT = range(8)
DEAD_BAND, LAG, DELAY, DELAY_JITTER, SLIP, TRAVEL_PER_M, TRAVEL_PER_S = range(8, 15)
HEADING_PER_M, HEADING_PER_S, DRIFT_PER_M, BATTERY_SAG, RISE, SOFT_DEAD_BAND = range(15, len(DRIVE_NUMBERS))

LEAST_LAG = 1e-9  # [s] what stands for no lag, which would be divided by
SMALL_TURN = 1e-3  # half a turn [rad] below which sin(x) / x is taken from its series
STANDS = 1e-3  # [m/s] below which wheels stand: a lag never ends


@stage
def _take(command, kept):
    for lane in range(LANES):
        kept[lane] = as_command(command[lane])


@stage
def take_commands(move, turn, lanes):
    """Keep the commands of a step, limited to -1..1."""
    _take(move, lanes.commands[0])
    _take(turn, lanes.commands[1])


@stage
def take_answers(neat, lanes):
    """Keep the commands that the networks ask for, limited to -1..1."""
    one, two = lanes.values[neat.n_inputs], lanes.values[neat.n_inputs + 1]
    if neat.drives_wheels:
        wheels_to_commands(one, two, lanes.commands[0], lanes.commands[1])
    else:
        take_commands(one, two, lanes)


@inlined
def _alive(command, dead_band):
    return command if abs(command) > dead_band else type(command)(0.0)


@stage
def _mix_wheels(move, turn, ahead, dead_band, left, right):
    """Left = move - turn, right = move + turn, each limited to -1..1; the wheels are those of the body's frame."""
    real = left.dtype.type
    sign = real(ahead)
    for lane in range(LANES):
        forward = sign * move[lane]
        left[lane] = _alive(as_command(forward - turn[lane]), dead_band[lane])
        right[lane] = _alive(as_command(forward + turn[lane]), dead_band[lane])


@stage
def _quantize(levels, lowest, left, right):
    """The faster wheel gets the nearest speed that exists, the other one follows in proportion."""
    real = left.dtype.type
    for lane in range(LANES):
        one = left[lane]
        two = right[lane]
        faster = abs(one) if abs(one) > abs(two) else abs(two)
        level = np.floor(faster * real(levels) + real(0.5))
        level = level if (level >= real(lowest)) | (level == real(0.0)) else real(lowest)
        scale = level * real(1.0 / levels) / (faster if faster > real(0.0) else real(1.0))
        left[lane] = one * scale
        right[lane] = two * scale


@stage
def _soften(soft, wheel):
    """A wheel stands up to a soft dead band, and its speed rises from 0 there to full."""
    real = wheel.dtype.type
    for lane in range(LANES):
        asked = wheel[lane]
        size = abs(asked) - soft[lane]
        room = real(1.0) - soft[lane]
        has_room = room > real(0.0)
        size = size / (room if has_room else real(1.0))
        moves = (size > real(0.0)) & has_room
        size = size if moves else real(0.0)
        wheel[lane] = size if asked > real(0.0) else -size


@stage
def _to_speeds(speed, sag, seconds, gain_left, gain_right, bias_left, bias_right, left, right):
    real = left.dtype.type
    for lane in range(LANES):
        charge = real(1.0) - sag[lane] * real(seconds)
        full = speed[lane] * (charge if charge > real(0.0) else real(0.0))
        one = left[lane]
        two = right[lane]
        left[lane] = full * gain_left[lane] * one + (bias_left[lane] if one != real(0.0) else real(0.0))
        right[lane] = full * gain_right[lane] * two + (bias_right[lane] if two != real(0.0) else real(0.0))


@stage
def _mix_independent(move, turn, ahead, dead_band, speed, turn_rate, track, left, right):
    """A speed and a turn rate, as the speeds of wheels in parts of the full one."""
    real = left.dtype.type
    for lane in range(LANES):
        forward = real(ahead) * _alive(move[lane], dead_band[lane])
        half = real(0.5 * TWO_PI) * track[lane] * turn_rate[lane] * _alive(turn[lane], dead_band[lane])
        half = half / speed[lane]
        left[lane] = forward - half
        right[lane] = forward + half


@stage
def _ask(shape, rules, lanes, step):
    """The wheels' speeds that the commands of a step ask for, into the latest of `targets`."""
    p, d, targets = lanes.p, shape.row_drive, lanes.targets
    for k in range(targets.shape[0] - 1, 1, -1):
        copy_row(targets[k - 2], targets[k])
    move, turn, left, right = lanes.commands[0], lanes.commands[1], targets[0], targets[1]
    if shape.mixing == INDEPENDENT:
        _mix_independent(
            move, turn, shape.ahead, p[d + DEAD_BAND], p[d + SPEED], p[d + TURN_RATE], p[d + TRACK], left, right
        )  # fmt: skip
    else:
        _mix_wheels(move, turn, shape.ahead, p[d + DEAD_BAND], left, right)
        if shape.levels > 0:
            _quantize(shape.levels, shape.lowest_level, left, right)
    if any_above_zero(p[d + SOFT_DEAD_BAND]):
        _soften(p[d + SOFT_DEAD_BAND], left)
        _soften(p[d + SOFT_DEAD_BAND], right)
    _to_speeds(
        p[d + SPEED], p[d + BATTERY_SAG], step * rules.step_s, p[d + GAIN_LEFT], p[d + GAIN_RIGHT],
        p[d + BIAS_LEFT], p[d + BIAS_RIGHT], left, right,
    )  # fmt: skip


@stage
def _wait(words, delay, jitter, seconds, steps, late, rest):
    """Compute the number of whole steps by which commands are late, and the time left of the old one in this step."""
    real = rest.dtype.type
    for lane in range(LANES):
        odd = np.int32(np.int32(words[lane] >> np.uint32(8)) * np.int32(2) + np.int32(1 - (1 << 24)))
        whole = delay[lane] + jitter[lane] * (real(odd) * real(1.0 / (1 << 24)))
        whole = whole if whole > real(0.0) else real(0.0)
        n = np.floor(whole / real(seconds))
        n = n if n < real(steps) else real(steps)
        time = whole - n * real(seconds)
        late[lane] = n
        rest[lane] = time if time < real(seconds) else real(seconds)


@stage
def _pick(late, place, asked, picked):
    real = late.dtype.type
    for lane in range(LANES):
        before = unmasked(picked[lane])
        this = asked[lane]
        picked[lane] = this if late[lane] == real(place) else before


@stage
def _fade(lag, time, rest):
    """Compute the share of a difference in speed that is left after a time, 0..1."""
    real = rest.dtype.type
    for lane in range(LANES):
        slow = lag[lane] if lag[lane] > real(LEAST_LAG) else real(LEAST_LAG)
        rest[lane] = exp(-time[lane] / slow)


@stage
def _rise(left, right, was_left, was_right, full, rise, time, level, first, last, rising, steady):
    """For how long wheels rise to the speeds that they are asked for, and from and to what.

    The faster wheel's speed rises from what it was to what it is to be at a constant rate, and falls at once; the other
    one's follows in proportion. Both begin anew where either turns the other way.

    Args:
        left, right: Speeds asked for [m/s].
        was_left, was_right: Those asked for before; changed.
        full: Speed at full command [m/s].
        rise: Time in which it rises from 0 to that [s].
        time: How long wheels go [s].
        level: Of the faster wheel, 1: full speed; changed.
        first, last: Written: parts of the speeds asked for, at the beginning and at the end of the rise.
        rising, steady: Written: how long it lasts, and how long wheels go after it [s].
    """
    real = level.dtype.type
    for lane in range(LANES):
        one = left[lane]
        two = right[lane]
        faster = abs(one) if abs(one) > abs(two) else abs(two)
        top = full[lane]
        end = faster / (top if top > real(0.0) else real(1.0))
        turns = (one * was_left[lane] < real(0.0)) | (two * was_right[lane] < real(0.0))
        before = level[lane]
        begin = before if before < end else end
        begin = real(0.0) if turns else begin
        slow = rise[lane]
        whole = time[lane]
        needed = (end - begin) * slow
        is_done = needed <= whole
        lasts = needed if is_done else whole
        reached = end if is_done else begin + whole / (slow if slow > real(0.0) else real(1.0))
        scale = real(1.0) / (end if end > real(0.0) else real(1.0))
        first[lane] = begin * scale
        last[lane] = real(1.0) if is_done else reached * scale
        rising[lane] = lasts
        steady[lane] = whole - lasts
        # A command that lasts no time is none.
        goes = whole > real(0.0)
        level[lane] = reached if goes else before
        was_left[lane] = one if goes else was_left[lane]
        was_right[lane] = two if goes else was_right[lane]


@stage
def _roll_up(target, lag, first, last, time, rest, speed, way, total):
    """Wheels follow a speed asked for that rises evenly; what they travel is the exact integral.

    Args:
        target: Speed that it rises to [m/s].
        lag: [s].
        first, last, time: Of `_rise`.
        rest: Of `_fade`.
        speed: Of the wheel [m/s]; changed.
        way: Written [m].
        total: Since the start [m]; changed.
    """
    real = speed.dtype.type
    for lane in range(LANES):
        slow = lag[lane] if lag[lane] > real(LEAST_LAG) else real(LEAST_LAG)
        lasts = time[lane]
        rises = lasts > real(0.0)
        begin = target[lane] * first[lane]
        end = target[lane] * last[lane]
        # A wheel that has followed for long is late by the lag: so much slower than what it is asked for.
        late = (end - begin) / (lasts if rises else real(1.0)) * slow
        old = speed[lane]
        new = end - late + (old - begin + late) * rest[lane]
        new = new if rises else old
        length = real(0.5) * (begin + end) * lasts - slow * (new - old)
        way[lane] = length
        total[lane] = total[lane] + length
        speed[lane] = new


@stage
def _roll(target, lag, time, rest, speed, travel, total):
    """Wheels near their targets exponentially; what they travel is the exact integral.

    Args:
        target: Speed asked for [m/s].
        lag: [s].
        time: How long [s].
        rest: Of `_fade`.
        speed: Of the wheel [m/s]; changed.
        travel: Written [m].
        total: Since the start [m]; changed.
    """
    real = speed.dtype.type
    for lane in range(LANES):
        slow = lag[lane] if lag[lane] > real(LEAST_LAG) else real(LEAST_LAG)
        asked = target[lane]
        short = speed[lane] - asked
        left = rest[lane]
        length = asked * time[lane] + short * slow * (real(1.0) - left)
        travel[lane] = length
        total[lane] = total[lane] + length
        speed[lane] = asked + short * left


@stage
def _to_motion(left, right, slip, track, drift, length, turn):
    real = length.dtype.type
    for lane in range(LANES):
        grip = real(1.0) - slip[lane]
        one = left[lane] * grip
        two = right[lane] * grip
        middle = real(0.5) * (one + two)
        length[lane] = middle
        turn[lane] = (two - one) / (real(TWO_PI) * track[lane]) + drift[lane] * middle


@stage
def _shake(words, left, right, other_left, other_right, seconds, per_m, per_s, noise):
    """Noise of a step that the wheels drive, whose variance grows with the way, and with the time unless they stand."""
    real = noise.dtype.type
    for lane in range(LANES):
        way = real(0.5) * (
            abs(left[lane]) + abs(right[lane]) + (abs(other_left[lane]) + abs(other_right[lane]))
        )
        time = real(seconds) if way > real(STANDS * seconds) else real(0.0)
        variance = per_m[lane] * per_m[lane] * way + per_s[lane] * per_s[lane] * time
        noise[lane] = np.sqrt(variance) * normal(words[lane], variance)


@stage
def _share(rest, seconds, noise, first, second):
    real = noise.dtype.type
    for lane in range(LANES):
        part = rest[lane] / real(seconds)
        moved = noise[lane]
        before = part * moved
        first[lane] = first[lane] + before
        second[lane] = second[lane] + (moved - before)


@stage
def _add_to(other, row):
    for lane in range(LANES):
        row[lane] = row[lane] + other[lane]


@stage
def _subtract(seconds, rest, left):
    real = left.dtype.type
    for lane in range(LANES):
        left[lane] = real(seconds) - rest[lane]


@stage
def _set(row, value):
    real = row.dtype.type
    for lane in range(LANES):
        row[lane] = real(value)


@stage
def _go(lanes, row, left, right, time, rises, left_way, right_way):
    """Wheels go for a time at the speeds that they are asked for, as they rise and lag.

    Args:
        lanes: State of the wheels is changed.
        row: First number of the drive.
        left, right: Speeds asked for [m/s].
        time: [s].
        rises: Whether any speed takes time to rise.
        left_way, right_way: Written [m].
    """
    lag, spare, fade = lanes.p[row + LAG], lanes.spare, lanes.spare[3]
    steady = time
    if rises:
        first, last, rising, steady = spare[14], spare[15], spare[16], spare[17]
        _rise(
            left, right, lanes.asked[0], lanes.asked[1], lanes.p[row + SPEED], lanes.p[row + RISE], time,
            lanes.level, first, last, rising, steady,
        )  # fmt: skip
        _fade(lag, rising, fade)
        _roll_up(left, lag, first, last, rising, fade, lanes.speeds[0], spare[18], lanes.wheels[0])
        _roll_up(right, lag, first, last, rising, fade, lanes.speeds[1], spare[19], lanes.wheels[1])
    _fade(lag, steady, fade)
    _roll(left, lag, steady, fade, lanes.speeds[0], left_way, lanes.wheels[0])
    _roll(right, lag, steady, fade, lanes.speeds[1], right_way, lanes.wheels[1])
    if rises:
        _add_to(spare[18], left_way)
        _add_to(spare[19], right_way)


@stage
def plan(shape, rules, key, lanes, step):
    """Compute the motion that a step's commands ask for, into `lanes.moved`; wheels and their speeds continue.

    Args:
        shape, rules, key: Structure, how trials are run, and of the random numbers.
        lanes: Commands, numbers and state are read; state, `moved` and `lasts` written.
        step: Number of the step.
    """
    p, d, spare, moved, targets = lanes.p, shape.row_drive, lanes.spare, lanes.moved, lanes.targets
    late, rest, going = spare[0], lanes.lasts[0], lanes.lasts[1]
    rises = any_above_zero(p[d + RISE])
    _ask(shape, rules, lanes, step)
    if shape.noisy:
        draw_lanes(step, lanes.drive_counters, key, lanes.words)
    if shape.late:
        if not shape.noisy:
            for lane in range(LANES):
                lanes.words[0, lane] = np.uint32(1 << 31)
        _wait(lanes.words[0], p[d + DELAY], p[d + DELAY_JITTER], rules.step_s, shape.delay_steps, late, rest)
        for wheel in range(2):
            copy_row(targets[wheel], spare[4 + wheel])
            copy_row(targets[2 + wheel], spare[6 + wheel])
            for k in range(1, shape.delay_steps + 1):
                _pick(late, k, targets[2 * k + wheel], spare[4 + wheel])
                _pick(late, k, targets[2 * k + 2 + wheel], spare[6 + wheel])
        _go(lanes, d, spare[6], spare[7], rest, rises, spare[8], spare[9])
    else:
        _set(rest, 0.0)
        for wheel in range(2):
            copy_row(targets[wheel], spare[4 + wheel])
            _set(spare[8 + wheel], 0.0)
    _subtract(rules.step_s, rest, going)
    _go(lanes, d, spare[4], spare[5], going, rises, spare[10], spare[11])
    if shape.late:
        _to_motion(spare[8], spare[9], p[d + SLIP], p[d + TRACK], p[d + DRIFT_PER_M], moved[0], moved[1])
    else:
        _set(moved[0], 0.0)
        _set(moved[1], 0.0)
    _to_motion(spare[10], spare[11], p[d + SLIP], p[d + TRACK], p[d + DRIFT_PER_M], moved[2], moved[3])
    if shape.noisy:
        _shake(
            lanes.words[1], spare[8], spare[9], spare[10], spare[11], rules.step_s,
            p[d + TRAVEL_PER_M], p[d + TRAVEL_PER_S], spare[12],
        )  # fmt: skip
        _shake(
            lanes.words[2], spare[8], spare[9], spare[10], spare[11], rules.step_s,
            p[d + HEADING_PER_M], p[d + HEADING_PER_S], spare[13],
        )  # fmt: skip
        if shape.late:
            _share(rest, rules.step_s, spare[12], moved[0], moved[2])
            _share(rest, rules.step_s, spare[13], moved[1], moved[3])
        else:
            _add_to(spare[12], moved[2])
            _add_to(spare[13], moved[3])
    if shape.mixing == INDEPENDENT:
        # First straight on, then around.
        _add_to(moved[2], moved[0])
        _add_to(moved[1], moved[3])
        _set(moved[1], 0.0)
        _set(moved[2], 0.0)
        _set(rest, rules.step_s)
        _set(going, rules.step_s)


@inlined
def arc_of(length, turn):
    """Return the chord of an arc, and sine and cosine of half its turn.

    The chord is length * sin(h) / h, h being half the turn [rad].
    """
    real = type(length)
    half = real(0.5) * turn
    s, c = sin_cos_of(half)
    angle = half * real(TWO_PI)
    small = abs(angle) < real(SMALL_TURN)
    chord = length * (
        real(1.0) - angle * angle * real(1.0 / 6.0) if small else s / (real(1.0) if small else angle)
    )
    return chord, s, c


@inlined
def along_arc(chord, s, c, turn, heading, sine, cosine):
    """Return the displacement of a point that drives an arc, and its heading there with sine and cosine.

    Args:
        chord, s, c: Result of `arc_of`; the chord has the direction halfway.
        turn: [turns].
        heading, sine, cosine: Before the arc.
    """
    real = type(chord)
    middle_s, middle_c = turned_by(sine, cosine, s, c)
    turned = heading + turn
    turned = turned - np.floor(turned + real(0.5))
    new_sine, new_cosine = turned_by(middle_s, middle_c, s, c)
    return chord * middle_c, chord * middle_s, turned, new_sine, new_cosine


@inlined
def _arc_step(length, turn, heading, sine, cosine):
    chord, s, c = arc_of(length, turn)
    return along_arc(chord, s, c, turn, heading, sine, cosine)


@stage
def _face(pose):
    """Recompute sines and cosines from the headings, so that errors do not add up over steps."""
    heading, sine, cosine = pose.heading, pose.sine, pose.cosine
    for lane in range(LANES):
        s, c = sin_cos_of(heading[lane])
        sine[lane] = s
        cosine[lane] = c


@stage
def _arc(length, turn, axle, pose, proposed):
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    to_x, to_y, to_heading = proposed.x, proposed.y, proposed.heading
    to_sine, to_cosine = proposed.sine, proposed.cosine
    for lane in range(LANES):
        dx, dy, turned, s, c = _arc_step(length[lane], turn[lane], heading[lane], sine[lane], cosine[lane])
        # The axle drives the arc; the origin turns around it.
        to_x[lane] = x[lane] + dx + axle[lane] * (cosine[lane] - c)
        to_y[lane] = y[lane] + dy + axle[lane] * (sine[lane] - s)
        to_heading[lane] = turned
        to_sine[lane] = s
        to_cosine[lane] = c


@stage
def _arc_on(length, turn, axle, pose):
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    for lane in range(LANES):
        old_s = sine[lane]
        old_c = cosine[lane]
        dx, dy, turned, s, c = _arc_step(length[lane], turn[lane], heading[lane], old_s, old_c)
        x[lane] = x[lane] + dx + axle[lane] * (old_c - c)
        y[lane] = y[lane] + dy + axle[lane] * (old_s - s)
        heading[lane] = turned
        sine[lane] = s
        cosine[lane] = c


@stage
def _straight_then_turn(length, turn, axle, pose, proposed):
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    to_x, to_y, to_heading = proposed.x, proposed.y, proposed.heading
    to_sine, to_cosine = proposed.sine, proposed.cosine
    real = x.dtype.type
    for lane in range(LANES):
        turned = heading[lane] + turn[lane]
        turned = turned - np.floor(turned + real(0.5))
        to_heading[lane] = turned
        sine_now, cosine_now = sin_cos_of(turned)
        to_x[lane] = x[lane] + length[lane] * cosine[lane] + axle[lane] * (cosine[lane] - cosine_now)
        to_y[lane] = y[lane] + length[lane] * sine[lane] + axle[lane] * (sine[lane] - sine_now)
        to_sine[lane] = sine_now
        to_cosine[lane] = cosine_now


@stage
def drive(shape, rules, key, lanes, step):
    """Compute the poses to which a step would carry the robots, if nothing is in the way, into `lanes.proposed`.

    Commands that are a speed and a turn rate have the body go along its old heading, and then turn, as Jyro's
    do; wheels have it drive an arc.

    Args:
        shape, rules, key, lanes, step: As in `plan`.
    """
    plan(shape, rules, key, lanes, step)
    moved, axle = lanes.moved, lanes.p[shape.row_drive + AXLE]
    if shape.mixing == INDEPENDENT:
        _straight_then_turn(moved[0], moved[3], axle, lanes.pose, lanes.proposed)
        return
    if shape.late:
        _arc(moved[0], moved[1], axle, lanes.pose, lanes.proposed)
        _arc_on(moved[2], moved[3], axle, lanes.proposed)
    else:
        _arc(moved[2], moved[3], axle, lanes.pose, lanes.proposed)
    _face(lanes.proposed)
