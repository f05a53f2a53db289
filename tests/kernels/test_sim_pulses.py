"""Counting pulses: word by word against the reference; one-sided, bursty, with the stated mean and variance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import noise as pulses_kernels
from realitygap.kernels.sim import ranges
from tests.kernels.sim_rows import PRECISIONS, random_words, row, rows
from tests.reference import senses as reference
from tests.reference.effort import cases

PULSES = 10  # of a Fluke 2


def count(
    share: Any,
    near: Any,
    words: np.ndarray,
    miss: Any,
    burst: Any,
    pulses: int = PULSES,
    real: Any = np.float64,
) -> np.ndarray:
    reading, rate = row(share, real), row(0.0, real)
    ranges.rate_of(row(miss[2], real), rate)
    pulses_kernels.count_pulses(
        row(near, real), np.int64(pulses), words, rows(miss[:2], real), rate, row(burst, real),
        row(0.0, real), row(0.0, real), reading,
    )  # fmt: skip
    return reading


def n_words(pulses: int) -> int:
    return int(pulses_kernels.pulse_words(np.int64(pulses)))


@pytest.mark.parametrize("real", PRECISIONS)
@pytest.mark.parametrize("pulses", [1, 4, 10, 13])
def test_counts_are_what_their_words_say(real: Any, pulses: int) -> None:
    rng = np.random.default_rng(1)
    for _ in range(cases(30, 2)):
        share, near = rng.uniform(0, 1.2, LANES), rng.uniform(0, 0.3, LANES)
        miss = rng.uniform(0, 1, LANES), rng.uniform(0, 0.3, LANES), rng.uniform(0.02, 0.1, LANES)
        burst = rng.uniform(0, 1, LANES)
        words = random_words(rng, n_words(pulses))
        answer = count(share, near, words, miss, burst, pulses, real)
        for lane in range(LANES):
            missing = reference.logistic(near[lane], *(one[lane] for one in miss))
            halves = [int(word) >> shift & 0xFFFF for word in words[1:, lane] for shift in (0, 16)]
            fates = [(half + 0.5) / 65536 for half in halves]
            shared = (int(words[0, lane]) >> 9) / 2**23 < burst[lane]
            scaled = share[lane] * pulses + 0.5
            if min(abs(fate - missing) for fate in fates) < 1e-5 or abs(scaled - round(scaled)) < 1e-4:
                continue  # a rounding decides
            plain = reference.pulses(share[lane], pulses, missing, shared, fates)
            assert answer[lane] == pytest.approx(plain, abs=1e-6)


@pytest.mark.parametrize("burst", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("share", [0.32, 1.0])
def test_counts_have_the_stated_mean_and_variance(burst: float, share: float) -> None:
    """Four standard errors of mean and variance: 1 in 8,000 by chance, in each of six cases."""
    rng = np.random.default_rng(2)
    n = cases(64_000, 640)
    miss = (0.8, 0.1, 0.05)
    answer = np.concatenate(
        [count(share, 0.08, random_words(rng, n_words(PULSES)), miss, burst) for _ in range(n // LANES)]
    )
    missing = reference.logistic(0.08, *miss)
    mean, variance = reference.pulse_moments(share, PULSES, missing, burst)
    assert answer.mean() == pytest.approx(mean, abs=4 * np.sqrt(variance / n))
    squares = (answer - mean) ** 2
    assert squares.mean() == pytest.approx(variance, abs=4 * squares.std() / np.sqrt(n))


def test_a_full_burst_sees_all_pulses_or_none() -> None:
    rng = np.random.default_rng(3)
    answer = count(0.7, 0.1, random_words(rng, n_words(PULSES)), (0.5, -1.0, 0.01), 1.0)
    assert set(np.round(answer, 6)) == {0.0, 0.7}


@settings(max_examples=cases(60, 8), deadline=None)
@given(
    share=st.floats(-1.0, 2.0), near=st.floats(0.0, 1.0), most=st.floats(0.0, 1.0), at=st.floats(-0.5, 1.0),
    width=st.floats(-0.2, 0.2), burst=st.floats(0.0, 1.0), pulses=st.integers(1, 16), seed=st.integers(0, 2**31),
    real=st.sampled_from(PRECISIONS),
)  # fmt: skip
def test_a_count_only_misses_and_is_one_of_so_many_levels(
    share: float,
    near: float,
    most: float,
    at: float,
    width: float,
    burst: float,
    pulses: int,
    seed: int,
    real: Any,
) -> None:
    words = random_words(np.random.default_rng(seed), n_words(pulses))
    answer = count(share, near, words, (most, at, width), burst, pulses, real)
    sure = count(share, near, words, (0.0, 0.0, 1.0), burst, pulses, real)
    assert ((answer >= 0) & (answer <= sure) & (sure <= 1)).all()
    assert answer * pulses == pytest.approx(np.round(answer * pulses), abs=1e-5)
