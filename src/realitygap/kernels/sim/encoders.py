"""Wheel encoders, and the pose that a program reckons from them.

An encoder counts what its wheel turned, times a gain, with an error whose variance grows with the way driven: so
it is the same however the way is cut into steps. The reckoned heading drifts by a rate per meter of way besides.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import stage
from realitygap.kernels.math.elementary import TWO_PI, normal, sin_cos_of_turns
from realitygap.kernels.math.lanes import LANES


@stage
def read_encoder(wheel, before, gain, noise, word, counted, step):
    """Count what a wheel did since the last step.

    Args:
        wheel: (LANES,) driven since the start [m].
        before: The same at the last step; changed to `wheel`.
        gain: Of the encoder.
        noise: Standard deviation per square root of a meter [m^0.5].
        word: Random.
        counted: What the encoder says in all [m]; changed.
        step: What it says of this step [m]; written.
    """
    for lane in range(LANES):
        now = wheel[lane]
        way = now - before[lane]
        said = way * gain[lane] + noise[lane] * np.sqrt(abs(way)) * normal(word[lane], way)
        step[lane] = said
        total = counted[lane]
        counted[lane] = total + said
        before[lane] = now


@stage
def reckon(left, right, track, axle, drift, reckoned):
    """Advance the reckoned pose of the body's origin by what the encoders say of a step.

    The axle's middle goes (left + right) / 2 along the heading midway through the step, and the heading turns by
    (right - left) / track + drift * |way|.

    Args:
        left, right: (LANES,) [m].
        track: Between the wheels [m].
        axle: How far the axle is ahead of the origin [m].
        drift: [turns/m].
        reckoned: (3, LANES) x, y [m], heading [turns], from (0, 0, 0) at the start; changed.
    """
    real = track.dtype.type
    x, y, heading = reckoned[0], reckoned[1], reckoned[2]
    for lane in range(LANES):
        way = real(0.5) * (left[lane] + right[lane])
        turn = (right[lane] - left[lane]) / (track[lane] * real(TWO_PI)) + drift[lane] * abs(way)
        old = heading[lane]
        s0, c0 = sin_cos_of_turns(old)
        s1, c1 = sin_cos_of_turns(old + real(0.5) * turn)
        new = old + turn
        new = new - np.floor(new + real(0.5))
        s2, c2 = sin_cos_of_turns(new)
        ahead = axle[lane]
        to_x = x[lane] + way * c1 + ahead * (c0 - c2)
        to_y = y[lane] + way * s1 + ahead * (s0 - s2)
        x[lane] = to_x
        y[lane] = to_y
        heading[lane] = new


@stage
def as_input(step, speed, step_s, value):
    """Compute an encoder's input to a network: the last step's count as a part of full speed, limited to -1..1."""
    real = value.dtype.type
    for lane in range(LANES):
        full = speed[lane] * real(step_s)
        one = step[lane] / (full if full > real(0.0) else real(1.0))
        one = one if one < real(1.0) else real(1.0)
        value[lane] = one if one > real(-1.0) else real(-1.0)
