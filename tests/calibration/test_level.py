"""Ends of what a likelihood ratio does not refute."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.calibration._posterior import level_ends


def test_ends_are_those_of_a_normal_distribution_when_parameters_correlate() -> None:
    rng = np.random.default_rng(0)
    spread = 0.02**2 * np.array([[1.0, 0.95, 0.0], [0.95, 1.0, 0.3], [0.0, 0.3, 1.0]])
    precision = np.linalg.inv(spread)
    ends = level_ends(
        lambda x: -0.5 * np.einsum("ij,jk,ik->i", x - 0.5, precision, x - 0.5),
        rng.multivariate_normal(np.full(3, 0.5), spread, 1000),
        rng,
    )
    assert ends == pytest.approx(0.5 + np.array([[-1.0], [1.0]]) * np.full(3, 0.02 * 1.645), abs=0.004)


def test_a_level_likelihood_refutes_nothing_up_to_its_corners() -> None:
    """The corner of a triangle was left out by quantiles of draws, such as of readings that count pulses."""
    rng = np.random.default_rng(0)

    def log_likelihood(x: np.ndarray) -> np.ndarray:
        return np.where((x.sum(axis=1) < 1.0) & (x > 0.4).all(axis=1), 0.0, -1e3)

    draws = rng.uniform(0.4, 0.6, (4000, 2))
    draws = draws[log_likelihood(draws) == 0][:1000]
    assert np.quantile(draws, 0.95, axis=0).max() < 0.58
    assert level_ends(log_likelihood, draws, rng) == pytest.approx(
        np.array([[0.4, 0.4], [0.6, 0.6]]), abs=0.002
    )


def test_ends_stay_within_what_is_possible() -> None:
    rng = np.random.default_rng(0)
    ends = level_ends(lambda x: np.zeros(len(x)), rng.random((200, 2)), rng)
    assert ends == pytest.approx(np.array([[0.0, 0.0], [1.0, 1.0]]), abs=0.01)
