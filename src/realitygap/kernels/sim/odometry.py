"""Wheels that follow recorded commands, and an extended Kalman filter of the poses that were seen.

Source: Särkkä (2013), Bayesian Filtering and Smoothing, sections 5.2 and 12.2. Differs: the likelihood of an innovation
is Student's t distribution, so that single false poses decide nothing (Roth, Özkan & Gustafsson 2013).
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, kernel
from realitygap.kernels.math.elementary import exp, log, sin_cos

SPEED_LEFT, SPEED_RIGHT, BIAS_LEFT, BIAS_RIGHT, DEAD_BAND, SOFT_DEAD_BAND, LAG = range(7)
"""Columns of the numbers of the wheels."""
N_WHEELS = 7

TRACK, AXLE, LEFT, ZERO, DRIFT, SLIP, TRAVEL, HEADING_PER_M, HEADING_PER_S, PLACE, ANGLE, FIRST = range(12)
"""Columns of the numbers of the body and of the camera."""
N_BODY = 12

LEAST_LAG = 1e-6  # [s] below which a lag is none
LEAST_ROOM = 1e-6  # of 1 - soft dead band, by which commands are divided
FIRST_TURN = 0.3  # standard deviation of the first heading if none was seen [rad]
DEGREES = 5.0  # of freedom of an innovation
STANDS = 1e-3  # [m/s] below which a body stands, and its heading does not wander with time
SMALL = 1e-4  # half a turn [rad] below which its chord is its arc
LEAST_VARIANCE = 1e-12  # of a step [m2, rad2]


@kernel
def roll_wheels(times, commands, wheels, ways):
    """Drive wheels by recorded commands.

    A speed nears that of its command within the lag, as in `drive.py`.

    Args:
        times: (n,) ascending [s].
        commands: (n, 2) shares of full speed; each lasts until the next time.
        wheels: (m, N_WHEELS) numbers of m robots.
        ways: (m, n, 2) distance of each wheel since the start [m]; written.
    """
    for robot in range(wheels.shape[0]):
        numbers = wheels[robot]
        room = max(1.0 - numbers[SOFT_DEAD_BAND], LEAST_ROOM)
        for wheel in range(2):
            speed, way = 0.0, 0.0
            ways[robot, 0, wheel] = 0.0
            for k in range(times.shape[0] - 1):
                asked = commands[k, wheel]
                size = abs(asked) if abs(asked) > numbers[DEAD_BAND] else 0.0
                size = max(size - numbers[SOFT_DEAD_BAND], 0.0) / room
                target = 0.0
                if size > 0.0:
                    target = size * numbers[SPEED_LEFT + wheel]
                    target = (target if asked > 0.0 else -target) + numbers[BIAS_LEFT + wheel]
                lasts = times[k + 1] - times[k]
                if numbers[LAG] > LEAST_LAG:
                    left = exp(-lasts / numbers[LAG])
                    short = speed - target
                    way += target * lasts + short * numbers[LAG] * (1.0 - left)
                    speed = target + short * left
                else:  # also of a lag below 0, which a search may try: the limit of a short lag
                    way += target * lasts + (speed - target) * numbers[LAG]
                    speed = target
                ways[robot, k + 1, wheel] = way


@kernel
def read_late(times, ways, late, seen):
    """Write the distances as they were some time before each time; they rise evenly after the end.

    Args:
        times: (n,) ascending [s].
        ways: (m, n, 2) distances at these times [m].
        late: (m,) time before [s].
        seen: (m, n, 2) distances then [m]; written.
    """
    n = times.shape[0]
    for robot in range(ways.shape[0]):
        row = 0
        for k in range(n):
            at = times[k] - late[robot]
            while row < n - 2 and times[row + 1] <= at:
                row += 1
            share = (at - times[row]) / (times[row + 1] - times[row])
            for wheel in range(2):
                before, after = ways[robot, row, wheel], ways[robot, row + 1, wheel]
                # before the first time the robot stood
                seen[robot, k, wheel] = before + (after - before) * share if share > 0.0 else before


@inlined
def _observe(state, spread, axis, by_heading, error, variance):
    """Take one observation, and return the variance of its innovation.

    Args:
        state, spread: (3,) and (3, 3), changed.
        axis: 0 for x, 1 for y, 2 for the heading.
        by_heading: Derivative of x or y by the heading [m]; 0 for the heading.
        error: Innovation.
        variance: Of the observation.
    """
    r0 = spread[axis, 0] + by_heading * spread[2, 0]
    r1 = spread[axis, 1] + by_heading * spread[2, 1]
    r2 = spread[axis, 2] + by_heading * spread[2, 2]
    own = r0 if axis == 0 else (r1 if axis == 1 else r2)
    total = own + by_heading * r2 + variance
    pull = 1.0 / total
    g0, g1, g2 = r0 * pull, r1 * pull, r2 * pull
    state[0] += g0 * error
    state[1] += g1 * error
    state[2] += g2 * error
    spread[0, 0] -= g0 * r0
    spread[0, 1] -= g0 * r1
    spread[0, 2] -= g0 * r2
    spread[1, 1] -= g1 * r1
    spread[1, 2] -= g1 * r2
    spread[2, 2] -= g2 * r2
    spread[1, 0], spread[2, 0], spread[2, 1] = spread[0, 1], spread[0, 2], spread[1, 2]
    return total


@kernel
def filter_poses(times, poses, ways, bodies, room, logs, off):
    """Filter the poses of a log with the distances of its wheels.

    Args:
        times: (n,) ascending [s].
        poses: (n, 3) x [m], y [m], heading [rad] of what was seen; nan if not seen.
        ways: (m, n, 2) distances of the wheels, of m robots [m].
        bodies: (m, N_BODY) numbers of the bodies, of their noise as standard deviations, and of the camera.
        room: (4, 3) for the state and its covariance; changed.
        logs: (m, n) log likelihood of each row's pose; written, 0 if none was seen.
        off: (m, n, 3) what was seen less what was predicted, along and across the heading [m] and of the heading
            [rad], since the last row that was seen; written, nan if none was seen.
    """
    n = times.shape[0]
    first = 0
    while first < n - 1 and not np.isfinite(poses[first, 0]):
        first += 1
    state, spread = room[0], room[1:]
    for robot in range(ways.shape[0]):
        body = bodies[robot]
        forward, sideways = -body[AXLE], body[LEFT]
        logs[robot] = 0.0
        off[robot] = np.nan
        has_heading = np.isfinite(poses[first, 2])
        state[2] = poses[first, 2] - body[ZERO] if has_heading else body[FIRST]
        sine, cosine = sin_cos(state[2])
        state[0] = poses[first, 0] - forward * cosine + sideways * sine
        state[1] = poses[first, 1] - forward * sine - sideways * cosine
        place, angle = body[PLACE] ** 2, body[ANGLE] ** 2
        spread[:] = 0.0
        spread[0, 0] = spread[1, 1] = place
        spread[2, 2] = angle if has_heading else FIRST_TURN**2
        for k in range(first, n - 1):
            left = (ways[robot, k + 1, 0] - ways[robot, k, 0]) * (1.0 - body[SLIP])
            right = (ways[robot, k + 1, 1] - ways[robot, k, 1]) * (1.0 - body[SLIP])
            length = 0.5 * (left + right)
            turn = (right - left) / body[TRACK] + body[DRIFT] * length
            way = 0.5 * (abs(left) + abs(right))
            lasts = times[k + 1] - times[k]
            sine_half, cosine_half = sin_cos(0.5 * turn)
            chord = length * (2.0 * sine_half / turn if abs(turn) > SMALL else 1.0)
            sine, cosine = sin_cos(state[2] + 0.5 * turn)
            state[0] += chord * cosine
            state[1] += chord * sine
            state[2] += turn
            a, b = -chord * sine, chord * cosine
            # the covariance of the heading enters those of the place
            c02, c12, c22 = spread[0, 2], spread[1, 2], spread[2, 2]
            spread[0, 0] += 2.0 * a * c02 + a * a * c22
            spread[0, 1] += b * c02 + a * c12 + a * b * c22
            spread[1, 1] += 2.0 * b * c12 + b * b * c22
            spread[0, 2] = c02 + a * c22
            spread[1, 2] = c12 + b * c22
            travel = body[TRAVEL] ** 2 * way + LEAST_VARIANCE
            wander = body[HEADING_PER_M] ** 2 * way + LEAST_VARIANCE
            if way > STANDS * lasts:
                wander += body[HEADING_PER_S] ** 2 * lasts
            # half of a false turn bends the step
            spread[0, 0] += travel * cosine * cosine + 0.25 * wander * a * a
            spread[0, 1] += travel * cosine * sine + 0.25 * wander * a * b
            spread[1, 1] += travel * sine * sine + 0.25 * wander * b * b
            spread[0, 2] += 0.5 * wander * a
            spread[1, 2] += 0.5 * wander * b
            spread[2, 2] += wander
            spread[1, 0], spread[2, 0], spread[2, 1] = spread[0, 1], spread[0, 2], spread[1, 2]
            seen = poses[k + 1]
            if not np.isfinite(seen[0]):
                continue
            sine, cosine = sine * cosine_half + cosine * sine_half, cosine * cosine_half - sine * sine_half
            by0, by1 = -forward * sine - sideways * cosine, forward * cosine - sideways * sine
            x, y = seen[0] - state[0] - by1, seen[1] - state[1] + by0
            beside, before = state[1], state[2]
            off[robot, k + 1, 0] = x * cosine + y * sine
            off[robot, k + 1, 1] = y * cosine - x * sine
            totals = _observe(state, spread, 0, by0, x, place)
            squares = 1.0 + x * x / (DEGREES * totals)
            y -= state[1] - beside + by1 * (state[2] - before)
            total = _observe(state, spread, 1, by1, y, place)
            totals *= total
            squares *= 1.0 + y * y / (DEGREES * total)
            if np.isfinite(seen[2]):
                error = seen[2] - body[ZERO] - before
                error -= 2.0 * np.pi * np.floor((error + np.pi) / (2.0 * np.pi))
                off[robot, k + 1, 2] = error
                error -= state[2] - before
                total = _observe(state, spread, 2, 0.0, error, angle)
                totals *= total
                squares *= 1.0 + error * error / (DEGREES * total)
            logs[robot, k + 1] = -0.5 * (log(totals) + (DEGREES + 1.0) * log(squares))
