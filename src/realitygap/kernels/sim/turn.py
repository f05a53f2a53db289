"""Sines and cosines of bodies that turn, as exact as the precision shows.

In single precision with fewer terms than `math.elementary.sin_cos_of_turns`, whose bits the platform `jyro` keeps.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined
from realitygap.kernels.math.bits import is_single
from realitygap.kernels.math.elementary import TWO_PI, sin_cos_of_turns


@inlined
def _short_sin_cos(turns):
    real = type(turns)
    quadrant = np.floor(turns * real(4.0) + real(0.5))
    r = (turns - quadrant * real(0.25)) * real(TWO_PI)
    z = r * r
    s = real(-1.0 / 5040.0) + z * real(1.0 / 362880.0)
    s = real(1.0 / 120.0) + z * s
    s = real(-1.0 / 6.0) + z * s
    sine = r + r * z * s
    c = real(-1.0 / 720.0) + z * real(1.0 / 40320.0)
    c = real(1.0 / 24.0) + z * c
    cosine = real(1.0) - real(0.5) * z + z * z * c
    turn = np.int32(quadrant)
    first = cosine if turn & 1 else sine
    second = sine if turn & 1 else cosine
    return -first if turn & 2 else first, -second if (turn + 1) & 2 else second


@inlined
def sin_cos_of(turns):
    """Sine and cosine of an angle in whole turns, within 1.5 units in the last place of 1."""
    if is_single(turns):
        return _short_sin_cos(turns)
    return sin_cos_of_turns(turns)


@inlined
def sin_cos_of_small(angle):
    """Sine and cosine of an angle of at most 0.25 rad."""
    real = type(angle)
    z = angle * angle
    if is_single(angle):
        s = real(1.0 / 120.0) - z * real(1.0 / 5040.0)
        c = real(1.0 / 24.0) - z * real(1.0 / 720.0)
    else:
        s = real(1.0 / 362880.0) - z * real(1.0 / 39916800.0)
        s = real(-1.0 / 5040.0) + z * s
        s = real(1.0 / 120.0) + z * s
        c = real(-1.0 / 3628800.0) + z * real(1.0 / 479001600.0)
        c = real(1.0 / 40320.0) + z * c
        c = real(-1.0 / 720.0) + z * c
        c = real(1.0 / 24.0) + z * c
    s = real(-1.0 / 6.0) + z * s
    return angle + angle * z * s, real(1.0) - real(0.5) * z + z * z * c


@inlined
def turned_by(sine, cosine, s, c):
    """Sine and cosine of the sum of two angles."""
    return sine * c + cosine * s, cosine * c - sine * s
