"""Logarithm, exponential and the normal distribution's quantile in plain arithmetic: the same bits on every machine.

Records contain the numbers that a study draws. So this module uses no function of a mathematical library, whose last
bit differs between machines.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10  # their sum is ln 2, after fdlibm
SMALLEST = (
    2.0**-33
)  # uniform numbers count as no nearer to 0 or 1, half a step of 32 random bits: 6.4 deviations

# Numerators and denominators of three rational functions, highest power first. Source: Wichura (1988), AS 241.
_MIDDLE = (
    (
        2509.0809287301227,
        33430.57558358813,
        67265.7709270087,
        45921.95393154987,
        13731.69376550946,
        1971.5909503065513,
        133.14166789178438,
        3.3871328727963665,
    ),
    (
        5226.495278852854,
        28729.085735721943,
        39307.89580009271,
        21213.794301586597,
        5394.196021424751,
        687.1870074920579,
        42.31333070160091,
        1.0,
    ),
)
_TAIL = (
    (
        0.0007745450142783414,
        0.022723844989269184,
        0.2417807251774506,
        1.2704582524523684,
        3.6478483247632045,
        5.769497221460691,
        4.630337846156546,
        1.4234371107496835,
    ),
    (
        1.0507500716444169e-09,
        0.0005475938084995345,
        0.015198666563616457,
        0.14810397642748008,
        0.6897673349851,
        1.6763848301838038,
        2.053191626637759,
        1.0,
    ),
)
_FAR = (
    (
        2.0103343992922881e-07,
        2.7115555687434876e-05,
        0.0012426609473880784,
        0.026532189526576124,
        0.29656057182850487,
        1.7848265399172913,
        5.463784911164114,
        6.657904643501103,
    ),
    (
        2.0442631033899397e-15,
        1.421511758316446e-07,
        1.8463183175100548e-05,
        0.0007868691311456133,
        0.014875361290850615,
        0.1369298809227358,
        0.599832206555888,
        1.0,
    ),
)


def _polynomial(coefficients: tuple[float, ...], r: Floats) -> Floats:
    value = np.full_like(r, coefficients[0])
    for coefficient in coefficients[1:]:
        value = value * r + coefficient
    return value


def _ratio(functions: tuple[tuple[float, ...], tuple[float, ...]], r: Floats) -> Floats:
    return _polynomial(functions[0], r) / _polynomial(functions[1], r)


def logarithm(x: NDArray[np.float64] | np.float64) -> Floats:
    """Return the natural logarithm of positive numbers, within 4e-16 relative to the larger of it and 1."""
    mantissa, power = np.frexp(np.asarray(x, dtype=np.float64))
    small = mantissa < np.sqrt(0.5)
    mantissa, power = np.where(small, 2 * mantissa, mantissa), power - small
    s = (mantissa - 1) / (mantissa + 1)  # ln m = 2 artanh s, |s| < 0.172
    z = s * s
    series = np.zeros_like(z)
    for k in range(21, 1, -2):
        series = (series + 1.0 / k) * z
    return np.asarray(power * LN2_HIGH + (2 * s * series + power * LN2_LOW + 2 * s))


def exponential(x: NDArray[np.float64] | np.float64) -> Floats:
    """Return Euler's number to the power of numbers of moderate size (|x| < 700), within 1e-15 relative."""
    x = np.asarray(x, dtype=np.float64)
    power = np.floor(x / (LN2_HIGH + LN2_LOW) + 0.5)
    r = (x - power * LN2_HIGH) - power * LN2_LOW
    series = np.ones_like(r)
    for k in range(14, 0, -1):
        series = 1.0 + series * r / k
    return np.asarray(np.ldexp(series, power.astype(np.int64)))


def normal_quantile(u: Floats) -> Floats:
    """Return the standard normal numbers whose cumulated probability is u, within 1e-14 relative.

    Args:
        u: Any shape, 0 <= u < 1.

    Source: Wichura (1988), Algorithm AS 241 (PPND16). Differs: nothing lies beyond half a step of 32 random bits from
    0 and 1, so all numbers are within 6.5 standard deviations.
    """
    u = np.clip(np.asarray(u, dtype=np.float64), SMALLEST, 1 - SMALLEST)
    q = u - 0.5
    middle = q * _ratio(_MIDDLE, 0.180625 - q * q)
    r = np.sqrt(-logarithm(np.where(q <= 0, u, 1 - u)))
    tail = np.where(r <= 5.0, _ratio(_TAIL, r - 1.6), _ratio(_FAR, r - 5.0))
    return np.asarray(np.where(np.abs(q) <= 0.425, middle, np.where(q < 0, -tail, tail)))
