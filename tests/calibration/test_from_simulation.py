from types import SimpleNamespace

import numpy as np
import pytest

from realitygap.calibration import (
    Effect,
    Evidence,
    Parameter,
    Posterior,
    fit_all,
    information_of,
    misfits,
    mixed,
    next_trials,
    numbers_of,
    ranges_of,
    scribbler_prior,
    values_of,
)
from realitygap.calibration._all_from_simulation import _predict
from realitygap.calibration._prior import standard_of
from realitygap.world import Distribution, load_robot

ROBOT = load_robot("scribbler-s2-fluke2")
PRIOR = (
    Parameter("drive.track", Distribution(uniform=(0.1, 0.2)), "m", (Effect("drive.track"),)),
    Parameter("drive.lag", Distribution(uniform=(0.0, 0.4)), "s", (Effect("drive.lag"),)),
    Parameter("drive.slip", Distribution(uniform=(0.0, 0.2)), "", (Effect("drive.slip"),)),
)
SLOPES = np.random.default_rng(5).normal(size=(2, 60)) * [[30.0], [4.0]]  # drive.slip shows in nothing


def simulate(one, numbers, key):
    """A simulator whose posterior is nearly normal: track shows well, lag less."""
    noise = np.random.default_rng(key).normal(size=(len(numbers["drive.track"]), 60))
    shown = np.outer(numbers["drive.track"] - 0.15, SLOPES[0]) + np.outer(
        numbers["drive.lag"] - 0.2, SLOPES[1]
    )
    return (shown + noise).astype(np.float32)


def evidence_with(seen):
    n = len(seen)
    kinds, trial, at_walls = np.full(n, "reading"), np.zeros(n, int), np.zeros(n, bool)
    return Evidence(SimpleNamespace(), (), lambda _: seen, seen, kinds, trial, np.arange(n), at_walls)


def observed(rng):
    standard = rng.normal(size=(1, 3))
    numbers = numbers_of(PRIOR, values_of(PRIOR, standard), ROBOT)
    return standard[0], evidence_with(simulate(None, numbers, int(rng.integers(2**60)))[0])


@pytest.mark.slow
def test_intervals_cover_as_often_as_they_say():
    # 3 x 50 intervals of 90 %: outside of 81 to 97 % by chance once in 1000 suites.
    inside = []
    for k in range(50):
        truth, evidence = observed(np.random.default_rng(k))
        places = fit_all([evidence], simulate, PRIOR, ROBOT, seed=k, effort="small").places
        low, high = np.quantile(places, [0.05, 0.95], axis=0)
        inside.append((low <= truth) & (truth <= high))
    assert 0.81 <= np.mean(inside) <= 0.97


def test_each_simulation_is_predicted_as_by_a_regression_without_it():
    rng = np.random.default_rng(4)
    places = rng.normal(size=(300, 3))
    shown = places @ rng.normal(size=(3, 24)) + 0.3 * (places**2) @ rng.normal(size=(3, 24))
    summaries = shown + 3.0 * rng.normal(size=(300, 24))
    told, _ = _predict(summaries, places, summaries[0])
    without = np.array(
        [_predict(np.delete(summaries, k, 0), np.delete(places, k, 0), summaries[k])[1] for k in range(40)]
    )
    by_all = np.array([_predict(summaries, places, row)[1] for row in summaries[:40]])
    # Means and squares stay those of all: a tenth of the difference is left.
    assert np.abs(told[:40] - without).mean() < 0.15 * np.abs(by_all - without).mean()


def test_observable_parameters_are_found_and_others_keep_their_prior():
    truth, evidence = observed(np.random.default_rng(7))
    places = fit_all([evidence], simulate, PRIOR, ROBOT, seed=1, effort="small").places
    information = (SLOPES[0] ** 2).sum() * (0.1 * 0.4) ** 2  # d track / d standard is at most 0.1 * 0.4
    assert places[:, 0].std() < 3 / np.sqrt(information)
    assert places[:, 0].mean() == pytest.approx(truth[0], abs=4 * places[:, 0].std())
    assert places[:, 2].std() == pytest.approx(1.0, abs=0.15)


def test_a_simulator_that_cannot_make_what_was_observed_is_told():
    rng = np.random.default_rng(3)
    _, right = observed(rng)
    numbers = numbers_of(
        PRIOR, fit_all([right], simulate, PRIOR, ROBOT, seed=1, effort="small").values, ROBOT
    )
    (fits,) = misfits([right], simulate, numbers, key=1)
    wrong = evidence_with(right.seen + 4 * np.where(np.arange(60) % 7 < 3, 1, -1).astype(np.float32))
    (fails,) = misfits([wrong], simulate, numbers, key=1)
    assert not fits.is_too_large
    assert fits.p > 0.01
    assert fails.is_too_large
    assert fails.p == 0.0
    (still,) = misfits([evidence_with(np.zeros(60, np.float32))], simulate, numbers, key=1)
    assert still.share == 0.0  # nothing varied, so there is no variance to predict


def test_the_next_trial_is_the_one_that_tells_of_the_goal():
    rng = np.random.default_rng(1)
    places = rng.normal(size=(400, 2))
    noise = rng.normal(size=(400, 8))
    of_first = (places[:, :1] * 2 + noise).astype(np.float32)
    of_second = (places[:, 1:] * 3 + noise).astype(np.float32)
    finest = np.full(8, 0.01, np.float32)
    informations = [information_of(places, vectors, finest) for vectors in (of_first, of_second)]
    assert next_trials(places, informations, 1) == [1]
    assert next_trials(places, informations, 1, goal=places[:, :1]) == [0]
    with pytest.raises(ValueError, match="at least one candidate"):
        next_trials(places, [], 1)


def test_the_prior_of_a_scribbler_holds_its_file_and_comes_back_from_its_scale():
    prior = scribbler_prior(ROBOT)
    standard = np.random.default_rng(0).normal(size=(7, len(prior)))
    assert standard_of(prior, values_of(prior, standard)) == pytest.approx(standard, abs=1e-9)
    ranges = ranges_of(prior, ROBOT)
    for name, value in ROBOT.numbers().items():
        if name in ranges and value > 0:
            assert ranges[name][0] <= value <= ranges[name][1], name
    even = {parameter.name: np.array([parameter.prior.center]) for parameter in prior}
    even |= {"drive.gain": np.array([0.9]), "drive.asymmetry": np.array([0.1])}
    numbers = numbers_of(prior, even, ROBOT)
    assert (numbers["drive.gain_left"][0], numbers["drive.gain_right"][0]) == pytest.approx((0.95, 0.85))


def test_three_of_four_draws_are_of_the_first_posterior_and_they_come_by_turns():
    ones, others = np.full((12, 3), 1.0), np.full((10, 3), -1.0)
    one, other = (
        Posterior(places, values_of(PRIOR, places), np.full(3, off), 7)
        for places, off in ((ones, 2.0), (others, -2.0))
    )
    both = mixed(one, other, PRIOR, share=3)
    np.testing.assert_array_equal(both.places[:, 0], [1.0, 1.0, 1.0, -1.0] * 2)
    np.testing.assert_allclose(both.values["drive.lag"], values_of(PRIOR, both.places)["drive.lag"])
    assert both.off.tolist() == [1.0, 1.0, 1.0]
    assert both.n_simulated == 14
