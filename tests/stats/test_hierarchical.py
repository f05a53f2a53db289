"""The hierarchical model against published figures, and how often its intervals cover."""

import numpy as np
import pytest

from realitygap.stats import Estimate, RandomEffects, random_effects

# Trials of a vaccine against tuberculosis (Colditz et al. 1994): cases and others among vaccinated and controls.
VACCINE = np.array([
    (4, 119, 11, 128), (6, 300, 29, 274), (3, 228, 11, 209), (62, 13536, 248, 12619), (33, 5036, 47, 5761),
    (180, 1361, 372, 1079), (8, 2537, 10, 619), (505, 87886, 499, 87892), (29, 7470, 45, 7232), (17, 1699, 65, 1600),
    (186, 50448, 141, 27197), (5, 2493, 3, 2338), (27, 16886, 29, 17825),
], float)  # fmt: skip


def log_ratios():
    """Return the logarithms of the ratios of risks, and their variances."""
    a, b, c, d = VACCINE.T
    return np.log(a / (a + b) / (c / (c + d))), 1 / a - 1 / (a + b) + 1 / c - 1 / (c + d)


def test_figures_are_those_of_metafor():
    """Viechtbauer (2010), Journal of Statistical Software 36(3), section 3; manual of `rma`, test="knha"."""
    found = random_effects(*log_ratios())
    assert isinstance(found, RandomEffects)
    assert found.spread.value**2 == pytest.approx(0.3132, abs=5e-5)
    assert np.square(found.spread.ends) == pytest.approx([0.1197, 1.1115], abs=5e-5)
    assert found.mean.value == pytest.approx(-0.7145, abs=5e-5)
    assert found.mean.ends == pytest.approx([-1.1084, -0.3206], abs=5e-5)


def test_without_spread_each_value_is_nearly_the_mean():
    found = random_effects([0.10, 0.11, 0.09, 0.10, 0.105, 0.095], [0.01] * 6)
    assert (found.spread.value, found.spread.low) == (0.0, 0.0)
    assert np.ptp([each.value for each in found.each]) < 0.5 * 0.02


def test_without_much_noise_each_value_is_as_it_was_seen():
    seen = [0.1, 0.5, -0.3, 0.2, 0.9]
    found = random_effects(seen, [1e-8] * 5)
    assert [each.value for each in found.each] == pytest.approx(seen, abs=1e-6)


@pytest.mark.parametrize(
    ("values", "variances"), [([1, 2, 3, 4], [1] * 4), ([1, 2, 3, 4, 5], [0, 1, 1, 1, 1])]
)
def test_too_few_values_and_values_without_noise_are_refused(values, variances):
    found = random_effects(values, variances)
    assert isinstance(found, Estimate)
    assert found.refused


@pytest.mark.parametrize("spread", [0.0, 0.03, 0.1])
@pytest.mark.parametrize("n", [5, 20])
def test_intervals_cover(n, spread):
    """1,000 studies: shares below 0.925 occur by chance in 2 of 10,000 if the coverage is 0.95."""
    rng = np.random.default_rng([n, int(100 * spread)])
    covered = {"mean": [], "spread": [], "each": []}
    for _ in range(1000):
        noise = rng.uniform(0.02, 0.06, n) ** 2
        truth = rng.normal(0.1, spread, n)
        found = random_effects(rng.normal(truth, np.sqrt(noise)), noise)
        covered["mean"].append(found.mean.low <= 0.1 <= found.mean.high)
        covered["spread"].append(found.spread.low <= spread <= found.spread.high)
        covered["each"].append(
            np.mean([each.low <= true <= each.high for each, true in zip(found.each, truth, strict=True)])
        )
    assert np.mean(covered["mean"]) >= 0.925
    assert np.mean(covered["spread"]) >= 0.925
    assert np.mean(covered["each"]) >= 0.925
