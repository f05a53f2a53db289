"""Elementary functions against Python's, and against decimals of 45 digits where the last bit is at stake."""

from __future__ import annotations

import math
import random
from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy.special import ndtri

from realitygap.kernels.math import elementary
from tests.reference.effort import cases


def angles(n: int) -> list[float]:
    """Angles of all sizes below 1e5, and those at which the quadrant changes."""
    rng = random.Random(1)
    spread = [rng.uniform(-1, 1) * 10.0 ** rng.uniform(-8, 5) for _ in range(n)]
    turns = [quarter * math.pi / 4 for quarter in range(-40, 41)]
    beside = [math.nextafter(angle, side) for angle in turns for side in (-math.inf, math.inf)]
    return [*spread, *turns, *beside, 0.0, -0.0, 5e-324, 99_999.9, -99_999.9]


def test_sine_and_cosine_are_within_their_bound() -> None:
    for angle in angles(cases(50_000, 2_000)):
        sine, cosine = elementary.sin_cos(angle)
        assert abs(sine - math.sin(angle)) < 1e-15, angle
        assert abs(cosine - math.cos(angle)) < 1e-15, angle


def test_in_turns_quarters_are_exact_and_the_rest_within_its_bound() -> None:
    quarters = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)]
    for quarter in range(-8, 9):
        assert elementary.sin_cos_of_turns(quarter / 4) == quarters[quarter % 4]
        assert elementary.sin_cos_of_turns(np.float32(quarter / 4)) == quarters[quarter % 4]
    rng = random.Random(4)
    for _ in range(cases(50_000, 2_000)):
        turns = rng.uniform(-1, 1)
        for real, bound in ((np.float64, 1e-15), (np.float32, 1.8e-7)):
            given = real(turns)
            sine, cosine = elementary.sin_cos_of_turns(given)
            assert abs(sine - math.sin(math.tau * float(given))) < bound
            assert abs(cosine - math.cos(math.tau * float(given))) < bound


def test_single_precision_stays_single_and_within_its_bound() -> None:
    for x in numbers(cases(20_000, 1_000)):
        given = np.float32(x)
        assert abs(elementary.tanh(given) - math.tanh(float(given))) < 2e-7
        assert abs(elementary.sigmoid(given) - 0.5 - 0.5 * math.tanh(0.5 * float(given))) < 1.2e-7


def test_a_heading_of_zero_points_exactly_along_x() -> None:
    assert elementary.sin_cos(0.0) == (0.0, 1.0)


def numbers(n: int) -> list[float]:
    rng = random.Random(2)
    small = [rng.uniform(-1, 1) * 10.0 ** rng.uniform(-9, 0) for _ in range(n)]
    large = [rng.uniform(-45, 45) for _ in range(n)]
    corners = [0.0, -0.0, 5e-324, 20.0, math.nextafter(20.0, 21), -20.0, 1.5397e-4]
    return [*small, *large, *corners]


def test_tanh_and_sigmoid_are_within_their_bounds() -> None:
    with localcontext(prec=45):
        for x in numbers(cases(6_000, 300)):
            true = 1 - 2 / ((2 * Decimal(x)).exp() + 1)
            assert abs(Decimal(elementary.tanh(x)) - true) < Decimal("3e-16"), x
            true = 1 / ((-Decimal(x)).exp() + 1)
            assert abs(Decimal(elementary.sigmoid(x)) - true) < Decimal("2e-16"), x


@pytest.mark.parametrize("x", [25.0, 1e3, 1e300, math.inf])
def test_far_out_tanh_is_one_and_sigmoid_zero_or_one(x: float) -> None:
    assert (elementary.tanh(x), elementary.tanh(-x)) == (1.0, -1.0)
    assert (elementary.sigmoid(2 * x), elementary.sigmoid(-2 * x)) == (1.0, 0.0)


def test_tanh_is_odd() -> None:
    for x in numbers(500):
        assert elementary.tanh(-x) == -elementary.tanh(x)


def test_exponentials_and_logarithm_are_within_their_bounds() -> None:
    """Two units in the last place, in either precision; in double held to decimals of 45 digits."""
    rng = random.Random(7)
    with localcontext(prec=45):
        for _ in range(cases(1_500, 300)):
            x = rng.choice([rng.uniform(-1, 1), rng.uniform(-87, 87)])
            for real in (np.float64, np.float32):
                given, unit = real(x), Decimal(float(np.finfo(real).eps))
                true = Decimal(float(given)).exp()
                assert abs(Decimal(float(elementary.exp(given))) / true - 1) < 2 * unit
                assert (
                    abs(Decimal(float(elementary.exp2(given))) / Decimal(2) ** Decimal(float(given)) - 1)
                    < 2 * unit
                )
                above = real(math.exp(x))
                true = Decimal(float(above)).ln()
                assert abs(Decimal(float(elementary.log(above))) - true) <= 2 * unit * abs(true)


def test_exponentials_stay_finite_and_logarithms_exact_where_they_can() -> None:
    for real in (np.float64, np.float32):
        assert elementary.exp(real(0.0)) == elementary.exp2(real(0.0)) == 1.0
        assert [elementary.exp2(real(k)) for k in (-126, -3, 5, 126)] == [2.0**-126, 0.125, 32.0, 2.0**126]
        assert elementary.exp2(real(1e4)) == 2.0**126  # limited, as is said
        assert elementary.exp(real(1e4)) == elementary.exp(real(87.0))
        assert elementary.exp(real(-1e4)) == elementary.exp(real(-87.0)) > 0.0
        assert elementary.log(real(1.0)) == 0.0


def test_normal_is_the_inverse_distribution_of_a_uniform_word() -> None:
    rng = random.Random(8)
    words = [rng.getrandbits(32) for _ in range(cases(20_000, 1_000))]
    words += [0, 1, 2, 3, 1000, 2**31 - 1, 2**31, 2**32 - 1]
    words += [rng.getrandbits(rng.randint(1, 32)) for _ in range(cases(2_000, 200))]  # the far tail
    for word in words:
        true = float(ndtri(min(word, 2**32 - 1 - word) / 2**32 + 2**-33)) * (1 if word < 2**31 else -1)
        for real in (np.float64, np.float32):
            assert abs(elementary.normal(np.uint32(word), real(0.0)) - true) < 2e-6, word
            assert elementary.normal(np.uint32(2**32 - 1 - word), real(0.0)) == -elementary.normal(
                np.uint32(word), real(0.0)
            )


def test_normal_has_mean_zero_and_variance_one_over_all_words() -> None:
    """At the middle of each of equal parts of all words: the mean is exact, the variance that of so many parts."""
    n = cases(4_096, 512)
    for real in (np.float64, np.float32):
        middles = [np.uint32((2 * k + 1) * (2**32 // (2 * n))) for k in range(n)]
        numbers = np.array([elementary.normal(word, real(0.0)) for word in middles], np.float64)
        true = ndtri((np.arange(n) + 0.5) / n)
        assert abs(numbers.mean()) < 1e-6
        assert abs(numbers.var() - true.var()) < 5e-6
