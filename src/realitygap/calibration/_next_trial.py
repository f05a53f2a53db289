"""Selection of the most informative trials: those that leave the least uncertainty about a goal.

Around what is known by now, what a trial shows is taken for linear in the parameters with normal noise, both learned
from robots of the posterior. Then a trial adds its information to the precision of the parameters, whatever comes out.

Source: Bayesian experimental design for linear models, Chaloner & Verdinelli, Statistical Science 10 (1995).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ._evidence import Vectors
from ._prior import Floats
from ._score import learn_compression


def information_of(places: Floats, vectors: Vectors, finest: Vectors) -> Floats:
    """Return the Fisher information of a trial's expected observations about the parameters, (p, p).

    Args:
        places: (m, p) parameters of robots from the posterior.
        vectors: (m, d) observations of each robot in the trial.
        finest: (d,) the least standard deviation of an entry.
    """
    weights = learn_compression(places, vectors, finest).of_means.astype(np.float64)
    return np.asarray(weights.T @ weights)


def next_trials(
    places: Floats, informations: Sequence[Floats], n: int, goal: Floats | None = None
) -> list[int]:
    """Return indices of the n candidates that together tell most, the one that tells most first.

    Args:
        places: (m, p) parameters of robots from the posterior.
        informations: (p, p) information of each candidate.
        n: Number of trials to choose. A candidate may be chosen again.
        goal: (m, q) quantities to predict for each robot, such as the mean coverage of controllers that were not
            tried. The choice lowers their variance. Default: it lowers the entropy of the parameters.

    Raises:
        ValueError: There is no candidate.
    """
    if not informations:
        raise ValueError("No trial to choose from, expected at least one candidate.")
    precision = np.linalg.inv(np.cov(places.T) + 1e-6 * np.eye(places.shape[1]))
    slopes = None if goal is None else _slopes(places, goal)
    chosen: list[int] = []
    for _ in range(n):
        left = [_unknown(precision + information, slopes) for information in informations]
        chosen.append(int(np.argmin(left)))
        precision = precision + informations[chosen[-1]]
    return chosen


def _slopes(places: Floats, goal: Floats) -> Floats:
    """Return the slopes of the goal by the parameters, (p, q), shrunk by noise."""
    off = places - places.mean(axis=0)
    p = off.shape[1]
    return np.linalg.solve(off.T @ off + len(off) * 0.05 * np.eye(p), off.T @ (goal - goal.mean(axis=0)))


def _unknown(precision: Floats, slopes: Floats | None) -> float:
    """Return the remaining uncertainty: variance of the predictions, or twice the entropy up to a constant."""
    if slopes is None:
        return -float(np.linalg.slogdet(precision)[1])
    return float(np.einsum("pq,pq->", slopes, np.linalg.solve(precision, slopes)))
