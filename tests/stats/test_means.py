"""Intervals of means end within the range of the values, and cover the mean as often as they claim."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from realitygap.gap import GapSide, measure_gap, replay_error, rms_interval
from realitygap.report._comparisons import Samples
from realitygap.stats import difference_interval, mean_interval, prove_equivalence, t_interval
from realitygap.study._transfer.result import estimate_mean

N = 6_000
"""Simulated samples; the error of a share of 0.95 is 0.003."""

DRAWS = {
    "beta(2, 3)": ((2, 3), (0, 1)),
    "beta(0.6, 2.4), with a tail": ((0.6, 2.4), (0, 1)),
    "beta(9, 1), near the upper end": ((9, 1), (0, 1)),
    "beta(1, 30), near the lower end": ((1, 30), (0, 1)),
    "beta(9, 1) from -1 to 1": ((9, 1), (-1, 1)),
    "beta(6, 2), only the upper end known": ((6, 2), (-np.inf, 1)),
    "beta(2, 6), only the lower end known": ((2, 6), (0, np.inf)),
}


@pytest.mark.slow
def test_interval_covers_the_mean_and_never_leaves_the_range():
    rng = np.random.default_rng(1)
    for name, ((a, b), within) in DRAWS.items():
        low, width = (-1, 2) if within[0] == -1 else (0, 1)
        truth = low + width * a / (a + b)
        for n in (2, 5, 10, 30):
            values = low + width * rng.beta(a, b, (N, n))
            error = values.std(axis=1, ddof=1) / np.sqrt(n)
            lower, upper = t_interval(values.mean(axis=1), error, n - 1, within)
            coverage = ((lower <= truth) & (truth <= upper)).mean()
            assert coverage > 0.925, f"{name}, n = {n}: covers {coverage:.3f}"
            assert within[0] <= lower.min(), name
            assert upper.max() <= within[1], name


def test_interval_without_a_range_is_the_usual_one_and_of_equal_values_is_their_mean():
    reach = stats.t.ppf(0.975, 7)
    low, high = t_interval([0.2, 3.0], [0.1, 0.5], 7)
    assert np.allclose(
        [low, high], [[0.2 - 0.1 * reach, 3 - 0.5 * reach], [0.2 + 0.1 * reach, 3 + 0.5 * reach]]
    )
    for mean in (0.0, 0.3, 1.0):
        assert t_interval(mean, 0.0, 1, (0.0, 1.0)) == (mean, mean)


def test_no_interval_of_a_score_leaves_its_range():
    """Scores near both ends of their range, of as few controllers and trials as each interval takes."""
    rng = np.random.default_rng(2)
    for c in (2, 3, 5, 8):
        for a, b in ((0.3, 0.3), (9, 1), (1, 9)):
            source, target = (
                GapSide(name, "SIM", rng.beta(*shape, (c, 2)), score_range=(0.0, 1.0))
                for name, shape in (("sim", (a, b)), ("twin", (b, a)))
            )
            found = measure_gap(source, target, margin=0.5, resamples=200)
            scales = {"level": -1, "equivalence": -1, "rms": 0, "a12": 0, "srcc": -1, "mmrv": 0}
            ends = {name: (scale, getattr(found, name)) for name, scale in scales.items()}
            ends["luck"] = -1, mean_interval(source.means - target.means, (-1.0, 1.0))
            ends["re-evolved"] = -1, difference_interval(target.means, source.means, (0.0, 1.0))
            ends["transfer"] = 0, estimate_mean(source.values)
            for name, (low, each) in ends.items():
                if each.low is not None:
                    assert low <= each.low <= each.value <= each.high <= 1, f"{name} of {c}: {each}"
            for side in (source, target):
                low, high = side.intervals()
                assert low.min() >= 0
                assert high.max() <= 1
            samples = Samples(rng.beta(a, b, 10), rng.beta(b, a, 10), paired=True)
            interval = samples.equivalence_interval()
            assert interval.low >= -1
            assert interval.high <= 1


def test_equivalence_has_one_scale_for_its_interval_and_its_p():
    rng = np.random.default_rng(3)
    for n in (2, 5, 20):
        for _ in range(100):
            differences = np.clip(rng.normal(rng.uniform(-0.5, 0.5), 0.3, n), -0.99, 0.99)
            found = prove_equivalence(differences, 0.6, (0.0, 1.0))
            assert found.equivalent == (found.difference.low > -0.6 and found.difference.high < 0.6)
    assert prove_equivalence(np.array([0.3, -0.9]), 1.0, (0.0, 1.0)).equivalent


def test_other_intervals_end_within_their_scale():
    squares = np.array([0.9, 0.95, 0.8, 0.99, 0.2])
    assert rms_interval(np.sqrt(squares), squares, squares.mean() * np.ones(99), most=1.0)[1] == 1.0
    poses = np.zeros((5, 2, 3))
    poses[:, 1] = [[5.0, 0, 3.1], [0.1, 0, 3.1], [0.1, 0, 0.1], [0, 0, 0], [0, 0, 3.0]]
    found = replay_error(poses, np.zeros((2, 5, 2, 3))).to_dict()
    assert min(found["distance"]["low"]) >= 0
    assert max(found["heading"]["high"]) <= np.pi
    with pytest.raises(ValueError, match=r"from 0 to 2, expected numbers in the score range, 0 to 1"):
        GapSide("sim", "SIM", np.array([[0.0, 2.0]]), score_range=(0.0, 1.0))
