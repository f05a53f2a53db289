"""The physics of a push: the motion of bodies that touch something and give way, in lanes.

At the deepest two contacts, the wall pushes along its normal n and rubs along its tangent t. The body moves by
A * wrench until it is free. If the grip of its wheels is proportional to their slip, A = diag(long, lat, ang) in the
frame of its axle. If the grip saturates, each wheel contributes half of A with the secant to its own grip. So a robot
turns about the wheel with the better grip.

Source: the wrench n - mu * sign(slip) * t, and A, of quasi-static pushing; secants, which lead to the motion of least
dissipation, as iteratively reweighted least squares (Weiszfeld 1937). Differs: friction holds the contact point if
less than mu times the normal push is enough for that (Coulomb). A full push against the slip would drag the body back.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, kernel, stage
from realitygap.kernels.math.elementary import TWO_PI
from realitygap.kernels.math.lanes import LANES, fill

from .shape import CONTACT_NUMBERS
from .turn import sin_cos_of_small, turned_by

LONG, LAT, ANG, SATURATION = (CONTACT_NUMBERS.index(name) for name in ("long", "lat", "ang", "saturation"))
CLEAR = 2e-6  # how far a body that was pushed is free [m]: above what rounding does in single precision
LEAST_GIVE = 0.05  # of what a body gives without friction: less would throw it far off
MOST_TURN = 0.25  # by which one push turns a body [rad]
SHORTEST = 1e-6  # time of a part in which anything slips [s]


@inlined
def _held_up(deep, slip, friction, nn, tt, nt):
    """Return the push and the rub of a contact that free it of `deep`, and of `slip` as far as friction can.

    Args:
        deep, slip: Distance to move along the normal, and distance slipped along the tangent [m].
        friction: Coefficient of friction.
        nn, tt, nt: Motion of the body by unit forces, as `_gives` returns it.
    """
    real = type(deep)
    # Friction holds it: no slip is left. Both are divided by `whole` later.
    whole = nn * tt - nt * nt
    hold_n = deep * tt + slip * nt
    hold_t = -slip * nn - deep * nt
    holds = (abs(hold_t) <= friction * hold_n) & (whole > real(0.0))
    # It does not: it rubs with all it has, against the slip that there would be without it.
    side = real(-1.0) if hold_t < real(0.0) else real(1.0)
    gives = nn + side * friction * nt
    least = real(LEAST_GIVE) * nn
    gives = gives if gives > least else least
    scale = real(1.0) / (whole if holds else gives)
    scale = scale if deep > real(0.0) else real(0.0)
    push = (hold_n if holds else deep) * scale
    rub = (hold_t if holds else side * friction * deep) * scale
    return push, rub


@inlined
def _gives(along, across, around, both, a, b, turn_n, turn_t):
    """Return a body's motion by unit forces: normal by a normal one, tangential by a tangential one, and mixed.

    Args:
        along, across, around, both: Motion by a force of 1 ahead and by one to the left, turn by a torque of 1, and
            turn by the force ahead.
        a, b: Normal of the contact.
        turn_n, turn_t: Torques of normal and tangent.
    """
    real = type(a)
    nn = along * a * a + across * b * b + around * turn_n * turn_n + real(2.0) * both * a * turn_n
    tt = along * b * b + across * a * a + around * turn_t * turn_t - real(2.0) * both * b * turn_t
    nt = (across - along) * a * b + around * turn_n * turn_t + both * (a * turn_t - b * turn_n)
    return nn, tt, nt


@inlined
def _moves(along, across, around, both, ahead, aside, torque):
    """Return the motion of a body by a wrench."""
    return along * ahead + both * torque, across * aside, around * torque + both * ahead


@inlined
def _between(angle):
    """Return an angle limited to +-MOST_TURN, which is in the range of `sin_cos_of_small`."""
    real = type(angle)
    most = real(MOST_TURN)
    angle = angle if angle < most else most
    return angle if angle > -most else -most


@stage
def unsaturated(p, row, give):
    """Compute a body's give if its wheels' grip is proportional to slip: along, across, around, and around by along."""
    long, lat, ang = p[row + LONG], p[row + LAT], p[row + ANG]
    along, across, around, both = give[0], give[1], give[2], give[3]
    real = both.dtype.type
    for k in range(LANES):
        along[k] = long[k]
        across[k] = lat[k]
        around[k] = ang[k]
        both[k] = real(0.0)


@stage
def saturated(p, row, seconds, parts, moved, give):
    """Compute the give of bodies whose wheels slipped as far as a push moved them: more slip means less grip.

    A wheel's grip is slip / sqrt(1 + (saturation * speed of slip) ** 2). Slip to the side counts sqrt(long / lat)
    times, as it does without saturation. The function uses the secant to the previous slip. Repeated calls lead to the
    slip of least dissipation.

    Args:
        p, row: Numbers of the robots, and the first row of contact.
        seconds, parts: (LANES,) duration of the motion [s], and number of its parts.
        moved: Result of `give_way`.
        give: Written, in the form of `unsaturated`.
    """
    long, lat, ang, saturation = p[row + LONG], p[row + LAT], p[row + ANG], p[row + SATURATION]
    go_x, go_y, spin = moved[0], moved[1], moved[2]
    along, across, around, both = give[0], give[1], give[2], give[3]
    real = both.dtype.type
    for k in range(LANES):
        l_x = long[k]
        l_y = lat[k]
        g = ang[k]
        time = seconds[k] / real(parts)
        rate = saturation[k] / (time if time > real(SHORTEST) else real(SHORTEST))
        half = np.sqrt(l_x / g) * spin[k]
        left = go_x[k] - half
        right = go_x[k] + half
        aside = go_y[k] * go_y[k] / l_y * l_x
        left = np.sqrt(real(1.0) + (left * left + aside) * rate * rate)
        right = np.sqrt(real(1.0) + (right * right + aside) * rate * rate)
        mean = real(0.5) * (left + right)
        along[k] = l_x * mean
        across[k] = l_y * left * right / mean
        around[k] = g * mean
        both[k] = real(0.5) * (right - left) * np.sqrt(l_x * g)


@stage
def _turn_alone(first, friction, give, pose, before, spins):
    """Compute the turn by the deepest contact alone, with bodies halfway through their free motion [rad]."""
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    old_x, old_y, old_heading = before.x, before.y, before.heading
    gap, facing, beside, corner_x, corner_y, rounding = first
    along, across, around, both = give[0], give[1], give[2], give[3]
    real = gap.dtype.type
    for k in range(LANES):
        g = around[k]
        l_x = along[k]
        l_y = across[k]
        w = both[k]
        d_x = x[k] - old_x[k]
        d_y = y[k] - old_y[k]
        turned = heading[k] - old_heading[k]
        turned = (turned - np.floor(turned + real(0.5))) * real(TWO_PI)
        deep = real(CLEAR) - gap[k]
        by_s, by_c = sin_cos_of_small(_between(real(-0.5) * turned))
        h_s, h_c = turned_by(sine[k], cosine[k], by_s, by_c)
        a = by_c * facing[k] + by_s * beside[k]
        b = by_c * beside[k] - by_s * facing[k]
        turn_n = corner_x[k] * b - corner_y[k] * a
        turn_t = corner_x[k] * a + corner_y[k] * b - rounding[k]
        nn, tt, nt = _gives(l_x, l_y, g, w, a, b, turn_n, turn_t)
        slip = (d_y * h_c - d_x * h_s) * a - (d_x * h_c + d_y * h_s) * b + turned * turn_t
        push, rub = _held_up(deep, slip, friction[k], nn, tt, nt)
        spins[k] = g * (push * turn_n + rub * turn_t) + w * (push * a - rub * b)


@stage
def _stand_halfway(pose, before, spins, half_sine, half_cosine, halfway):
    """Compute headings and motion of bodies halfway through their motion with the push of `_turn_alone`.

    Args:
        pose, before: Arguments of `give_way`.
        spins: Result of `_turn_alone`.
        half_sine, half_cosine: Written: sine and cosine of the heading halfway.
        halfway: (5, LANES) written: sine and cosine of the turn to there; the free motion along and across [m], and
            around [rad], in the frame halfway.
    """
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    old_x, old_y, old_heading = before.x, before.y, before.heading
    to_s, to_c, along, across, around = halfway[0], halfway[1], halfway[2], halfway[3], halfway[4]
    real = half_sine.dtype.type
    for k in range(LANES):
        d_x = x[k] - old_x[k]
        d_y = y[k] - old_y[k]
        turned = heading[k] - old_heading[k]
        turned = (turned - np.floor(turned + real(0.5))) * real(TWO_PI)
        by_s, by_c = sin_cos_of_small(_between(real(0.5) * (spins[k] - turned)))
        h_s, h_c = turned_by(sine[k], cosine[k], by_s, by_c)
        to_s[k] = by_s
        to_c[k] = by_c
        along[k] = d_x * h_c + d_y * h_s
        across[k] = d_y * h_c - d_x * h_s
        around[k] = turned
        half_sine[k] = h_s
        half_cosine[k] = h_c


@stage
def _see_halfway(contact, give, halfway, held):
    """Compute the values of a contact with bodies at the poses of `_stand_halfway`.

    Args:
        contact, give: Arguments of `give_way`.
        halfway: Result of `_stand_halfway`.
        held: (8, LANES) written: normal; torques of normal and tangent; result of `_gives`; slip.
    """
    facing, beside, corner_x, corner_y, rounding = contact[1:]
    along, across, around, both = give[0], give[1], give[2], give[3]
    to_s, to_c, go_x, go_y, turned = halfway[0], halfway[1], halfway[2], halfway[3], halfway[4]
    to_a, to_b, to_n, to_t, to_nn, to_tt, to_nt, to_slip = (
        held[0], held[1], held[2], held[3], held[4], held[5], held[6], held[7],
    )  # fmt: skip
    for k in range(LANES):
        by_s = to_s[k]
        by_c = to_c[k]
        a = by_c * facing[k] + by_s * beside[k]
        b = by_c * beside[k] - by_s * facing[k]
        turn_n = corner_x[k] * b - corner_y[k] * a
        turn_t = corner_x[k] * a + corner_y[k] * b - rounding[k]
        nn, tt, nt = _gives(along[k], across[k], around[k], both[k], a, b, turn_n, turn_t)
        to_a[k] = a
        to_b[k] = b
        to_n[k] = turn_n
        to_t[k] = turn_t
        to_nn[k] = nn
        to_tt[k] = tt
        to_nt[k] = nt
        to_slip[k] = go_y[k] * a - go_x[k] * b + turned[k] * turn_t


@stage
def _push_by(gap, friction, give, held, go_x, go_y, spin, next_x, next_y, next_spin):
    """Compute the motion by one contact, given the motion by the other one.

    Args:
        gap: Gap of the contact.
        friction, give: Arguments of `give_way`.
        held: Result of `_see_halfway`.
        go_x, go_y, spin: Motion by the other contact: along and across [m], around [rad].
        next_x, next_y, next_spin: Written: motion by this one.
    """
    along, across, around, both = give[0], give[1], give[2], give[3]
    of_a, of_b, of_n, of_t, of_nn, of_tt, of_nt, of_slip = (
        held[0], held[1], held[2], held[3], held[4], held[5], held[6], held[7],
    )  # fmt: skip
    real = gap.dtype.type
    for k in range(LANES):
        a = of_a[k]
        b = of_b[k]
        turn_n = of_n[k]
        turn_t = of_t[k]
        x = go_x[k]
        y = go_y[k]
        turn = spin[k]
        deep = (real(CLEAR) - gap[k]) - (x * a + y * b + turn * turn_n)
        slip = of_slip[k] + (y * a - x * b + turn * turn_t)
        push, rub = _held_up(deep, slip, friction[k], of_nn[k], of_tt[k], of_nt[k])
        x, y, turn = _moves(
            along[k], across[k], around[k], both[k], push * a - rub * b, push * b + rub * a,
            push * turn_n + rub * turn_t,
        )  # fmt: skip
        next_x[k] = x
        next_y[k] = y
        next_spin[k] = turn


@stage
def _move_by_both(gap, go_x, go_y, spin, next_x, next_y, next_spin, to_x, to_y, to_spin):
    """Add the motions by both contacts, limited to a turn of MOST_TURN; 0 in lanes whose deepest one does not touch."""
    real = gap.dtype.type
    for k in range(LANES):
        turn = spin[k] + next_spin[k]
        size = abs(turn)
        limit = real(MOST_TURN) / (size if size > real(MOST_TURN) else real(MOST_TURN))
        limit = limit if gap[k] <= real(0.0) else real(0.0)
        to_x[k] = (go_x[k] + next_x[k]) * limit
        to_y[k] = (go_y[k] + next_y[k]) * limit
        to_spin[k] = turn * limit


@kernel
def give_way(first, second, friction, give, pose, before, pushes, moved):
    """Compute the push that frees touching bodies at their deepest two contacts, in the frames of their axles.

    The pushes depend on the turn of the body during the motion. So they are computed at the pose halfway, which is
    estimated with a push by the deepest contact alone. Then the two are computed in turn, each with the motion by the
    other. There are several short loops, because a processor overlaps vectors of a loop only if its body is short.

    Args:
        first, second: The deepest two contacts.
        friction: Coefficient of friction.
        give: (4, LANES) result of `unsaturated` or `saturated`.
        pose, before: Pose after and before the free motion.
        pushes: (28, LANES) working memory.
        moved: (5, LANES) written: along and across [m], around [rad], sine and cosine of the heading halfway.
    """
    real = first.gap.dtype.type
    held, next_held, one, two, halfway = pushes[:8], pushes[8:16], pushes[16:19], pushes[19:22], pushes[22:27]
    _turn_alone(first, friction, give, pose, before, pushes[27])
    _stand_halfway(pose, before, pushes[27], moved[3], moved[4], halfway)
    _see_halfway(first, give, halfway, held)
    _see_halfway(second, give, halfway, next_held)
    for k in range(3):
        fill(two[k], real(0.0))
    for _ in range(2):
        _push_by(first.gap, friction, give, held, two[0], two[1], two[2], one[0], one[1], one[2])
        _push_by(second.gap, friction, give, next_held, one[0], one[1], one[2], two[0], two[1], two[2])
    _move_by_both(first.gap, one[0], one[1], one[2], two[0], two[1], two[2], moved[0], moved[1], moved[2])


@stage
def go(moved, pose):
    """Apply the motion that `give_way` computed."""
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    go_x, go_y, to_spin, half_sine, half_cosine = moved[0], moved[1], moved[2], moved[3], moved[4]
    real = x.dtype.type
    for k in range(LANES):
        h_s = half_sine[k]
        h_c = half_cosine[k]
        spin = to_spin[k]
        s = sine[k]
        c = cosine[k]
        x[k] = x[k] + (go_x[k] * h_c - go_y[k] * h_s)
        y[k] = y[k] + (go_x[k] * h_s + go_y[k] * h_c)
        angle = heading[k] + spin * real(1.0 / TWO_PI)
        angle = angle - np.floor(angle + real(0.5))
        by_s, by_c = sin_cos_of_small(spin)
        new_s, new_c = turned_by(s, c, by_s, by_c)
        heading[k] = angle
        sine[k] = new_s
        cosine[k] = new_c
