"""Predictions from a simulation's scores, against a plain computation of the same definitions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from realitygap.gap import PriorProcess

UNIT = st.floats(0, 1, width=32)


def plain(x, prior, tried, scores, length, spread, offset, noise):
    """The definitions one by one: every covariance by a loop, the inverse of the matrix, and densities."""

    def k(one, other):
        r = np.sqrt(5 * sum((a - b) ** 2 for a, b in zip(one, other, strict=True))) / length
        return offset**2 + spread**2 * (1 + r + r**2 / 3) * np.exp(-r)

    among = np.array(
        [[k(x[a], x[b]) + noise[a] * (i == j) for j, b in enumerate(tried)] for i, a in enumerate(tried)]
    )
    inverse = np.linalg.inv(among)
    means, densities = [], []
    for simulated in prior:
        residual = np.array(scores) - simulated[tried]
        means.append(
            [simulated[m] + [k(x[m], x[a]) for a in tried] @ inverse @ residual for m in range(len(x))]
        )
        densities.append(np.exp(-0.5 * residual @ inverse @ residual))
    weights = np.array(densities) / sum(densities)
    across = [np.array([k(x[m], x[a]) for a in tried]) for m in range(len(x))]
    variance = np.array([k(x[m], x[m]) - row @ inverse @ row for m, row in enumerate(across)])
    mean = weights @ np.array(means)
    return mean, variance + weights @ (np.array(means) - mean) ** 2, weights


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.float64, (6, 2), elements=UNIT),
    arrays(np.float64, (3, 6), elements=UNIT),
    st.lists(st.tuples(st.integers(0, 5), UNIT), min_size=1, max_size=5),
    st.floats(0.2, 1),
    st.floats(0, 0.5),
)
def test_prediction_is_that_of_the_definitions(x, prior, told, spread, offset):
    noise = np.linspace(0.01, 0.05, 6)
    process = PriorProcess(x, prior, spread=spread, offset=offset, noise=noise)
    for controller, score in told:
        process.tell(controller, score)
    tried, scores = [each[0] for each in told], [each[1] for each in told]
    mean, variance, weights = plain(x, prior, tried, scores, 0.4, spread, offset, noise)
    found = process.predict()
    np.testing.assert_allclose(found.mean, mean, atol=1e-8)
    np.testing.assert_allclose(found.deviation**2, variance, atol=1e-8)
    np.testing.assert_allclose(process.weights, weights, atol=1e-8)
    assert process.tried == tuple(tried)


def test_one_prior_is_scikit_learns_process_of_the_differences():
    """An independent implementation: with the parameters of the paper, and a prior mean of 0 for the differences."""
    sklearn = pytest.importorskip("sklearn.gaussian_process")
    kernels = pytest.importorskip("sklearn.gaussian_process.kernels")
    random = np.random.default_rng(3)
    x, prior = random.random((40, 6)), random.random(40)
    tried, scores = random.permutation(40)[:9], random.random(9)
    process = PriorProcess(x, prior)
    for controller, score in zip(tried, scores, strict=True):
        process.tell(int(controller), score)
    other = sklearn.GaussianProcessRegressor(kernels.Matern(0.4, nu=2.5), alpha=0.001, optimizer=None)
    difference, deviation = other.fit(x[tried], scores - prior[tried]).predict(x, return_std=True)
    found = process.predict()
    np.testing.assert_allclose(found.mean, prior + difference, atol=1e-9)
    np.testing.assert_allclose(found.deviation, deviation, atol=1e-6)


def test_the_first_trial_is_of_the_best_in_simulation_and_a_bad_one_moves_its_neighbors():
    x = np.array([[0.0], [0.05], [1.0]])
    process = PriorProcess(x, [0.9, 0.85, 0.6])
    assert process.choose() == 0
    process.tell(0, 0.1)
    assert process.choose() == 2
    assert process.predict().mean[1] < 0.2
    assert not process.is_enough()
    process.tell(2, 0.6)
    assert process.is_enough()


def test_a_shared_difference_leaves_the_order_as_it_is():
    """With an offset, one bad trial lowers all predictions; without it, far ones stay as the simulation says."""
    x, prior = np.array([[0.0], [1.0]]), [0.9, 0.8]
    far = []
    for offset in (0.0, 0.5):
        process = PriorProcess(x, prior, spread=0.1, offset=offset)
        process.tell(0, 0.5)
        far.append(process.predict().mean[1])
    assert far[0] > 0.75
    assert far[1] < 0.45


def test_trials_weigh_the_simulation_that_foretold_them():
    random = np.random.default_rng(1)
    x, prior = random.random((30, 2)), random.random((4, 30))
    process = PriorProcess(x, prior, spread=0.1, noise=0.01)
    np.testing.assert_array_equal(process.weights, np.full(4, 0.25))
    for controller in range(6):
        process.tell(controller, prior[2, controller])
    assert process.weights.argmax() == 2
    assert process.weights[2] > 0.9


def test_the_search_finds_the_best_arm_under_a_break():
    """The planar arm of the source, reproduced in small: eight joints, one of which no longer moves.

    Angles of 8 joints with 2,000 random settings are the repertoire, its descriptor is the end position, and its score
    is minus the spread of the angles. A broken joint moves the ends. Trial and error has to touch a goal on the broken
    arm, to within a tenth of its length, in at most 20 trials; the best in simulation misses by more. Over 20 goals.
    """
    random = np.random.default_rng(5)
    angles = random.uniform(-0.9, 0.9, (2000, 8))

    def ends(of):
        sums = np.cumsum(of, axis=1)
        return np.stack([np.cos(sums).mean(axis=1), np.sin(sums).mean(axis=1)], axis=1)

    broken = angles.copy()
    broken[:, 2] = 0.7
    intact, found = ends(angles), ends(broken)
    misses = []
    for goal in found[random.integers(0, 2000, 20)]:
        promised, true = (-np.hypot(*(place - goal).T) for place in (intact, found))
        process = PriorProcess((intact + 1) / 2, promised)
        first = process.choose()
        for _ in range(20):
            process.tell(k := process.choose(), true[k])
        misses.append((-true[first], -max(process.scores)))
    before, after = np.median(misses, axis=0)
    assert before > 0.1
    assert after < 0.1


def test_trials_without_noise_may_be_repeated():
    process = PriorProcess([[0.1], [0.2]], [0.5, 0.4], noise=1e-18)
    for _ in range(3):
        process.tell(0, 0.3)
    assert process.predict().mean[0] == pytest.approx(0.3, abs=1e-6)


def test_other_evidence_multiplies_the_likelihood_of_a_simulation():
    process = PriorProcess([[0.0], [1.0]], [[0.2, 0.4], [0.6, 0.8]])
    process.weigh([0.0, np.log(3)])
    np.testing.assert_allclose(process.weights, [0.25, 0.75])
    np.testing.assert_allclose(process.predict().mean, [0.5, 0.7])
    before = PriorProcess([[0.0], [1.0]], [[0.2, 0.4], [0.6, 0.8]])
    for each in (process, before):
        each.tell(0, 0.3)
    odds = [each.weights[1] / each.weights[0] for each in (process, before)]
    assert odds[0] == pytest.approx(3 * odds[1])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"descriptors": [0.5, 0.5]}, "expected \\(m, d\\)"),
        ({"descriptors": np.empty((0, 2)), "simulated": []}, "expected \\(m, d\\)"),
        ({"simulated": [0.1]}, "one score for each of 2 controllers"),
        ({"simulated": [0.1, float("nan")]}, "simulated"),
        ({"length": 0}, "length is 0"),
        ({"spread": -1}, "spread is -1"),
        ({"offset": -0.1}, "offset is -0.1"),
        ({"noise": 0}, "noise is 0"),
        ({"noise": [0.1, 0.1, 0.1]}, "noise has shape"),
        ({"simulated": np.empty((0, 2))}, "one score for each of 2 controllers"),
    ],
)
def test_wrong_arguments_are_refused(arguments, says):
    right = {"descriptors": [[0.1], [0.2]], "simulated": [0.5, 0.6]}
    with pytest.raises(ValueError, match=says):
        PriorProcess(**right | arguments)
    process = PriorProcess(**right)
    with pytest.raises(ValueError, match="controller is 2"):
        process.tell(2, 0.5)
    with pytest.raises(ValueError, match="score"):
        process.tell(0, float("inf"))
    assert process.tried == process.scores == ()
    with pytest.raises(ValueError, match=r"evidence has shape \(2,\), expected \(1,\)"):
        process.weigh([0.0, 0.0])
