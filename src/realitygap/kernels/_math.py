"""Elementary functions in plain float64 arithmetic: the same bits on every machine.

Mathematical libraries differ in the last bit from machine to machine, and one bit is enough to part two
evolutions for good; so the functions that a trial needs are written out here.
"""

from __future__ import annotations

import math

from ._compile import kernel

# pi/2 and ln 2 as sums of three and two numbers whose products with a small integer are exact (Cody & Waite).
HALF_PI_1 = 1.57079632673412561417e00
HALF_PI_2 = 6.07710050630396597660e-11
HALF_PI_3 = 2.02226624879595063154e-21
TWO_OVER_PI = 6.36619772367581382433e-01
LN2_HIGH = 6.93147180369123816490e-01
LN2_LOW = 1.90821492927058770002e-10
ONE_OVER_LN2 = 1.44269504088896338700e00
TWO_PI = 6.28318530717958647693e00

TANH_IS_ONE = 20.0  # beyond it 1 - tanh(x) is less than half a unit in the last place


@kernel
def sin_cos(angle: float) -> tuple[float, float]:
    """Sine and cosine of an angle [rad] of moderate size (|angle| < 1e5), within 1e-15.

    Taylor polynomials on [-pi/4, pi/4] after taking away the nearest multiple of pi/2.
    """
    quadrant = math.floor(angle * TWO_OVER_PI + 0.5)
    r = ((angle - quadrant * HALF_PI_1) - quadrant * HALF_PI_2) - quadrant * HALF_PI_3
    z = r * r
    s = 1.0 / 6227020800.0 - z / 1307674368000.0
    s = -1.0 / 39916800.0 + z * s
    s = 1.0 / 362880.0 + z * s
    s = -1.0 / 5040.0 + z * s
    s = 1.0 / 120.0 + z * s
    s = -1.0 / 6.0 + z * s
    sine = r + r * z * s
    c = -1.0 / 87178291200.0 + z / 20922789888000.0
    c = 1.0 / 479001600.0 + z * c
    c = -1.0 / 3628800.0 + z * c
    c = 1.0 / 40320.0 + z * c
    c = -1.0 / 720.0 + z * c
    c = 1.0 / 24.0 + z * c
    cosine = 1.0 - 0.5 * z + z * z * c
    turn = int(quadrant) & 3
    if turn == 0:
        return sine, cosine
    if turn == 1:
        return cosine, -sine
    if turn == 2:
        return -sine, -cosine
    return -cosine, sine


@kernel
def exp(x: float) -> float:
    """E to the power x, |x| < 700, within 2 units in the last place."""
    k = math.floor(x * ONE_OVER_LN2 + 0.5)
    r = (x - k * LN2_HIGH) - k * LN2_LOW
    p = 1.0 / 479001600.0 + r / 6227020800.0
    p = 1.0 / 39916800.0 + r * p
    p = 1.0 / 3628800.0 + r * p
    p = 1.0 / 362880.0 + r * p
    p = 1.0 / 40320.0 + r * p
    p = 1.0 / 5040.0 + r * p
    p = 1.0 / 720.0 + r * p
    p = 1.0 / 120.0 + r * p
    p = 1.0 / 24.0 + r * p
    p = 1.0 / 6.0 + r * p
    p = 0.5 + r * p
    p = 1.0 + r * p
    p = 1.0 + r * p
    return math.ldexp(p, int(k))


@kernel
def tanh(x: float) -> float:
    """Hyperbolic tangent, within 3e-16 absolute."""
    size = abs(x)
    if size > TANH_IS_ONE:
        value = 1.0
    else:
        value = 1.0 - 2.0 / (exp(2.0 * size) + 1.0)
    return -value if x < 0.0 else value


@kernel
def sigmoid(x: float) -> float:
    """The logistic function 1 / (1 + e^-x), within 2e-16 absolute; 0 or 1 far out."""
    return 0.5 + 0.5 * tanh(0.5 * x)


@kernel
def wrap_heading(heading: float) -> float:
    """The same direction in [0, 2 pi)."""
    wrapped = heading - TWO_PI * math.floor(heading / TWO_PI)
    # Rounding can lift a quotient just below a whole number to it, or leave a sum at the upper end.
    return wrapped if 0.0 <= wrapped < TWO_PI else 0.0
