"""Elementary functions in plain arithmetic: the same bits on every machine.

Mathematical libraries differ in the last bit from machine to machine, and one bit is enough to part two
evolutions for good; so the functions that a trial needs are written out here. They work in the precision of
their argument, and without branches, so that the compiler can take many arguments side by side.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined

from .bits import is_single, power_of_two, split

# pi/2 and ln 2 as sums of three and two numbers whose products with a small integer are exact (Cody & Waite).
HALF_PI_1 = 1.57079632673412561417e00
HALF_PI_2 = 6.07710050630396597660e-11
HALF_PI_3 = 2.02226624879595063154e-21
TWO_OVER_PI = 6.36619772367581382433e-01
LN2_HIGH = 6.93145751953125e-01  # 15 bits: exact in single precision, and times any k here
LN2_LOW = 1.42860682030941723212e-06
ONE_OVER_LN2 = 1.44269504088896338700e00
TWO_PI = 6.28318530717958647693e00

LN2 = 6.93147180559945309417e-01
LOG2_E = ONE_OVER_LN2

TANH_IS_ONE = 20.0  # beyond it 1 - tanh(x) is less than half a unit in the last place


@inlined
def _sin_cos_in(quadrant, r):
    """Sine and cosine of quadrant * pi/2 + r, |r| <= pi/4, by Taylor polynomials."""
    real = type(r)
    z = r * r
    s = real(1.0 / 6227020800.0) - z * real(1.0 / 1307674368000.0)
    s = real(-1.0 / 39916800.0) + z * s
    s = real(1.0 / 362880.0) + z * s
    s = real(-1.0 / 5040.0) + z * s
    s = real(1.0 / 120.0) + z * s
    s = real(-1.0 / 6.0) + z * s
    sine = r + r * z * s
    c = real(-1.0 / 87178291200.0) + z * real(1.0 / 20922789888000.0)
    c = real(1.0 / 479001600.0) + z * c
    c = real(-1.0 / 3628800.0) + z * c
    c = real(1.0 / 40320.0) + z * c
    c = real(-1.0 / 720.0) + z * c
    c = real(1.0 / 24.0) + z * c
    cosine = real(1.0) - real(0.5) * z + z * z * c
    turn = np.int32(quadrant)
    first = cosine if turn & 1 else sine
    second = sine if turn & 1 else cosine
    return -first if turn & 2 else first, -second if (turn + 1) & 2 else second


@inlined
def sin_cos(angle):
    """Sine and cosine of an angle [rad] of moderate size (|angle| < 1e5), float64, within 1e-15."""
    quadrant = np.floor(angle * TWO_OVER_PI + 0.5)
    r = ((angle - quadrant * HALF_PI_1) - quadrant * HALF_PI_2) - quadrant * HALF_PI_3
    return _sin_cos_in(quadrant, r)


@inlined
def sin_cos_of_turns(turns):
    """Sine and cosine of an angle in whole turns, within 1.5 units in the last place of 1.

    In turns, taking away quarters is exact; so quarter turns have the sines and cosines 0, 1 and -1.
    """
    real = type(turns)
    quadrant = np.floor(turns * real(4.0) + real(0.5))
    return _sin_cos_in(quadrant, (turns - quadrant * real(0.25)) * real(TWO_PI))


@inlined
def tanh(x):
    """Hyperbolic tangent, within 3e-16 absolute (in single precision 2e-7).

    1 - 2 / (e^2x + 1), where e^2x is a Taylor polynomial times a power of two.
    """
    return tanh_of_series(x, exp_series(tanh_remainder(x)))


@inlined
def _doublings(x):
    """2 |x|, and how many whole ln 2 there are in it."""
    real = type(x)
    size = abs(x)
    double = real(2.0) * (size if size < real(TANH_IS_ONE) else real(TANH_IS_ONE))
    return double, np.floor(double * real(ONE_OVER_LN2) + real(0.5))


@inlined
def tanh_remainder(x):
    """The first of three parts of `tanh`: what whole ln 2 leave of 2 |x|."""
    real = type(x)
    double, k = _doublings(x)
    return (double - k * real(LN2_HIGH)) - k * real(LN2_LOW)


@inlined
def exp_series(r):
    """The second part: e^r, |r| <= ln 2 / 2."""
    real = type(r)
    p = real(1.0 / 479001600.0) + r * real(1.0 / 6227020800.0)
    p = real(1.0 / 39916800.0) + r * p
    p = real(1.0 / 3628800.0) + r * p
    p = real(1.0 / 362880.0) + r * p
    p = real(1.0 / 40320.0) + r * p
    p = real(1.0 / 5040.0) + r * p
    p = real(1.0 / 720.0) + r * p
    p = real(1.0 / 120.0) + r * p
    p = real(1.0 / 24.0) + r * p
    p = real(1.0 / 6.0) + r * p
    p = real(0.5) + r * p
    p = real(1.0) + r * p
    return real(1.0) + r * p


@inlined
def tanh_of_series(x, p):
    """The last part: tanh(x) from e^r."""
    real = type(x)
    _, k = _doublings(x)
    value = real(1.0) - real(2.0) / (p * power_of_two(k) + real(1.0))
    value = -value if x < real(0.0) else value
    return value if x == x else x


@inlined
def sigmoid(x):
    """The logistic function 1 / (1 + e^-x), within 2e-16 absolute (in single precision 1.2e-7)."""
    real = type(x)
    return real(0.5) + real(0.5) * tanh(real(0.5) * x)


@inlined
def _series_of_exp(r):
    """e^r, |r| <= ln 2 / 2, with as many terms as the precision shows."""
    real = type(r)
    if is_single(r):
        p = real(1.0 / 720.0) + r * real(1.0 / 5040.0)
    else:
        p = real(1.0 / 479001600.0) + r * real(1.0 / 6227020800.0)
        p = real(1.0 / 39916800.0) + r * p
        p = real(1.0 / 3628800.0) + r * p
        p = real(1.0 / 362880.0) + r * p
        p = real(1.0 / 40320.0) + r * p
        p = real(1.0 / 5040.0) + r * p
        p = real(1.0 / 720.0) + r * p
    p = real(1.0 / 120.0) + r * p
    p = real(1.0 / 24.0) + r * p
    p = real(1.0 / 6.0) + r * p
    p = real(0.5) + r * p
    p = real(1.0) + r * p
    return real(1.0) + r * p


@inlined
def exp2(x):
    """2^x within 2 units in the last place; x is limited to -126..126."""
    real = type(x)
    x = x if x < real(126.0) else real(126.0)
    x = x if x > real(-126.0) else real(-126.0)
    k = np.floor(x + real(0.5))
    return _series_of_exp((x - k) * real(LN2)) * power_of_two(k)


@inlined
def exp(x):
    """e^x within 2 units in the last place; x is limited to -87..87."""
    real = type(x)
    x = x if x < real(87.0) else real(87.0)
    x = x if x > real(-87.0) else real(-87.0)
    k = np.floor(x * real(ONE_OVER_LN2) + real(0.5))
    r = (x - k * real(LN2_HIGH)) - k * real(LN2_LOW)
    return _series_of_exp(r) * power_of_two(k)


@inlined
def log(x):
    """Natural logarithm of a normal number above zero, within 2 units in the last place.

    x = m * 2^k, and ln m = 2 artanh(s) with s = (m - 1) / (m + 1), |s| < 0.172.
    """
    real = type(x)
    m, k = split(x)
    f = m - real(1.0)
    s = f / (real(2.0) + f)
    z = s * s
    if is_single(x):
        p = real(1.0 / 7.0) + z * real(1.0 / 9.0)
    else:
        p = real(1.0 / 19.0) + z * real(1.0 / 21.0)
        p = real(1.0 / 17.0) + z * p
        p = real(1.0 / 15.0) + z * p
        p = real(1.0 / 13.0) + z * p
        p = real(1.0 / 11.0) + z * p
        p = real(1.0 / 9.0) + z * p
        p = real(1.0 / 7.0) + z * p
    p = real(1.0 / 5.0) + z * p
    p = real(1.0 / 3.0) + z * p
    # ln(1 + f) = f - s (f - 2 z p): what is added to f is small
    rest = f - real(2.0) * z * p
    return k * real(LN2_HIGH) + (f - (s * rest - k * real(LN2_LOW)))


@inlined
def normal(word, like):
    """The number of a standard normal distribution that a uniform 32-bit word stands for.

    The inverse of the distribution, within 2e-6 absolute, in the precision of `like`;
    a word and its complement give opposite numbers, so the mean over all words is exactly 0. The largest is 6.34.

    Source of the form: Giles, "Approximating the erfinv function", GPU Computing Gems 2 (2011); the coefficients
    are our own, for tails down to 2^-33.
    """
    real = type(like)
    other = np.uint32(~word)
    below = word < other
    tail = (real(np.int32(word if below else other)) + real(0.5)) * real(1.0 / 4294967296.0)
    x = real(1.0) - real(2.0) * tail
    w = -log(real(4.0) * tail * (real(1.0) - tail))
    far = w >= real(5.5)
    v = np.sqrt(w if w > real(0.0) else real(0.0)) - real(3.0) if far else w - real(2.5)
    p = real(-2.732110930e-04) if far else real(4.729262337e-07)
    p = (real(1.740405073e-03) if far else real(-4.453896187e-06)) + p * v
    p = (real(-4.809903357e-03) if far else real(-6.022083432e-06)) + p * v
    p = (real(8.132112027e-03) if far else real(3.069274266e-04)) + p * v
    p = (real(-1.088682166e-02) if far else real(-1.773825466e-03)) + p * v
    p = (real(1.334934609e-02) if far else real(-5.905282776e-03)) + p * v
    p = (real(1.416588824e00) if far else real(3.488034789e-01)) + p * v
    p = (real(4.006434441e00) if far else real(2.123313014e00)) + p * v
    z = x * p
    return -z if below else z
