"""Elementary functions against Python's, and against decimals of 45 digits where the last bit is at stake."""

from __future__ import annotations

import math
import random
from decimal import Decimal, localcontext

import numpy as np
import pytest

from realitygap.kernels import _math
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
        sine, cosine = _math.sin_cos(angle)
        assert abs(sine - math.sin(angle)) < 1e-15, angle
        assert abs(cosine - math.cos(angle)) < 1e-15, angle


def test_in_turns_quarters_are_exact_and_the_rest_within_its_bound() -> None:
    quarters = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)]
    for quarter in range(-8, 9):
        assert _math.sin_cos_of_turns(quarter / 4) == quarters[quarter % 4]
        assert _math.sin_cos_of_turns(np.float32(quarter / 4)) == quarters[quarter % 4]
    rng = random.Random(4)
    for _ in range(cases(50_000, 2_000)):
        turns = rng.uniform(-1, 1)
        for real, bound in ((np.float64, 1e-15), (np.float32, 1.8e-7)):
            given = real(turns)
            sine, cosine = _math.sin_cos_of_turns(given)
            assert abs(sine - math.sin(math.tau * float(given))) < bound
            assert abs(cosine - math.cos(math.tau * float(given))) < bound


def test_single_precision_stays_single_and_within_its_bound() -> None:
    for x in numbers(cases(20_000, 1_000)):
        given = np.float32(x)
        assert abs(_math.tanh(given) - math.tanh(float(given))) < 2e-7
        assert abs(_math.sigmoid(given) - 0.5 - 0.5 * math.tanh(0.5 * float(given))) < 1.2e-7


def test_a_heading_of_zero_points_exactly_along_x() -> None:
    assert _math.sin_cos(0.0) == (0.0, 1.0)


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
            assert abs(Decimal(_math.tanh(x)) - true) < Decimal("3e-16"), x
            true = 1 / ((-Decimal(x)).exp() + 1)
            assert abs(Decimal(_math.sigmoid(x)) - true) < Decimal("2e-16"), x


@pytest.mark.parametrize("x", [25.0, 1e3, 1e300, math.inf])
def test_far_out_tanh_is_one_and_sigmoid_zero_or_one(x: float) -> None:
    assert (_math.tanh(x), _math.tanh(-x)) == (1.0, -1.0)
    assert (_math.sigmoid(2 * x), _math.sigmoid(-2 * x)) == (1.0, 0.0)


def test_tanh_is_odd() -> None:
    for x in numbers(500):
        assert _math.tanh(-x) == -_math.tanh(x)
