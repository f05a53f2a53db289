"""Numbers that are drawn: what comes out of uniform ones, and what cannot be."""

import math

import numpy as np
import pytest
from scipy import special

from realitygap.world import Distribution
from realitygap.world._quantiles import exponential, logarithm, normal_quantile

EVEN = (np.arange(20_000) + 0.5) / 20_000


def test_elementary_functions_agree_with_the_mathematical_library():
    x = np.exp(np.linspace(-700, 700, 10_001))
    assert (np.abs(logarithm(x) - np.log(x)) / np.maximum(1, np.abs(np.log(x)))).max() < 4e-16
    y = np.linspace(-690, 690, 10_001)
    assert np.abs(exponential(y) / np.exp(y) - 1).max() < 1e-15
    u = np.concatenate([EVEN, 10.0 ** -np.arange(1.0, 10.0), 1 - 10.0 ** -np.arange(1.0, 10.0)])
    assert np.abs(normal_quantile(u) - special.ndtri(u)).max() < 2e-14


def test_normal_quantile_of_the_ends_is_finite_and_odd():
    low, high = normal_quantile(np.array([0.0, 1.0 - 2.0**-53]))
    assert -6.5 < low < -6.3
    assert low == -high
    assert normal_quantile(np.array([0.5]))[0] == 0.0


@pytest.mark.parametrize(
    ("values", "mean", "deviation"),
    [
        ({"uniform": (1.0, 3.0)}, 2.0, 2 / math.sqrt(12)),
        ({"normal": (0.153, 0.002)}, 0.153, 0.002),
        ({"choice": (1.0, 2.0, 6.0)}, 3.0, math.sqrt(14 / 3)),
        (
            {"log_uniform": (1.0, math.e)},
            math.e - 1,
            math.sqrt((math.e**2 - 1) / 2 - (math.e - 1) ** 2),
        ),
    ],
)
def test_mean_and_deviation_are_as_stated(values, mean, deviation):
    drawn = Distribution(**values).of(EVEN)
    assert drawn.mean() == pytest.approx(mean, rel=1e-3)
    assert drawn.std() == pytest.approx(deviation, rel=2e-3)


@pytest.mark.parametrize("kind", ["uniform", "normal", "log_uniform"])
def test_samples_grow_with_the_uniform_number_and_keep_its_shape(kind):
    drawn = Distribution(**{kind: (0.5, 2.0)}).of(EVEN.reshape(100, 200))
    assert drawn.shape == (100, 200)
    assert (np.diff(drawn.ravel()) > 0).all()


def test_least_and_most_limit_a_distribution():
    cut = Distribution(normal=(0.0, 1.0), least=-0.5, most=1.0)
    drawn = cut.of(EVEN)
    assert (drawn.min(), drawn.max()) == (-0.5, 1.0) == (cut.lowest, cut.highest)
    free = Distribution(normal=(0.0, 1.0))
    assert free.lowest < free.of(np.array([0.0]))[0] < -6


@pytest.mark.parametrize(
    ("values", "center"),
    [
        ({"uniform": (1, 3)}, 2.0),
        ({"normal": (5, 1)}, 5.0),
        ({"log_uniform": (1, 4)}, 2.0),
        ({"choice": (7, 1)}, 7.0),
        ({"uniform": (1, 3), "most": 1.5}, 1.5),
    ],
)
def test_a_distribution_has_a_center(values, center):
    assert Distribution(**values).center == center


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({}, "got none"),
        ({"uniform": [1, 2], "normal": [1, 2]}, "got uniform and normal"),
        ({"uniform": [2, 1]}, "expected uniform = [lower, upper]"),
        ({"log_uniform": [0, 1]}, "expected log_uniform above 0"),
        ({"normal": [0, -1]}, "standard deviation of at least 0"),
        ({"choice": []}, "at least one number"),
        ({"uniform": [1, math.nan]}, "expected a finite number"),
        ({"uniform": [1, 2], "per": "day"}, "expected 'trial', 'run' or 'study'"),
        ({"uniform": [1, 2], "least": 3, "most": 2}, "more than most"),
        ({"unifrom": [1, 2]}, "Did you mean 'uniform'?"),
    ],
)
def test_a_wrong_one_is_refused_in_our_words(values, says):
    with pytest.raises(ValueError, match="Distribution") as caught:
        Distribution(**values)
    assert says in str(caught.value)


def test_it_survives_the_trip_through_plain_values():
    drawn = Distribution(normal=(0.1, 0.2), per="run", least=0.0)
    assert drawn.to_dict() == {"normal": [0.1, 0.2], "per": "run", "least": 0.0}
    assert Distribution(**drawn.to_dict()) == drawn
