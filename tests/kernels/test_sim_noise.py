"""Noise of range sensors: word by word against the reference; probabilities, means and variances as stated."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import noise, ranges
from tests.kernels.sim_rows import PRECISIONS, TOLERANCE, random_words, row, rows, unit_of
from tests.reference import senses as reference
from tests.reference.effort import cases

NONE = (0.0, 0.0, 1.0)


def mix(
    readings: Any, near: Any, words: np.ndarray, drop: Any, outlier: Any, real: Any = np.float64
) -> np.ndarray:
    """(LANES,) readings with dropouts and outliers, each (most, at, width)."""
    reading, drop_rate, outlier_rate = row(readings, real), row(0.0, real), row(0.0, real)
    ranges.rate_of(row(drop[2], real), drop_rate)
    ranges.rate_of(row(outlier[2], real), outlier_rate)
    noise.mixture(
        row(near, real), words[0], words[1], rows(drop[:2], real), drop_rate, rows(outlier[:2], real), outlier_rate,
        reading,
    )  # fmt: skip
    return reading


def many(readings: float, near: float, drop: Any, outlier: Any, n: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.concatenate(
        [mix(readings, near, random_words(rng, 2), drop, outlier) for _ in range(n // LANES)]
    )


@pytest.mark.parametrize("real", PRECISIONS)
def test_each_reading_is_what_its_words_say_with_other_numbers_in_each_lane(real: Any) -> None:
    rng = np.random.default_rng(1)
    kinds = set()
    for _ in range(cases(60, 4)):
        readings, near = rng.uniform(-0.3, 1.3, LANES), rng.uniform(0, 0.4, LANES)
        drop = rng.uniform(0, 1, LANES), rng.uniform(0, 0.4, LANES), rng.uniform(0.01, 0.1, LANES)
        outlier = rng.uniform(0, 1, LANES), rng.uniform(0, 0.4, LANES), -rng.uniform(0.01, 0.1, LANES)
        words = random_words(rng, 2)
        answer = mix(readings, near, words, drop, outlier, real)
        choice, value = unit_of(words[0], 21), unit_of(words[1])
        for lane in range(LANES):
            nothing = reference.logistic(near[lane], *(one[lane] for one in drop))
            anything = reference.logistic(near[lane], *(one[lane] for one in outlier))
            if min(abs(choice[lane] - nothing), abs(1 - choice[lane] - anything)) < 1e-4:
                continue  # a rounding decides
            plain = reference.mixed(readings[lane], choice[lane], value[lane], nothing, anything)
            assert answer[lane] == pytest.approx(plain, abs=TOLERANCE[real])
            kinds.add("nothing" if plain == 0 else "anything" if plain == value[lane] else "reading")
    assert kinds == {"nothing", "anything", "reading"}


@pytest.mark.parametrize("near", [0.0, 0.1, 0.15, 0.3])
def test_dropouts_and_outliers_have_the_stated_probabilities(near: float) -> None:
    """Over words that are spread evenly, so nothing is left to chance: 2^16 of them, and each share within 2^-15."""
    n = cases(1 << 16, 1 << 10)
    drop, outlier = (0.4, 0.15, 0.03), (0.3, 0.1, -0.05)
    choices = (np.arange(n, dtype=np.uint64) * (2**32 // n) + 2**31 // n).astype(np.uint32).reshape(-1, LANES)
    value = np.full(LANES, 0x40000000, np.uint32)  # an outlier of 1/4
    answer = np.concatenate([mix(0.75, near, np.stack([words, value]), drop, outlier) for words in choices])
    assert (answer == 0).mean() == pytest.approx(reference.logistic(near, *drop), abs=2 / n)
    assert (abs(answer - 0.25) < 1e-6).mean() == pytest.approx(reference.logistic(near, *outlier), abs=2 / n)
    assert set(np.round(answer, 5)) == {0.0, 0.25, 0.75}


def test_dropouts_keep_their_share_if_both_shares_add_up_to_more_than_one() -> None:
    n = cases(1 << 14, 1 << 10)
    choices = (np.arange(n, dtype=np.uint64) * (2**32 // n) + 2**31 // n).astype(np.uint32).reshape(-1, LANES)
    value = np.full(LANES, 0x40000000, np.uint32)
    always, often = (1.0, -1.0, 0.001), (0.75, -1.0, 0.001)
    answer = np.concatenate([mix(0.5, 0.1, np.stack([words, value]), often, always) for words in choices])
    assert (answer == 0).mean() == pytest.approx(0.75, abs=2 / n)
    assert (answer > 0).mean() == pytest.approx(0.25, abs=2 / n)
    assert 0.5 not in answer


@pytest.mark.parametrize("near", [0.05, 0.2])
def test_the_mixture_has_the_stated_mean_and_variance(near: float) -> None:
    """Each bound is four standard errors (of the variance, of readings in 0..1): 1 in 16,000 by chance."""
    drop, outlier = (0.5, 0.15, 0.03), (0.4, 0.1, 0.05)
    n = cases(128_000, 1_280)
    answer = many(0.7, near, drop, outlier, n, 2)
    mean, variance = reference.mixture_moments(
        0.7, reference.logistic(near, *drop), reference.logistic(near, *outlier)
    )
    assert answer.mean() == pytest.approx(mean, abs=4 * np.sqrt(variance / n))
    assert ((answer - mean) ** 2).mean() == pytest.approx(variance, abs=4 * np.sqrt(variance / n))


def test_outliers_are_uniform() -> None:
    """Mean and variance of 1/2 and 1/12 within four standard errors: 1 in 8,000 by chance."""
    n = cases(64_000, 1_280)
    answer = many(0.7, 0.2, NONE, (1.0, -1.0, 0.001), n, 3)
    assert answer.mean() == pytest.approx(1 / 2, abs=4 * np.sqrt(1 / 12 / n))
    assert answer.var() == pytest.approx(1 / 12, abs=4 * np.sqrt(1 / 180 / n))
    assert answer.min() > 0
    assert answer.max() < 1


@pytest.mark.parametrize("real", PRECISIONS)
def test_gain_noise_is_proportional_to_the_reading(real: Any) -> None:
    """Relative mean 1 and variance gain^2, within four standard errors; another gain in each lane."""
    rng = np.random.default_rng(4)
    gain = np.linspace(0.0, 0.3, LANES)
    n = cases(4_000, 50)
    readings = rng.uniform(0.2, 1.0, LANES)
    answers = np.empty((n, LANES))
    for k in range(n):
        reading = row(readings, real)
        noise.gain_noise(random_words(rng, 1)[0], row(gain, real), reading)
        answers[k] = reading / readings
    standard = (answers[:, 1:] - 1) / gain[1:]
    size = standard.size
    assert standard.mean() == pytest.approx(0.0, abs=4 / np.sqrt(size))
    assert standard.var() == pytest.approx(1.0, abs=4 * np.sqrt(2 / size))
    assert answers[:, 0] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("real", PRECISIONS)
def test_uniform_noise_is_the_papers(real: Any) -> None:
    """Mean exactly 0 over opposite words; the largest is the level; variance level^2 / 3."""
    words = np.array([0, 2**32 - 1, 2**31, 2**31 - 1] + [2**20] * (LANES - 4), np.uint32)
    reading = row(0.0, real)
    noise.uniform_noise(words, row(0.5, real), reading)
    assert reading[0] == -reading[1] == pytest.approx(-0.5, abs=1e-7)
    assert reading[2] == -reading[3] == pytest.approx(0.0, abs=1e-7)
    rng = np.random.default_rng(5)
    answers = []
    for _ in range(cases(1_000, 20)):
        reading = row(0.0, real)
        noise.uniform_noise(random_words(rng, 1)[0], row(0.1, real), reading)
        answers.append(reading)
    moved = np.concatenate(answers).astype(np.float64)
    assert moved.var() == pytest.approx(0.01 / 3, abs=4 * 0.01 * np.sqrt(4 / 45 / moved.size))  # 1 in 16,000


probability = st.floats(0.0, 1.0)
place = st.floats(-0.5, 1.0)
width = st.floats(-0.2, 0.2)
kind = st.tuples(probability, place, width)


@settings(max_examples=cases(60, 8), deadline=None)
@given(
    reading=st.floats(-2.0, 3.0), near=st.floats(0.0, 2.0), drop=kind, outlier=kind, seed=st.integers(0, 2**31),
    real=st.sampled_from(PRECISIONS),
)  # fmt: skip
def test_readings_stay_between_nothing_and_all(
    reading: float, near: float, drop: Any, outlier: Any, seed: int, real: Any
) -> None:
    answer = mix(reading, near, random_words(np.random.default_rng(seed), 2), drop, outlier, real)
    assert ((answer >= 0) & (answer <= 1)).all()


@settings(max_examples=cases(20, 4), deadline=None)
@given(drop=kind, outlier=kind, seed=st.integers(0, 2**31), real=st.sampled_from(PRECISIONS))
def test_a_lane_depends_on_no_other_and_not_on_its_place(
    drop: Any, outlier: Any, seed: int, real: Any
) -> None:
    rng = np.random.default_rng(seed)
    readings, near, words = rng.uniform(0, 1, LANES), rng.uniform(0, 0.5, LANES), random_words(rng, 2)
    answer = mix(readings, near, words, drop, outlier, real)
    order = rng.permutation(LANES)
    moved = mix(readings[order], near[order], np.ascontiguousarray(words[:, order]), drop, outlier, real)
    assert (moved == answer[order]).all()


def test_more_dropouts_with_distance_make_a_mean_that_falls_with_it() -> None:
    """Same words at every distance: no reading rises as things go away, so neither does the mean."""
    words = random_words(np.random.default_rng(6), 2)
    means = [
        mix(np.exp(-near / 0.1), near, words, (0.9, 0.2, 0.03), NONE).mean()
        for near in np.linspace(0, 0.4, 41)
    ]
    assert (np.diff(means) <= 0).all()


def test_the_second_word_is_independent_of_the_choice_and_keeps_complements() -> None:
    """21 bits that the choice does not use: uniform and uncorrelated with it, four standard errors, 1 in 5,000."""
    rng = np.random.default_rng(7)
    chosen, seconds = [], []
    for place in (0, 1, 2):
        for _ in range(cases(300, 10)):
            word, spare = random_words(rng, 2)
            value, opposite = np.zeros((2, LANES), np.uint32)
            noise.second_word(word, spare, np.int64(place), value)
            noise.second_word(~word, ~spare, np.int64(place), opposite)
            assert (opposite == ~value).all()
            assert (value >> 21 == word & 0x7FF).all()
            assert (value >> 11 & 0x3FF == spare >> 10 * place & 0x3FF).all()
            chosen.append(unit_of(word, 21))
            seconds.append(unit_of(value, 21))
    a, b = np.concatenate(chosen), np.concatenate(seconds)
    assert b.mean() == pytest.approx(0.5, abs=4 * np.sqrt(1 / 12 / b.size))
    assert b.var() == pytest.approx(1 / 12, abs=4 * np.sqrt(1 / 180 / b.size))
    assert np.corrcoef(a, b)[0, 1] == pytest.approx(0, abs=4 / np.sqrt(b.size))
